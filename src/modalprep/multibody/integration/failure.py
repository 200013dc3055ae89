"""Why a run ended early, in one sentence."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Protocol

import numpy as np

from modalprep.errors import SimulationError
from modalprep.multibody.elements.half_turns import turning
from modalprep.multibody.evaluation.evaluate import Equations, evaluate
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.evaluation.singular import gimbal_lock, without_inertia
from modalprep.multibody.integration.driver import Watch
from modalprep.multibody.integration.stepping import NOT_CONVERGED, OPEN, Run
from modalprep.multibody.kernels.closed_loops.singularities import SINGULAR
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.loads import Callback
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.reference.equations import mass_and_force

LATER = 1e-3  # of the run
COUNTS = 0.02  # times the step: the rate of what holds it
MOST_EVALUATIONS = 1e6  # to the end of a run, beyond which its callbacks are looked at
SHARES = (1e-3, 2e-3, 5e-3)  # of a step; a smooth load changes there by that share of its change in the step
MOST_HALVED = 20  # of 256 fixed steps
A_STEP = 12.0  # evaluations
STALLED = 1e-9  # of the time so far: shorter steps than that are those of a run that stands still
ROUGH, ROUND_OFF = 0.1, 1e-9
NEARLY_SINGULAR = 1e-5  # of the scaled mass matrix: accelerations are then 1e5 times too large


class Running(Protocol):
    """What an explanation needs of a run."""

    system: System
    packed: Packed
    loading: Loading
    equations: Equations
    steps: Run
    watch: Watch
    looked: tuple[int, float]
    raise_callback: Callable[[], None]


def diverged(run: Running) -> str:
    """Return the sentence of a run that ended because a deflection grew beyond all meaning."""
    name = body_of(run, int(run.steps.counters[0].cause))
    x = modal_rows(run, name)
    sizes = float(np.abs(run.steps.y[x]) @ run.watch.size[x])
    why = "" if run.system.bodies[name].has_geometric_stiffness else " without geometric stiffness"
    return f"diverged at t = {run.steps.clock[0].time:.4g} s: body {name!r} deflects by {sizes:.0f} times its size{why}"


def wound(run: Running) -> str:
    """Return the sentence of a run that ended because a spring of rotations is turned by half a turn."""
    load = turning(run.system)[int(run.steps.counters[0].cause)]
    return (
        f"ended at t = {run.steps.clock[0].time:.4g} s: {load.noun} {load.name!r} passes half a turn, where its torque "
        "would jump: make it an element of a joint, whose angle counts the turns"
    )


def failure(run: Running, t: float) -> SimulationError:
    """Return the error of a run that cannot go on at time t: the body, and what to do."""
    cause = int(run.steps.counters[0].cause)
    begin = f"simulation stopped at t = {t:.6g} s: "
    loops = run.loading.loops
    near = loops and min(loops.work.sine[0], loops.work.closed_sine[0]) < SINGULAR
    locked = loops and _locked(run, t)
    if near and not locked:
        return SimulationError(
            f"{begin}the loops are at a change point, where round-off decides what a closure does, and the steps for "
            f"rtol = {run.steps.clock[0].rtol:g} do not get past it by this method: give another rtol or another method"
        )
    if loops and (locked or cause == OPEN):
        return SimulationError(
            begin + loops.widest() + "; the mechanism is locked or at a dead point there, look at its "
            "prescribed motions and lengths"
        )
    if gimbal := gimbal_lock(run.system, run.packed, run.steps.y):
        return SimulationError(begin + gimbal)
    evaluate(run.equations, t, run.steps.y, run.steps.ydot)
    loaded = _not_finite(run)
    if loaded and cause < 0:
        return SimulationError(f"{begin}the forces on body {loaded!r} are not finite; look for an infinite load there")
    clock = run.steps.clock[0]
    if clock.last_step > 0.0 and clock.next_step > STALLED * t:
        return too_long(run, t, A_STEP * (run.loading.t_end - t) / clock.next_step)
    if cause >= 0 or (cause != NOT_CONVERGED and _nearly_singular(run, t)):
        name = body_of(run, cause) if cause >= 0 else softest(run)
        if not run.system.bodies[name].n:
            return SimulationError(begin + without_inertia(run.system, run.packed, run.steps.y, name))
        return SimulationError(
            f"{begin}the mass matrix of body {name!r} is no longer positive, its deflection is too large for its "
            "modes; keep fewer modes, leave out the inertia truncation vectors, or cut the body into smaller ones"
        )
    if cause == NOT_CONVERGED:
        return SimulationError(
            f"{begin}the iterations of the implicit method do not converge, body {fastest(run)!r} moves fastest; "
            "loads may change too fast with the motion for it: use method = 'explicit'"
        )
    name = fastest(run)
    advice = (
        "drop its highest modes or loosen rtol"
        if run.system.bodies[name].n
        else ("look for loads that jump or have no bound there")
    )
    return SimulationError(f"{begin}the step size collapsed, body {name!r} moves fastest; {advice}")


def too_long(run: Running, t: float, evaluations: float) -> SimulationError:
    """Return the error of a run whose steps are too short for its span: it would take so many evaluations more."""
    if locked := gimbal_lock(run.system, run.packed, run.steps.y):
        return SimulationError(f"simulation stopped at t = {t:.6g} s: {locked}")
    return SimulationError(
        f"simulation stopped at t = {t:.6g} s: the steps are so short that the rest of the run would take about "
        f"{evaluations:.0e} evaluations, since {why_short(run, t)}; lower t_end, or look for a load, stiffness or "
        "damping that is far too large there"
    )


def why_short(run: Running, t: float) -> str:
    """Say why steps are short: what changes so fast with the motion, else the body that moves fastest."""
    rate, what = fastest_element(run, t)
    if rate * float(run.steps.clock[0].last_step) > COUNTS:
        return f"{what} changes with the motion at a rate of {rate:.0e} 1/s"
    return f"body {fastest(run)!r} moves fastest"


def fastest_element(run: Running, t: float) -> tuple[float, str]:
    """Return the highest rate (1/s) at which an element of a joint changes with the motion, and its words."""
    M, _ = mass_and_force(run.system.with_masses_at(t), run.steps.y[:-1], run.loading.prescribe(t))
    if not np.isfinite(M).all():
        return 0.0, ""
    mobility = np.diag(np.linalg.pinv(M))
    found = [
        (rate, f"{words} of joint {joint.name!r}")
        for joint in run.system.joints
        for element, u in zip(joint.elements, run.packed.speeds_of(joint.name), strict=False)
        for rate, words in _rates(element, float(mobility[u]))
    ]
    return max(found, default=(0.0, ""))


def _rates(e: HingeElement, mobility: float) -> Iterator[tuple[float, str]]:
    """Yield the rates of one element, whose coordinate has a mobility (1/kg or 1/(kg m^2))."""
    if e.friction:
        words = f"the friction, of a transition velocity of {e.transition_velocity:g},"
        yield e.friction / e.transition_velocity * mobility, words
    yield e.damping * mobility, "the damping"
    yield np.sqrt(e.stiffness * mobility), "the stiffness"
    if e.limited:
        yield np.sqrt(e.limit_stiffness * mobility), "the stiffness of the limits"
        yield e.limit_damping * mobility, "the damping of the limits"


def refuse_noise(run: Running, spent: int, moved: float) -> None:
    """Refuse a callback without a smooth course when the steps become too short to reach the end.

    Parameters
    ----------
    spent, moved : int, float
        Evaluations and seconds of the last steps.

    Raises
    ------
    SimulationError
        When the forces change as much in a thousandth of a step as in the whole of it.
    """
    if run.loading.compiled or run.steps.clock[0].fixed_step > 0.0:
        return
    t, h = float(run.steps.clock[0].time), float(run.steps.clock[0].next_step)
    if spent * (run.loading.t_end - t) < MOST_EVALUATIONS * moved:
        return
    if all(_rough(run, t, h, share) for share in SHARES):
        names = ", ".join(repr(load.name) for load in run.system.loads if isinstance(load, Callback))
        raise SimulationError(
            f"simulation stopped at t = {t:.6g} s: the values of callback {names} change as much in "
            f"{SHARES[0] * h:.0e} s as in {h:.0e} s, so that no step is short enough; a load is a "
            "function of t and the state: draw noise before the run at fixed times, and interpolate it"
        )


def refuse_fixed_step(run: Running, halved: int) -> None:
    """Refuse a fixed step at which the motion is unstable: `halved` of the last steps gave no finite numbers.

    Raises
    ------
    SimulationError
        When these are many: the run would go on with steps much shorter than what was asked for.
    """
    step = float(run.steps.clock[0].fixed_step)
    if step > 0.0 and halved > MOST_HALVED:
        raise SimulationError(
            f"simulation stopped at t = {run.steps.clock[0].time:.6g} s: the motion is unstable with the fixed step of "
            f"{step:g} s, body {fastest(run)!r} moves fastest; give a shorter step, or none"
        )


def _rough(run: Running, t: float, h: float, share: float) -> bool:
    """Whether the accelerations change in a small share of a step about as much as in the whole step."""
    here, near, far = (_accelerations(run, t, s * h) for s in (0.0, share, 1.0))
    small = np.abs(near - here).max()
    whole = np.abs(far - here).max()
    return small > ROUGH * whole and small > ROUND_OFF * np.abs(here).max()


def _accelerations(run: Running, t: float, later: float) -> np.ndarray:
    """Return the accelerations a moment later, the state moved on with its present rates."""
    ydot = np.empty_like(run.steps.ydot)
    evaluate(run.equations, t + later, run.steps.y + later * run.steps.ydot, ydot)
    run.raise_callback()
    return ydot[run.packed.nx : -1]


def body_of(run: Running, link: int) -> str:
    """Return the body that a link carries, or helps to carry."""
    return next(row.body for row in run.packed.links[link:] if row.body)


def modal_rows(run: Running, body: str) -> slice:
    """Return the rows of a body's modal coordinates."""
    return run.packed.modes_of(body)


def softest(run: Running) -> str:
    """Return the body of the largest modal coordinate."""
    return max(run.system.order, key=lambda name: np.abs(run.steps.y[modal_rows(run, name)]).max(initial=0.0))


def fastest(run: Running) -> str:
    """Return the body whose own accelerations are the largest."""
    udot = np.abs(run.steps.ydot[run.packed.nx : -1])
    rows = {name: run.packed.model.links[run.packed.link_of(name)] for name in run.system.order}
    ends = {name: row["uq"] + run.system.bodies[name].n for name, row in rows.items()}
    return max(rows, key=lambda name: udot[rows[name]["u"] : ends[name]].max(initial=0.0))


def _locked(run: Running, t: float) -> bool:
    """Whether the loops do not close a little later."""
    later = t + LATER * run.watch.times[-1]
    y = run.steps.y[:-1].copy()
    motion = run.loading.prescribe(later, run.equations.data)
    return not run.loading.closed_loops.project(run.equations.data, y, motion, later)


def _not_finite(run: Running) -> str:
    """Return the first body whose load is not a number."""
    for i, link in enumerate(run.packed.links):
        if link.body and not np.all(np.isfinite(run.equations.data.links["wrench"][i])):
            return link.body
    bad = np.flatnonzero(~np.isfinite(run.equations.tau))
    links = run.packed.model.links["u"]
    return body_of(run, int(np.flatnonzero(links <= bad[0])[-1])) if len(bad) else ""


def _nearly_singular(run: Running, t: float) -> bool:
    M, _ = mass_and_force(run.system.with_masses_at(t), run.steps.y[:-1], run.loading.prescribe(t))
    scale = 1 / np.sqrt(np.abs(np.diag(M)))
    return not np.linalg.eigvalsh(M * scale * scale[:, None])[0] > NEARLY_SINGULAR
