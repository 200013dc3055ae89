"""Joints in the recursions: how each type moves, and how its speeds are eliminated (theory 5.1 and 5.2).

This is the only kernel that knows the types of joints apart. `link` is a record of `Model.links`, `own` its record of
`Data.links`. The motion subspace S holds the speeds' directions in the link's frame: z of rotation or translation, all
rotations, or all six. A joint of one axis needs a column of the inertia and one pivot, three rotations the inverse of a
symmetric (3, 3), a free joint the factor of the whole inertia. Of the joints of one axis only the revolute has code of
its own: it is the common case.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import numbers
from modalprep.multibody.kernels.algebra.inertia_blocks import (
    all_blocks,
    blocks_times,
    column_parts,
    first_column,
    less_outer_blocks,
    rotated,
    second_column,
)
from modalprep.multibody.kernels.algebra.matrices import (
    inertia_times,
    inverse_symmetric,
    product,
    square,
    symmetric_product,
    symmetric_times,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.rotations import quaternion_rate, quaternion_rotation, turned
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    ZERO6,
    ZERO9,
    add3,
    add6,
    at,
    axpy3,
    combined,
    cross,
    dot3,
    dot_in_pairs,
    get3,
    get6,
    get9,
    put6,
    put9,
    sub6,
    sub9,
    take3,
    take4,
    take6,
)
from modalprep.multibody.kernels.data import FREE, PRESCRIBED, REVOLUTE, SLIDING, SPHERICAL


@compile_inline
def along_axis(link, v):
    """Return the component of a spatial vector (force or acceleration) along a joint of one axis: ``S' v``."""
    return v[5] if link.joint == REVOLUTE else link.along * v[2] + link.about * v[5]


@compile_inline
def joint_motion(link, prescribed, nx, y, turn):
    """Motion that a joint adds to the frame it stands in, whose rotation to the parent link's axes is `turn`.

    Returns
    -------
    turn : rotation of the link to the parent link's axes
    offset : translation, parent link's axes
    rate : of the translation, link's axes
    spin : angular velocity, link's axes
    extra : acceleration that prescribed motions and turning axes add, link's axes
    """
    joint = link.joint
    x = link.x
    u = nx + link.u
    offset, rate, spin, extra = ZERO3, ZERO3, ZERO3, ZERO6
    if joint == REVOLUTE:
        turn = turned(turn, y[x])
        spin = (0.0, 0.0, y[u])
    elif joint == SLIDING or joint == PRESCRIBED:
        place, speed, acceleration = (y[x], y[u], 0.0) if joint == SLIDING else get3(prescribed)
        along, about = link.along, link.about
        offset = times(turn, (0.0, 0.0, along * place))
        rate = (0.0, 0.0, along * speed)
        turn = turned(turn, about * place)
        spin = (0.0, 0.0, about * speed)
        extra = (0.0, 0.0, along * acceleration, 0.0, 0.0, about * acceleration)
    elif joint == SPHERICAL:
        turn = product(turn, quaternion_rotation(take4(y, x)))
        spin = take3(y, u)
    elif joint == FREE:
        offset = times(turn, take3(y, x))
        turn = product(turn, quaternion_rotation(take4(y, x + 3)))
        rate = take3(y, u)
        spin = take3(y, u + 3)
        c = cross(spin, rate)
        extra = (c[0], c[1], c[2], 0.0, 0.0, 0.0)
    return turn, offset, rate, spin, extra


@compile_inline
def joint_rates(link, nx, y, ydot):
    """Write the time derivatives of a joint's coordinates to ``ydot``."""
    joint = link.joint
    x = link.x
    u = nx + link.u
    if joint == REVOLUTE or joint == SLIDING:
        ydot[x] = y[u]
    elif joint == SPHERICAL:
        ydot[x], ydot[x + 1], ydot[x + 2], ydot[x + 3] = quaternion_rate(take4(y, x), take3(y, u))
    elif joint == FREE:
        e = take4(y, x + 3)
        ydot[x], ydot[x + 1], ydot[x + 2] = times(quaternion_rotation(e), take3(y, u))
        ydot[x + 3], ydot[x + 4], ydot[x + 5], ydot[x + 6] = quaternion_rate(e, take3(y, u + 3))


@compile_inline
def along_joint(link, speeds, linear, angular):
    """Return (linear, angular) with ``S speeds (nu,)`` added."""
    joint, u = link.joint, link.u
    if joint == REVOLUTE:
        angular = (angular[0], angular[1], angular[2] + speeds[u])
    elif joint == SLIDING:
        linear = (linear[0], linear[1], linear[2] + link.along * speeds[u])
        angular = (angular[0], angular[1], angular[2] + link.about * speeds[u])
    elif joint == SPHERICAL:
        angular = add3(angular, take3(speeds, u))
    elif joint == FREE:
        linear = add3(linear, take3(speeds, u))
        angular = add3(angular, take3(speeds, u + 3))
    return linear, angular


@compile_inline
def joint_force(link, wrench, out):
    """Write the generalised forces ``S' wrench`` of a joint to ``out (nu,)``."""
    joint, u = link.joint, link.u
    if joint == REVOLUTE or joint == SLIDING:
        out[u] = along_axis(link, wrench)
    elif joint == SPHERICAL:
        out[u], out[u + 1], out[u + 2] = wrench[3], wrench[4], wrench[5]
    elif joint == FREE:
        out[u], out[u + 1], out[u + 2], out[u + 3], out[u + 4], out[u + 5] = wrench


@compile_inline
def column(link, M, H, J):
    """Return ``I S`` of a joint of one axis: force and torque."""
    if link.joint == REVOLUTE:
        return (H[2], H[5], H[8]), (J[2], J[4], J[5])
    a, b = link.along, link.about
    force = (a * M[2] + b * H[2], a * M[4] + b * H[5], a * M[5] + b * H[8])
    return force, (a * H[6] + b * J[2], a * H[7] + b * J[4], a * H[8] + b * J[5])


@compile_inline
def axis_inertia(link, B, more):
    """Return ``S' I S + more`` of a joint of one axis, B the inertia I by axes. `more` (nu,) may be None."""
    m, h, _, d = numbers(B[5])
    if link.joint != REVOLUTE:
        d = link.along * (link.along * m + 2.0 * link.about * h) + link.about * link.about * d
    return d if more is None else d + more[at(link.u)]


@compile_inline
def axis_column(link, own, g, B):
    """Return ``I S`` of a joint of one axis in the parent link's axes, each axis (linear, angular) twice.

    What the accelerations need of it goes to `pivot`: ``g``, ``g I S`` and ``g S' I b``; g is the inverse of
    `axis_inertia`, B is I by axes.
    """
    half = product(get9(own.rotation), all_blocks(B))
    v = second_column(half[2]), second_column(half[5]), second_column(half[8])
    if link.joint != REVOLUTE:
        linear = first_column(half[2]), first_column(half[5]), first_column(half[8])
        v = combined(link.along, linear, link.about, v)
    f, t = column_parts(v)
    own.pivot[0], own.pivot[7] = g, g * along_axis(link, blocks_times(B, get6(own.bias)))
    put6(own.pivot[1:], (g * f[0], g * f[1], g * f[2], g * t[0], g * t[1], g * t[2]))
    return v


@compile_inline
def through_axis(link, own, g, v, B, P, tau):
    """Return inertia and bias force of a link with its joint of one axis eliminated, in the parent link's axes.

    ``I - I S g S' I`` and ``P + I b + I S g (tau - S' (P + I b))``; B is I by axes, as the result, v of `axis_column`.
    """
    turn = get9(own.rotation)
    P = add6(P, blocks_times(B, get6(own.bias)))
    e = g * (tau[at(link.u)] - along_axis(link, P))
    f, t = column_parts(v)
    f = axpy3(times(turn, (P[0], P[1], P[2])), e, f)
    t = axpy3(times(turn, (P[3], P[4], P[5])), e, t)
    return less_outer_blocks(rotated(turn, B), g, v), f, t


@compile_inline
def factor_joint(link, own, M, H, J, more):
    """Write the factor of ``S' I S + more`` of a joint of several axes to `pivot`; False when it is not positive."""
    joint, u = link.joint, link.u
    if joint == SPHERICAL:
        d = J
        if more is not None:
            d = (J[0] + more[u], J[1], J[2], J[3] + more[u + 1], J[4], J[5] + more[u + 2])
        g, pivots = inverse_symmetric(d)
        if not (pivots[0] > 0.0 and pivots[1] > 0.0 and pivots[2] > 0.0):
            return False
        put6(own.pivot, g)
    elif joint == FREE:
        return _factor(own.pivot, M, H, J, more, u)
    return True


@compile_inline
def through_joint(link, own, M, H, J, P, tau, more):
    """Return inertia and bias force of a link, its axes, with its joint of several axes eliminated, or of none.

    ``I - I S D^-1 S' I`` and ``P + I S D^-1 (tau - S' P)`` with ``D = S' I S + more``, after `factor_joint`.
    """
    joint, u = link.joint, link.u
    if joint == SPHERICAL:
        g = get6(own.pivot)
        e = symmetric_times(g, (tau[u] - P[3], tau[u + 1] - P[4], tau[u + 2] - P[5]))
        f = times(H, e)
        t = symmetric_times(J, e)
        P = add6(P, (f[0], f[1], f[2], t[0], t[1], t[2]))
        HG = product(H, square(g))
        JG = product(square(J), square(g))
        M = sub6(M, symmetric_product(HG, H))
        H = sub9(H, product(HG, square(J)))
        J = sub6(J, symmetric_product(JG, square(J)))
    elif joint == FREE:
        x = _solve(own.pivot, own.acceleration, sub6(take6(tau, u), P))
        P = add6(P, inertia_times(M, H, J, x))
        M, H, J = _left_of_free(own.pivot, own.acceleration, more, u)
    return M, H, J, P


@compile_inline
def speeds_from_bias(link, own, P, tau):
    """Return ``S D^-1 (tau - S' P)``: what the joint yields to its bias force, after `factor_joint`."""
    joint, u = link.joint, link.u
    if joint == REVOLUTE:
        return (0.0, 0.0, 0.0, 0.0, 0.0, own.pivot[0] * (tau[u] - P[5]))
    if joint == SLIDING:
        e = own.pivot[0] * (tau[u] - along_axis(link, P))
        return (0.0, 0.0, link.along * e, 0.0, 0.0, link.about * e)
    if joint == SPHERICAL:
        t = symmetric_times(get6(own.pivot), (tau[u] - P[3], tau[u + 1] - P[4], tau[u + 2] - P[5]))
        return (0.0, 0.0, 0.0, t[0], t[1], t[2])
    if joint == FREE:
        return _solve(own.pivot, own.acceleration, sub6(take6(tau, u), P))
    return ZERO6


@compile_inline
def joint_accelerations(link, own, base, linear, angular, tau, udot, whole):
    """Write ``udot = D^-1 (tau - S' (P + I A))`` of a joint for the acceleration A that it has without.

    Returns the acceleration (linear, angular) with the joint's own. A joint of one axis takes A from the acceleration
    `base` of its frame on the parent, parent link's axes, which need not wait; `whole` as in `forward`.
    """
    joint, u, M, H, J, P = link.joint, link.u, own.M, own.H, own.J, own.force
    v, t = linear, angular
    if joint == REVOLUTE or joint == SLIDING:
        free = own.pivot[0] * (tau[at(u)] - along_axis(link, P)) - whole * own.pivot[7]
        found = udot[at(u)] = free - dot_in_pairs(take6(own.pivot, 1), base)
        if joint == REVOLUTE:
            return v, (t[0], t[1], t[2] + found)
        return (v[0], v[1], v[2] + link.along * found), (t[0], t[1], t[2] + link.about * found)
    if joint == SPHERICAL:
        f = add3(transposed_times(H, v), symmetric_times(J, t))
        b = (tau[u] - P[3] - f[0], tau[u + 1] - P[4] - f[1], tau[u + 2] - P[5] - f[2])
        udot[u], udot[u + 1], udot[u + 2] = symmetric_times(own.pivot, b)
    elif joint == FREE:
        f = inertia_times(M, H, J, (v[0], v[1], v[2], t[0], t[1], t[2]))
        x = _solve(own.pivot, own.acceleration, sub6(sub6(take6(tau, u), get6(P)), f))
        udot[u], udot[u + 1], udot[u + 2], udot[u + 3], udot[u + 4], udot[u + 5] = x
    return along_joint(link, udot, v, t)


@compile_kernel
def _factor(pivot, M, H, J, more, u):
    """Eliminate a whole inertia by rows in ``pivot (21,)``; False when it is not positive."""
    put6(pivot, (M[0], M[1], M[2], H[0], H[1], H[2]))
    put6(pivot[6:], (M[3], M[4], H[3], H[4], H[5], M[5]))
    put9(pivot[12:], (H[6], H[7], H[8], J[0], J[1], J[2], J[3], J[4], J[5]))
    start = 0
    for a in range(6):
        if more is not None:
            pivot[start] += more[u + a]
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
def _left_of_free(pivot, x, more, u):
    """What a free joint hands to its parent: ``h - h (I + h)^-1 h`` of the added inertia h, else nothing."""
    if more is None:
        return ZERO6, ZERO9, ZERO6
    h = take6(more, u)
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


@compile_kernel
def normalise(model, y):
    """Scale all quaternions of y to unit length."""
    for i in range(len(model.links)):
        link = model.links[i]
        if link.joint == SPHERICAL or link.joint == FREE:
            x = link.x + (3 if link.joint == FREE else 0)
            e = take4(y, x)
            f = 1.0 / np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3])
            for k in range(4):
                y[x + k] *= f


@compile_inline
def is_turn(link, u):
    """Whether speed u of a link's joint turns it, and does not shift it."""
    return link.joint == SPHERICAL or link.about != 0.0 or (link.joint == FREE and u >= link.u + 3)


@compile_kernel
def move(model, y, d, out):
    """Move coordinates y by increments ``d (nu,)``, to `out` or in place: exponentials where a joint turns freely."""
    for i in range(len(model.links)):
        link = model.links[i]
        joint, x, u = link.joint, link.x, link.u
        for a in range(link.modes):
            out[link.xq + a] = y[link.xq + a] + d[link.uq + a]
        if joint == REVOLUTE or joint == SLIDING:
            out[x] = y[x] + d[u]
        elif joint == SPHERICAL:
            _turn(y, x, take3(d, u), out)
        elif joint == FREE:
            r = take3(d, u)
            w = take3(d, u + 3)
            ww = dot3(w, w)
            b = 0.5 - ww / 24.0
            c = 1.0 / 6.0 - ww / 120.0
            if ww > 1e-6:
                angle = np.sqrt(ww)
                b = (1.0 - np.cos(angle)) / ww
                c = (angle - np.sin(angle)) / (ww * angle)
            wr = cross(w, r)
            r = add3(r, axpy3((b * wr[0], b * wr[1], b * wr[2]), c, cross(w, wr)))
            r = times(quaternion_rotation(take4(y, x + 3)), r)
            out[x] = y[x] + r[0]
            out[x + 1] = y[x + 1] + r[1]
            out[x + 2] = y[x + 2] + r[2]
            _turn(y, x + 3, w, out)


@compile_kernel
def _turn(y, x, w, out):
    """Turn the quaternion at x by the rotation vector w of its own frame."""
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
