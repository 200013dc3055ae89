"""What rounding errors of mass matrix, damping and stiffness do as forces: for the error of a linearisation."""

from __future__ import annotations

import math

import numpy as np

from modalprep.compiler.jit import compile_kernel

NEGLIGIBLE = 1e-6  # of what the fastest motion makes: the least that a column counts as
SLOWEST = 1e-3  # 1/s, the fastest motion of a system counts as at least this fast: the rate of a low orbit
EPS = np.finfo(float).eps
ROUND_OFF = 0.5  # EPS, of the sum of absolute values: a rounding error


@compile_kernel
def columns(sizes, cancelling, out):
    """Write what columns of accelerations by coordinates and by speeds, of `sizes` (2, n), count as to ``out (2, n)``.

    One that is smaller than `NEGLIGIBLE` of what the fastest motion makes counts as that. So does one in which forces
    cancel, `cancelling` being what they could make one by one.
    """
    stiff, fast = cancelling, SLOWEST
    for k in range(sizes.shape[1]):
        stiff, fast = max(stiff, sizes[0, k]), max(fast, sizes[1, k])
    rate = max(math.sqrt(stiff), fast)
    for k in range(sizes.shape[1]):
        out[0, k] = max(sizes[0, k], NEGLIGIBLE * rate * rate)
        out[1, k] = max(sizes[1, k], NEGLIGIBLE * rate)


@compile_kernel
def rounding_forces(K, D, M, size, scale, sizes, cancelling, weights, out):
    """Write the forces (n,) that rounding errors make, root mean squares, where each column is one.

    Rounding errors of the entries count as independent of each other. No acceleration is above its column: those that M
    multiplies are the scales at most.

    Parameters
    ----------
    size : (n,)
        Sum of the absolute values that make each force.
    scale : (n,)
        Size of each coordinate.
    sizes : (2, n)
        The largest acceleration, in the scales, by a unit of each coordinate and of each speed.
    weights : (2, n)
        Written: coordinates and speeds whose columns are one.
    """
    n = len(out)
    for k in range(n):
        sizes[0, k] *= scale[k]
        sizes[1, k] *= scale[k]
    columns(sizes, cancelling, weights)
    largest = 0.0
    for k in range(n):
        largest = max(largest, 1.0 / weights[0, k])
        weights[0, k] = scale[k] / weights[0, k]
        weights[1, k] = scale[k] / weights[1, k]
    x, u = weights[0], weights[1]
    for i in range(n):
        by_x, by_u, by_a = K[i], D[i], M[i]
        total = 0.0
        for k in range(n):
            p, q, r = x[k] * by_x[k], u[k] * by_u[k], scale[k] * by_a[k]
            total += p * p + q * q + r * r
        out[i] = EPS * (math.sqrt(total) + ROUND_OFF * largest * size[i])
