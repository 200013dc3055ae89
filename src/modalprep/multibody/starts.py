"""Where a run starts: at rest, in equilibrium, in a steady motion, or at a state that is given."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.analysis.equilibrium import Equilibrium, static_equilibrium
from modalprep.multibody.analysis.periodic import periodic_state
from modalprep.multibody.analysis.steady import deflected_state, has_start_rate, moving_joints, steady_state
from modalprep.multibody.evaluation.evaluator import Evaluator, start_state
from modalprep.multibody.evaluation.loops import Loops
from modalprep.multibody.evaluation.system_state import SystemState, state_of
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.results.channels import STATE, Channels
from modalprep.multibody.results.record import layout
from modalprep.multibody.results.result import Result
from modalprep.suggest import refuse_unknown

FORCED = 3e-3  # times the relative tolerance: vibrations of a forced motion are below 1e-6 of its deflections
FORCED_ALPHA = 1e-2  # times that: each change of the step of generalised-alpha, of order 2, lets a little ring
FINEST = 1e-13
APART = 1e-9  # s, or of the time: two output times that are nearer are one
Start = Literal["rest", "quasi_static", "equilibrium", "steady", "periodic"]
Given = Start | SystemState | Equilibrium | Result | Mapping[str, object]


def started(system: System, start: Given, period: float | None = None) -> SystemState | None:
    """Return the state at which a run of a system starts; None of the start values of the joints, modes at rest.

    Parameters
    ----------
    start : {"rest", "quasi_static", "equilibrium", "steady", "periodic"}, SystemState, Equilibrium, Result or dict
        As `simulate` takes it.
    period : float or None
        s, of "periodic".

    Raises
    ------
    InputError
        When the start is unknown, or does not go with the system.
    SimulationError
        When there is no equilibrium.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> weld = Joint(name="wall", type="weld", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(weld,), gravity=np.array([0, 0, -9.81]))
    >>> started(arm, "rest") is None, started(arm, "equilibrium")
    (True, SystemState(t = 0 s, 0 joints, 1 flexible bodies))
    """
    if period is not None:
        _refuse_period(start, period)
    if isinstance(start, SystemState):
        return start
    if isinstance(start, Equilibrium):
        return _of_system(system, start.y, start.t)
    if isinstance(start, Result):
        return _end_of(start)
    if isinstance(start, Mapping):
        return named_state(system, start)
    refuse_unknown(str(start), get_args(Start), "simulation start")
    if start == "rest":
        return None
    if start == "quasi_static":
        return _of_system(system, deflected_state(system), 0.0)
    if start == "periodic":
        return _of_system(system, periodic_state(system, period), 0.0)
    return _in_equilibrium(system) if start == "equilibrium" else _steady(system)


def tolerances(start: Given, state: SystemState | None, rtol: float) -> tuple[float, float]:
    """Return the relative tolerance of the steps: finer where the motion is to have no vibration of its own.

    A forced motion that varies is followed to rtol of its deflections, and what the steps miss of it rings. A run that
    goes on from one of such a tolerance keeps it.

    Parameters
    ----------
    start : str, SystemState, Equilibrium, Result or dict
        As `simulate` takes it.
    state : SystemState or None
        Which that is.

    Returns
    -------
    float, float
        The tolerance, and by what generalised-alpha multiplies it.

    Examples
    --------
    >>> tolerances("periodic", None, 1e-5), tolerances("steady", None, 1e-5)
    ((3e-08, 0.01), (1e-05, 1.0))
    """
    own = max(FORCED * rtol, FINEST)
    finer = max(FORCED_ALPHA, FINEST / own)
    before = 0.0 if state is None else float(state.steps.get("rtol", 0.0))
    is_forced = before in (own, own * finer) or (isinstance(start, str) and start == "periodic")
    return (own, finer) if is_forced else (rtol, 1.0)


def state_at(system: System, run: Result, t: float | None = None) -> SystemState:
    """Return the state of a run at one of its output times, the last by default.

    Parameters
    ----------
    system : System
        That of the run.
    t : float or None
        s.

    Returns
    -------
    SystemState
        With the lengths that closures have at the start values of the joints.

    Raises
    ------
    InputError
        When the run has no output at that time, or is of another system.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.simulate import simulate
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", rate=1.0)
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> run = simulate(arm, t_end=0.1)
    >>> state = state_at(arm, run, 0.05)
    >>> bool(state.joints["hinge"] == run["hinge.angle"][5])
    True
    """
    k = len(run.time) - 1 if t is None else int(np.argmin(np.abs(run.time - t)))
    if t is not None and not abs(run.time[k] - t) <= APART * max(1.0, abs(t)):
        raise InputError(f"start: the run has no output at t = {t:g} s; the nearest is at {run.time[k]:.10g} s")
    packed = pack(system)
    loops = _loops_of(system)
    index, columns, width = layout(Channels(system, packed, loops))
    row = np.zeros(width)
    for name, places in index.items():
        if name not in run:
            raise InputError(f"start: the run is of another system: it has no channel {name!r}")
        row[places] = run[name][k]
    y = start_state(packed)
    of_state = columns.joints[columns.joints[:, 0] == STATE]
    y[of_state[:, 1]] = row[of_state[:, 3]]
    for name, body in system.bodies.items():
        if body.n:
            y[packed.modes_of(name)] = run[f"{name}.modal"][k]
    return state_of(system, y, float(run.time[k]), loops=loops)


def _refuse_period(start: Given, period: float) -> None:
    """Refuse a period that is not one, or of another start."""
    if not (isinstance(start, str) and start == "periodic"):
        raise InputError("simulation period: it belongs to start = 'periodic'; leave it out")
    if not 0 < period < float("inf"):
        raise InputError(f"simulation period = {period:g} must be positive")


def _of_system(system: System, y: np.ndarray, t: float) -> SystemState:
    """Return the state of a vector; closures keep what they found at the start values of the joints."""
    return state_of(system, y, t, loops=_loops_of(system))


def _loops_of(system: System) -> Loops | None:
    """Return the closed loops with the lengths of the start values, where there are any."""
    return Evaluator(system).loops if system.closures else None


def _end_of(run: Result) -> SystemState:
    if run.state is None:
        raise InputError("start: this run does not hold its last state; take one of `simulate`, or a file of one")
    return run.state


def _in_equilibrium(system: System) -> SystemState:
    moving = [joint.name for joint in system.joints if has_start_rate(joint)]
    if moving:
        raise InputError(
            f"start = 'equilibrium': joint {moving[0]!r} has a rate in its start; leave it out, or give "
            "start = 'steady', which keeps it"
        )
    return _of_system(system, static_equilibrium(system).y, 0.0)


def _steady(system: System) -> SystemState:
    """Return the steady state; of a system that rests on prescribed joints by the search that leaves unstable ones."""
    driven_loops = system.closures and any(joint.motions for joint in system.joints)
    if moving_joints(system) or driven_loops:
        return _of_system(system, steady_state(system), 0.0)
    return _of_system(system, static_equilibrium(system, steady=True).y, 0.0)


def named_state(system: System, values: Mapping[str, object]) -> SystemState:
    """Return the start whose modal coordinates are given as ``{"arm.modal": [...], "arm.modal_rate": [...]}``.

    Raises
    ------
    InputError
        When a name is no ``body.modal`` or ``body.modal_rate``.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> weld = Joint(name="wall", type="weld", parent="ground", child="arm")
    >>> named_state(System(bodies={"arm": uniform_beam(modes=1)}, joints=(weld,)), {"arm.modal": [0.1]}).modal
    {'arm': array([0.1])}
    """
    found: dict[str, dict[str, np.ndarray]] = {"modal": {}, "modal_rate": {}}
    for name, numbers in values.items():
        body, _, what = name.rpartition(".")
        if what not in found:
            raise InputError(
                f"start: {name!r} is neither 'body.modal' nor 'body.modal_rate'; joints have their own start values"
            )
        refuse_unknown(body, system.bodies, "start: body")
        found[what][body] = np.atleast_1d(np.asarray(numbers, dtype=float))
    return SystemState(modal=found["modal"], modal_rates=found["modal_rate"])
