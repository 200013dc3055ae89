"""Deflected starts: modes, and in a steady motion joints that rest, are in equilibrium with the accelerations there."""

from __future__ import annotations

import numpy as np

from modalprep.errors import SimulationError
from modalprep.multibody.analysis.accelerations import Accelerations
from modalprep.multibody.analysis.differences import jacobian
from modalprep.multibody.analysis.equilibrium import LARGEST
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.tangent import SystemTangent
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.system import System

STEP = 1e-2  # of the differences, in scales of the coordinates
MAX_STEPS = 50
CONVERGED = 1e-13  # step
STALLED = 1e-9  # step that no longer shrinks: round-off
NEUTRAL = 1e-10  # of the largest stiffness: a coordinate with less is left where it is


def moving_joints(system: System) -> tuple[str, ...]:
    """Return the joints whose accelerations are free in a steady motion: free ones, and those that start with a rate.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", rate=2.0)
    >>> moving_joints(System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,)))
    ('hinge',)
    """
    return tuple(joint.name for joint in system.joints if joint.type == "free" or has_start_rate(joint))


def has_start_rate(joint: Joint) -> bool:
    """Return whether a joint starts with a speed.

    Examples
    --------
    >>> has_start_rate(Joint(name="hinge", type="revolute", parent="ground", child="arm", rate=2.0))
    True
    """
    return any(np.any(rate) for rate in (joint.rate, joint.speed, joint.velocity, joint.angular_velocity))


def deflected_state(system: System, t: float = 0.0) -> np.ndarray:
    """Return the state in which joints are as at the start, and modes have neither speed nor acceleration.

    The accelerations of the joints follow from the equations of motion: a pendulum that is released has the deflection
    of its fall, and does not ring. Arguments and errors as `steady_state`.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", angle=0.5)
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,), gravity=np.array([0, -9.81, 0]))
    >>> y = deflected_state(arm)
    >>> float(y[0]), bool(np.abs(y[1:3]).max() > 0)
    (0.5, True)
    """
    return _balanced(system, t, {joint.name for joint in system.joints})


def steady_state(system: System, t: float = 0.0) -> np.ndarray:
    """Return the state in which the modes, and the joints that rest, have neither speed nor acceleration.

    Joints that move (`moving_joints`, and prescribed ones) have the coordinates and speeds of the start; their
    accelerations follow from the equations of motion. So a body that spins freely, or orbits, is deflected as it
    remains while it does. Newton's method on the accelerations of all others.

    Parameters
    ----------
    t : float
        s, at which functions of time are taken.

    Returns
    -------
    (nx + nu,)

    Raises
    ------
    SimulationError
        When no such state is found.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", rate=2.0)
    >>> y = steady_state(System(bodies={"arm": uniform_beam(modes=8)}, joints=(hinge,)))
    >>> bool(np.abs(y[1:9]).max() > 0), float(y[9])
    (True, 2.0)
    """
    return _balanced(system, t, set(moving_joints(system)))


def _balanced(system: System, t: float, moving: set[str]) -> np.ndarray:
    """Return the state in which all but the `moving` joints have neither speed nor acceleration."""
    evaluator = Evaluator(system, t)
    found = _Resting(evaluator, moving)
    y = found.start
    before = size = np.inf
    for _ in range(MAX_STEPS):
        step = found.step(y)
        size = np.abs(step).max(initial=0.0)
        step *= min(1.0, LARGEST / max(size, LARGEST))
        y = found.moved(y, step)
        if size <= CONVERGED or (size <= STALLED and size >= 0.5 * before):
            return y
        before = size
    raise SimulationError(
        f"no steady state at t = {t:g} s: after {MAX_STEPS} steps the largest is still {size:.1e} of a radian or of a "
        "body's size; start at rest, or constrain what has no equilibrium in this motion"
    )


class _Resting:
    """The coordinates without speed, in their scales, and the accelerations that they would have."""

    def __init__(self, evaluator: Evaluator, moving: set[str]) -> None:
        self.evaluator = evaluator
        loops = evaluator.loops is not None  # whose joints follow the modes
        resting = [kind == "body" or (name not in moving and not loops) for kind, name in evaluator.owner]
        self.places = np.flatnonzero(resting)
        self.scale = evaluator.scale[self.places]
        self.start = evaluator.start.copy()
        self.start[evaluator.nx + self.places] = 0.0

    def moved(self, y: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return a state whose resting coordinates differ by a scaled step (n,), loops closed."""
        full = np.zeros(self.evaluator.nu)
        full[self.places] = self.scale * step
        return self.evaluator.closed(self.evaluator.moved(y, full))

    def accelerations(self, y: np.ndarray) -> np.ndarray:
        """Return those of the resting coordinates (n,), scaled."""
        self.evaluator.load(y)
        return self.evaluator.accelerations(np.zeros(self.evaluator.nu))[self.places] / self.scale

    def step(self, y: np.ndarray) -> np.ndarray:
        """Return Newton's step (n,), none in coordinates without stiffness."""
        if not len(self.places):
            return np.zeros(0)
        slope = self._slope(y)
        rows = np.abs(slope).max(axis=1)
        rows = np.maximum(rows, NEUTRAL * rows.max(initial=0.0)) + np.finfo(float).tiny
        return np.linalg.lstsq(slope / rows[:, None], -self.accelerations(y) / rows, rcond=NEUTRAL)[0]

    def _slope(self, y: np.ndarray) -> np.ndarray:
        """Return the derivative of the accelerations (n, n), of a tree exactly.

        Joints of loops follow the modes.
        """
        evaluator, own = self.evaluator, self.places
        if evaluator.loops is not None:
            return jacobian(lambda z: self.accelerations(self.moved(y, z)), np.full(len(own), STEP))[0]
        chart, nu = Chart(evaluator, y), evaluator.nu
        evaluator.load(chart.y)
        exact = SystemTangent(chart, evaluator.accelerations(np.zeros(nu)))
        by_x = Accelerations(exact, exact.equations(np.zeros((nu, nu))), np.zeros((nu, 0))).A
        return by_x[np.ix_(own, own)] * self.scale / self.scale[:, None]
