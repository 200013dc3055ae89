"""Matrices and spatial inertias on tuples.

Matrices are tuples by rows: 9 numbers for (3, 3), 6 for a symmetric one (xx, xy, xz, yy, yz, zz). A spatial
inertia is (M 6, H 9, J 6) = [[M, H], [H^T, J]] of linear and angular motion.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.multibody.kernels.algebra.tuples import add3

UNIT9 = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@compile_inline
def less_outer(S, g, a):
    """Return ``S - g a a^T`` of a symmetric S."""
    x, y, z = g * a[0], g * a[1], g * a[2]
    return (
        S[0] - x * a[0],
        S[1] - x * a[1],
        S[2] - x * a[2],
        S[3] - y * a[1],
        S[4] - y * a[2],
        S[5] - z * a[2],
    )


@compile_inline
def less_product(H, g, a, b):
    """Return ``H - g a b^T``."""
    x, y, z = g * a[0], g * a[1], g * a[2]
    return (
        H[0] - x * b[0],
        H[1] - x * b[1],
        H[2] - x * b[2],
        H[3] - y * b[0],
        H[4] - y * b[1],
        H[5] - y * b[2],
        H[6] - z * b[0],
        H[7] - z * b[1],
        H[8] - z * b[2],
    )


@compile_inline
def plus_product(H, a, b):
    """Return ``H + a b^T``."""
    return (
        H[0] + a[0] * b[0],
        H[1] + a[0] * b[1],
        H[2] + a[0] * b[2],
        H[3] + a[1] * b[0],
        H[4] + a[1] * b[1],
        H[5] + a[1] * b[2],
        H[6] + a[2] * b[0],
        H[7] + a[2] * b[1],
        H[8] + a[2] * b[2],
    )


@compile_inline
def antisymmetric(A):
    """Return ``eps_cab A_ba``, twice the vector of the antisymmetric part of A."""
    return A[7] - A[5], A[2] - A[6], A[3] - A[1]


@compile_inline
def transposed(A):
    """Return ``A^T``."""
    return A[0], A[3], A[6], A[1], A[4], A[7], A[2], A[5], A[8]


@compile_inline
def spin_matrix(w):
    """Return ``w~``."""
    return 0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0


@compile_inline
def first_moment(H):
    """Return the first moment s of ``H = -s~``, the coupling in a body's inertia."""
    return H[5], H[6], H[1]


@compile_inline
def times(R, v):
    """Return ``R v``."""
    return (
        R[0] * v[0] + R[1] * v[1] + R[2] * v[2],
        R[3] * v[0] + R[4] * v[1] + R[5] * v[2],
        R[6] * v[0] + R[7] * v[1] + R[8] * v[2],
    )


@compile_inline
def transposed_times(R, v):
    """Return ``R^T v``."""
    return (
        R[0] * v[0] + R[3] * v[1] + R[6] * v[2],
        R[1] * v[0] + R[4] * v[1] + R[7] * v[2],
        R[2] * v[0] + R[5] * v[1] + R[8] * v[2],
    )


@compile_inline
def symmetric_times(S, v):
    """Return ``S v`` of a symmetric S."""
    return (
        S[0] * v[0] + S[1] * v[1] + S[2] * v[2],
        S[1] * v[0] + S[3] * v[1] + S[4] * v[2],
        S[2] * v[0] + S[4] * v[1] + S[5] * v[2],
    )


@compile_inline
def inertia_times(M, H, J, v):
    """Spatial inertia times a spatial vector."""
    a = v[:3]
    w = v[3:]
    f = add3(symmetric_times(M, a), times(H, w))
    t = add3(transposed_times(H, a), symmetric_times(J, w))
    return f[0], f[1], f[2], t[0], t[1], t[2]


@compile_inline
def product(A, B):
    """Return ``A B``."""
    return (
        A[0] * B[0] + A[1] * B[3] + A[2] * B[6],
        A[0] * B[1] + A[1] * B[4] + A[2] * B[7],
        A[0] * B[2] + A[1] * B[5] + A[2] * B[8],
        A[3] * B[0] + A[4] * B[3] + A[5] * B[6],
        A[3] * B[1] + A[4] * B[4] + A[5] * B[7],
        A[3] * B[2] + A[4] * B[5] + A[5] * B[8],
        A[6] * B[0] + A[7] * B[3] + A[8] * B[6],
        A[6] * B[1] + A[7] * B[4] + A[8] * B[7],
        A[6] * B[2] + A[7] * B[5] + A[8] * B[8],
    )


@compile_inline
def product_transposed(A, B):
    """Return ``A B^T``."""
    return (
        A[0] * B[0] + A[1] * B[1] + A[2] * B[2],
        A[0] * B[3] + A[1] * B[4] + A[2] * B[5],
        A[0] * B[6] + A[1] * B[7] + A[2] * B[8],
        A[3] * B[0] + A[4] * B[1] + A[5] * B[2],
        A[3] * B[3] + A[4] * B[4] + A[5] * B[5],
        A[3] * B[6] + A[4] * B[7] + A[5] * B[8],
        A[6] * B[0] + A[7] * B[1] + A[8] * B[2],
        A[6] * B[3] + A[7] * B[4] + A[8] * B[5],
        A[6] * B[6] + A[7] * B[7] + A[8] * B[8],
    )


@compile_inline
def symmetric_product(A, B):
    """Return the symmetric ``A B^T`` of two matrices whose product is known to be symmetric."""
    return (
        A[0] * B[0] + A[1] * B[1] + A[2] * B[2],
        A[0] * B[3] + A[1] * B[4] + A[2] * B[5],
        A[0] * B[6] + A[1] * B[7] + A[2] * B[8],
        A[3] * B[3] + A[4] * B[4] + A[5] * B[5],
        A[3] * B[6] + A[4] * B[7] + A[5] * B[8],
        A[6] * B[6] + A[7] * B[7] + A[8] * B[8],
    )


@compile_inline
def square(S):
    """Return the nine numbers of a symmetric matrix."""
    return S[0], S[1], S[2], S[1], S[3], S[4], S[2], S[4], S[5]


@compile_inline
def inverse_symmetric(S):
    """Return the inverse of a symmetric (3, 3), and its leading pivots (first, second, third)."""
    a, b, c, d, e, f = S
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * A + b * B + c * C
    g = 1.0 / det
    minor = a * d - b * b
    return (A * g, B * g, C * g, (a * f - c * c) * g, (b * c - a * e) * g, minor * g), (a, minor / a, det / minor)
