"""Runs that take long say how long and why; those whose steps are too short to reach the end are stopped."""

from __future__ import annotations

import logging
from time import perf_counter

import numpy as np

from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.evaluate import GOOD, Equations, evaluate
from modalprep.multibody.integration.failure import Running, too_long, why_short
from modalprep.multibody.integration.method_selection import any_direction, top_frequency
from modalprep.multibody.integration.stepping import Run
from modalprep.multibody.model.loads import Callback

CALLS, MOST_CALLS = 20_000, 1e7  # between two looks at a run with callbacks, and to its end: some minutes
EVALUATIONS, ENDLESS = 1_000_000, 1e11  # of compiled equations: a day
STEEP = 10.0  # times the highest rate of the system without its callbacks
ITERATIONS, NUDGE = 6, 1e-7  # of a power iteration, and m/s or rad/s
LOG = logging.getLogger("modalprep")  # Python prints warnings on the standard error, unless a program says otherwise
FIRST, GROWTH = 5.0, 2.0  # s of the first line; the interval grows with the time spent
LONG = 60.0  # s more, from which the cause is looked for
SHORT = 1e-5  # of the run: steps that are short
MINUTE, HOUR, DAY = 60.0, 3600.0, 86400.0


def refuse_endless(run: Running) -> None:
    """Refuse a run that advances so slowly that it would not end, by its last thousands of evaluations.

    Raises
    ------
    SimulationError
        Which names the callback that is too stiff, or the body that moves fastest.
    """
    count = int(run.steps.counters["evaluations"][0])
    spent = count - run.looked[0]
    if spent < (EVALUATIONS if run.loading.compiled else CALLS):
        return
    t = float(run.steps.clock[0].time)
    moved = t - run.looked[1]
    left = run.loading.t_end - t
    run.looked = (count, t)
    more = spent * left / moved if moved > 0.0 else np.inf
    if more > MOST_CALLS and not run.loading.compiled:
        _refuse_stiff_callback(run, t, more)
    if more > ENDLESS:
        raise too_long(run, t, more)


def _refuse_stiff_callback(run: Running, t: float, remaining: float) -> None:
    """Refuse a callback that changes with the motion much faster than all else does."""
    flags = run.equations.flags
    hook = int(flags["callback"][0])
    flags["callback"] = 0
    rest = _fastest_rate(run.equations, run.steps, t)
    flags["callback"] = hook
    rates = _rates(run, t)
    name = max(rates, key=rates.__getitem__)
    if rates[name] > STEEP * rest:
        raise SimulationError(
            f"simulation stopped at t = {t:.6g} s: the load of callback {name!r} is too stiff for its explicit "
            f"evaluation: it changes with the motion at a rate of {rates[name]:.1e} 1/s, so that the rest of the run "
            f"would take about {remaining:.0e} evaluations; use dampers, springs or bushings, which are treated "
            "implicitly, or lower its factors"
        )


def _rates(run: Running, t: float) -> dict[str, float]:
    """Return the fastest rate of the system with each callback alone, by its name."""
    loading = run.loading
    whole = run.loading.system
    found = {}
    for law in [load for load in whole.loads if isinstance(load, Callback)]:
        loading.system = whole.with_(loads=(law,))
        found[law.name] = _fastest_rate(run.equations, run.steps, t)
    loading.system = whole
    run.raise_callback()
    return found


def _fastest_rate(eq: Equations, run: Run, t: float) -> float:
    """Return the highest rate (1/s) at which small changes of the positions or the speeds change."""
    nx = len(eq.state) - len(eq.tau)
    y = run.y.copy()
    base, moved = np.zeros_like(run.y), np.zeros_like(run.y)
    if evaluate(eq, t, y, base) != GOOD:
        return 0.0
    d = any_direction(len(eq.tau)).copy()
    rate = 0.0
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


class Forecast:
    """Says on the log how a run goes on, at growing intervals."""

    def __init__(self) -> None:
        self.begun: float | None = None
        # s spent; s spent and s reached at the last line
        self.next = FIRST
        self.mark = (0.0, 0.0)

    def look(self, run: Running) -> None:
        """Write a line when it is time for one; the clock begins at the first look, after the compilation."""
        now = perf_counter()
        if self.begun is None:
            self.begun = now
            self.mark = (0.0, float(run.steps.clock[0].time))
        spent = now - self.begun
        if spent < self.next:
            return
        t = float(run.steps.clock[0].time)
        moved = t - self.mark[1]
        left = run.loading.t_end - t
        more = (spent - self.mark[0]) * left / moved if moved > 0.0 else np.inf
        LOG.warning("%s", self._line(run, t, spent, more))
        self.mark = (spent, t)
        self.next = GROWTH * spent

    def _line(self, run: Running, t: float, spent: float, remaining: float) -> str:
        end = run.loading.t_end
        step = float(run.steps.clock[0].last_step)
        line = f"t = {t:.4g} of {end:g} s after {lasting(spent)}, {lasting(remaining)} more at this rate"
        if remaining < LONG or step > SHORT * end:
            return line
        return f"{line}: steps are of {step:.0e} s, since {why_short(run, t)}"


def lasting(seconds: float) -> str:
    """Write a time that a user waits.

    Examples
    --------
    >>> [lasting(seconds) for seconds in (4.6, 200.0, 5000.0, 2e5, 4e7)]
    ['5 s', '3 min', '1.4 h', '2.3 days', 'more than a year']
    """
    if seconds < 2 * MINUTE:
        return f"{seconds:.0f} s"
    if seconds < HOUR:
        return f"{seconds / MINUTE:.0f} min"
    if seconds < DAY:
        return f"{seconds / HOUR:.1f} h"
    return f"{seconds / DAY:.1f} days" if seconds < 365 * DAY else "more than a year"
