"""Where a function of one variable changes its sign: panels of five nodes, extrema between them, roots, poles."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

NODES = (0.0, 0.22, 0.5, 0.78, 1.0)  # of a panel: not evenly spaced, so that no period fits all of them
FINE = 8  # places between two nodes at which the polynomial through all five is looked at
DEPTH = 4  # how often a panel is halved that its polynomial does not fit
FIT = 0.03  # misfit of a polynomial that fits, of the range of the values
CLOSE = 0.02  # so near to zero, of the range of the values, its extrema are located
NOTHING = 1e-13  # values below are not looked at more closely: round-off
MOST_TRIALS, FINEST = 100, 1e-8  # for a root or an extremum; of the latter, of its interval
POLE, WRAP = 10.0, 0.01  # sizes beside a pole and a jump, of those at the ends of the interval that shrank to it
HOPELESS = 10.0  # a lowest value so far above zero, of its difference to the next ones, comes not through it
GOLDEN = 0.381966

Function = Callable[[float], float]


class Crossing(NamedTuple):
    """A change of sign: the first time after it, s, and the sign from then on."""

    t: float
    sign: float


def _weights() -> np.ndarray:
    """Return the weights (5,) of the fourth divided difference, times the error of a cubic that leaves it out."""
    s = np.array(NODES)
    return 0.03 / np.array([np.prod(s[j] - np.delete(s, j)) for j in range(5)])


def _polynomials() -> np.ndarray:
    """Return the values (4 (FINE + 1), 5) of Lagrange's polynomials at places of each of the four intervals."""
    s = np.array(NODES)
    x = np.concatenate([np.linspace(a, b, FINE + 1) for a, b in pairwise(s)])
    return np.array([np.prod([(x - s[k]) / (s[j] - s[k]) for k in range(5) if k != j], axis=0) for j in range(5)]).T


WEIGHTS = tuple(_weights().tolist())
POLYNOMIALS = _polynomials()


def node_times(a: float, b: float) -> list[float]:
    """Return the five times of a panel."""
    return [a, *(a + s * (b - a) for s in NODES[1:-1]), b]


def crossings(
    f: Function, t: Sequence[float], v: Sequence[float], left: bool, most: float = POLE, depth: int = 0
) -> Iterator[Crossing]:
    """Yield the crossings of a function within a panel, in order.

    Parameters
    ----------
    t, v : (5,)
        Nodes and values there.
    left : bool
        Whether the first value is a side only: the function has just crossed zero, or been sent back there.
    most : float
        Growth of the values at which a change of sign is a pole, or a jump that does not count.
    depth : int
        How often the panel has been halved.
    """
    misfit = abs(sum(w * x for w, x in zip(WEIGHTS, v, strict=True)))
    low = min(v)
    high = max(v)
    if low == high or max(low, -high) > 0.5 * (high - low) + 2.0 * misfit:
        return
    fits = misfit <= FIT * (high - low) < np.inf or max(high, -low) <= NOTHING
    if not fits and depth < DEPTH:
        yield from _halves(f, t, v, left, most, depth)
        return
    rows = (POLYNOMIALS @ np.array(v)).reshape(4, FINE + 1).tolist() if fits else [[a, b] for a, b in pairwise(v)]
    margin = 0.5 * misfit + CLOSE * (high - low)
    close = [_near_misses(row, margin, left and k == 0) for k, row in enumerate(rows)]
    if depth < DEPTH and any(
        row[0] * row[-1] < 0.0 and (_changes(row) > 1 or k) for row, k in zip(rows, close, strict=True)
    ):
        yield from _halves(f, t, v, left, most, depth)
        return
    times, values = [t[0]], [v[0]]
    for k, row in enumerate(rows):
        found = [] if row[0] * row[-1] < 0.0 else _dipped(f, t[k], t[k + 1], row, close[k])
        for time, value in (*found, (t[k + 1], v[k + 1])):
            times.append(time)
            values.append(value)
    yield from plain_crossings(f, times, values, most)


def _dipped(f: Function, a: float, b: float, row: list[float], close: Sequence[int]) -> list[tuple[float, float]]:
    """Return the times in (a, b), and the values there, at which a function comes through zero near some places."""
    n = len(row) - 1
    found = []
    step = (b - a) / n
    for k in close:
        side = np.sign(row[0] or row[-1])
        seen = dip(f, side, a + max(k - 1, 0) * step, a + min(k + 1, n) * step)
        if seen is not None and (found[-1][0] if found else a) < seen[0] < b:
            found.append(seen)
    return found


def plain_crossings(f: Function, t: Sequence[float], v: Sequence[float], most: float = POLE) -> Iterator[Crossing]:
    """Yield the crossings that the signs at the nodes show, poles left out as of `root`."""
    for k in range(len(t) - 1):
        if (v[k] < 0.0 <= v[k + 1]) or (v[k] > 0.0 >= v[k + 1]):
            found = root(f, t[k], t[k + 1], v[k], v[k + 1], most)
            if found is not None:
                yield Crossing(found, 1.0 if v[k] < 0.0 else -1.0)


def _halves(
    f: Function, t: Sequence[float], v: Sequence[float], left: bool, most: float, depth: int
) -> Iterator[Crossing]:
    for a, b, va, vb, first in ((t[0], t[2], v[0], v[2], left), (t[2], t[4], v[2], v[4], False)):
        times = node_times(a, b)
        if not a < times[1] < times[3] < b:
            return
        yield from crossings(f, times, [va, *map(f, times[1:-1]), vb], first, most, depth + 1)


def _changes(row: Sequence[float]) -> int:
    return sum(a * b < 0.0 for a, b in pairwise(row))


def _near_misses(row: Sequence[float], margin: float, left: bool) -> list[int]:
    """Return where a function comes near to zero, or through it, and turns back to the side of the ends, or to its own.

    left: whether the first value is no such place, as the function leaves zero there.
    """
    found = []
    ends = np.sign(row[0] or row[-1]) if row[0] * row[-1] >= 0.0 else 0.0
    for k, x in enumerate(row):
        side = ends or np.sign(x)
        near = [side * y for y in (*row[max(k - 1, 0) : k], *row[k + 1 : k + 2])]
        at_end = (k == 0 and (left or x == 0.0)) or (k == len(row) - 1 and x == 0.0)
        if not at_end and side * x <= min(margin, *near):
            found.append(k)
    return found


def dip(f: Function, side: float, a: float, b: float) -> tuple[float, float] | None:
    """Return a time in (a, b) at which a function is not on its side of zero, and its value; None without one.

    The lowest value is looked for as of Brent (1973), 5.8: golden sections and parabolas.
    """
    least = FINEST * (b - a)
    x = w = u = a + GOLDEN * (b - a)
    fx = side * f(x)
    fw = fu = fx
    move = before = 0.0
    for trial in range(MOST_TRIALS):
        if fx <= 0.0:
            return x, side * fx
        middle = 0.5 * (a + b)
        hopeless = trial > 3 and fx > HOPELESS * (max(fw, fu) - fx)
        if hopeless or abs(x - middle) + 0.5 * (b - a) <= 2.0 * least:
            return None
        r, q = (x - w) * (fx - fu), (x - u) * (fx - fw)
        p = (x - u) * q - (x - w) * r
        q = 2.0 * (q - r)
        p = -p if q > 0.0 else p
        q = abs(q)
        if abs(p) < abs(0.5 * q * before) and q * (a - x) < p < q * (b - x):
            move, before = p / q, move
        else:
            before = (a if x >= middle else b) - x
            move = GOLDEN * before
        at = x + (move if abs(move) >= least else np.copysign(least, move or middle - x))
        value = side * f(at)
        if value <= fx:
            a, b = (x, b) if at >= x else (a, x)
            u, fu, w, fw, x, fx = w, fw, x, fx, at, value
        else:
            a, b = (at, b) if at < x else (a, at)
            if value <= fw or w == x:
                u, fu, w, fw = w, fw, at, value
            elif value <= fu or u in (x, w):
                u, fu = at, value
    return None


def root(f: Function, a: float, b: float, fa: float, fb: float, most: float = POLE) -> float | None:
    """Return the first time, to round-off, after the change of sign between a and b; None for a pole.

    A pole has values on both sides that are `most` times as large as those at a and b.

    The interval shrinks as of Chandrupatla (1997): by inverse quadratic interpolation where it is safe, else by half.
    """
    largest = max((abs(x) for x in (fa, fb) if np.isfinite(x)), default=0.0)
    t = 0.5
    end = b
    x, fx, y, fy = b, fb, a, fa  # the last place and the other side
    z, fz = y, fy
    for _ in range(MOST_TRIALS):
        if fx == 0.0:
            return x
        at = x + t * (y - x)
        if at in (x, y):
            break
        value = f(at)
        if (value > 0.0) == (fx > 0.0) and value != 0.0:
            z, fz = x, fx
        else:
            z, fz, y, fy = y, fy, x, fx
        x, fx = at, value
        t = _next_share(x, y, z, fx, fy, fz)
    if min(abs(fx), abs(fy)) > most * largest:
        return None
    return min(max(x, y), end)


def _next_share(x: float, y: float, z: float, fx: float, fy: float, fz: float) -> float:
    """Return the next place between x and y, as a share of the way, not nearer to either than round-off."""
    least = min(0.5, 2.3e-16 * max(abs(x), 1e-300) / abs(y - x)) if y != x else 0.5
    share = 0.5
    if np.isfinite([fx, fy, fz]).all() and fx != fy and fz not in (fx, fy) and z != y:
        xi, phi = (x - y) / (z - y), (fx - fy) / (fz - fy)
        if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            share = fx / (fy - fx) * fz / (fy - fz) + (z - x) / (y - x) * fx / (fz - fx) * fy / (fz - fy)
    return min(1.0 - least, max(least, share))
