"""Modes of a structure that its body drops, and the truncation vectors that stand for them (theory 11.1)."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.reduction.selection import NOTHING
from modalprep.reduction.table import DIRECTIONS, FIXED, FREE
from modalprep.reduction.truncation import BEYOND, MOSTLY

BASE = "base"


def acts_statically(body: FlexibleBody, frequency: np.ndarray, Y: np.ndarray, up_to: float) -> np.ndarray:
    """Return which modes ``Y (m, n)`` of a body act statically in a response up to a frequency: its truncation vectors.

    Truncation vectors mix dropped modes. Where the band has dropped modes, those below twice its end act statically.
    Where it has none, the inertia of truncation vectors improves the response up to its end, and is kept.

    Parameters
    ----------
    frequency : (n,)
        Hz, of the modes Y.
    up_to : float
        Hz.

    Returns
    -------
    (n,) bool

    References
    ----------
    Theory 11.1.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> beam = uniform_beam(modes=2).with_(truncation=np.array([0.0, 1.0]))
    >>> acts_statically(beam, beam.frequency, np.eye(2), 100.0)
    array([False,  True])
    """
    if body.modes.complete_below >= up_to:
        return np.zeros(len(frequency), dtype=bool)
    share = body.truncation @ Y**2 / np.sum(Y**2, axis=0)
    return (share > MOSTLY) & (frequency < BEYOND * up_to)


def dropped_below(body: FlexibleBody, inputs: tuple[str, ...], top: float) -> np.ndarray:
    """Return the frequencies (Hz) below `top` of modes that the reduction dropped, and that the inputs excite.

    Modes without effective mass in any driven direction are not excited by the base. Forces may excite all.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> dropped_below(uniform_beam(modes=2), ("base.y",), 9.0)
    array([], dtype=float64)
    """
    table = body.modes
    some = np.array([kind in (FIXED, FREE) for kind in table.kind], dtype=bool) & ~table.kept
    some &= np.nan_to_num(table.frequency, nan=np.inf) < top
    driven = [DIRECTIONS.index(name.removeprefix(f"{BASE}.")) for name in inputs if name.startswith(f"{BASE}.")]
    if len(driven) == len(inputs) and some.any():
        still = table.fraction[:, driven].max(axis=1) < NOTHING
        some &= ~(still & (np.array(table.kind) == FIXED))
    return table.frequency[some]
