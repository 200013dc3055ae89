"""What a run looks at after its steps: output times, sizes of deflections, the address of what looks for events."""

from __future__ import annotations

from functools import cache

import numpy as np

from modalprep.compiler.by_address import Pattern
from modalprep.multibody.evaluation.evaluate import SHARED, Equations
from modalprep.multibody.integration.driver import Watch
from modalprep.multibody.packing.tree import blank

CHUNK = 256  # steps between two reports of progress
SAMPLES = 256  # states in the buffer


def new_watch(times: np.ndarray, size: np.ndarray, ny: int, eq: Equations) -> Watch:
    """Return what a run watches; the address of what looks for events is still zero.

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
    return _pattern().copy(times=np.ascontiguousarray(times), size=size, **seen)


@cache
def _pattern() -> Pattern[Watch]:
    given = {"times": np.zeros(0), "samples": np.zeros((0, 0)), "size": np.zeros(0), "state": np.zeros(0)}
    own = {
        "hook": np.zeros(1, np.int64),
        "stop": np.full(1, np.inf),
        "branches": np.zeros(1, np.int64),
        "cuts": np.zeros(1, np.int64),
        "shared": blank(SHARED, 1),
    }
    return Pattern(Watch(**given, **own), (*given, "shared"))
