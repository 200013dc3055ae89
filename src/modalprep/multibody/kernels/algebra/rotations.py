"""Rotations on tuples: about an axis, by quaternions (w, x, y, z), by Cayley's map of a rotation vector."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.tuples import (
    axpy3,
    cross,
    dot3,
)

# Quarter of a turn in three parts: multiples of the first two, up to MOST / QUARTER[0], have no round-off.
QUARTER = (float.fromhex("0x1.921fb544p+0"), float.fromhex("0x1.0b4611a6p-34"), float.fromhex("0x1.3198a2e037073p-69"))
MOST = 1e5
COSINE = tuple((-1) ** k / math.factorial(2 * k) for k in range(1, 9))  # Taylor's, of powers of x^2, from x^2 on
SINE = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(1, 9))


@compile_inline
def _series(c, z, zz):
    """Return the polynomial of eight coefficients in z, the square of z given: in pairs, which need not wait."""
    low = (c[0] + z * c[1]) + zz * (c[2] + z * c[3])
    high = (c[4] + z * c[5]) + zz * (c[6] + z * c[7])
    return low + zz * zz * high


@partial(compile_inline, fastmath={"contract"})  # sums in another order would lose the digits of QUARTER
def cosine_sine(angle):
    """Return cosine and sine, to round-off: series about the nearest quarter of a turn; of libm when it is far."""
    if not abs(angle) < MOST:
        return np.cos(angle), np.sin(angle)
    k = np.rint(angle * (2.0 / np.pi))
    x = (angle - k * QUARTER[0]) - (k * QUARTER[1] + k * QUARTER[2])
    z = x * x
    c = 1.0 + z * _series(COSINE, z, z * z)
    s = x + x * z * _series(SINE, z, z * z)
    quarters = int(k)
    if quarters & 1:
        c, s = -s, c
    return (-c, -s) if quarters & 2 else (c, s)


@compile_inline
def turned(C, angle):
    """Return ``C Rz(angle)``."""
    c, s = cosine_sine(angle)
    return (
        C[0] * c + C[1] * s,
        C[1] * c - C[0] * s,
        C[2],
        C[3] * c + C[4] * s,
        C[4] * c - C[3] * s,
        C[5],
        C[6] * c + C[7] * s,
        C[7] * c - C[6] * s,
        C[8],
    )


@compile_inline
def quaternion_rotation(e):
    """Rotation matrix of the quaternion e = (w, x, y, z) of any length."""
    w, x, y, z = e
    f = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        1.0 - f * (y * y + z * z),
        f * (x * y - w * z),
        f * (x * z + w * y),
        f * (x * y + w * z),
        1.0 - f * (x * x + z * z),
        f * (y * z - w * x),
        f * (x * z - w * y),
        f * (y * z + w * x),
        1.0 - f * (x * x + y * y),
    )


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
def unit_quaternion(y, x):
    """Scale the quaternion at x of y to unit length."""
    e = y[x], y[x + 1], y[x + 2], y[x + 3]
    f = 1.0 / np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3])
    for k in range(4):
        y[x + k] *= f


@compile_kernel
def turn_quaternion(y, x, w, out):
    """Turn the quaternion at x of y by the rotation vector w of its own frame, to the same place of `out`."""
    ww = dot3(w, w)
    c, s = 1.0 - ww / 8.0, 0.5 - ww / 48.0
    if ww > 1e-6:
        angle = np.sqrt(ww)
        c = np.cos(0.5 * angle)
        s = np.sin(0.5 * angle) / angle
    a = y[x]
    b = (y[x + 1], y[x + 2], y[x + 3])
    v = (s * w[0], s * w[1], s * w[2])
    e = axpy3(axpy3(cross(b, v), a, v), c, b)
    out[x] = c * a - dot3(b, v)
    out[x + 1], out[x + 2], out[x + 3] = e


@compile_inline
def cayley(x):
    """Rotation matrix of the Cayley map of x: ``1 + s (x~ + x~ x~ / 2)``, ``s = 4 / (4 + x.x)``; and s."""
    xx = dot3(x, x)
    s = 4.0 / (4.0 + xx)
    h = 0.5 * s
    d = 1.0 - 0.5 * s * xx
    R = (
        d + h * x[0] * x[0],
        h * x[0] * x[1] - s * x[2],
        h * x[0] * x[2] + s * x[1],
        h * x[0] * x[1] + s * x[2],
        d + h * x[1] * x[1],
        h * x[1] * x[2] - s * x[0],
        h * x[0] * x[2] - s * x[1],
        h * x[1] * x[2] + s * x[0],
        d + h * x[2] * x[2],
    )
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
