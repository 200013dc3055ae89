"""What unit multipliers of all rows do in the recursion: ``G M^-1 G^T`` in one pass from the tips to the root.

A multiplier is a force on the ends of its row, which the recursion hands from link to link towards the ground as it
does with bias forces (theory 5.4): eliminated modes and joints leave less of it, by what they yield. What they yield to
one row moves another, and all of that together is ``G M^-1 G^T``. Only links between a row's ends and the ground have a
part in it.

Arguments as in constraints.py.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import (
    WIDTH,
    four,
    get_lane6,
    get_lanes,
    get_lanes3,
    get_lanes6,
    put_lanes,
    put_lanes3,
    put_lanes6,
)
from modalprep.multibody.kernels.algebra.matrices import inertia_times, symmetric_times, times, transposed_times
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    add6,
    at,
    axpy6,
    cross,
    dot3,
    dot6,
    get3,
    get6,
    get9,
    get_angular,
    sub3,
    sub6,
    take3,
)
from modalprep.multibody.kernels.articulated_body import inward_link
from modalprep.multibody.kernels.closed_loops.constraints import COUPLER
from modalprep.multibody.kernels.closed_loops.products import (
    add_other_products,
    add_products,
    clear,
    yielded_to_free,
    zeros,
)
from modalprep.multibody.kernels.data import FREE, REVOLUTE, SLIDING, SPHERICAL
from modalprep.multibody.kernels.interfaces import carried
from modalprep.multibody.kernels.joints import along_axis, column, speeds_from_bias
from modalprep.multibody.kernels.modal import (
    add_row_to_modes,
    condense_rows,
)


@compile_kernel
def respond(cons, model, data, work, tau):
    """Write the responses of the bundles, after `constraint_residual` and an `inward` with joint forces ``tau (nu,)``.

    See `write_responses`.
    """
    _act_on_ends(cons, model, data, work)
    for p in range(len(work.entries)):
        _through_link(model, data, work, p, tau)


@compile_kernel
def inward_and_respond(cons, model, data, work, tau, more, c1, c2):
    """Do as `inward`, then as `respond`, link by link: each waits for its own numbers; returns the status of `inward`.

    `constraint_residual` goes before, but that of planar loops.
    """
    if not work.flat[0]:
        _act_on_ends(cons, model, data, work)
    p = 0
    count = len(work.entries)
    for i in range(len(model.links) - 1, -1, -1):
        if not inward_link(model, data, i, tau, more, c1, c2):
            return i
        while p < count and work.paths.entries[at(p)].link == i:
            _through_link(model, data, work, p, tau)
            p += 1
    return -1


@compile_inline
def _through_link(model, data, work, p, tau):
    """Let the modes and the joint of a link yield to the forces of its entry p, and hand the rest to the parent."""
    entry = work.paths.entries[at(p)]
    if p == entry.begin:
        condense_rows(data.modal, model, entry.link, p, entry.end, work)
    if model.links[at(entry.link)].joint == REVOLUTE:
        _through_hinge(model, data, work, p, tau)
    else:
        _through_joint(model, data, work, p, tau)


@compile_kernel
def write_responses(work):
    """Write `S`, with the compliance of rows, and `free`, as they stand in the bundles after `respond`."""
    for p in range(len(work.between)):
        one = work.paths.bundles[at(p)]
        free = work.bundles[at(p)].free
        for k in range(one.count):
            i = at(one.rows[at(k)])
            row = work.S[i]
            work.free[i] = free[at(k)]
            for q in range(p + 1):
                S = work.bundles[at(p)].S if p == q else work.between[at(p), at(q)].S
                other = work.paths.bundles[at(q)]
                for c in range(other.count):
                    j = at(other.rows[at(c)])
                    row[j] = work.S[j, i] = S[at(4 * k + c)]
            row[i] += work.compliance[i]


@compile_inline
def _act_on_ends(cons, model, data, work):
    """Let all rows push their ends."""
    for k in range(1, len(work.bundles)):
        for q in range(k):
            clear(work, work.between[at(k), at(q)].S)
    for k in range(work.paths.moving):
        group = work.paths.groups[at(k)]
        line = work.groups[at(k)].line
        if group.first:
            put_lanes(work.bundles[at(group.bundle)].free, 0, zeros(work))
            clear(work, work.bundles[at(group.bundle)].S)
        if group.bundle >= 0 and group.kind != COUPLER:
            f = get_lanes3(line, 0)
            total = work.bundles[at(group.bundle)].free
            _act_on_end(cons, model, data, work, total, group.at_b, group.adds_b, group.b, f, line, 24, group.turning)
            f = (-1.0 * f[0], -1.0 * f[1], -1.0 * f[2])
            _act_on_end(cons, model, data, work, total, group.at_a, group.adds_a, group.a, f, line, 12, True)


@compile_inline
def _act_on_end(cons, model, data, work, total, p, adds, end, f, line, c, turning):
    """Let rows of a bundle push an end at entry p by forces, and by torques from number c of `line` on if `turning`.

    Others did so before if it `adds`; `total` is the `free` of the bundle.
    """
    own = work.ends[at(end)]
    free = get_lanes(total, 0)
    if p < 0:
        put_lanes(total, 0, free + dot3(f, carried(data, get3(own.position), ZERO3)))
        return
    p = at(p)
    link = at(cons.ends[at(end)].link)
    base = get9(data.links[link].orientation)
    force = work.entries[p].force
    f = transposed_times(base, f)
    none = four(0.0)
    t = transposed_times(base, get_lanes3(line, c)) if turning else (none, none, none)
    wrench = (f[0], f[1], f[2], t[0], t[1], t[2])
    put_lanes(total, 0, free + dot6(wrench, get6(own.bias)))
    for k in range(model.links[link].modes):
        a = at(k)
        forces = work.modal[p]
        own_force = dot6(wrench, get6(work.shape[at(end), a]))
        put_lanes(forces, 4 * a, get_lanes(forces, 4 * a) + own_force if adds else own_force)
    t = add3(t, cross(get3(own.arm), f))
    wrench = (f[0], f[1], f[2], t[0], t[1], t[2])
    if adds:
        wrench = add6(get_lanes6(force), wrench)
    put_lanes6(force, wrench)


@compile_inline
def _through_hinge(model, data, work, p, tau):
    """Let a revolute joint yield to the forces of entry p, and hand the rest to the parent."""
    entry, mine = work.paths.entries[at(p)], work.entries[at(p)]
    i = at(entry.link)
    own = data.links[i]
    g = data.links[i].pivot[0]
    force = get_lanes6(mine.force)
    e = force[5] + entry.factor
    H = own.H
    J = own.J
    put_lanes(mine.drive, 0, e)
    force = axpy6(force, -g * e, (H[2], H[5], H[8], J[2], J[4], J[5]))
    free = e * (g * (tau[at(entry.u)] - own.force[5]))
    _hand_on(model, data, work, i, entry, force, free, get9(own.rotation), get3(own.arm), get6(own.bias))
    add_products(work.bundles[at(entry.bundle)].S, entry.count, mine.drive, g * e)
    if p > entry.begin:
        add_other_products(work, p, g)


@compile_kernel
def _through_joint(model, data, work, p, tau):
    """Do as `_through_hinge` with a joint of another type."""
    i = at(work.paths.entries[at(p)].link)
    if model.links[i].joint == SPHERICAL:
        _through_ball(model, data, work, i, p, tau)
    elif model.links[i].joint == FREE:
        _through_free(model, data, work, i, p, tau)
    else:
        _through_one(model, data, work, i, p, tau)


@compile_inline
def _through_one(model, data, work, i, p, tau):
    """Do as `_through_hinge` with another joint of one axis, or of none."""
    link = model.links[i]
    own = data.links[i]
    g = 0.0
    speed = 0.0
    entry, mine = work.paths.entries[p], work.entries[p]
    if link.joint == SLIDING:
        g = own.pivot[0]
        speed = g * (tau[link.u] - along_axis(link, get6(own.force)))
    f, t = column(link, own.M, own.H, own.J)
    force = get_lanes6(mine.force)
    e = along_axis(link, force) + entry.factor
    put_lanes(mine.drive, 0, e)
    force = axpy6(force, -g * e, (f[0], f[1], f[2], t[0], t[1], t[2]))
    _hand_on(model, data, work, i, entry, force, e * speed, get9(own.rotation), get3(own.arm), get6(own.bias))
    if g > 0.0:
        add_products(work.bundles[entry.bundle].S, entry.count, mine.drive, g * e)
        add_other_products(work, p, g)


@compile_inline
def _through_ball(model, data, work, i, p, tau):
    """Do as `_through_hinge` with a spherical joint."""
    link = model.links[i]
    own = data.links[i]
    entry = work.paths.entries[at(p)]
    force = get_lanes6(work.entries[at(p)].force)
    turn = symmetric_times(get6(own.pivot), (force[3], force[4], force[5]))
    put_lanes3(work.speeds, 0, turn)
    for q in range(entry.begin, p + 1):
        other = work.paths.entries[at(q)].bundle
        S = work.bundles[at(other)].S if q == p else work.between[at(entry.bundle), at(other)].S
        t = get_lanes3(work.entries[at(q)].force, 12)
        for k in range(entry.count):
            x = work.speeds[at(k)], work.speeds[at(k + WIDTH)], work.speeds[at(k + 2 * WIDTH)]
            put_lanes(S, WIDTH * k, get_lanes(S, WIDTH * k) + dot3(t, x))
    free = dot3(turn, sub3(take3(tau, link.u), get_angular(own.force)))
    f = sub3((force[0], force[1], force[2]), times(get9(own.H), turn))
    t = sub3((force[3], force[4], force[5]), symmetric_times(get6(own.J), turn))
    force = (f[0], f[1], f[2], t[0], t[1], t[2])
    _hand_on(model, data, work, i, entry, force, free, get9(own.rotation), get3(own.arm), get6(own.bias))


@compile_inline
def _through_free(model, data, work, i, p, tau):
    """Do as `_through_hinge` with a free joint."""
    link, own, entry = model.links[i], data.links[i], work.paths.entries[p]
    turn = get9(own.rotation)
    arm = get3(own.arm)
    bias = get6(own.bias)
    M = get6(own.M)
    H = get9(own.H)
    J = get6(own.J)
    speeds = speeds_from_bias(link, own, get6(own.force), tau)
    force = get_lanes6(work.entries[p].force)
    x = yielded_to_free(own, work.speeds, force)  # which it leaves in `speeds` too
    for k in range(entry.count):
        x_k = get_lane6(work.speeds, at(k))
        for q in range(entry.begin, p + 1):
            other = work.paths.entries[at(q)].bundle
            S = work.bundles[at(other)].S if q == p else work.between[at(entry.bundle), at(other)].S
            f = get_lanes6(work.entries[at(q)].force)
            put_lanes(S, 4 * k, get_lanes(S, 4 * k) + dot6(f, x_k))
    left = sub6(force, inertia_times(M, H, J, x))
    _hand_on(model, data, work, i, entry, left, dot6(force, speeds), turn, arm, bias)


@compile_inline
def _hand_on(model, data, work, i, entry, force, free, turn, arm, bias):
    """Hand to the parent what is left of an entry's force, which counts with the bias of link i in `free`."""
    f = times(turn, (force[0], force[1], force[2]))
    t = times(turn, (force[3], force[4], force[5]))
    total = work.bundles[at(entry.bundle)].free
    free += get_lanes(total, 0) + dot6(force, bias)
    if entry.up < 0:
        free += dot3(f, get3(data.links[at(len(model.links))].acceleration))
    else:
        add_row_to_modes(data.modal, model, i, f, t, work.modal, entry)
        t = add3(t, cross(arm, f))
        up = work.entries[at(entry.up)].force
        force = (f[0], f[1], f[2], t[0], t[1], t[2])
        if entry.adds:
            force = add6(get_lanes6(up), force)
        put_lanes6(up, force)
    put_lanes(total, 0, free)
