"""The inward sweep: the rows of each speed, of the composite inertia of what it carries.

At each link stand the rows of all speeds of its subtree: what its wrench changes by with their coordinates and their
speeds, and, as the mass matrix is symmetric, what they feel of the acceleration b of the link and of its spin.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, get_lanes, numbers, put_lanes, transposed_lanes
from modalprep.multibody.kernels.algebra.matrices import symmetric_times, times, transposed_times
from modalprep.multibody.kernels.algebra.rows import put_rows3, rows3, rows6
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    add6,
    axpy3,
    combined,
    cross,
    dot3,
    dot6,
    get3,
    get6,
    get9,
    get_angular,
    put3,
    put6,
    put_angular,
    sub3,
    take3,
    take6,
)
from modalprep.multibody.kernels.interfaces import free_position
from modalprep.multibody.kernels.tangents.turns import add_turn_curvature


@compile_kernel
def inward_tangents(model, data, work, K, D, M, force, size):
    """Write the derivatives (nu, nu) by coordinates, speeds and accelerations, the forces (nu,) and their sizes.

    After `outward_tangents`; what else acts on the links may have been added to the wrenches of the work. Entries of
    speeds of different branches stay what they are: zero.
    """
    for k in range(len(work.preorder) - 1, -1, -1):
        i = work.preorder[k]
        _own_modes(work.modes, model, i, K, D, M, force, size)
        _joint(model, work, i, K, D, M, force, size)
        if model.links[i].parent < len(model.links):
            _to_parent(work.modes, model, data, work, i, K, D, M)


@compile_inline
def _own_modes(modes, model, i, K, D, M, force, size):
    """Add the block of link i's modes, and their forces."""
    if modes is not None:
        if model.links[i].slot >= 0:
            _block(modes.bodies, model.links[i].slot, model.links[i].modes, model.links[i].uq, K, D, M, force, size)


@compile_inline
def _block(own, s, n, u, K, D, M, force, size):
    """Add the block of n modes from speed u on, and their forces."""
    for a in range(n):
        force[u + a] = own.force[s, 6 + a]
        size[u + a] = own.size[s, a]
        for b in range(n):
            K[u + a, u + b] = own.by_q[s, 6 + a, b]
            D[u + a, u + b] = own.by_qd[s, 6 + a, b]
            M[u + a, u + b] = own.by_qdd[s, a, b]


@compile_inline
def _joint(model, work, i, K, D, M, force, size):
    """Add the rows and columns of link i's joint."""
    link = model.links[i]
    frame = work.frames[i]
    rows = work.rows
    columns = work.columns
    count, first = link.uq - link.u, frame.first
    for s in range(count):
        column = columns[first + s]
        J = take6(column, 0)
        force[link.u + s] = dot6(J, get6(frame.wrench))
        size[link.u + s] = _absolute(J, get6(frame.sizes))
        _put_row(rows, first + s, frame, column)
    for s in range(count):
        J = take6(columns[first + s], 0)
        for r in range(count):
            K[link.u + s, link.u + r] = dot6(J, _row6(rows, 0, first + r))
            D[link.u + s, link.u + r] = dot6(J, _row6(rows, 6, first + r))
            M[link.u + s, link.u + r] = dot6(J, _row6(rows, 12, first + r))
    for b in range(first + count, frame.end, WIDTH):
        of = _rows(rows, b)
        for s in range(count):
            _entries(work, b, frame.end, of, columns[first + s], link.u + s, K, D, M)
    for s in range(count):
        f, t = turned_wrench(frame.wrench, take3(columns[first + s], 0), take3(columns[first + s], 3))
        _add_row6(rows, 0, first + s, (f[0], f[1], f[2], t[0], t[1], t[2]))


@compile_inline
def _absolute(a, b):
    """Return ``|a| . b``."""
    return (
        abs(a[0]) * b[0] + abs(a[1]) * b[1] + abs(a[2]) * b[2] + abs(a[3]) * b[3] + abs(a[4]) * b[4] + abs(a[5]) * b[5]
    )


@compile_inline
def turned_wrench(w, displacement, rotation):
    """Return the change of a wrench, in fixed axes at a fixed point, when its frame moves: force, torque."""
    f = get3(w)
    return cross(rotation, f), add3(cross(rotation, get_angular(w)), cross(displacement, f))


@compile_inline
def _composite(frame, x):
    """Return the composite inertia times a twist x, as force and torque."""
    s = get3(frame.first_moment)
    f = axpy3(cross(x[1], s), frame.mass, x[0])
    return f, add3(cross(s, x[0]), symmetric_times(get6(frame.inertia), x[1]))


@compile_inline
def _spun(frame, w):
    """Return the derivative of force and torque by the spin, times w."""
    return times(get9(frame.gyro), w), times(get9(frame.gyro[9:]), w)


@compile_inline
def _spun_transposed(frame, x):
    """Return what a twist x makes of the derivative by the spin: ``gyro' x``."""
    return add3(transposed_times(get9(frame.gyro), x[0]), transposed_times(get9(frame.gyro[9:]), x[1]))


@compile_inline
def _changes(frame, J, V, by_x, by_u):
    """Return the changes of the wrench of a composite by a column: by coordinate, speed and acceleration, each (f, t).

    And what its speed feels of the spin.
    """
    x, spun = _composite(frame, by_x), _spun(frame, V)
    u, turned = _composite(frame, by_u), _spun(frame, J[1])
    x = add3(x[0], spun[0]), add3(x[1], spun[1])
    u = add3(u[0], turned[0]), add3(u[1], turned[1])
    return x, u, _composite(frame, J), _spun_transposed(frame, J)


@compile_inline
def _pair(x, c):
    """Return a twist of a column."""
    return take3(x, c), take3(x, c + 3)


@compile_inline
def _put_row(rows, place, frame, column):
    """Write the row of a joint's speed."""
    J = _pair(column, 0)
    x, u, m, spin = _changes(frame, J, take3(column, 9), _pair(column, 12), _pair(column, 18))
    for c in range(3):
        rows[c, place], rows[3 + c, place] = x[0][c], x[1][c]
        rows[6 + c, place], rows[9 + c, place] = u[0][c], u[1][c]
        rows[12 + c, place], rows[15 + c, place] = m[0][c], m[1][c]
        rows[18 + c, place] = spin[c]


@compile_inline
def _row6(rows, c, place):
    """Return six numbers of a row."""
    return (
        rows[c, place],
        rows[c + 1, place],
        rows[c + 2, place],
        rows[c + 3, place],
        rows[c + 4, place],
        rows[c + 5, place],
    )


@compile_inline
def _add_row6(rows, c, place, x):
    """Add six numbers to a row."""
    for k in range(6):
        rows[c + k, place] += x[k]


@compile_inline
def _rows(rows, b):
    """Return four rows."""
    return rows6(rows, 0, b), rows6(rows, 6, b), rows6(rows, 12, b), rows3(rows, 18, b)


@compile_inline
def _products(of, column):
    """Return the entries between four rows and a column: K, D and M above the diagonal, K and D below it."""
    by_x, by_u, mass, spin = of
    J = take6(column, 0)
    lower_K = dot6(take6(column, 12), mass) + dot3(take3(column, 9), spin)
    lower_D = dot6(take6(column, 18), mass) + dot3(take3(column, 3), spin)
    return dot6(J, by_x), dot6(J, by_u), dot6(J, mass), lower_K, lower_D


@compile_inline
def _entries(work, b, end, of, column, u, K, D, M):
    """Write the entries between four rows from place b on, not after `end`, and speed u, whose column is given."""
    x, y, m, xt, yt = _products(of, column)
    if b + WIDTH <= end and work.straight[b]:
        r = work.order[b]
        put_lanes(K[u], r, x)
        put_lanes(D[u], r, y)
        put_lanes(M[u], r, m)
    else:
        _put_entries(work, b, end, numbers(x), K[u])
        _put_entries(work, b, end, numbers(y), D[u])
        _put_entries(work, b, end, numbers(m), M[u])
    _put_entries(work, b, end, numbers(xt), K[:, u])
    _put_entries(work, b, end, numbers(yt), D[:, u])
    _put_entries(work, b, end, numbers(m), M[:, u])


@compile_inline
def _put_entries(work, b, end, x, out):
    """Write four numbers of the speeds at places from b on, before `end`."""
    for k in range(WIDTH):
        if b + k < end:
            out[work.order[b + k]] = x[k]


@compile_inline
def _four_entries(work, b, of, columns, a, u, K, D, M):
    """Write the entries between four rows from place b on and four modes from a on, whose speeds begin at u."""
    x0, y0, m0, s0, t0 = _products(of, columns[a])
    x1, y1, m1, s1, t1 = _products(of, columns[a + 1])
    x2, y2, m2, s2, t2 = _products(of, columns[a + 2])
    x3, y3, m3, s3, t3 = _products(of, columns[a + 3])
    r, c = work.order[b], u + a
    _put_rows4(K, c, r, (x0, x1, x2, x3))
    _put_rows4(D, c, r, (y0, y1, y2, y3))
    _put_rows4(M, c, r, (m0, m1, m2, m3))
    _put_rows4(K, r, c, transposed_lanes(s0, s1, s2, s3))
    _put_rows4(D, r, c, transposed_lanes(t0, t1, t2, t3))
    _put_rows4(M, r, c, transposed_lanes(m0, m1, m2, m3))


@compile_inline
def _put_rows4(A, r, c, x):
    """Write four rows of four numbers."""
    put_lanes(A[r], c, x[0])
    put_lanes(A[r + 1], c, x[1])
    put_lanes(A[r + 2], c, x[2])
    put_lanes(A[r + 3], c, x[3])


@compile_inline
def _to_parent(modes, model, data, work, i, K, D, M):
    """Bring rows, inertia and wrench of link i and what it carries to its parent."""
    link, frame = model.links[i], work.frames[i]
    parent = work.frames[link.parent]
    arm = times(get9(data.links[link.parent].orientation), get3(data.links[i].arm))
    if modes is not None:
        if link.phi >= 0:
            _parent_modes(model, data, work, i, arm, K, D, M)
    _shift_rows(work.rows, frame.first, frame.end, arm)
    _shift_inertia(frame, parent, arm)
    f, t = get3(frame.wrench), get_angular(frame.wrench)
    put3(parent.wrench, add3(get3(parent.wrench), f))
    put_angular(parent.wrench, add3(get_angular(parent.wrench), add3(t, cross(arm, f))))
    f, t = get3(frame.sizes), get_angular(frame.sizes)
    x, y, z = abs(arm[0]), abs(arm[1]), abs(arm[2])
    put3(parent.sizes, add3(get3(parent.sizes), f))
    t = add3(t, (y * f[2] + z * f[1], z * f[0] + x * f[2], x * f[1] + y * f[0]))
    put_angular(parent.sizes, add3(get_angular(parent.sizes), t))


@compile_inline
def _shift_rows(rows, first, end, arm):
    """Take the rows of a link's subtree to another origin."""
    tail = first + ((end - first) & -WIDTH)
    for b in range(first, tail, WIDTH):
        for c in range(0, 18, 6):
            put_rows3(rows, c + 3, b, add3(rows3(rows, c + 3, b), cross(arm, rows3(rows, c, b))))
    for r in range(tail, end):
        for c in range(0, 18, 6):
            t = cross(arm, (rows[c, r], rows[c + 1, r], rows[c + 2, r]))
            rows[c + 3, r] += t[0]
            rows[c + 4, r] += t[1]
            rows[c + 5, r] += t[2]


@compile_inline
def _shift_inertia(frame, parent, arm):
    """Add a composite inertia, and its derivative by the spin, to that of the parent."""
    m, s, J = frame.mass, get3(frame.first_moment), get6(frame.inertia)
    half = combined(1.0, s, 0.5 * m, arm)
    both = 2.0 * dot3(arm, half)
    x, y, z = arm
    parent.mass += m
    put3(parent.first_moment, add3(get3(parent.first_moment), axpy3(s, m, arm)))
    moved = (
        J[0] + both - 2.0 * x * half[0],
        J[1] - x * half[1] - y * half[0],
        J[2] - x * half[2] - z * half[0],
        J[3] + both - 2.0 * y * half[1],
        J[4] - y * half[2] - z * half[1],
        J[5] + both - 2.0 * z * half[2],
    )
    put6(parent.inertia, add6(get6(parent.inertia), moved))
    for c in range(3):
        f = frame.gyro[c], frame.gyro[3 + c], frame.gyro[6 + c]
        t = cross(arm, f)
        for r in range(3):
            parent.gyro[3 * r + c] += f[r]
            parent.gyro[9 + 3 * r + c] += frame.gyro[9 + 3 * r + c] + t[r]


@compile_kernel
def _parent_modes(model, data, work, i, arm, K, D, M):
    """Add the entries between the modes of link i's parent and all that link i carries, and the parts of their rows."""
    link, frame = model.links[i], work.frames[i]
    p = link.parent
    n, uq = model.links[p].modes, model.links[p].uq
    columns, each = work.modes.turns.columns[link.phi], work.modes.columns
    _transpose(columns, each, n)
    for b in range(frame.first, frame.end, WIDTH):
        of = _rows(work.rows, b)
        a = 0
        if b + WIDTH <= frame.end and work.straight[b]:
            while a + WIDTH <= n:
                _four_entries(work, b, of, each, a, uq, K, D, M)
                a += WIDTH
        while a < n:
            _entries(work, b, frame.end, of, each[a], uq + a, K, D, M)
            a += 1
    base = get9(data.links[p].orientation)
    r = add3(free_position(model, p, link.interface), get3(work.modes.bends.p[link.phi]))
    to_end = times(base, r)
    rest = sub3(arm, to_end)
    f = get3(frame.wrench)
    t = add3(get_angular(frame.wrench), cross(rest, f))
    _own_rows(frame, columns, work.modes.own, n)
    _mode_block(model, work, p)
    _add_modal_forces(model, work, i)
    out = work.modes.bodies.by_q[model.links[p].slot, 6:]
    f_own, t_own = transposed_times(base, f), transposed_times(base, t)
    add_turn_curvature(model, work.modes, p, link.interface, link.phi, f_own, t_own, out)
    _add_mode_rows(work, p, n, columns, arm, to_end, rest, f, t)


@compile_inline
def _add_modal_forces(model, work, i):
    """Add what the wrench of link i does on the modes of its parent."""
    link, frame = model.links[i], work.frames[i]
    s = model.links[link.parent].slot
    for a in range(model.links[link.parent].modes):
        J = take6(work.modes.columns[a], 0)
        work.modes.bodies.force[s, 6 + a] += dot6(J, get6(frame.wrench))
        work.modes.bodies.size[s, a] += _absolute(J, get6(frame.sizes))


@compile_inline
def _transpose(columns, each, n):
    """Write columns of modes (24, n) mode by mode: compiled code reads numbers that follow each other fast."""
    for b in range(0, n, WIDTH):
        for c in range(0, 24, WIDTH):
            x = transposed_lanes(
                get_lanes(columns[c], b),
                get_lanes(columns[c + 1], b),
                get_lanes(columns[c + 2], b),
                get_lanes(columns[c + 3], b),
            )
            put_lanes(each[b], c, x[0])
            put_lanes(each[b + 1], c, x[1])
            put_lanes(each[b + 2], c, x[2])
            put_lanes(each[b + 3], c, x[3])


@compile_inline
def _own_rows(frame, columns, own, n):
    """Write the rows of the parent's modes at a link."""
    for b in range(0, n, WIDTH):
        J = rows3(columns, 0, b), rows3(columns, 3, b)
        by_x = rows3(columns, 12, b), rows3(columns, 15, b)
        by_u = rows3(columns, 18, b), rows3(columns, 21, b)
        x, u, m, spin = _changes(frame, J, rows3(columns, 9, b), by_x, by_u)
        put_rows3(own, 0, b, x[0])
        put_rows3(own, 3, b, x[1])
        put_rows3(own, 6, b, u[0])
        put_rows3(own, 9, b, u[1])
        put_rows3(own, 12, b, m[0])
        put_rows3(own, 15, b, m[1])
        put_rows3(own, 18, b, spin)


@compile_inline
def _mode_block(model, work, p):
    """Add what the modes of link p feel of each other through a link that it carries."""
    own, bodies = work.modes.own, work.modes.bodies
    s, n = model.links[p].slot, model.links[p].modes
    for b in range(0, n, WIDTH):
        x, u, m = rows6(own, 0, b), rows6(own, 6, b), rows6(own, 12, b)
        for a in range(n):
            J = take6(work.modes.columns[a], 0)
            put_lanes(bodies.by_q[s, 6 + a], b, get_lanes(bodies.by_q[s, 6 + a], b) + dot6(J, x))
            put_lanes(bodies.by_qd[s, 6 + a], b, get_lanes(bodies.by_qd[s, 6 + a], b) + dot6(J, u))
            put_lanes(bodies.by_qdd[s, a], b, get_lanes(bodies.by_qdd[s, a], b) + dot6(J, m))


@compile_inline
def _add_mode_rows(work, p, n, columns, arm, to_end, rest, f, t):
    """Add the rows of the parent's modes at a link to those at the parent; the wrench turns with the interface."""
    rows, own, first = work.rows, work.modes.own, work.frames[p].modes
    for b in range(0, n, WIDTH):
        place = first + b
        turn = rows3(columns, 3, b)
        moved = sub3(rows3(columns, 0, b), cross(turn, rest))
        force = cross(turn, f)
        torque = add3(add3(cross(turn, t), cross(moved, f)), cross(to_end, force))
        _add_rows(rows, 0, place, force, torque)
        for c in range(0, 18, 6):
            x = rows3(own, c, b)
            _add_rows(rows, c, place, x, add3(rows3(own, c + 3, b), cross(arm, x)))
        put_rows3(rows, 18, place, add3(rows3(rows, 18, place), rows3(own, 18, b)))


@compile_inline
def _add_rows(rows, c, b, f, t):
    """Add forces and torques to four rows."""
    put_rows3(rows, c, b, add3(rows3(rows, c, b), f))
    put_rows3(rows, c + 3, b, add3(rows3(rows, c + 3, b), t))
