"""Functions of time as the kernel reads them: knots of a piecewise quintic Hermite interpolation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_kernel


@by_address
class Tables(NamedTuple):
    """Packed functions; `middle` says on which side of a break the integrator is.

    A function is a run of pieces, a piece a run of knots; within a piece the function has two continuous
    derivatives. `middle` is any time inside the stretch between breaks that is being integrated (NaN: the time of
    the call decides), so that both ends of a stretch belong to its own piece.
    """

    first: np.ndarray  # (functions + 1,) int, first piece of each function
    until: np.ndarray  # (pieces,) end of each piece, s
    knot: np.ndarray  # (pieces + 1,) int, first knot of each piece
    knots: np.ndarray  # (knots, 4) time, value, first and second derivative
    middle: np.ndarray  # (1,) s


@compile_kernel
def quintic(left, right, t):
    """Return value, rate and acceleration at t between two knots (time, value, rate, acceleration)."""
    h = right[0] - left[0]
    s = (t - left[0]) / h
    f = left[1]
    v = h * left[2]
    a = 0.5 * h * h * left[3]
    df = right[1] - f - v - a
    dv = h * right[2] - v - 2.0 * a
    da = h * h * right[3] - 2.0 * a
    c3 = 10.0 * df - 4.0 * dv + 0.5 * da
    c4 = -15.0 * df + 7.0 * dv - da
    c5 = 6.0 * df - 3.0 * dv + 0.5 * da
    value = f + s * (v + s * (a + s * (c3 + s * (c4 + s * c5))))
    rate = v + s * (2.0 * a + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))
    acceleration = 2.0 * a + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))
    return value, rate / h, acceleration / (h * h)


@compile_kernel
def table(tables, k, t):
    """Return value, rate and acceleration of function k at time t.

    The quintic through value and two derivatives at both ends of an interval; the error of the value falls with
    the sixth power of the interval, and the rate is exactly the derivative of the value.
    """
    when = tables.middle[0]
    if when != when:
        when = t
    piece = tables.first[k]
    last = tables.first[k + 1] - 1
    while piece < last:
        mid = (piece + last) // 2
        if tables.until[mid] > when:
            last = mid
        else:
            piece = mid + 1
    low = tables.knot[piece]
    high = tables.knot[piece + 1] - 1
    while high - low > 1:
        mid = (low + high) // 2
        if tables.knots[mid, 0] <= t:
            low = mid
        else:
            high = mid
    return quintic(tables.knots[low], tables.knots[low + 1], t)


@compile_kernel
def value(tables, k, t):
    """Return the value of function k at time t; zero for number -1, which is no function."""
    if k < 0:
        return 0.0
    found, _, _ = table(tables, k, t)
    return found
