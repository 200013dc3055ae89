"""When the law of a deployment leaves a range of lengths."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from modalprep.errors import InputError
from modalprep.multibody.deployment import (
    EXACT,
    Deployment,
)
from modalprep.multibody.deployment_phase import IN, OUT, Change
from modalprep.multibody.timefunction import FOREVER

SAMPLES = 20_000  # of a law, between which it is taken to pass a length once


def samples(d: Deployment, t_end: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and lengths of a law.

    Raises
    ------
    InputError
        When it leaves what there is.
    """
    t, begin = np.linspace(0.0, t_end, SAMPLES + 1), 0.0
    length = np.zeros_like(t)
    for piece in d.law.pieces:
        here = t >= begin
        length[here], begin = piece.evaluate(t[here])[0], piece.until
    length[t >= d.jam] = d.law(min(d.jam, t_end))[0]
    wrong = ~((length >= -EXACT * d.rod) & (length <= d.length + EXACT * d.rod))
    if np.any(wrong):
        first = np.flatnonzero(wrong)[0]
        raise InputError(
            f"deployment {d.name!r}: the law asks for {length[first]:g} m at t = {t[first]:g} s; there are "
            f"{d.length:g} m, from none to all of it may be out"
        )
    return t, length


def leaving(d: Deployment, k: int, bounds: tuple[float, float], t: float, sampled: tuple) -> Change:
    """Return when the law first leaves a range of lengths."""
    times, length = sampled
    slack = EXACT * d.rod
    after = np.flatnonzero((times > t) & ((length > bounds[1] + slack) | (length < bounds[0] - slack)))
    if not len(after):
        return Change(FOREVER, k, "")
    i = after[0]
    what, bound = (OUT, bounds[1]) if length[i] > bounds[1] else (IN, bounds[0])
    a, b = max(t, times[i - 1]), times[i]
    sides = [d.law(s)[0] - bound for s in (a, b)]
    if sides[0] * sides[1] >= 0:
        return Change(a, k, what)
    return Change(float(brentq(lambda s: d.law(s)[0] - bound, a, b, xtol=1e-15 * times[-1])), k, what)
