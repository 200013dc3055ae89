"""Linear equations about a state or a steady motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.analysis.differences import jacobian
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.inputs_outputs import Input, output
from modalprep.multibody.analysis.state_space import StateSpace
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.kernels.data import FREE, SPHERICAL
from modalprep.multibody.kernels.interfaces import world
from modalprep.multibody.model.system import System
from modalprep.suggest import refuse_other
from modalprep.vectors import skew

PLACE_STEP, SPEED_STEP = 0.05, 1.0  # initial steps, in scales of the coordinates and of their rates


def linearise(
    system: System,
    y: np.ndarray | None = None,
    t: float = 0.0,
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
) -> StateSpace:
    """Return the linear equations about a state of a system.

    The kinematic rows are exact; the others are central differences of the order-n accelerations with Richardson
    extrapolation, accurate to about 1e-11 of the largest entry (`StateSpace.error` has the estimate of each case).

    Parameters
    ----------
    y : (nx + nu,)
        State, such as `static_equilibrium(system).y`; default: the start of the joints. Loops that it leaves open
        are closed.
    t : float
        s, at which functions of time are taken; prescribed hinges move as they do then.
    inputs, outputs : sequence of str
        Inputs ``hinge`` or ``hinge.2`` (N or N m in the joint's second speed), ``body.interface.force.x`` (N) and
        ``.torque.z`` (N m), inertial axes. Outputs ``hinge.angle``, ``.rate``, ``.displacement``, ``.speed``
        (``.angle.2`` the second), ``body.modal.3``, ``body.stress.point.xx``, ``body.recovery.name.place.component``,
        ``body.interface.position.x``, ``.rotation``, ``.velocity``, ``.angular_velocity``, ``.acceleration`` and
        ``.angular_acceleration``, inertial axes.

    Returns
    -------
    StateSpace
        The four matrices in the independent coordinates, with estimates of their errors.

    Raises
    ------
    InputError
        When a name is not known in the system, the state has another size, or a loop cannot be closed.
    SimulationError
        When the mass matrix is not positive, or closed loops are in a singular position.

    References
    ----------
    A. K. Banerjee, Flexible Multibody Dynamics, Wiley 2016, section 9.4 (independent coordinates of closed loops);
    theory 5.6.
    L. F. Richardson, The deferred approach to the limit, Phil. Trans. R. Soc. A 226 (1927) 299.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint_element import HingeElement
    >>> from modalprep.multibody.model.joint import Joint
    >>> disc = rigid_body("disc", mass=1.0, centre=np.zeros(3), inertia=2 * np.eye(3), interfaces={"root": np.zeros(3)})
    >>> spring = HingeElement(stiffness=18.0, damping=0.4)
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="disc", elements=spring)
    >>> linear = linearise(System(bodies={"disc": disc}, joints=(hinge,)), inputs=["hinge"], outputs=["hinge.angle"])
    >>> linear.A.round(9).tolist(), linear.B.round(9).tolist(), linear.C.tolist()
    ([[0.0, 1.0], [-9.0, -0.2]], [[0.0], [0.5]], [[1.0, 0.0]])
    """
    refuse_other("linearise: the system", System, system)
    evaluator = Evaluator(system, t)
    y = evaluator.start if y is None else np.array(y, dtype=float)
    if y.shape != (evaluator.nx + evaluator.nu,) or not np.all(np.isfinite(y)):
        raise InputError(f"the state needs {evaluator.nx + evaluator.nu} finite numbers; it has {y.size}")
    chart = Chart(evaluator, y := evaluator.closed(y))
    applied = [Input(evaluator, name) for name in inputs]
    read = [output(evaluator, name, y) for name in outputs]
    free = chart.independent
    n = len(chart.independent)
    ni = len(inputs)

    def response(z: np.ndarray) -> np.ndarray:
        state = chart.moved(z[:n], z[n : 2 * n])
        evaluator.load(state)
        world(evaluator.packed.model, evaluator.data)
        tau = sum((e.apply(size) for e, size in zip(applied, z[2 * n :], strict=True)), np.zeros(evaluator.nu))
        return np.concatenate([evaluator.accelerations(tau), [function(state) for function in read]])

    reference = response(np.zeros(2 * n + ni))
    scale = evaluator.scale[free]
    J, error = jacobian(
        _finite_where_valid(response, len(reference)),
        np.concatenate([PLACE_STEP * scale, SPEED_STEP * scale, np.ones(ni)]),
    )
    if not np.all(np.isfinite(error)):
        raise SimulationError(
            "cannot linearise: near this state a mass matrix is not positive definite or a closed loop is singular; "
            "keep fewer modes and truncation vectors, or use another state"
        )
    top = np.hstack([(transport(evaluator, y) @ chart.R)[free], np.eye(n), np.zeros((n, ni))])
    seen = np.arange(evaluator.nu, len(J))
    return StateSpace(
        A=np.vstack([top[:, : 2 * n], J[free, : 2 * n]]),
        B=np.vstack([top[:, 2 * n :], J[free, 2 * n :]]),
        C=J[seen, : 2 * n],
        D=J[seen, 2 * n :],
        inputs=tuple(inputs),
        outputs=tuple(outputs),
        owner=tuple(evaluator.owner),
        independent=free,
        R=chart.R,
        y=y,
        udot=reference[: evaluator.nu],
        error=max(_relative(error[rows], J[rows]) for rows in (free, seen)),
        error_estimate=np.vstack([np.zeros((n, 2 * n)), error[free, : 2 * n]]),
    )


def _finite_where_valid(function: Callable, size: int) -> Callable:
    """Return the function (size,) with NaN where a step is too large for the system to be evaluated."""

    def tried(z: np.ndarray) -> np.ndarray:
        try:
            return function(z)
        except SimulationError:
            return np.full(size, np.nan)

    return tried


def _relative(error: np.ndarray, of: np.ndarray) -> float:
    largest = np.abs(of).max(initial=0.0)
    return float(error.max(initial=0.0) / largest) if largest > 0 else 0.0


def transport(evaluator: Evaluator, y: np.ndarray) -> np.ndarray:
    """Return the rate of small coordinate changes due to the rotation of the body axes (nu, nu).

    With rotation vector x and displacement d in the body's axes ``x' = dw - w~ x``, ``d' = dv - w~ d - v~ x``.
    """
    N = np.zeros((evaluator.nu, evaluator.nu))
    for row, kind in zip(evaluator.packed.model.links, evaluator.packed.types, strict=True):
        first = row["u"]
        u = y[evaluator.nx + first : evaluator.nx + first + 6]
        if kind == SPHERICAL:
            N[first : first + 3, first : first + 3] = -skew(u[:3])
        if kind == FREE:
            N[first : first + 3, first : first + 3] = N[first + 3 : first + 6, first + 3 : first + 6] = -skew(u[3:])
            N[first : first + 3, first + 3 : first + 6] = -skew(u[:3])
    return N
