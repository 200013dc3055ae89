"""Functions of the angle in the exponential map of a rotation vector x, of ``s = x.x``.

    exp(x~) = 1 + a x~ + b x~ x~     integral of it = 1 + b x~ + c x~ x~

``a = sin|x| / |x|, b = (1 - cos|x|) / s, c = (|x| - sin|x|) / |x|^3``.
"""

from __future__ import annotations

from math import factorial, perm

import numpy as np

SMALL = 1.0  # rad^2, below which they are series


def series(order: int) -> tuple[float, ...]:
    """Return the coefficients of a derivative of ``c(s) = sum_k (-s)^k / (2 k + 3)!``.

    Examples
    --------
    >>> [round(x, 6) for x in series(1)[:2]]
    [-0.008333, 0.000397]
    """
    return tuple((-1) ** k * perm(k, order) / factorial(2 * k + 3) for k in range(order, order + TERMS))


TERMS = 10
C, C1, C2, C3, C4 = map(series, range(5))


def angle_functions(s: float) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return ``a = sin x / x``, b, c of ``s = x^2``, and the first, second and third derivatives of b and c by s.

    Up to a turn of 1 between neighbours by series of c, to round-off; a and b follow from its derivatives.

    Examples
    --------
    >>> [round(float(f), 6) for f in angle_functions(0.0)[:5]]
    [1.0, 0.5, 0.166667, -0.041667, -0.008333]
    """
    if s < SMALL:
        c = c1 = c2 = c3 = c4 = 0.0
        for k in range(TERMS - 1, -1, -1):
            c = c * s + C[k]
            c1 = c1 * s + C1[k]
            c2 = c2 * s + C2[k]
            c3 = c3 * s + C3[k]
            c4 = c4 * s + C4[k]
        b = 3 * c + 2 * s * c1
        b1 = 5 * c1 + 2 * s * c2
        b2 = 7 * c2 + 2 * s * c3
        b3 = 9 * c3 + 2 * s * c4
        return 1 - s * c, b, c, b1, c1, b2, c2, b3, c3
    x = np.sqrt(s)
    a, b = np.sin(x) / x, (1 - np.cos(x)) / s
    c = (1 - a) / s
    b1, c1 = (a / 2 - b) / s, (b / 2 - 1.5 * c) / s
    a1 = -c - s * c1
    b2, c2 = (a1 / 2 - 2 * b1) / s, (b1 / 2 - 2.5 * c1) / s
    a2 = -2 * c1 - s * c2
    b3, c3 = (a2 / 2 - 3 * b2) / s, (b2 / 2 - 3.5 * c2) / s
    return a, b, c, b1, c1, b2, c2, b3, c3
