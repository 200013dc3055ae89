"""A spherical joint: a quaternion and three rates of rotation, which need the inverse of a symmetric (3, 3)."""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.multibody.kernels.algebra.inertia_blocks import parts
from modalprep.multibody.kernels.algebra.matrices import (
    inverse_symmetric,
    product,
    square,
    symmetric_product,
    symmetric_times,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.rotations import (
    quaternion_rate,
    quaternion_rotation,
    turn_quaternion,
    unit_quaternion,
)
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    ZERO6,
    add3,
    add6,
    get6,
    put6,
    sub6,
    sub9,
    take3,
    take4,
    unit3,
)
from modalprep.multibody.kernels.joints.weld import to_parent


@compile_inline
def motion(link, prescribed, nx, y, turn):
    """See `weld.motion`."""
    turn = product(turn, quaternion_rotation(take4(y, link.x)))
    return turn, ZERO3, ZERO3, take3(y, nx + link.u), ZERO6


@compile_inline
def rates(link, nx, y, ydot):
    """Write the rate of the quaternion."""
    x = link.x
    ydot[x], ydot[x + 1], ydot[x + 2], ydot[x + 3] = quaternion_rate(take4(y, x), take3(y, nx + link.u))


@compile_inline
def along(link, speeds, linear, angular):
    """Return (linear, angular) with ``S speeds`` added."""
    return linear, add3(angular, take3(speeds, link.u))


@compile_inline
def direction(link, s):
    """See `weld.direction`."""
    return ZERO3, unit3(s)


@compile_inline
def project(link, wrench, out):
    """Write the torque."""
    u = link.u
    out[u], out[u + 1], out[u + 2] = wrench[3], wrench[4], wrench[5]


@compile_inline
def eliminate(link, own, B, P, tau, added, grounded):
    """See `weld.eliminate`."""
    M, H, J = parts(B)
    u = link.u
    d = J
    if added is not None:
        d = (J[0] + added[u], J[1], J[2], J[3] + added[u + 1], J[4], J[5] + added[u + 2])
    g, pivots = inverse_symmetric(d)
    if not (pivots[0] > 0.0 and pivots[1] > 0.0 and pivots[2] > 0.0):
        return False, B, ZERO3, ZERO3
    put6(own.pivot, g)
    if grounded:
        return True, B, ZERO3, ZERO3
    e = symmetric_times(g, (tau[u] - P[3], tau[u + 1] - P[4], tau[u + 2] - P[5]))
    f = times(H, e)
    t = symmetric_times(J, e)
    P = add6(P, (f[0], f[1], f[2], t[0], t[1], t[2]))
    HG = product(H, square(g))
    JG = product(square(J), square(g))
    M = sub6(M, symmetric_product(HG, H))
    H = sub9(H, product(HG, square(J)))
    J = sub6(J, symmetric_product(JG, square(J)))
    return to_parent(own, M, H, J, P)


@compile_inline
def response(link, own, P, tau):
    """See `weld.response`."""
    u = link.u
    t = symmetric_times(get6(own.pivot), (tau[u] - P[3], tau[u + 1] - P[4], tau[u + 2] - P[5]))
    return (0.0, 0.0, 0.0, t[0], t[1], t[2])


@compile_inline
def accelerations(link, own, base, linear, angular, tau, udot, biases):
    """See `weld.accelerations`."""
    u = link.u
    P = own.force
    f = add3(transposed_times(own.H, linear), symmetric_times(own.J, angular))
    b = (tau[u] - P[3] - f[0], tau[u + 1] - P[4] - f[1], tau[u + 2] - P[5] - f[2])
    udot[u], udot[u + 1], udot[u + 2] = symmetric_times(own.pivot, b)
    return along(link, udot, linear, angular)


@compile_inline
def normalise(link, y):
    """Scale the quaternion to unit length."""
    unit_quaternion(y, link.x)


@compile_inline
def move(link, y, d, out):
    """Turn the quaternion by a rotation vector."""
    turn_quaternion(y, link.x, take3(d, link.u), out)
