"""The outward sweep: motion of the links, what it changes by, and the forces of each link by its own motion.

A column of a frame says what one coordinate or speed changes by: the twist J of the frame; the components of its
velocity V; and ``b = da - dV x V`` of those of its acceleration a. Where a joint or an interface has no part in a
change, the columns (J, dV, b) of the next frame are those of the last one, shifted as twists are: they are written at
the frame where they begin, and stay as they are in the axes of the ground.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, get_lanes
from modalprep.multibody.kernels.algebra.matrices import (
    product,
    product_transposed,
    spin_matrix,
    square,
    symmetric_times,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.rows import put_rows3, rows3
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    axpy3,
    combined,
    cross,
    dot3,
    get3,
    get6,
    get9,
    get_angular,
    put3,
    put6,
    put_angular,
    scaled3,
    sub3,
    sub9,
    take3,
)
from modalprep.multibody.kernels.interfaces import free_position, place_link
from modalprep.multibody.kernels.joints import joint_direction
from modalprep.multibody.kernels.tangents.bodies import flexible_slopes
from modalprep.multibody.kernels.tangents.turns import relative_slopes, turn_interface


@compile_kernel
def outward_tangents(model, data, work):
    """Write the motion of all links and their own derivatives to the work; after `newton_euler.required_forces`."""
    ground = work.frames[len(model.links)]
    put6(ground.velocity, (0.0, 0.0, 0.0, *get3(data.links[len(model.links)].omega)))
    put6(ground.acceleration, (*get3(data.links[len(model.links)].acceleration), 0.0, 0.0, 0.0))
    for i in range(len(model.links)):
        place_link(model, data, i)
    for i in work.preorder:
        _link(work.modes, model, data, work, i)


@compile_inline
def _link(modes, model, data, work, i):
    """Write motion, columns and own derivatives of link i."""
    link, own = model.links[i], data.links[i]
    parent = work.frames[link.parent]
    frame = work.frames[i]
    before = get9(data.links[link.parent].orientation)
    base = get9(own.orientation)
    arm = times(before, get3(own.arm))
    V = shifted_twist(get3(parent.velocity), get_angular(parent.velocity), arm)
    a = shifted_twist(get3(parent.acceleration), get_angular(parent.acceleration), arm)
    v, w = add3(V[0], times(before, get3(own.slide))), times(base, get3(own.omega))
    V, a = _held(modes, model, data, work, i, arm, V, a)
    put3(frame.velocity, v)
    put_angular(frame.velocity, w)
    put3(frame.acceleration, axpy3(times(base, get3(own.acceleration)), -1.0, cross(w, v)))
    put_angular(frame.acceleration, times(base, get_angular(own.acceleration)))
    for s in range(link.uq - link.u):
        linear, angular = joint_direction(link, s)
        S = times(base, linear), times(base, angular)
        _joint_column(work.columns[frame.first + s], S, V, a, (v, w))
    _own_forces(modes, model, data, work, i, base, v, w)


@compile_inline
def _held(modes, model, data, work, i, arm, V, a):
    """Return velocity and acceleration of link i where its joint does not move, given those on a rigid parent."""
    if modes is not None:
        if model.links[i].phi >= 0:
            return _interface(model, data, work, i, arm)
    return V, a


@compile_inline
def shifted_twist(linear, angular, arm):
    """Return a twist (linear, angular) at the end of an arm."""
    return add3(linear, cross(angular, arm)), angular


@compile_inline
def turned_twist(V, x):
    """Return what turning with the twist V does to the components of a twist x: ``V x``."""
    return add3(cross(V[1], x[0]), cross(V[0], x[1])), cross(V[1], x[1])


@compile_inline
def plus(x, y):
    """Return the sum of two twists."""
    return add3(x[0], y[0]), add3(x[1], y[1])


@compile_inline
def _joint_column(out, S, V, a, V_next):
    """Write the column of a joint's speed with the direction S; V and a where the joint does not move."""
    turned = turned_twist(V, S)
    put_twist(out, 0, S)
    put_twist(out, 6, turned)
    put_twist(out, 12, plus(turned_twist(a, S), turned_twist(V, turned)))
    put_twist(out, 18, plus(turned, turned_twist(V_next, S)))


@compile_inline
def put_twist(out, c, x):
    """Write a twist to six numbers from c on."""
    put3(out[c:], x[0])
    put3(out[c + 3 :], x[1])


@compile_inline
def _interface(model, data, work, i, arm):
    """Write the columns of a flexible parent's modes at link i, which is held at its interface; `arm` to link i.

    Returns velocity and acceleration of link i where its joint does not move.
    """
    link = model.links[i]
    r = end_motion(model, data, work, link.parent, link.interface, link.phi)
    base = get9(data.links[link.parent].orientation)
    rest = sub3(arm, times(base, r))
    return mode_columns(model, data, work, link.parent, link.phi, r, rest)


@compile_inline
def end_motion(model, data, work, link, node, k):
    """Write the motion of an interface of a flexible body to place k of the work; returns its position."""
    modes = work.modes
    moved, _ = turn_interface(data.modal, model, modes, link, node, k)
    return add3(free_position(model, link, node), moved)


@compile_kernel
def mode_columns(model, data, work, link, k, r, rest):
    """Write the columns of the modes at a frame that is fixed to an interface at r, `rest` from there.

    After `end_motion`. Returns velocity and acceleration of the frame.
    """
    frame, turns = work.frames[link], work.modes.turns
    base = get9(data.links[link].orientation)
    arm = times(base, r)
    V = shifted_twist(get3(frame.velocity), get_angular(frame.velocity), arm)
    a = shifted_twist(get3(frame.acceleration), get_angular(frame.acceleration), arm)
    twist = times(base, get3(turns.twist[k])), times(base, get_angular(turns.twist[k]))
    rate = times(base, get3(turns.rate[k])), times(base, get_angular(turns.rate[k]))
    V_next = plus(V, twist)
    for b in range(0, model.links[link].modes, WIDTH):
        S, V_q, a_q, a_qd = relative_slopes(work.modes.bends, turns, k, b)
        S, V_q = _both(base, S), _both(base, V_q)
        turned = turned_twist(V, S)
        V_x = plus(turned, V_q)
        by_x = plus(plus(turned_twist(a, S), _both(base, a_q)), plus(turned_twist(V, V_q), turned_twist(V_next, V_x)))
        back = turned_twist(twist, turned)
        by_x = axpy3(by_x[0], -1.0, back[0]), axpy3(by_x[1], -1.0, back[1])
        by_u = plus(plus(turned, _both(base, a_qd)), turned_twist(V_next, S))
        out = turns.columns[k]
        _put_mode_columns(out, 0, b, S, rest)
        _put_mode_columns(out, 6, b, V_x, rest)
        _put_mode_columns(out, 12, b, by_x, rest)
        _put_mode_columns(out, 18, b, by_u, rest)
    a = plus(plus(a, rate), turned_twist(V, twist))
    return shifted_twist(V_next[0], V_next[1], rest), shifted_twist(a[0], a[1], rest)


@compile_inline
def _both(R, x):
    """Return a twist in turned axes."""
    return times(R, x[0]), times(R, x[1])


@compile_inline
def _put_mode_columns(out, c, b, x, rest):
    """Write a part of four columns, shifted."""
    put_rows3(out, c, b, add3(x[0], cross(x[1], rest)))
    put_rows3(out, c + 3, b, x[1])


@compile_inline
def _own_forces(modes, model, data, work, i, base, v, w):
    """Write the inertia of link i's body, its force, and the derivatives by the spin and the modes."""
    own, frame = data.links[i], work.frames[i]
    frame.mass = own.M[0]
    s = times(base, (own.H[5], own.H[6], own.H[1]))
    J = turned_inertia(base, get6(own.J))
    put3(frame.first_moment, s)
    put6(frame.inertia, J)
    if modes is not None:
        if model.links[i].slot >= 0:
            _flexible_forces(model, data, work, i, base)
            return
    m = own.M[0]
    a = times(base, get3(own.acceleration))
    alpha = times(base, get_angular(own.acceleration))
    f = add3(combined(m, a, 1.0, cross(alpha, s)), cross(w, cross(w, s)))
    t = add3(add3(cross(s, a), symmetric_times(J, alpha)), cross(w, symmetric_times(J, w)))
    _put_wrench(frame, f, t)
    W, full = spin_matrix(w), square(J)
    put_matrix(frame.gyro, 0, spin_matrix(scaled3(-2.0, combined(m, v, 1.0, cross(w, s)))))
    T = product(W, full)
    T = sub9(T, product(full, W))
    T = sub9(T, spin_matrix(symmetric_times(J, w)))
    put_matrix(frame.gyro, 9, sub9(T, scaled9(2.0, product(spin_matrix(s), spin_matrix(v)))))


@compile_inline
def _put_wrench(frame, f, t):
    """Write a wrench and its size."""
    put3(frame.wrench, f)
    put_angular(frame.wrench, t)
    put6(frame.sizes, (abs(f[0]), abs(f[1]), abs(f[2]), abs(t[0]), abs(t[1]), abs(t[2])))


@compile_inline
def scaled9(f, A):
    """Return ``f A``."""
    return f * A[0], f * A[1], f * A[2], f * A[3], f * A[4], f * A[5], f * A[6], f * A[7], f * A[8]


@compile_inline
def put_matrix(out, c, A):
    """Write nine numbers from c on."""
    put3(out[c:], A[:3])
    put3(out[c + 3 :], A[3:6])
    put3(out[c + 6 :], A[6:])


@compile_inline
def turned_inertia(R, J):
    """Return a moment of inertia in turned axes."""
    A = product_transposed(product(R, square(J)), R)
    return A[0], A[1], A[2], A[4], A[5], A[8]


@compile_inline
def _flexible_forces(model, data, work, i, base):
    """Write force and derivatives of a flexible body, and the rows of its modes."""
    own, frame, modes = data.links[i], work.frames[i], work.modes
    modal, s = data.modal, model.links[i].slot
    a = get3(own.acceleration)
    alpha = get_angular(own.acceleration)
    w = get3(own.omega)
    S = add9_outer(spin_matrix(alpha), w)
    flexible_slopes(modal, model, modes, i, a, S, w)
    force = modes.bodies.force[s]
    _put_wrench(frame, times(base, get3(force)), times(base, take3(force, 3)))
    v = transposed_times(base, get3(frame.velocity))
    H, J, m = get9(own.H), square(get6(own.J)), own.M[0]
    for c in range(3):
        moved = column(spin_matrix(v), c)
        spun = column(spin_matrix(w), c)
        spin = modes.bodies.by_spin[c]
        f = combined(-2.0 * m, moved, -1.0, times(H, spun))
        t = combined(-2.0, transposed_times(H, moved), -1.0, times(J, spun))
        put3(spin, add3(get3(spin), f))
        put_angular(spin, add3(take3(spin, 3), t))
    _put_gyro(frame, modes.bodies.by_spin, base)
    _mode_rows(model, data, work, i, base, v, w)


@compile_inline
def add9_outer(A, w):
    """Return ``A + w~ w~``."""
    x = dot3(w, w)
    return (
        A[0] + w[0] * w[0] - x,
        A[1] + w[0] * w[1],
        A[2] + w[0] * w[2],
        A[3] + w[1] * w[0],
        A[4] + w[1] * w[1] - x,
        A[5] + w[1] * w[2],
        A[6] + w[2] * w[0],
        A[7] + w[2] * w[1],
        A[8] + w[2] * w[2] - x,
    )


@compile_inline
def column(A, c):
    """Return a column of a matrix."""
    return A[c], A[3 + c], A[6 + c]


@compile_inline
def _put_gyro(frame, by_spin, base):
    """Write the derivatives of force and torque by the spin, axes of the ground."""
    for c in range(0, 6, 3):
        x, y, z = take3(by_spin[0], c), take3(by_spin[1], c), take3(by_spin[2], c)
        A = (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])
        put_matrix(frame.gyro, 3 * c, product_transposed(product(base, A), base))


@compile_kernel
def _mode_rows(model, data, work, i, base, v, w):
    """Write what the wrench of a body changes by with its modes to the rows of the sweep, and the modal mass."""
    modal, s, n = data.modal, model.links[i].slot, model.links[i].modes
    own, rows, first = work.modes.bodies, work.rows, work.frames[i].modes
    for b in range(0, n, WIDTH):
        place = first + b
        for c in range(0, 6, 3):
            put_rows3(rows, c, place, times(base, rows3(own.by_q[s], c, b)))
            put_rows3(rows, 6 + c, place, times(base, rows3(own.by_qd[s], c, b)))
            put_rows3(rows, 12 + c, place, times(base, rows3(modal.M_rf[s], c, b)))
        S, C = rows3(modal.M_rf[s], 0, b), rows3(modal.M_rf[s], 3, b)
        spin = get_lanes(own.by_spin[0, 6:], b), get_lanes(own.by_spin[1, 6:], b), get_lanes(own.by_spin[2, 6:], b)
        spin = axpy3(axpy3(spin, 2.0, cross(v, S)), 1.0, cross(w, C))
        put_rows3(rows, 18, place, times(base, spin))
    for a in range(n):
        own.size[s, a] = abs(own.force[s, 6 + a])
        for b in range(a, n):
            own.by_qdd[s, a, b] = own.by_qdd[s, b, a] = modal.M_ff[s, a, b]
