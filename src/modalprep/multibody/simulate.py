"""Integrate a system in time with the order-n kernel, and audit the run by its energy balance."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.checkpoints import RUNNING, Every, times_from
from modalprep.multibody.compilation import by_two_processes
from modalprep.multibody.evaluation.system_state import SystemState, state_of
from modalprep.multibody.integration.method_selection import METHODS
from modalprep.multibody.integration.run import Integration, Outcome
from modalprep.multibody.model.events import Event, idle_closures
from modalprep.multibody.model.functions.survey import survey_width
from modalprep.multibody.model.idle_stations import stations_where_needed
from modalprep.multibody.model.system import System
from modalprep.multibody.preparation import prepare
from modalprep.multibody.results.momenta import unaudited
from modalprep.multibody.results.ranges import left_ranges, range_channel
from modalprep.multibody.results.record import Recorder
from modalprep.multibody.results.result import Result
from modalprep.multibody.results.ringing import ringing
from modalprep.multibody.results.time_notes import time_notes
from modalprep.multibody.results.validity import imbalance, large_deflections
from modalprep.multibody.starts import Given, started, tolerances
from modalprep.suggest import refuse_other
from modalprep.verdicts.notes import told

MAX_OUTPUTS = 1e7
RHO_INF = 0.9  # of generalised-alpha, by default


@told
@stations_where_needed(lambda run, name: run[f"{name}.modal"])
def simulate(
    system: System,
    t_end: float,
    *,
    output_step: float = 0.01,
    rtol: float = 1e-5,
    atol: float = 1e-10,
    method: str = "auto",
    step: float | None = None,
    start: Given = "rest",
    period: float | None = None,
    rho_inf: float = RHO_INF,
    max_step: float | None = None,
    shortest_event: float | None = None,
    events: Sequence[Event] = (),
    reference: bool = False,
    progress: Callable[[float], None] | None = None,
    checkpoint: Callable[[Result], None] | None = None,
    checkpoint_every: float = 60.0,
) -> Result:
    """Integrate from the joints' start values, modes at rest, or from another start, to `t_end`.

    All methods run in compiled code on the order-n recursion, with dense output, and restart where a function of time
    changes its piece. Steps end at the points of tables, and are short where functions of time vary. The work of
    prescribed hinges, forces and drives, less the dissipation of dampers and friction, is integrated as well, so that
    ``energy.error`` checks the whole run.

    Parameters
    ----------
    t_end, output_step : float
        s.
    rtol, atol : float
        Relative and absolute tolerance of the coordinates at the end of the run, apart from the error growth of the
        motion itself; in a step of the explicit method also of the speeds. The scale is at least a radian for a
        rotation, a hundredth of the body's size for a deflection (a twentieth for "rosenbrock" where joints move) and
        that times its frequency for its rate, and the largest value so far for all else. An implicit method does not
        resolve vibrations of modes, springs and bushings below the tolerance; larger ones it resolves in each step, but
        not in their phase at the end.
    method : {"auto", "explicit", "generalised_alpha", "rosenbrock"}
        DOP853 of order 8; generalised-alpha of order 2 and ROS34PW2 of order 3, which treat the stiffness of modes,
        hinges, springs and bushings implicitly, so that the step is limited by the motion and not by the highest
        frequency. "auto" monitors the evaluations of each method per simulated second and switches to the cheapest;
        `Result.message` says which and why. Python callbacks are called in these trials too.
    step : float or None
        A fixed step (s) instead of error control; shorter where functions of time ask for it.
    start : {"rest", "quasi_static", "equilibrium", "steady", "periodic"}, SystemState, Equilibrium, Result or dict
        "rest": the modes are at rest without deflection. "quasi_static": joints are as at their start, and the modes
        have the deflection of the accelerations there, so that what is released does not ring. "equilibrium":
        everything rests in static equilibrium (`static_equilibrium`), prescribed joints where they are. "steady":
        joints that move, prescribed ones, those with a rate in their start and free ones, keep their rates, and modes
        and all other joints are in equilibrium with that motion. "periodic": the motion repeats itself after `period`,
        as that of a mechanism whose crank turns at a constant rate, without vibrations of its own: its steps have the
        tolerance ``0.003 rtol``, of generalised-alpha ``3e-5 rtol``. A state, or the end of another run, whose time
        goes on: the run begins there. A dictionary has modal coordinates, ``{"arm.modal": [...]}``.
    period : float or None
        Of a "periodic" start, s, after which loads and prescribed motions repeat; default: a turn of the slowest joint
        that turns at a constant rate.
    rho_inf : float
        Spectral radius of generalised-alpha at infinite frequency, 0 to 1.
    max_step : float or None
        The longest step, s: for what functions of Python do to the system, which the step control cannot know.
    shortest_event : float or None
        The width (s) to which expressions of time are looked through before the run, by default 1e-4 of `t_end`, and
        events of Python functions during it, by default 1e-3. Notes say what might be missed by default.
    events : sequence of Event
        Zero crossings to be located. Where they change closures the histories have the states before and after.
    reference : bool
        Use the slow reference implementation with the explicit method, for comparison.
    progress : callable
        Called with the time every few hundred steps.
    checkpoint : callable
        Called with the run so far, every `checkpoint_every` seconds of real time: it can be a start, and `join_runs`
        puts both parts together.
    checkpoint_every : float
        s.

    Returns
    -------
    Result
        ``status = "diverged"`` when a deflection exceeded 100 body sizes, or a bushing or rotational spring passes half
        a turn; the histories end there. ``notes`` name the bodies that deflect by more than a tenth of their size, or
        turn within themselves by more than 0.3 rad, and functions of time that may hold shorter events.

    Raises
    ------
    InputError
        When a time or tolerance is not positive, or an event has an unknown name.
    SimulationError
        When the run cannot continue; the message names time, body and cause.

    References
    ----------
    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993 (DOP853).
    J. Chung, G. M. Hulbert, A time integration algorithm for structural dynamics with improved numerical dissipation:
    the generalized-alpha method, J. Appl. Mech. 60 (1993) 371.
    J. Rang, L. Angermann, New Rosenbrock W-methods of order 3 for partial differential algebraic equations of index 1,
    BIT 45 (2005) 761 (ROS34PW2).
    Theory 5.2 and 5.3.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,), gravity=np.array([0, -9.81, 0]))
    >>> run = simulate(arm, t_end=0.1)
    >>> bool(run["hinge.angle"][-1] < 0), run.stats["energy_error"] < 1e-8
    (True, True)
    """
    refuse_other("simulate: the system", System, system)
    check_span(t_end, output_step, rtol, atol, method)
    _check_fixed_step(step)
    check_steps(t_end, max_step, shortest_event)
    _check_method(method, rho_inf, reference)
    state = started(system, start, period)
    own, finer = tolerances(start, state, rtol)
    begin = 0.0 if state is None else state.t
    if not begin < t_end:
        raise InputError(f"simulation t_end = {t_end:g} s is not after its start, which is at {begin:g} s")
    times = times_from(begin, t_end, output_step)
    with by_two_processes(system):
        integration = prepare(
            system,
            times,
            start=state,
            reference=reference,
            method="explicit" if reference else method,
            rtol=own,
            finer=finer,
            atol=atol,
            step=step,
            rho=rho_inf,
            longest=max_step or np.inf,
            shortest_event=shortest_event,
            events=events,
        )
        recorder = Recorder(integration, len(times) + 1)  # one more for an event that ends the run
        keep = None
        if checkpoint is not None:
            keep = Every(checkpoint_every, lambda: checkpoint(_so_far(integration, recorder))).call
        outcome = integration.run(recorder.add, progress, keep)
    result = recorder.result(outcome.status, _message(outcome, integration), outcome.stats)
    notes = (
        *system.notes,
        *unaudited(recorder.parts),
        *idle_closures(system, events),
        *integration.change_points.notes(),
        *_notes_on_motion(integration, result, from_rest=state is None),
        *integration.notes(),
        *time_notes(system, t_end, shortest_event),
        *(imbalance(result, rtol, sum(body.m for body in system.bodies.values())) if step is None else ()),
    )
    return result.with_(state=_state(integration), events=outcome.events, impacts=outcome.impacts, notes=notes)


def _notes_on_motion(integration: Integration, result: Result, from_rest: bool) -> list[str]:
    """Return notes on large deflections, joints beyond their range, and modes that ring after a start from rest."""
    system = integration.system
    modal = {name: result[f"{name}.modal"] for name, body in system.bodies.items() if body.n}
    ranged = {joint.name: result[range_channel(joint)] for joint in system.joints if joint.range is not None}
    found = [*large_deflections(system.bodies, result.time, modal), *left_ranges(system.joints, result.time, ranged)]
    return [*found, *_ringing(integration, result, modal)] if from_rest else found


def _message(outcome: Outcome, integration: Integration) -> str:
    """Return how the run ended, and what loops and events have to say."""
    loops = integration.loading.loops
    return "; ".join([outcome.message, *(loops.notes if loops else ()), *integration.changes.notes()])


def _check_fixed_step(step: float | None) -> None:
    if step is not None and not 0 < step < float("inf"):
        raise InputError(f"simulation step = {step:g} must be positive")


def _check_method(method: str, rho_inf: float, reference: bool) -> None:
    """Refuse options that the method does not have."""
    if not 0 <= rho_inf <= 1:
        raise InputError(f"simulation rho_inf = {rho_inf:g} must be between 0 and 1")
    if reference and method not in ("auto", "explicit"):
        raise InputError(f"the reference implementation is integrated explicitly, not by {method!r}; leave out method")
    if rho_inf != RHO_INF and (reference or method in ("explicit", "rosenbrock")):
        raise InputError(f"rho_inf = {rho_inf:g} has no effect on this method; it belongs to 'generalised_alpha'")


def _ringing(integration: Integration, result: Result, modal: dict[str, np.ndarray]) -> tuple[str, ...]:
    flexible = integration.packed.flexible
    nx = integration.packed.nx
    first = {integration.packed.links[i].body or "": integration.first[nx:][u] for i, _, u in flexible}
    return ringing(integration.system.bodies, result.time, modal, first)


def _so_far(integration: Integration, recorder: Recorder) -> Result:
    """Return the run so far, at whose end another one can start."""
    message = f"reached t = {float(integration.steps.clock[0].time):g} s so far"
    return recorder.result(RUNNING, message, integration.stats()).with_(state=_state(integration))


def _state(integration: Integration) -> SystemState:
    return state_of(
        integration.system,
        integration.steps.y[:-1].copy(),
        float(integration.steps.clock[0].time),
        loops=integration.loading.loops,
        steps=integration.uncut or integration.step_control(),
    )


def check_span(t_end: float, output_step: float, rtol: float, atol: float, method: str) -> None:
    """Refuse times and tolerances that are not positive, too many outputs, an unknown method."""
    for name, value in (("t_end", t_end), ("output_step", output_step), ("rtol", rtol), ("atol", atol)):
        if not isinstance(value, int | float) or not 0 < value < float("inf"):
            raise InputError(f"simulation {name} = {value} must be a positive number")
    if not t_end / output_step <= MAX_OUTPUTS:
        raise InputError(
            f"simulation t_end = {t_end:g} with output_step = {output_step:g} gives more than {MAX_OUTPUTS:.0e} "
            "output times; lower t_end or raise output_step"
        )
    if method not in ("auto", *METHODS):
        raise InputError(f"simulation method {method!r} is not one of auto, {', '.join(METHODS)}")


def check_steps(t_end: float, max_step: float | None, shortest_event: float | None) -> None:
    """Refuse a longest step or a shortest event that is not positive, and an event too short to be looked for."""
    if max_step is not None and (not isinstance(max_step, int | float) or not 0 < max_step < float("inf")):
        raise InputError(f"simulation max_step = {max_step} must be a positive number")
    survey_width(t_end, shortest_event)
