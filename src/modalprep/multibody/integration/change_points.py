"""The change points of closed loops that a run passes, and what a user should know of them."""

from __future__ import annotations

import numpy as np

from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.integration.branches import Course, Crossing
from modalprep.multibody.integration.stepping import Run

MOST = 8  # change points that are looked at; then a run no longer looks for them
MOST_LOOKS = 2000  # steps that are looked at
EXACT = 1e-6  # rad or m between branches that meet, lengths and angles having sixteen digits
SMALL = 1e-3  # share of a tangent that is not told


class ChangePoints:
    """Those of one run.

    Attributes
    ----------
    passed : list of Crossing
    """

    def __init__(self, loading: Loading) -> None:
        self.loading, self.looks = loading, 0
        self.passed: list[Crossing] = []
        self._before: Course | None = None

    def look(self, run: Run) -> bool:
        """Look at the last step, one that came near a singular position; returns whether to go on with looking.

        Raises
        ------
        SimulationError
            When the step went from one branch of the motion to another.
        """
        self.looks += 1
        before, course = self._before, Course.of(self.loading, run, self._before)
        self._before, gap = course, None if before is None else course.between(before)
        for crossing in [*([] if gap is None else gap.crossings()), *course.crossings()]:
            if crossing.left:
                raise SimulationError(
                    f"simulation stopped at t = {crossing.time:.6g} s: at a change point of the closed loops the step "
                    "went over to another branch of the motion; give another rtol or another method"
                )
            self.passed.append(crossing)
        return len(self.passed) < MOST and self.looks < MOST_LOOKS

    def notes(self) -> list[str]:
        """Return one sentence on the change points that were passed, if any."""
        if not self.passed:
            return []
        first, more = self.passed[0], [f"{point.time:.6g}" for point in self.passed[1:]]
        text = f"at t = {first.time:.6g} s the loops pass a change point, where closure {self._closure(first)!r} "
        text += "loses a condition and branches of the motion cross"
        if first.apart > EXACT:
            text += f", but for {first.apart:.1g} (rad or m) by which lengths or angles differ from those that do"
        text += "; the run goes straight on"
        if first.kept is not None:
            text += f", {self._ratios(first.kept)}, and not along the other branch, {self._ratios(first.other)}"
        if more:
            text += f"; so it does at t = {', '.join(more)} s"
        if len(self.passed) >= MOST or self.looks >= MOST_LOOKS:
            text += "; later change points were not looked for"
        return [text]

    def _closure(self, crossing: Crossing) -> str:
        row = self.loading.loops.closing.rows[crossing.row]
        return self.loading.system.closures[row.closure].name

    def _ratios(self, tangent: np.ndarray) -> str:
        """Return the speeds of joints and modes along a tangent, as shares of the largest."""
        shares, links, parts = tangent / tangent[np.argmax(np.abs(tangent))], self.loading.packed.model.links, []
        for link, begin, end in zip(self.loading.packed.links, links["u"], links["uq"], strict=True):
            parts += [f"{link.joint.name} {share:.3g}" for share in shares[begin:end] if abs(share) > SMALL]
        return " : ".join(parts)
