"""``S = G M^-1 G^T`` of all rows in one pass from the tips to the root (theory 5.4).

A unit multiplier exerts forces on the ends of its row. They pass from link to link towards the ground as bias forces
do in `inward`: the elimination of modes and joints leaves a part of them, and the products of the eliminated forces
add up to S. Only the links between the ends of a row and the ground contribute.

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
    unsigned,
)
from modalprep.multibody.kernels.articulated_body import inward, inward_link
from modalprep.multibody.kernels.closed_loops.constraints import ABOUT, ANGLE, COUPLER
from modalprep.multibody.kernels.closed_loops.products import (
    add_coupling,
    add_outer_product,
    clear_responses,
    free_joint_response,
)
from modalprep.multibody.kernels.interfaces import carried
from modalprep.multibody.kernels.joints import along_axis, column, speeds_from_bias
from modalprep.multibody.kernels.modal import (
    add_row_to_modes,
    condense_rows,
)
from modalprep.multibody.model.joint_types import FREE, SPHERICAL


@compile_kernel
def inward_with_rows(cons, model, data, work, tau, added, c1, c2):
    """Do as `inward`, and write S and `free` of the bundles; returns the status of `inward`.

    After `constraint_residual`. `cons` and `work` may be None. Arguments from `tau` on as of `inward`.
    """
    if cons is None:
        return inward(model, data, tau, added, c1, c2)
    _unit_forces(cons, model, data, work)
    p = 0
    count = len(work.entries)
    for i in range(len(model.links) - 1, -1, -1):
        if not inward_link(model, data, i, tau, added, c1, c2):
            return i
        while p < count and work.paths.entries[unsigned(p)].link == i:
            _eliminate_link(model, data, work, p, tau)
            p += 1
    return -1


@compile_inline
def _eliminate_link(model, data, work, p, tau):
    """Eliminate the modes and the joint of a link from the forces of its entry p, and add the rest to the parent's."""
    entry = work.paths.entries[unsigned(p)]
    if p == entry.begin:
        condense_rows(data.modal, model, entry.link, p, entry.end, work)
    joint = model.links[unsigned(entry.link)].joint
    if joint == SPHERICAL:
        _eliminate_spherical(model, data, work, p, tau)
    elif joint == FREE:
        _eliminate_free(model, data, work, p, tau)
    else:
        _eliminate_axis(model, data, work, p, tau)


@compile_kernel
def gather_responses(work):
    """Write `S`, with the compliance of rows, and `free` from the bundles, after `inward_with_rows`."""
    for p in range(len(work.between)):
        one = work.paths.bundles[unsigned(p)]
        free = work.bundles[unsigned(p)].free
        for k in range(one.count):
            i = unsigned(one.rows[unsigned(k)])
            row = work.S[i]
            work.free[i] = free[unsigned(k)]
            for q in range(p + 1):
                S = work.bundles[unsigned(p)].S if p == q else work.between[unsigned(p), unsigned(q)].S
                other = work.paths.bundles[unsigned(q)]
                for c in range(other.count):
                    j = unsigned(other.rows[unsigned(c)])
                    row[j] = work.S[j, i] = S[unsigned(4 * k + c)]
            row[i] += work.compliance[i]


@compile_inline
def _unit_forces(cons, model, data, work):
    """Write the forces of unit multipliers of all rows on the links of their ends."""
    clear_responses(work)
    for k in range(work.paths.movable):
        group = work.paths.groups[unsigned(k)]
        if group.bundle >= 0 and group.kind != COUPLER:
            line = work.groups[unsigned(k)].line
            total = work.bundles[unsigned(group.bundle)].free
            f = get_lanes3(line, 0)
            torque = group.kind == ANGLE or group.kind == ABOUT
            entry, adds = group.entry_b, group.accumulates_b
            _force_on_end(cons, model, data, work, total, entry, adds, group.b, f, line, 24, torque)
            f = (-1.0 * f[0], -1.0 * f[1], -1.0 * f[2])
            entry, adds = group.entry_a, group.accumulates_a
            _force_on_end(cons, model, data, work, total, entry, adds, group.a, f, line, 12, True)


@compile_inline
def _force_on_end(cons, model, data, work, total, p, accumulates, end, f, line, c, torque):
    """Write forces f on an end, with torques from number c of `line` on if `torque`, to entry p, the link of the end.

    They are added to those of other ends if it `accumulates`; `total` is the `free` of the bundle.
    """
    own = work.ends[unsigned(end)]
    free = get_lanes(total, 0)
    if p < 0:
        put_lanes(total, 0, free + dot3(f, carried(data, get3(own.position), ZERO3)))
        return
    p = unsigned(p)
    link = unsigned(cons.ends[unsigned(end)].link)
    base = get9(data.links[link].orientation)
    force = work.entries[p].force
    f = transposed_times(base, f)
    none = four(0.0)
    t = transposed_times(base, get_lanes3(line, c)) if torque else (none, none, none)
    wrench = (f[0], f[1], f[2], t[0], t[1], t[2])
    put_lanes(total, 0, free + dot6(wrench, get6(own.bias)))
    for k in range(model.links[link].modes):
        a = unsigned(k)
        forces = work.modal[p]
        own_force = dot6(wrench, get6(work.shape[unsigned(end), a]))
        put_lanes(forces, 4 * a, get_lanes(forces, 4 * a) + own_force if accumulates else own_force)
    t = add3(t, cross(get3(own.arm), f))
    wrench = (f[0], f[1], f[2], t[0], t[1], t[2])
    if accumulates:
        wrench = add6(get_lanes6(force), wrench)
    put_lanes6(force, wrench)


@compile_inline
def _eliminate_axis(model, data, work, p, tau):
    """Eliminate a joint of one axis, or of none, from the forces of entry p."""
    entry, mine = work.paths.entries[unsigned(p)], work.entries[unsigned(p)]
    i = unsigned(entry.link)
    link, own = model.links[i], data.links[i]
    force = get_lanes6(mine.force)
    free = four(0.0)
    if entry.u >= 0:
        g = own.pivot[0]
        f, t = column(link, own.M, own.H, own.J)
        e = along_axis(link, force) + entry.factor
        put_lanes(mine.joint_force, 0, e)
        force = axpy6(force, -g * e, (f[0], f[1], f[2], t[0], t[1], t[2]))
        free = e * (g * (tau[unsigned(entry.u)] - along_axis(link, get6(own.force))))
        add_outer_product(work.bundles[unsigned(entry.bundle)].S, entry.count, mine.joint_force, g * e)
        if p > entry.begin:
            add_coupling(work, p, g)
    _add_to_parent(model, data, work, i, entry, force, free, get9(own.rotation), get3(own.arm), get6(own.bias))


@compile_kernel
def _eliminate_spherical(model, data, work, p, tau):
    """Eliminate a spherical joint from the forces of entry p."""
    entry = work.paths.entries[unsigned(p)]
    i = unsigned(entry.link)
    link, own = model.links[i], data.links[i]
    force = get_lanes6(work.entries[unsigned(p)].force)
    turn = symmetric_times(get6(own.pivot), (force[3], force[4], force[5]))
    put_lanes3(work.speeds, 0, turn)
    for q in range(entry.begin, p + 1):
        other = work.paths.entries[unsigned(q)].bundle
        S = work.bundles[unsigned(other)].S if q == p else work.between[unsigned(entry.bundle), unsigned(other)].S
        t = get_lanes3(work.entries[unsigned(q)].force, 12)
        for k in range(entry.count):
            x = work.speeds[unsigned(k)], work.speeds[unsigned(k + WIDTH)], work.speeds[unsigned(k + 2 * WIDTH)]
            put_lanes(S, WIDTH * k, get_lanes(S, WIDTH * k) + dot3(t, x))
    free = dot3(turn, sub3(take3(tau, link.u), get_angular(own.force)))
    f = sub3((force[0], force[1], force[2]), times(get9(own.H), turn))
    t = sub3((force[3], force[4], force[5]), symmetric_times(get6(own.J), turn))
    force = (f[0], f[1], f[2], t[0], t[1], t[2])
    _add_to_parent(model, data, work, i, entry, force, free, get9(own.rotation), get3(own.arm), get6(own.bias))


@compile_kernel
def _eliminate_free(model, data, work, p, tau):
    """Eliminate a free joint from the forces of entry p."""
    entry = work.paths.entries[unsigned(p)]
    i = unsigned(entry.link)
    link, own = model.links[i], data.links[i]
    turn = get9(own.rotation)
    arm = get3(own.arm)
    bias = get6(own.bias)
    M = get6(own.M)
    H = get9(own.H)
    J = get6(own.J)
    speeds = speeds_from_bias(link, own, get6(own.force), tau)
    force = get_lanes6(work.entries[p].force)
    x = free_joint_response(own, work.speeds, force)  # in `speeds` too
    for k in range(entry.count):
        x_k = get_lane6(work.speeds, unsigned(k))
        for q in range(entry.begin, p + 1):
            other = work.paths.entries[unsigned(q)].bundle
            S = work.bundles[unsigned(other)].S if q == p else work.between[unsigned(entry.bundle), unsigned(other)].S
            f = get_lanes6(work.entries[unsigned(q)].force)
            put_lanes(S, 4 * k, get_lanes(S, 4 * k) + dot6(f, x_k))
    rest = sub6(force, inertia_times(M, H, J, x))
    _add_to_parent(model, data, work, i, entry, rest, dot6(force, speeds), turn, arm, bias)


@compile_inline
def _add_to_parent(model, data, work, i, entry, force, free, turn, arm, bias):
    """Add the rest of an entry's force to the parent's entry, and its product with the bias of link i to `free`."""
    f = times(turn, (force[0], force[1], force[2]))
    t = times(turn, (force[3], force[4], force[5]))
    total = work.bundles[unsigned(entry.bundle)].free
    free += get_lanes(total, 0) + dot6(force, bias)
    if entry.parent < 0:
        free += dot3(f, get3(data.links[unsigned(len(model.links))].acceleration))
    else:
        add_row_to_modes(data.modal, model, i, f, t, work.modal, entry)
        t = add3(t, cross(arm, f))
        up = work.entries[unsigned(entry.parent)].force
        force = (f[0], f[1], f[2], t[0], t[1], t[2])
        if entry.accumulates:
            force = add6(get_lanes6(up), force)
        put_lanes6(up, force)
    put_lanes(total, 0, free)
