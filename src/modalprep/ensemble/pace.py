"""Lines on the log that say how an ensemble goes on."""

from __future__ import annotations

from time import perf_counter

from modalprep.multibody.integration.endless import FIRST, GROWTH, LOG, lasting


class Pace:
    """Says how many cases have ended, at growing intervals, as a run says what it has reached.

    Parameters
    ----------
    before, count : int
        Cases that had ended before, and all.
    """

    def __init__(self, before: int, count: int) -> None:
        self.before = before
        self.count = count
        self.begun = perf_counter()
        self.next = FIRST

    def look(self, finished: int) -> None:
        """Write a line when it is time for one."""
        spent = perf_counter() - self.begun
        if spent < self.next or finished == self.count:
            return
        self.next = GROWTH * spent
        more = (self.count - finished) * spent / max(1, finished - self.before)
        at_this_rate = f", {lasting(more)} more at this rate" if finished > self.before else ""
        LOG.warning("%s", f"{finished} of {self.count} cases after {lasting(spent)}{at_this_rate}")
