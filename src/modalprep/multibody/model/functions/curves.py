"""Piecewise polynomials of time: straight lines, monotone curves and splines through points, splines of callables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator, PPoly, make_interp_spline

from modalprep.errors import InputError
from modalprep.vectors import vector

SAMPLED = 1e-11  # error of a sampled callable, relative to its largest value
FIRST_SAMPLES, MOST_SAMPLES = 64, 65536  # intervals of a sampled callable
SHORTEST = 1e-9  # interval of a sampled callable, of its span
ALIKE = 1e-9  # relative size of what two neighbouring polynomials may differ by and still be one smooth curve


class Lines(PPoly):
    """Straight lines between points."""


class Monotone(PPoly):
    """A curve that rises and falls with its points (PCHIP): its rate is continuous, its acceleration is not."""


class MotionSpline(PPoly):
    """A cubic spline where a motion needs a continuous rate."""

    in_place_of_lines = True


class Sampled(PPoly):
    """A quintic spline of a callable, with the width (s) to which that was surveyed."""

    width: float


def through(
    t: Sequence[float] | np.ndarray, values: Sequence[float] | np.ndarray, smooth: bool, spline: bool
) -> list[tuple[float, PPoly]]:
    """Return ``(end, curve)`` of the curves through points, from one repeated time to the next.

    Raises
    ------
    InputError
        When the points are too few, out of order or not finite.
    """
    t, values = vector(t), vector(values)
    if smooth and spline:
        raise InputError("table of time: 'smooth' is a monotone curve and 'spline' is another; give one of them")
    if t.ndim != 1 or t.shape != values.shape:
        raise InputError(f"table of time: {t.size} times and {values.size} values; give one value per time")
    if not np.all(np.isfinite([t, values])):
        raise InputError("table of time: a time or a value is not a finite number")
    cuts = [0, *(np.flatnonzero(np.diff(t) == 0) + 1), len(t)]
    if np.any(np.diff(t) < 0) or np.any(np.diff(cuts) < 2):
        raise InputError(
            "table of time: needs two points or more at increasing times; a jump repeats its time once, and has "
            "two points or more on either side"
        )
    curve = CubicSpline if spline else monotone if smooth else lines
    return [(float(t[b - 1]), curve(t[a:b], values[a:b])) for a, b in pairwise(cuts)]


def lines(t: np.ndarray, values: np.ndarray) -> PPoly:
    """Return straight lines through points (n,)."""
    return Lines(np.array([np.diff(values) / np.diff(t), values[:-1]]), t)


def monotone(t: np.ndarray, values: np.ndarray) -> PPoly:
    """Return the monotone cubic Hermite interpolation of points (n,).

    References
    ----------
    F. N. Fritsch, J. Butland, A method for constructing local monotone piecewise cubic interpolants, SIAM J. Sci. Stat.
    Comput. 5 (1984) 300.
    """
    found = PchipInterpolator(t, values)
    return Monotone(found.c, found.x)


def smoothed(curve: PPoly) -> PPoly:
    """Return the cubic spline through the points of straight lines."""
    found = CubicSpline(curve.x, curve(curve.x))
    return MotionSpline(found.c, found.x)


def sampled(function: Callable[[float], float], until: float, width: float) -> PPoly:
    """Return the quintic spline of a callable on [0, until], refined where it varies, tested at steps of width / 2.

    Raises
    ------
    InputError
        When the callable is not finite, or not smooth enough.
    """
    value = cache(lambda t: _finite(function, t))
    values = np.vectorize(value, otypes=[float])
    survey = np.linspace(0.0, until, max(2 * FIRST_SAMPLES, int(np.ceil(2 * until / width))) + 1)
    known = values(survey)
    t = np.linspace(0.0, until, FIRST_SAMPLES + 1)
    size = np.abs(known).max()
    while True:
        found = make_interp_spline(t, values(t), k=5)
        middle = (t[1:] + t[:-1]) / 2
        wrong = survey[np.abs(found(survey) - known) > SAMPLED * size]
        wrong = np.append(wrong, middle[np.abs(found(middle) - values(middle)) > SAMPLED * size])
        if not len(wrong):
            break
        coarse = np.clip(np.searchsorted(t, wrong, side="right") - 1 + np.array([[-1], [0], [1]]), 0, len(middle) - 1)
        t = np.union1d(t, middle[coarse])
        if len(t) > MOST_SAMPLES or np.diff(t).min() < SHORTEST * until:
            raise InputError(
                f"function of time: {len(t)} samples up to t = {until:g} s do not resolve it near t = {wrong[0]:.6g} s;"
                " it must be smooth: give jumps as pieces of an expression, or by a table that repeats their times"
            )
    curve = PPoly.from_spline(found)
    there = np.diff(curve.x) > 0
    result = Sampled(curve.c[:, there], np.append(curve.x[:-1][there], curve.x[-1]))
    result.width = float(width)
    return result


def _finite(function: Callable[[float], float], t: float) -> float:
    value = float(function(float(t)))
    if not np.isfinite(value):
        raise InputError(f"function of time: not finite at t = {t:g} s")
    return value


def scaled(curve: PPoly, factor: float) -> PPoly:
    """Return a curve of the same kind, times a number."""
    found = copy(curve)
    found.c = factor * curve.c
    return found


def parts(curve: PPoly, until: float) -> list[tuple[float, PPoly]]:
    """Return ``(end, polynomial)`` of each part of lines and monotone curves, whose derivatives jump at points."""
    if not isinstance(curve, Lines | Monotone):
        return [(until, curve)]
    ends = [*curve.x[1:-1].tolist(), until]
    return [(end, PPoly(curve.c[:, k : k + 1], curve.x[k : k + 2])) for k, end in enumerate(ends)]


def in_motion(curve: PPoly, until: float) -> list[tuple[float, PPoly]]:
    """Return what a prescribed motion takes of a curve: a cubic spline in place of lines, and `parts`."""
    return [(until, smoothed(curve))] if isinstance(curve, Lines) else parts(curve, until)


def knots(curve: PPoly) -> np.ndarray:
    """Return time, value, rate and acceleration at the ends of the polynomials (n, 4); twice where they differ.

    Examples
    --------
    >>> knots(lines(np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0, 2.0])))[:, :3].tolist()
    [[0.0, 0.0, 2.0], [1.0, 2.0, 2.0], [1.0, 2.0, 0.0], [3.0, 2.0, 0.0]]
    """
    h = np.diff(curve.x)
    both = [curve.c]
    for _ in range(2):
        powers = np.arange(len(both[-1]) - 1, 0, -1)[:, None]
        both.append(both[-1][:-1] * powers if len(powers) else np.zeros((1, len(h))))
    left = np.column_stack([curve.x[:-1], *(c[-1] for c in both)])
    right = np.column_stack([curve.x[1:], *(np.polyval(c, h) for c in both)])
    differ = np.any(np.abs(right[:-1] - left[1:]) > ALIKE * np.abs(left).max(axis=0), axis=1)
    return np.insert(np.vstack([left, right[-1:]]), np.flatnonzero(differ) + 1, right[:-1][differ], axis=0)
