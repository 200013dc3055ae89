"""Where the numbers of a system stand in the image of its records, found by packing it with others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.multibody.evaluation.evaluate import build_equations
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import pack
from modalprep.runtime.changes import Change
from modalprep.runtime.image import Image

EXACT = 1e-13  # relative round-off of a number that was multiplied once or twice
WORD = 8


class Place(NamedTuple):
    """A number of an image, in bytes from its begin, that is a factor times a value.

    `later` is how much the time of its knot is after that of the first knot of a function of time, s; negative where it
    is in no knot.
    """

    at: int
    factor: float
    later: float = -1.0


class Places:
    """Those of numbers of one system, in the image of its equations."""

    def __init__(self, system: System, t_end: float, shortest_event: float | None) -> None:
        self._system, self._given = system, (t_end, shortest_event)
        self._words = self._image(system)
        self._unsteady = self._image(system) != self._words  # of memory that nobody has written

    def of(self, change: Change) -> list[Place] | None:
        """Return where a number stands; None where not all that follows from it is a multiple of it.

        Everything is packed with two other values. A change that would be lost is so never offered: each word that
        differs must be proportional to the value, at all three.
        """
        steps = [0.5 * change.value or 1.0, 2.0 * change.value or 2.0]
        images = [self._image(change.make(self._system, change.value + step)) for step in steps]
        if any(len(image) != len(self._words) for image in images):
            return None
        differ = ~self._unsteady & np.any([image != self._words for image in images], axis=0)
        at = np.flatnonzero(differ)
        now, *moved = (words[at].view(float) for words in (self._words, *images))
        factor = (moved[0] - now) / steps[0]
        size = np.abs(factor) * max(abs(change.value), abs(steps[1]))
        found = (now, change.value), *((m, change.value + step) for m, step in zip(moved, steps, strict=True))
        for numbers, value in found:
            if not np.all(np.abs(numbers - factor * value) <= EXACT * size):
                return None
        exact = np.where(np.abs(factor - factor.round()) < EXACT, factor.round(), factor)
        return [Place(WORD * int(k), float(f)) for k, f in zip(at, exact, strict=True)]

    def _image(self, system: System) -> np.ndarray:
        packed = pack(system)
        loading = Loading(system, packed, *self._given)
        return Image(build_equations(packed, loading, packed.data())).words
