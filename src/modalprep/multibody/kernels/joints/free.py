"""A free joint: position and quaternion, velocity and angular velocity; it needs the factor of the whole inertia."""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.inertia_blocks import parts
from modalprep.multibody.kernels.algebra.matrices import inertia_times, product, times
from modalprep.multibody.kernels.algebra.rotations import (
    quaternion_rate,
    quaternion_rotation,
    turn_quaternion,
    unit_quaternion,
)
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    ZERO6,
    ZERO9,
    add3,
    add6,
    axpy3,
    cross,
    dot3,
    get6,
    put6,
    put9,
    sub6,
    take3,
    take4,
    take6,
    unit3,
)
from modalprep.multibody.kernels.joints.weld import to_parent


@compile_inline
def motion(link, prescribed, nx, y, turn):
    """See `weld.motion`."""
    x = link.x
    u = nx + link.u
    offset = times(turn, take3(y, x))
    turn = product(turn, quaternion_rotation(take4(y, x + 3)))
    rate = take3(y, u)
    spin = take3(y, u + 3)
    c = cross(spin, rate)
    return turn, offset, rate, spin, (c[0], c[1], c[2], 0.0, 0.0, 0.0)


@compile_inline
def rates(link, nx, y, ydot):
    """Write the rates of position and quaternion."""
    x = link.x
    u = nx + link.u
    e = take4(y, x + 3)
    ydot[x], ydot[x + 1], ydot[x + 2] = times(quaternion_rotation(e), take3(y, u))
    ydot[x + 3], ydot[x + 4], ydot[x + 5], ydot[x + 6] = quaternion_rate(e, take3(y, u + 3))


@compile_inline
def along(link, speeds, linear, angular):
    """Return (linear, angular) with ``S speeds`` added."""
    return add3(linear, take3(speeds, link.u)), add3(angular, take3(speeds, link.u + 3))


@compile_inline
def direction(link, s):
    """See `weld.direction`."""
    return unit3(s), unit3(s - 3)


@compile_inline
def project(link, wrench, out):
    """Write the wrench."""
    u = link.u
    out[u], out[u + 1], out[u + 2], out[u + 3], out[u + 4], out[u + 5] = wrench


@compile_inline
def eliminate(link, own, B, P, tau, added, grounded):
    """See `weld.eliminate`; only what `added` holds is left for the parent."""
    M, H, J = parts(B)
    u = link.u
    if not _factor(own.pivot, M, H, J, added, u):
        return False, B, ZERO3, ZERO3
    if grounded:
        return True, B, ZERO3, ZERO3
    x = _solve(own.pivot, own.acceleration, sub6(take6(tau, u), P))
    P = add6(P, inertia_times(M, H, J, x))
    M, H, J = _left(own.pivot, own.acceleration, added, u)
    return to_parent(own, M, H, J, P)


@compile_inline
def response(link, own, P, tau):
    """See `weld.response`."""
    return _solve(own.pivot, own.acceleration, sub6(take6(tau, link.u), P))


@compile_inline
def accelerations(link, own, base, linear, angular, tau, udot, biases):
    """See `weld.accelerations`."""
    v, t, u = linear, angular, link.u
    f = inertia_times(own.M, own.H, own.J, (v[0], v[1], v[2], t[0], t[1], t[2]))
    x = _solve(own.pivot, own.acceleration, sub6(sub6(take6(tau, u), get6(own.force)), f))
    udot[u], udot[u + 1], udot[u + 2], udot[u + 3], udot[u + 4], udot[u + 5] = x
    return along(link, udot, linear, angular)


@compile_inline
def normalise(link, y):
    """Scale the quaternion to unit length."""
    unit_quaternion(y, link.x + 3)


@compile_inline
def move(link, y, d, out):
    """Move by the exponential of velocity and angular velocity in unit time."""
    x = link.x
    r = take3(d, link.u)
    w = take3(d, link.u + 3)
    b, c = _exponential(dot3(w, w))
    wr = cross(w, r)
    r = add3(r, axpy3((b * wr[0], b * wr[1], b * wr[2]), c, cross(w, wr)))
    r = times(quaternion_rotation(take4(y, x + 3)), r)
    out[x] = y[x] + r[0]
    out[x + 1] = y[x + 1] + r[1]
    out[x + 2] = y[x + 2] + r[2]
    turn_quaternion(y, x + 3, w, out)


@compile_inline
def _exponential(ww):
    """Return ``(1 - cos a) / a^2`` and ``(a - sin a) / a^3`` of an angle a whose square is `ww`."""
    if ww > 1e-6:
        angle = np.sqrt(ww)
        return (1.0 - np.cos(angle)) / ww, (angle - np.sin(angle)) / (ww * angle)
    return 0.5 - ww / 24.0, 1.0 / 6.0 - ww / 120.0


@compile_kernel
def _factor(pivot, M, H, J, added, u):
    """Eliminate a whole inertia by rows in ``pivot (21,)``; False when it is not positive."""
    put6(pivot, (M[0], M[1], M[2], H[0], H[1], H[2]))
    put6(pivot[6:], (M[3], M[4], H[3], H[4], H[5], M[5]))
    put9(pivot[12:], (H[6], H[7], H[8], J[0], J[1], J[2], J[3], J[4], J[5]))
    start = 0
    for a in range(6):
        if added is not None:
            pivot[start] += added[u + a]
        d = pivot[start]
        if not d > 0.0:
            return False
        row = start
        for b in range(1, 6 - a):
            row += 7 - a - b
            f = pivot[start + b] / d
            for c in range(b, 6 - a):
                pivot[row + c - b] -= f * pivot[start + c]
        start += 6 - a
    return True


@compile_kernel
def _solve(pivot, x, v):
    """Solve with the rows of `_factor`; ``x (6,)`` is scratch."""
    put6(x, v)
    start = 0
    for a in range(6):
        for b in range(1, 6 - a):
            x[a + b] -= pivot[start + b] / pivot[start] * x[a]
        start += 6 - a
    for a in range(5, -1, -1):
        start -= 6 - a
        found = x[a]
        for b in range(1, 6 - a):
            found -= pivot[start + b] * x[a + b]
        x[a] = found / pivot[start]
    return get6(x)


@compile_kernel
def _left(pivot, x, added, u):
    """Return the inertia that is left for the parent: ``h - h (I + h)^-1 h`` of the added inertia h, else nothing."""
    if added is None:
        return ZERO6, ZERO9, ZERO6
    h = take6(added, u)
    a = _solve(pivot, x, (h[0], 0.0, 0.0, 0.0, 0.0, 0.0))
    b = _solve(pivot, x, (0.0, h[1], 0.0, 0.0, 0.0, 0.0))
    c = _solve(pivot, x, (0.0, 0.0, h[2], 0.0, 0.0, 0.0))
    d = _solve(pivot, x, (0.0, 0.0, 0.0, h[3], 0.0, 0.0))
    e = _solve(pivot, x, (0.0, 0.0, 0.0, 0.0, h[4], 0.0))
    f = _solve(pivot, x, (0.0, 0.0, 0.0, 0.0, 0.0, h[5]))
    M = (
        h[0] - h[0] * a[0],
        -h[0] * b[0],
        -h[0] * c[0],
        h[1] - h[1] * b[1],
        -h[1] * c[1],
        h[2] - h[2] * c[2],
    )
    H = (
        -h[0] * d[0],
        -h[0] * e[0],
        -h[0] * f[0],
        -h[1] * d[1],
        -h[1] * e[1],
        -h[1] * f[1],
        -h[2] * d[2],
        -h[2] * e[2],
        -h[2] * f[2],
    )
    J = (
        h[3] - h[3] * d[3],
        -h[3] * e[3],
        -h[3] * f[3],
        h[4] - h[4] * e[4],
        -h[4] * f[4],
        h[5] - h[5] * f[5],
    )
    return M, H, J
