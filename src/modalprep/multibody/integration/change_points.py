"""The change points of closed loops that a run passes, and what a user should know of them."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.integration.branches import Course, Crossing, Regular, along
from modalprep.multibody.integration.branching_start import NEITHER, Start
from modalprep.multibody.integration.stepping import Run

MOST = 8  # change points that are looked at; then a run no longer looks for them
MOST_LOOKS = 2000  # steps that are looked at
EXACT = 1e-6  # rad or m between branches that meet, lengths and angles having sixteen digits
SMALL = 1e-3  # share of a tangent that is not told
BEGIN = 1e-6  # of the time that was reached: a change point there is that of the start


class ChangePoints:
    """Those of one run from a closed state y (nx + nu + 1,).

    Attributes
    ----------
    start : Start or None
        That at which the run starts.
    passed : list of Crossing
    """

    def __init__(self, loading: Loading, start: Start | None, y: np.ndarray) -> None:
        self.loading, self.start, self.looks = loading, start, 0
        self.passed: list[Crossing] = []
        self._before: Course | None = None
        loops = loading.loops
        self._y = y[:-1]
        self._active = 0 if loops is None else np.count_nonzero(loops.active_rows)
        self._rank = 0 if loops is None else int(loops.work.rank[0])

    def look(self, run: Run) -> bool:
        """Look at the last step, one that came near a singular position; returns whether to go on with looking.

        Raises
        ------
        SimulationError
            When the step went from one branch of the motion to another.
        """
        self.looks += 1
        before = self._before
        course = Course.of(self.loading, run, self._regular(), self._before)
        if self.start and self.looks == 1:
            self._leave(self.start, course)
        self._before = course
        gap = None if before is None else course.between(before)
        for crossing in [*([] if gap is None else gap.crossings()), *course.crossings()]:
            if self.start and crossing.time <= BEGIN * course.end:
                continue
            if crossing.left:
                raise SimulationError(
                    f"simulation stopped at t = {crossing.time:.6g} s: at a change point of the closed loops the step "
                    "went over to another branch of the motion; give another rtol or another method"
                )
            self.passed.append(crossing)
        return len(self.passed) < MOST and self.looks < MOST_LOOKS

    @cached_property
    def _size(self) -> float:
        return Course(self.loading, (0.0, 0.0), (self._y, self._y), Regular(0, 0.0)).largest

    def _regular(self) -> Regular:
        """Return what the rows are, also where the last state is so near a change point that it has lost one."""
        loops = self.loading.closed_loops
        active = np.count_nonzero(loops.active_rows)
        if active != self._active:  # after an event
            self._active, self._rank = active, 0
        self._rank = max(self._rank, int(loops.work.closed_rank[0]))
        return Regular(self._rank, self._size)

    def notes(self) -> list[str]:
        """Return a sentence on the change point of the start and one on those that were passed, if any."""
        said = [] if self.start is None else [self._start_note(self.start)]
        return [*said, self._passed_note()] if self.passed else said

    def _start_note(self, start: Start) -> str:
        text = f"the run starts at a change point, where closure {self._closure(start.row)!r} loses a condition and "
        if start.tangents is None:
            return f"{text}may go on in several ways, or in none; start beside it to choose"
        ways = [self._ratios(tangent) for tangent in start.tangents]
        text += "branches of the motion cross; "
        if self.looks == 0:
            return f"{text}it stays there, and may leave it along {ways[0]} or along {ways[1]}"
        text += f"it goes on along {ways[0]}, and not along the other branch, {ways[1]}; start speeds choose a branch"
        if start.share > NEITHER:
            text += f"; those that belong to neither, {start.share:.2g} of the kinetic energy, were taken off"
        return text

    def _leave(self, start: Start, course: Course) -> None:
        """See by the first step which branch the run goes along."""
        if start.tangents is not None and along(start.tangents, course.ends[1][course.nx :]) < 0.0:
            self.start = start._replace(tangents=start.tangents[::-1])

    def _passed_note(self) -> str:
        first = self.passed[0]
        more = [f"{point.time:.6g}" for point in self.passed[1:]]
        text = f"at t = {first.time:.6g} s the loops pass a change point, where closure {self._closure(first.row)!r} "
        text += "loses a condition and branches of the motion cross"
        if first.apart > EXACT:
            text += f", but for {first.apart:.1g} (rad or m) by which lengths or angles differ from those that do"
        text += "; the run goes straight on"
        if first.tangents is not None:
            incoming, other = map(self._ratios, first.tangents)
            text += f", {incoming}, and not along the other branch, {other}"
        if more:
            text += f"; so it does at t = {', '.join(more)} s"
        if len(self.passed) >= MOST or self.looks >= MOST_LOOKS:
            text += "; later change points were not looked for"
        return text

    def _closure(self, row: int) -> str:
        return self.loading.system.closures[self.loading.closed_loops.closing.rows[row].closure].name

    def _ratios(self, tangent: np.ndarray) -> str:
        """Return the speeds of joints and modes along a tangent, as shares of the largest."""
        shares = tangent / tangent[np.argmax(np.abs(tangent))]
        links = self.loading.packed.model.links
        parts = []
        for link, begin, end in zip(self.loading.packed.links, links["u"], links["uq"], strict=True):
            parts += [f"{link.joint.name} {share:.3g}" for share in shares[begin:end] if abs(share) > SMALL]
        return " : ".join(parts)
