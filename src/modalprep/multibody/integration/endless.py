"""Runs that would not end: steps so short that their number to the end of the run is beyond all patience, and why."""

from __future__ import annotations

import numpy as np

from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.evaluate import GOOD, Equations, evaluate
from modalprep.multibody.integration.failure import Running, too_long
from modalprep.multibody.integration.method_selection import any_direction, top_frequency
from modalprep.multibody.integration.stepping import Run
from modalprep.multibody.model.loads import Callback

CALLS, MOST_CALLS = 20_000, 1e7  # between two looks at a run with callbacks, and to its end: some minutes
EVALUATIONS, ENDLESS = 1_000_000, 1e11  # of compiled equations: a day
STEEP = 10.0  # times the highest rate of the system without its callbacks
ITERATIONS, NUDGE = 6, 1e-7  # of a power iteration, and m/s or rad/s


def refuse_endless(run: Running) -> None:
    """Refuse a run that advances so slowly that it would not end, by its last thousands of evaluations.

    Raises
    ------
    SimulationError
        Which names the callback that is too stiff, or the body that moves fastest.
    """
    count, t = int(run.steps.count[0].evaluations), float(run.steps.clock[0].time)
    spent, moved, left = count - run.looked[0], t - run.looked[1], run.loading.t_end - t
    if spent < (EVALUATIONS if run.loading.compiled else CALLS):
        return
    run.looked = (count, t)
    more = spent * left / moved if moved > 0.0 else np.inf
    if more > MOST_CALLS and not run.loading.compiled:
        _refuse_stiff_callback(run, t, more)
    if more > ENDLESS:
        raise too_long(run, t, more)


def _refuse_stiff_callback(run: Running, t: float, more: float) -> None:
    """Refuse a callback that changes with the motion much faster than all else does."""
    flags = run.equations.flags
    hook, flags["callback"] = int(flags["callback"][0]), 0
    rest = _fastest_rate(run.equations, run.steps, t)
    flags["callback"] = hook
    rates = _rates(run, t)
    name = max(rates, key=rates.__getitem__)
    if rates[name] > STEEP * rest:
        raise SimulationError(
            f"simulation stopped at t = {t:.6g} s: the load of callback {name!r} is too stiff for its explicit "
            f"evaluation: it changes with the motion at a rate of {rates[name]:.1e} 1/s, so that the rest of the run "
            f"would take about {more:.0e} evaluations; use dampers, springs or bushings, which are treated "
            "implicitly, or lower its factors"
        )


def _rates(run: Running, t: float) -> dict[str, float]:
    """Return the fastest rate of the system with each callback alone, by its name."""
    loading, whole, found = run.loading, run.loading.system, {}
    for law in [load for load in whole.loads if isinstance(load, Callback)]:
        loading.system = whole.with_(loads=(law,))
        found[law.name] = _fastest_rate(run.equations, run.steps, t)
    loading.system = whole
    run.raise_callback()
    return found


def _fastest_rate(eq: Equations, run: Run, t: float) -> float:
    """Return the highest rate (1/s) at which small changes of the positions or the speeds change."""
    nx, y = len(eq.state) - len(eq.tau), run.y.copy()
    base, moved = np.zeros_like(run.y), np.zeros_like(run.y)
    if evaluate(eq, t, y, base) != GOOD:
        return 0.0
    d, rate = any_direction(len(eq.tau)).copy(), 0.0
    for _ in range(ITERATIONS):
        size = np.abs(d).max(initial=0.0)
        if not 0.0 < size < np.inf:
            break
        y[nx:-1] = run.y[nx:-1] + (NUDGE / size) * d
        if evaluate(eq, t, y, moved) != GOOD:
            break
        d = moved[nx:-1] - base[nx:-1]
        rate = float(np.linalg.norm(d) / np.linalg.norm(y[nx:-1] - run.y[nx:-1]))
    return max(rate, top_frequency(eq, run, t))
