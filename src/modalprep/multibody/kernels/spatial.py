"""Small algebra on tuples, compiled into the kernels: no array, no slice, everything in registers.

Matrices are tuples by rows: 9 numbers for (3, 3), 6 for a symmetric one (xx, xy, xz, yy, yz, zz). A spatial
inertia is (M 6, H 9, J 6) = [[M, H], [H^T, J]] of linear and angular motion.
"""

from __future__ import annotations

import numpy as np

from modalprep.jit import compile_inline

ZERO3 = (0.0, 0.0, 0.0)
ZERO6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
ZERO8 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
ZERO9 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
UNIT9 = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@compile_inline
def get3(v):
    """The first three numbers of an array: the linear part of a spatial vector."""
    return v[0], v[1], v[2]


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
        a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5], a[6] + b[6], a[7] + b[7],
        a[8] + b[8],
    )  # fmt: skip


@compile_inline
def sub9(a, b):
    """Return ``a - b``."""
    return (
        a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5], a[6] - b[6], a[7] - b[7],
        a[8] - b[8],
    )  # fmt: skip


@compile_inline
def less_outer(S, g, a):
    """Return ``S - g a a^T`` of a symmetric S."""
    x, y, z = g * a[0], g * a[1], g * a[2]
    return (
        S[0] - x * a[0], S[1] - x * a[1], S[2] - x * a[2], S[3] - y * a[1], S[4] - y * a[2], S[5] - z * a[2],
    )  # fmt: skip


@compile_inline
def less_product(H, g, a, b):
    """Return ``H - g a b^T``."""
    x, y, z = g * a[0], g * a[1], g * a[2]
    return (
        H[0] - x * b[0], H[1] - x * b[1], H[2] - x * b[2], H[3] - y * b[0], H[4] - y * b[1], H[5] - y * b[2],
        H[6] - z * b[0], H[7] - z * b[1], H[8] - z * b[2],
    )  # fmt: skip


@compile_inline
def dot3(a, b):
    """Return ``a . b``."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compile_inline
def cross(a, b):
    """Return ``a x b``."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


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
    a, w = v[:3], v[3:]
    f, t = add3(symmetric_times(M, a), times(H, w)), add3(transposed_times(H, a), symmetric_times(J, w))
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
def outer(a, b):
    """Return ``a b^T``."""
    return (
        a[0] * b[0], a[0] * b[1], a[0] * b[2], a[1] * b[0], a[1] * b[1], a[1] * b[2], a[2] * b[0], a[2] * b[1],
        a[2] * b[2],
    )  # fmt: skip


@compile_inline
def rotated_symmetric(R, S):
    """Return ``R S R^T``."""
    return symmetric_product(product(R, square(S)), R)


@compile_inline
def rotated_inertia(R, M, H, J):
    """Spatial inertia in axes turned by R."""
    return rotated_symmetric(R, M), product_transposed(product(R, H), R), rotated_symmetric(R, J)


@compile_inline
def hinged_times(M, H, J, v):
    """`inertia_times` of an inertia that has nothing about z: H without its third column, J without row and column."""
    a, x, y = v[:3], v[3], v[4]
    f = symmetric_times(M, a)
    return (
        f[0] + H[0] * x + H[1] * y, f[1] + H[3] * x + H[4] * y, f[2] + H[6] * x + H[7] * y,
        H[0] * a[0] + H[3] * a[1] + H[6] * a[2] + J[0] * x + J[1] * y,
        H[1] * a[0] + H[4] * a[1] + H[7] * a[2] + J[1] * x + J[3] * y, 0.0,
    )  # fmt: skip


@compile_inline
def rotated_hinged(R, M, H, J):
    """`rotated_inertia` of an inertia that has nothing about z."""
    a, b = times(R, (H[0], H[3], H[6])), times(R, (H[1], H[4], H[7]))
    x, y = (R[0], R[3], R[6]), (R[1], R[4], R[7])
    c = (x[0] * J[0] + y[0] * J[1], x[1] * J[0] + y[1] * J[1], x[2] * J[0] + y[2] * J[1])
    d = (x[0] * J[1] + y[0] * J[3], x[1] * J[1] + y[1] * J[3], x[2] * J[1] + y[2] * J[3])
    K = (
        c[0] * x[0] + d[0] * y[0], c[0] * x[1] + d[0] * y[1], c[0] * x[2] + d[0] * y[2],
        c[1] * x[1] + d[1] * y[1], c[1] * x[2] + d[1] * y[2], c[2] * x[2] + d[2] * y[2],
    )  # fmt: skip
    return rotated_symmetric(R, M), add9(outer(a, x), outer(b, y)), K


@compile_inline
def turned(C, angle):
    """Return ``C Rz(angle)``."""
    c, s = np.cos(angle), np.sin(angle)
    return (
        C[0] * c + C[1] * s, C[1] * c - C[0] * s, C[2],
        C[3] * c + C[4] * s, C[4] * c - C[3] * s, C[5],
        C[6] * c + C[7] * s, C[7] * c - C[6] * s, C[8],
    )  # fmt: skip


@compile_inline
def quaternion_rotation(e):
    """Rotation matrix of the quaternion e = (w, x, y, z) of any length."""
    w, x, y, z = e
    f = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        1.0 - f * (y * y + z * z), f * (x * y - w * z), f * (x * z + w * y),
        f * (x * y + w * z), 1.0 - f * (x * x + z * z), f * (y * z - w * x),
        f * (x * z - w * y), f * (y * z + w * x), 1.0 - f * (x * x + y * y),
    )  # fmt: skip


@compile_inline
def rotation_quaternion(R):
    """Quaternion (w, x, y, z) of a rotation matrix, by its largest component, which is positive (Shepperd 1978)."""
    trace = R[0] + R[4] + R[8]
    if trace >= max(R[0], R[4], R[8]):
        e = (1.0 + trace, R[7] - R[5], R[2] - R[6], R[3] - R[1])
    elif R[0] >= max(R[4], R[8]):
        e = (R[7] - R[5], 1.0 + 2.0 * R[0] - trace, R[1] + R[3], R[2] + R[6])
    elif R[4] >= R[8]:
        e = (R[2] - R[6], R[1] + R[3], 1.0 + 2.0 * R[4] - trace, R[5] + R[7])
    else:
        e = (R[3] - R[1], R[2] + R[6], R[5] + R[7], 1.0 + 2.0 * R[8] - trace)
    f = 1.0 / np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3])
    return f * e[0], f * e[1], f * e[2], f * e[3]


@compile_inline
def quaternion_rate(e, w):
    """Time derivative of a quaternion from the angular velocity in the turned frame."""
    return (
        0.5 * (-e[1] * w[0] - e[2] * w[1] - e[3] * w[2]),
        0.5 * (e[0] * w[0] + e[2] * w[2] - e[3] * w[1]),
        0.5 * (e[0] * w[1] + e[3] * w[0] - e[1] * w[2]),
        0.5 * (e[0] * w[2] + e[1] * w[1] - e[2] * w[0]),
    )


@compile_inline
def cayley(x):
    """Rotation matrix of the Cayley map of x: ``1 + s (x~ + x~ x~ / 2)``, ``s = 4 / (4 + x.x)``; and s."""
    xx = dot3(x, x)
    s = 4.0 / (4.0 + xx)
    h, d = 0.5 * s, 1.0 - 0.5 * s * xx
    R = (
        d + h * x[0] * x[0], h * x[0] * x[1] - s * x[2], h * x[0] * x[2] + s * x[1],
        h * x[0] * x[1] + s * x[2], d + h * x[1] * x[1], h * x[1] * x[2] - s * x[0],
        h * x[0] * x[2] - s * x[1], h * x[1] * x[2] + s * x[0], d + h * x[2] * x[2],
    )  # fmt: skip
    return R, s


@compile_inline
def cayley_rate(x, s, v):
    """Return ``s (1 + x~/2) v``: angular velocity of a rate of x."""
    c = cross(x, v)
    return s * (v[0] + 0.5 * c[0]), s * (v[1] + 0.5 * c[1]), s * (v[2] + 0.5 * c[2])


@compile_inline
def half_tangent(x):
    """Argument of the Cayley map whose turn is the rotation vector x, to the fourth order: ``2 tan(|x|/2) x / |x|``."""
    return axpy3(x, dot3(x, x) / 12.0, x)


@compile_inline
def half_tangent_rate(x, v):
    """Return the rate of `half_tangent` for a rate v of x."""
    return axpy3(axpy3(v, dot3(x, x) / 12.0, v), dot3(x, v) / 6.0, x)


@compile_inline
def skew_columns(r, H):
    """Return ``r~ H``."""
    return (
        r[1] * H[6] - r[2] * H[3], r[1] * H[7] - r[2] * H[4], r[1] * H[8] - r[2] * H[5],
        r[2] * H[0] - r[0] * H[6], r[2] * H[1] - r[0] * H[7], r[2] * H[2] - r[0] * H[8],
        r[0] * H[3] - r[1] * H[0], r[0] * H[4] - r[1] * H[1], r[0] * H[5] - r[1] * H[2],
    )  # fmt: skip


@compile_inline
def shifted(M, H, J, r):
    """Coupling and inertia of ``T^T I T`` with ``T = [[1, -r~], [0, 1]]``; M stays."""
    a, b, c, d, e, f = M
    x, y, z = r
    K = (  # H - M r~
        H[0] - (b * z - c * y), H[1] - (c * x - a * z), H[2] - (a * y - b * x),
        H[3] - (d * z - e * y), H[4] - (e * x - b * z), H[5] - (b * y - d * x),
        H[6] - (e * z - f * y), H[7] - (f * x - c * z), H[8] - (c * y - e * x),
    )  # fmt: skip
    A, B = skew_columns(r, K), skew_columns(r, H)
    return K, (
        J[0] + A[0] + B[0], J[1] + A[1] + B[3], J[2] + A[2] + B[6],
        J[3] + A[4] + B[4], J[4] + A[5] + B[7], J[5] + A[8] + B[8],
    )  # fmt: skip


@compile_inline
def inverse_symmetric(S):
    """Return the inverse of a symmetric (3, 3), and its leading pivots (first, second, third)."""
    a, b, c, d, e, f = S
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * A + b * B + c * C
    g = 1.0 / det
    minor = a * d - b * b
    return (A * g, B * g, C * g, (a * f - c * c) * g, (b * c - a * e) * g, minor * g), (a, minor / a, det / minor)


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
def row9(A, i, c):
    """Nine numbers of row i from column c."""
    return (
        A[i, c], A[i, c + 1], A[i, c + 2], A[i, c + 3], A[i, c + 4], A[i, c + 5], A[i, c + 6], A[i, c + 7], A[i, c + 8],
    )  # fmt: skip


@compile_inline
def row8(A, i, j):
    """Eight numbers ``A[i, j, :8]``."""
    return A[i, j, 0], A[i, j, 1], A[i, j, 2], A[i, j, 3], A[i, j, 4], A[i, j, 5], A[i, j, 6], A[i, j, 7]


@compile_inline
def add8(a, b):
    """Return ``a + b``."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5], a[6] + b[6], a[7] + b[7]


@compile_inline
def get8(A, k, i, j):
    """Eight numbers ``A[k, i, j, :8]``."""
    return (
        A[k, i, j, 0], A[k, i, j, 1], A[k, i, j, 2], A[k, i, j, 3], A[k, i, j, 4], A[k, i, j, 5], A[k, i, j, 6],
        A[k, i, j, 7],
    )  # fmt: skip


@compile_inline
def put8(A, k, i, j, v):
    """Write eight numbers to ``A[k, i, j, :8]``."""
    A[k, i, j, 0], A[k, i, j, 1], A[k, i, j, 2], A[k, i, j, 3] = v[0], v[1], v[2], v[3]
    A[k, i, j, 4], A[k, i, j, 5], A[k, i, j, 6], A[k, i, j, 7] = v[4], v[5], v[6], v[7]


@compile_inline
def take6(a, i):
    """Six numbers ``a[i:i + 6]``."""
    return a[i], a[i + 1], a[i + 2], a[i + 3], a[i + 4], a[i + 5]


@compile_inline
def take9(a, i):
    """Nine numbers ``a[i:i + 9]``."""
    return a[i], a[i + 1], a[i + 2], a[i + 3], a[i + 4], a[i + 5], a[i + 6], a[i + 7], a[i + 8]


@compile_inline
def take12(a, i):
    """Twelve numbers ``a[i:i + 12]``."""
    return (
        a[i], a[i + 1], a[i + 2], a[i + 3], a[i + 4], a[i + 5], a[i + 6], a[i + 7], a[i + 8], a[i + 9], a[i + 10],
        a[i + 11],
    )  # fmt: skip


@compile_inline
def axpy6(a, f, b):
    """Return ``a + f b``."""
    return (
        a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2], a[3] + f * b[3], a[4] + f * b[4], a[5] + f * b[5],
    )  # fmt: skip


@compile_inline
def axpy9(a, f, b):
    """Return ``a + f b``."""
    return (
        a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2], a[3] + f * b[3], a[4] + f * b[4], a[5] + f * b[5],
        a[6] + f * b[6], a[7] + f * b[7], a[8] + f * b[8],
    )  # fmt: skip


@compile_inline
def axpy8(a, f, b):
    """Return ``a + f b``."""
    return (
        a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2], a[3] + f * b[3], a[4] + f * b[4], a[5] + f * b[5],
        a[6] + f * b[6], a[7] + f * b[7],
    )  # fmt: skip


@compile_inline
def dot8(a, b):
    """Return ``a . b``."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6] + a[7] * b[7]


@compile_inline
def dot12(a, b):
    """Return ``a . b``."""
    return (
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6] + a[7] * b[7]
        + a[8] * b[8] + a[9] * b[9] + a[10] * b[10] + a[11] * b[11]
    )  # fmt: skip
