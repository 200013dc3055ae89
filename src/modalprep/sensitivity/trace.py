"""A run with all its steps: what derivatives are taken along."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from modalprep.compiler.jit import bound
from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.integration.run import Integration, Record
from modalprep.multibody.packing.step_bounds import StepBounds
from modalprep.sensitivity.jumps import Jump
from modalprep.sensitivity.local import Moment
from modalprep.sensitivity.taken import Taken, advance_kept, new_taken

ROWS = 64  # steps that are kept at once
APART = 1e-12  # of the time: two steps between which nothing lies


class Step(NamedTuple):
    """A step that was taken.

    Attributes
    ----------
    method : int
        EXPLICIT, ROSENBROCK or ALPHA of `integration.driver`.
    t, h : float
        s, its begin and length.
    stretch : (float, float)
        Between breaks of functions of time, s.
    y : (nx + nu,)
        State at its begin.
    end : (nx + nu,)
        State at its end.
    udot : (nu,)
        Accelerations at its end.
    ratio : float
        Its length over that of the step before, 0 where the method begins.
    algorithmic : (2, nu)
        Algorithmic accelerations of generalised-alpha at begin and end.
    """

    method: int
    t: float
    h: float
    stretch: tuple[float, float]
    y: np.ndarray
    end: np.ndarray
    udot: np.ndarray
    ratio: float
    algorithmic: np.ndarray

    @property
    def begin(self) -> Moment:
        """When it begins."""
        return Moment(self.t, self.stretch)

    def at(self, c: float) -> Moment:
        """Return the moment of a stage, a share of the step after its begin."""
        return Moment(self.t + c * self.h, self.stretch)


class Traced(Integration):
    """A run that keeps its steps.

    Parameters
    ----------
    beside : sequence of Loading
        Of systems beside this one, whose functions of time its steps follow too.

    Attributes
    ----------
    trace : list of Step and Jump
    """

    def __init__(self, *args, beside: Sequence[Loading] = (), **options) -> None:
        self._beside = beside
        self.trace: list[Step | Jump] = []
        self._stretch = (0.0, 0.0)
        self._last = 0.0  # length of the last step of this method
        super().__init__(*args, **options)

    def _step_bounds(self, rtol: float) -> StepBounds:
        return self.loading.step_bounds(rtol, self._beside)

    def _begin(self, begin: float, end: float) -> None:
        self._last = 0.0
        self._stretch = next(s for s in self.loading.stretches if s[0] <= begin < s[1])
        super()._begin(begin, end)

    @cached_property
    def _advance(self) -> Callable[[int, float, int], int]:
        taken = new_taken(ROWS, self.packed.nx, self.packed.nu)
        given = self.equations, self.steps, self.watch, taken
        advance = bound(advance_kept, *given, rest=(int, float, int))

        def kept(method: int, stop: float, most: int) -> int:
            code = advance(method, stop, most)
            self._keep(method, taken)
            return code

        return kept

    def _keep(self, method: int, taken: Taken) -> None:
        """Keep the steps that were taken last; an event may have ended one early."""
        count = int(taken.filled[0])
        rows = (each[:count].copy() for each in (taken.y, taken.end, taken.udot, taken.algorithmic))
        for (begin, end), y, after, udot, algorithmic in zip(taken.times[:count].tolist(), *rows, strict=True):
            if self.trace and abs(self.trace[-1].at(1.0).t - begin) > APART * max(1.0, abs(begin)):
                raise SimulationError(f"the steps of the run are not known near t = {begin:.6g} s")
            h = end - begin
            ratio = h / self._last if self._last > 0 else 0.0
            self.trace.append(Step(method, begin, h, self._stretch, y, after, udot, ratio, algorithmic))
            self._last = h

    def _change(self, record: Record, end: float) -> bool:
        before = self.steps.y[:-1].copy()
        here = [self.events[e] for e in self.search.signs]
        goes_on = super()._change(record, end)
        hits = [event for event in here if event.impacts]
        if len(hits) > 1:
            raise SimulationError(f"derivatives of a run: several impacts at once, at t = {self._t:.6g} s")
        if hits:
            self.trace.append(Jump(self._t, self._stretch, hits[0], before, self.steps.y[:-1].copy()))
        return goes_on

    @property
    def method(self) -> str:
        """Names of the methods of all steps, in their order."""
        names = ("explicit", "rosenbrock", "generalised_alpha")
        return ", ".join(dict.fromkeys(names[step.method] for step in self.steps_taken))

    @property
    def steps_taken(self) -> list[Step]:
        """The steps without the jumps."""
        return [each for each in self.trace if isinstance(each, Step)]
