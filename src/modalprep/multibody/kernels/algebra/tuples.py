"""Tuples of numbers, which stay in registers: from arrays and back, sums and products of vectors.

A spatial vector is a tuple of six numbers (linear, angular).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from modalprep.compiler.jit import compile_inline

ZERO3 = (0.0, 0.0, 0.0)
ZERO6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
ZERO9 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@compile_inline
def unsigned(i):
    """Return an index that is not negative as one that does not count from the end: five instructions less."""
    return np.uint64(i)


@compile_inline
def get3(v):
    """The first three numbers of an array: the linear part of a spatial vector."""
    return v[0], v[1], v[2]


@compile_inline
def unit3(axis):
    """Return the direction of axis 0, 1 or 2, zero for any other number."""
    return 1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0


@compile_inline
def scaled3(f, v):
    """Return ``f v``."""
    return f * v[0], f * v[1], f * v[2]


@compile_inline
def get_angular(v):
    """The angular part of a spatial vector in an array."""
    return v[3], v[4], v[5]


@compile_inline
def get6(v):
    """Six numbers of an array."""
    return v[0], v[1], v[2], v[3], v[4], v[5]


@compile_inline
def get9(v):
    """Nine numbers of an array."""
    return v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8]


@compile_inline
def put3(out, v):
    """Write three numbers to an array."""
    out[0], out[1], out[2] = v


@compile_inline
def put_angular(out, v):
    """Write the angular part of a spatial vector to an array."""
    out[3], out[4], out[5] = v


@compile_inline
def put6(out, v):
    """Write six numbers to an array."""
    out[0], out[1], out[2], out[3], out[4], out[5] = v


@compile_inline
def put9(out, v):
    """Write nine numbers to an array."""
    out[0], out[1], out[2], out[3], out[4] = v[0], v[1], v[2], v[3], v[4]
    out[5], out[6], out[7], out[8] = v[5], v[6], v[7], v[8]


@compile_inline
def copy(v, out):
    """Write the numbers of v to `out (n,)`, as many as it has room for: a slice would check shapes and may allocate."""
    for k in range(len(out)):
        out[k] = v[k]


@compile_inline
def add3(a, b):
    """Return ``a + b``."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compile_inline
def sub3(a, b):
    """Return ``a - b``."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compile_inline
def axpy3(a, f, b):
    """Return ``a + f b``."""
    return a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]


@compile_inline
def combined(f, a, g, b):
    """Return ``f a + g b``, three numbers each."""
    return f * a[0] + g * b[0], f * a[1] + g * b[1], f * a[2] + g * b[2]


@compile_inline
def add6(a, b):
    """Return ``a + b``."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@compile_inline
def sub6(a, b):
    """Return ``a - b``."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5]


@compile_inline
def add9(a, b):
    """Return ``a + b``."""
    return (
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
        a[6] + b[6],
        a[7] + b[7],
        a[8] + b[8],
    )


@compile_inline
def sub9(a, b):
    """Return ``a - b``."""
    return (
        a[0] - b[0],
        a[1] - b[1],
        a[2] - b[2],
        a[3] - b[3],
        a[4] - b[4],
        a[5] - b[5],
        a[6] - b[6],
        a[7] - b[7],
        a[8] - b[8],
    )


@compile_inline
def dot3(a, b):
    """Return ``a . b``."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compile_inline
def cross(a, b):
    """Return ``a x b``."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compile_inline
def take3(v, u):
    """Three numbers of a vector from u on."""
    return v[u], v[u + 1], v[u + 2]


@compile_inline
def take4(v, u):
    """Four numbers of a vector from u on."""
    return v[u], v[u + 1], v[u + 2], v[u + 3]


@compile_inline
def row3(A, i, c):
    """Three numbers of row i from column c."""
    return A[i, c], A[i, c + 1], A[i, c + 2]


@compile_inline
def take6(a, i):
    """Six numbers ``a[i:i + 6]``."""
    return a[i], a[i + 1], a[i + 2], a[i + 3], a[i + 4], a[i + 5]


@compile_inline
def axpy6(a, f, b):
    """Return ``a + f b``."""
    return (
        a[0] + f * b[0],
        a[1] + f * b[1],
        a[2] + f * b[2],
        a[3] + f * b[3],
        a[4] + f * b[4],
        a[5] + f * b[5],
    )


@compile_inline
def axpy9(a, f, b):
    """Return ``a + f b``."""
    return (
        a[0] + f * b[0],
        a[1] + f * b[1],
        a[2] + f * b[2],
        a[3] + f * b[3],
        a[4] + f * b[4],
        a[5] + f * b[5],
        a[6] + f * b[6],
        a[7] + f * b[7],
        a[8] + f * b[8],
    )


@compile_inline
def dot6(a, b):
    """Return ``a . b``."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@partial(compile_inline, fastmath={"contract"})
def dot_in_pairs(a, b):
    """Return `dot6` for those who wait for it: in this order, the products of three pairs need not."""
    return (a[0] * b[0] + a[3] * b[3]) + (a[1] * b[1] + a[4] * b[4]) + (a[2] * b[2] + a[5] * b[5])


@compile_inline
def dot12(a, b):
    """Return ``a . b``."""
    return (
        a[0] * b[0]
        + a[1] * b[1]
        + a[2] * b[2]
        + a[3] * b[3]
        + a[4] * b[4]
        + a[5] * b[5]
        + a[6] * b[6]
        + a[7] * b[7]
        + a[8] * b[8]
        + a[9] * b[9]
        + a[10] * b[10]
        + a[11] * b[11]
    )
