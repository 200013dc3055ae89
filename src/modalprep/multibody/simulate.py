"""Integrate a system in time with the order-n kernel, and audit the run by its energy balance."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody import kernel
from modalprep.multibody.dense_constraints import closed_accelerations
from modalprep.multibody.dense_loads import loaded_accelerations
from modalprep.multibody.events import Event
from modalprep.multibody.forces import Energies
from modalprep.multibody.integrators import METHODS, Integration
from modalprep.multibody.layout import (
    PRESCRIBED,
    PRESCRIBED_REVOLUTE,
    UQ,
    XQ,
    pack,
    workspace,
)
from modalprep.multibody.loading import Loading
from modalprep.multibody.plant import start_state
from modalprep.multibody.record import Recorder
from modalprep.multibody.result import Result
from modalprep.multibody.system import System

MOST_OUTPUTS = 1e7


def simulate(
    system: System,
    *,
    t_end: float,
    output_step: float = 0.01,
    rtol: float = 1e-7,
    atol: float = 1e-10,
    method: str = "auto",
    step: float | None = None,
    rho_inf: float = 0.9,
    events: Sequence[Event] = (),
    dense: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Result:
    """Integrate from the joints' start values, modes at rest, to `t_end`.

    All methods run in compiled code on the order-n recursion, with dense output, and restart where a function of time
    changes its piece. The work of prescribed hinges, forces and drives less what dampers and friction take is
    integrated along, so that ``energy.error`` is a check of the whole run.

    Parameters
    ----------
    t_end, output_step : float
        s.
    rtol, atol : float
        Relative and absolute tolerance of coordinates and speeds. A turn counts by a radian at least, a deflection by a
        hundredth of its body's size at least, all else by the largest value so far.
    method : {"auto", "explicit", "generalized_alpha", "rosenbrock"}
        DOP853, of order 8; generalized-alpha, of order 2, and ROS34PW2, of order 3, which treat modal and hinge
        stiffness implicitly: steps are then as long as the motion allows, whatever the highest mode. "auto" takes the
        quicker one; `Result.message` says which, and why.
    step : float or None
        A fixed step (s) in place of error control.
    rho_inf : float
        Generalized-alpha: what is left of the highest vibration after one step, 1 to 0.
    events : sequence of Event
        Zero crossings to be located.
    dense : bool
        Use the dense twin of the kernel, explicitly: slow, for comparison.
    progress : callable
        Called with the time every few hundred steps.

    Returns
    -------
    Result
        ``status = "diverged"`` when a deflection exceeded 100 body sizes; the histories end there.

    Raises
    ------
    InputError
        When a time or tolerance is not positive, or an event names what is not there.
    SimulationError
        When the run cannot go on; the sentence names time, body and cause.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.system import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,), gravity=np.array([0, -9.81, 0]))
    >>> run = simulate(arm, t_end=0.1)
    >>> bool(run["hinge.angle"][-1] < 0), run.stats["energy_error"] < 1e-8
    (True, True)
    """
    for name, value in (("t_end", t_end), ("output_step", output_step), ("rtol", rtol), ("atol", atol)):
        if not 0 < value < float("inf"):
            raise InputError(f"simulation {name} = {value:g} must be positive")
    if not t_end / output_step <= MOST_OUTPUTS:
        raise InputError(
            f"simulation t_end = {t_end:g} with output_step = {output_step:g} asks for more than {MOST_OUTPUTS:.0e} "
            "output times; lower t_end or raise output_step"
        )
    if method not in METHODS:
        raise InputError(f"simulation method {method!r} is not one of {', '.join(METHODS)}")
    if step is not None and not 0 < step < float("inf"):
        raise InputError(f"simulation step = {step:g} must be positive")
    if not 0 <= rho_inf <= 1:
        raise InputError(f"simulation rho_inf = {rho_inf:g} must be between 0 and 1")
    run = _Run(system, t_end)
    recorder = Recorder(system, run)
    times: list[float] = []

    def record(t: float, y: np.ndarray) -> None:
        times.append(t)
        recorder.add(t, run.closed(t, y))

    integration = Integration(
        system, run.packed, run.loading, run.start(), np.linspace(0.0, t_end, max(2, round(t_end / output_step) + 1)),
        run.size, method="explicit" if dense else method, rtol=rtol, atol=atol, step=step, rho=rho_inf, events=events,
        twin=_twin(system, run.loading) if dense else None,
    )  # fmt: skip
    outcome = integration.run(record, progress)
    notes = run.loading.loops.notes if run.loading.loops else []
    message = "; ".join([outcome.message, *notes])
    found = recorder.result(np.array(times), outcome.status, message, outcome.stats)
    return found.with_(events=outcome.events)


def _twin(system: System, loading: Loading) -> Callable:
    """Return the accelerations of the dense twin, ``(y, motion, t) -> (nu,)``."""
    if loading.loops is None:
        return lambda y, motion, t: loaded_accelerations(system, y, motion, t)
    closing = loading.loops.closing
    return lambda y, motion, t: closed_accelerations(system, closing, y, motion, t)[0]


def start_channels(system: System, t_end: float) -> Result:
    """Return every channel at the start only: which names a run to `t_end` will have, before it runs."""
    run = _Run(system, t_end)
    recorder = Recorder(system, run)
    recorder.add(0.0, run.start())
    return recorder.result(np.zeros(1), "start", "", {})


class _Run:
    """A packed system, its scratch and counters."""

    def __init__(self, system: System, t_end: float) -> None:
        self.system = system
        self.packed = pack(system)
        self.W, self.F = workspace(self.packed.tree, self.packed.flex)
        self.loading = Loading(system, self.packed, t_end)
        self.nx, self.nu = self.packed.nx, self.packed.nu
        self.prescribed = np.flatnonzero(np.isin(self.packed.types, PRESCRIBED))
        self.along = np.where(self.packed.types[self.prescribed] == PRESCRIBED_REVOLUTE, 5, 2)
        self.reactions = np.zeros((len(self.packed.links), 6))
        self.status = -1
        self.energies = Energies(0.0, 0.0, 0.0)
        self.damping, self.size = np.zeros(self.nu), np.zeros(self.nx)
        for name, body in system.bodies.items():
            row = self.packed.tree.ints[self.packed.link_of(name)]
            self.damping[row[UQ] : row[UQ] + body.n] = body.D
            extent = max(np.ptp(body.points, axis=0).max(initial=0.0), 1e-12)
            self.size[row[XQ] : row[XQ] + body.n] = np.abs(body.shape).max(axis=(0, 1), initial=0.0) / extent

    def start(self) -> np.ndarray:
        """Joint coordinates and speeds as the joints say, modes at rest, no work done."""
        return np.append(start_state(self.packed), 0.0)

    def closed(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return a state between steps, brought back onto the closed loops."""
        if self.loading.loops is None:
            return y
        found = y.copy()
        self.loading.loops.settle(self.W, self.F, found[:-1], self.loading.prescribe(t), t)
        return found

    def derivative(self, t: float, y: np.ndarray) -> np.ndarray:
        """Time derivative of [coordinates | speeds | work]; NaN where the mass matrix is not positive."""
        tree, flex, tau = self.packed.tree, self.packed.flex, self.loading.tau
        motion, ydot, state = self.loading.prescribe(t), np.zeros(len(y)), y[:-1]
        if not np.all(np.isfinite(state)):  # a trial of the implicit method, nothing for callbacks
            return np.full(len(y), np.nan)
        kernel.outward(tree, flex, self.W, self.F, state, motion)
        self.energies = self.loading.apply(self.W, self.F, state, t)
        if self.loading.loops:
            self.loading.loops.residual(self.W, self.F, state, motion, t)
        self.status = kernel.inward(tree, flex, self.W, self.F, tau, None, 0.0, 0.0)
        if self.status >= 0:
            return np.full(len(y), np.nan)
        kernel.forward(tree, flex, self.W, self.F, tau, ydot[self.nx : -1])
        if self.loading.loops:
            self.loading.loops.correct(self.W, self.F, ydot[self.nx : -1])
        kernel.kinematic(tree, state, ydot)
        kernel.reactions(tree, self.W, self.reactions)
        ydot[-1] = self.drive @ motion[self.prescribed, 1] + self.energies.power
        ydot[-1] -= self.damping @ state[self.nx :] ** 2
        ydot[-1] += self.loading.loops.power if self.loading.loops else 0.0
        return ydot

    @property
    def drive(self) -> np.ndarray:
        """Torque or force of each prescribed hinge."""
        return self.reactions[self.prescribed, self.along]
