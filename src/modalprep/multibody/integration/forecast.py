"""Lines on a run that takes long: where it is, how much longer it will take, and what makes its steps short."""

from __future__ import annotations

import logging
from time import perf_counter

import numpy as np

from modalprep.multibody.integration.failure import Running, why_short

LOG = logging.getLogger("modalprep")  # Python prints warnings on the standard error, unless a program says otherwise
FIRST, GROWTH = 5.0, 2.0  # s of the first line; the interval grows with the time spent
LONG = 60.0  # s more, from which the cause is looked for
SHORT = 1e-5  # of the run: steps that are short
MINUTE, HOUR, DAY = 60.0, 3600.0, 86400.0


class Forecast:
    """Says on the log how a run goes on, at growing intervals."""

    def __init__(self) -> None:
        self.begun: float | None = None
        self.next, self.mark = FIRST, (0.0, 0.0)  # s spent; s spent and s reached at the last line

    def look(self, run: Running) -> None:
        """Write a line when it is time for one; the clock begins at the first look, after the compilation."""
        now, t = perf_counter(), float(run.steps.clock[0].time)
        if self.begun is None:
            self.begun, self.mark = now, (0.0, t)
        spent = now - self.begun
        if spent < self.next:
            return
        moved, left = t - self.mark[1], run.loading.t_end - t
        more = (spent - self.mark[0]) * left / moved if moved > 0.0 else np.inf
        LOG.warning("%s", self._line(run, t, spent, more))
        self.mark, self.next = (spent, t), GROWTH * spent

    def _line(self, run: Running, t: float, spent: float, more: float) -> str:
        end, step = run.loading.t_end, float(run.steps.clock[0].last_step)
        line = f"t = {t:.4g} of {end:g} s after {lasting(spent)}, {lasting(more)} more at this rate"
        if more < LONG or step > SHORT * end:
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
