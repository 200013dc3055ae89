"""What a run looks at after its steps: output times, sizes of deflections, events."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from modalprep.by_address import Pattern
from modalprep.multibody.evaluation.evaluate import SHARED, Equations
from modalprep.multibody.integration.driver import PROBES, Watch
from modalprep.multibody.model.events import Event
from modalprep.multibody.packing.tree import blank

CHUNK = 256  # steps between two reports of progress
SAMPLES = 256  # states in the buffer


def new_watch(times: np.ndarray, size: np.ndarray, ny: int, eq: Equations, events: Sequence[Event]) -> Watch:
    """Return what a run watches; the address of what writes the event functions is still zero.

    Parameters
    ----------
    times : (nt,)
        Of the outputs, s.
    size : (nx,)
        Deflection of a modal coordinate, in sizes of its body.
    ny : int
        Length of a state, with the work.
    """
    samples = np.zeros((min(SAMPLES, len(times)), ny))
    seen = {"state": eq.state, "shared": eq.shared, "samples": samples}
    watch = _pattern(len(events)).copy(times=np.ascontiguousarray(times), size=size, **seen)
    if events:
        watch.sense[:] = [[event.direction, event.terminal or event.changes] for event in events]
    return watch


@cache
def _pattern(events: int) -> Pattern[Watch]:
    given = {"times": np.zeros(0), "samples": np.zeros((0, 0)), "size": np.zeros(0), "state": np.zeros(0)}
    own = {
        "hook": np.zeros(1, np.int64), "sense": np.zeros((events, 2), np.int64),
        "found": np.zeros((CHUNK * PROBES * events, 2)), "shared": blank(SHARED, 1),
        **{name: np.zeros(events) for name in ("values", "now", "before")},
    }  # fmt: skip
    return Pattern(Watch(**given, **own), (*given, "shared"))
