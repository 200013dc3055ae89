"""What functions of time ask of the steps: how long they may be where a function varies, and where they have to end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from modalprep.multibody.kernels.time_tables import Tables, quintic

NODES = 6  # of the polynomial that a step can follow
LOOKED_AT = 14  # samples of a part, before all others are
FINE = 4  # samples between two knots
NEGLIGIBLE = 1e-5  # of the range of a function: what a polynomial may miss
ROUND_OFF = 1e-12  # of its largest value
APART = 1e-12  # of the end of the run: times that are nearer to each other are one


class StepBounds(NamedTuple):
    """Stretches of time in which steps are at most so long, and the times at which a step ends."""

    cells: np.ndarray  # (n, 2) begin of each, longest step, s; from one to the next
    ends: np.ndarray  # (m,) s, ascending: the rate of a function, or its acceleration, jumps there


def ending_at(bounds: StepBounds, times: np.ndarray) -> StepBounds:
    """Return what the functions of time ask, with further times (k,) at which a step ends; nearby ones are one.

    Examples
    --------
    >>> ending_at(StepBounds(np.zeros((0, 2)), np.array([0.5])), np.array([0.5 + 1e-16, 1.0])).ends
    array([0.5, 1. ])
    """
    apart = [t for t in bounds.ends if not np.any(np.abs(times - t) <= APART * max(1.0, abs(t)))]
    return bounds._replace(ends=np.sort(np.concatenate([np.array(apart), times])))


def step_bounds(
    all_tables: Sequence[Tables], t_end: float, further: Sequence[np.ndarray] = (), rtol: float = NEGLIGIBLE
) -> StepBounds:
    """Return what the functions of tables ask of the steps; `further` are times between which others are smooth.

    Between the times of a cell a function is a polynomial of degree five to `NEGLIGIBLE`, which a step of that length
    cannot miss. Tables of points end a step at each point that is no part of such a cell, nor of one to `rtol` where
    that is less: a step that passes points misses what they bend.
    """
    edges = list(further)
    ends = [np.zeros(0)]
    for tables in all_tables:
        for first, last in zip(tables.first[:-1], tables.first[1:], strict=True):
            found, kinks = _of_function(tables, int(first), int(last), min(rtol, NEGLIGIBLE))
            edges.append(found)
            ends.append(kinks)
    return StepBounds(_merged(edges, t_end), _apart(np.concatenate(ends), t_end))


def smooth_cells(t: np.ndarray, f: np.ndarray, tolerance: float, every: int = 1) -> np.ndarray:
    """Return the numbers of samples between which f (n,) is a polynomial of t (n,), multiples of `every`.

    The whole is halved until each part, or a single interval, is smooth.
    """
    begin = np.array([0])
    end = np.array([(len(t) - 1) // every])
    found = [np.array([0])]
    while len(begin):
        fits = _fit(t, f, begin * every, end * every, tolerance) | (end - begin == 1)
        found.append(end[fits])
        begin, end = begin[~fits], end[~fits]
        middle = (begin + end) // 2
        begin, end = np.sort(np.append(begin, middle)), np.sort(np.append(middle, end))
    return np.sort(np.concatenate(found)) * every


def _fit(t: np.ndarray, f: np.ndarray, begin: np.ndarray, end: np.ndarray, tolerance: float) -> np.ndarray:
    """Whether the polynomial through six samples of each part misses no other one; a few are looked at first."""
    count = end - begin
    nodes = begin[:, None] + count[:, None] * np.arange(NODES) // (NODES - 1)
    x, divided = t[nodes], f[nodes]
    with np.errstate(all="ignore"):
        for k in range(1, NODES):
            divided[:, k:] = np.diff(divided[:, k - 1 :]) / (x[:, k:] - x[:, :-k])
        some = begin[:, None] + count[:, None] * np.arange(LOOKED_AT) // (LOOKED_AT - 1)
        every = np.arange(len(begin))[:, None]
        fits = (count >= NODES) & np.all(_miss(t, f, x, divided, some, every) <= tolerance, axis=1)
    found = np.flatnonzero(fits)
    if len(found):
        first = np.cumsum(count[found]) - count[found]
        part = np.repeat(found, count[found])
        sample = np.arange(len(part)) + np.repeat(begin[found] - first, count[found])
        fits[found] = np.maximum.reduceat(_miss(t, f, x, divided, sample, part), first) <= tolerance
    return fits


def _miss(
    t: np.ndarray, f: np.ndarray, x: np.ndarray, divided: np.ndarray, sample: np.ndarray, part: np.ndarray
) -> np.ndarray:
    """Return how far the polynomials of parts miss samples; both are numbers, of one shape together."""
    at = t[sample]
    value = divided[part, NODES - 1]
    for k in range(NODES - 2, -1, -1):
        value = value * (at - x[part, k]) + divided[part, k]
    return np.abs(value - f[sample])


def tolerance_of(f: np.ndarray, share: float = NEGLIGIBLE) -> float:
    """Return what a polynomial may miss of samples (n,), a share of their range."""
    return max(share * np.ptp(f), ROUND_OFF * np.abs(f).max())


def _of_function(tables: Tables, first: int, last: int, share: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the times between which a function is smooth, and of its kinks that count at a share of its range."""
    pieces = [tables.knots[tables.knot[k] : tables.knot[k + 1]] for k in range(first, last)]
    sampled = [_samples(knots) for knots in pieces]
    together = np.concatenate([f for _, f in sampled])
    tolerance, least = tolerance_of(together), tolerance_of(together, share)
    edges, kinks = [], []
    for knots, (t, f) in zip(pieces, sampled, strict=True):
        edge = t[smooth_cells(t, f, tolerance, FINE)]
        twice = knots[:-1, 0][np.diff(knots[:, 0]) == 0]
        edges.append(edge)
        finer = t[smooth_cells(t, f, least, FINE)] if len(twice) and least < tolerance else edge
        kinks.append(np.intersect1d(twice, finer))
    return np.unique(np.concatenate(edges)), np.concatenate(kinks)


def _samples(knots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times and values at the knots of a piece and between them."""
    there = np.diff(knots[:, 0]) > 0
    left = knots[:-1][there].T[:, :, None]
    right = knots[1:][there].T[:, :, None]
    t = left[0] + (right[0] - left[0]) * np.arange(FINE) / FINE
    value = getattr(quintic, "py_func", quintic)(left, right, t)[0]
    return np.append(t, knots[-1, 0]), np.append(value, knots[-1, 1])


def _merged(edges: list[np.ndarray], t_end: float) -> np.ndarray:
    """Return the cells of all functions together: of each time the shortest."""
    edges = [edge for edge in edges if len(edge) > 2 or edge[-1] - edge[0] < t_end]
    if not edges:
        return np.zeros((0, 2))
    begins = np.unique(np.concatenate(edges))
    longest = np.full(len(begins), np.inf)
    for edge in edges:
        here = np.searchsorted(edge, begins, side="right") - 1
        widths = np.append(np.diff(edge), np.inf)
        longest = np.minimum(longest, np.where(here < 0, np.inf, widths[here]))
    changes = np.append(True, np.diff(longest) != 0)
    return np.column_stack([begins, longest])[changes]


def _apart(times: np.ndarray, t_end: float) -> np.ndarray:
    if not len(times):
        return times
    times = np.unique(times[(times > APART * t_end) & (times < t_end * (1 - APART))])
    return times[np.diff(times, prepend=0.0) > APART * t_end]
