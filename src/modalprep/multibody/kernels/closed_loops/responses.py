"""What unit multipliers of all rows do in the recursion: ``G M^-1 G^T`` in one pass from the tips to the root.

A multiplier is a force on the ends of its row, which the recursion hands from link to link towards the ground as it
does with bias forces (theory 5.4): eliminated modes and joints leave less of it, by what they yield. What they yield to
one row moves another, and all of that together is ``G M^-1 G^T``. Only links between a row's ends and the ground have a
part in it.

Arguments as in constraints.py.
"""

from __future__ import annotations

from modalprep.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.lanes import (
    WIDTH,
    add_lanes,
    four,
    get_lane6,
    get_lanes,
    get_lanes3,
    get_lanes6,
    lanes,
    put_lane6,
    put_lanes,
    put_lanes6,
)
from modalprep.multibody.kernels.algebra.matrices import inertia_times, times, transposed_times
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    ZERO6,
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
    put6,
    sub6,
)
from modalprep.multibody.kernels.articulated_body import forward_bias
from modalprep.multibody.kernels.closed_loops.constraints import COUPLER
from modalprep.multibody.kernels.data import FREE, REVOLUTE, SLIDING, SPHERICAL
from modalprep.multibody.kernels.interfaces import carried
from modalprep.multibody.kernels.joints import along_axis, column, speeds_from_bias
from modalprep.multibody.kernels.modal import (
    add_row_to_modes,
    clear_bias_of_modes,
    condense_rows,
    push_bias_of_modes,
)


@compile_kernel
def respond(cons, model, data, work, tau):
    """Write the responses of the bundles, after `constraint_residual` and an `inward` with joint forces ``tau (nu,)``.

    See `write_responses`.
    """
    _act_on_ends(cons, model, data, work)
    for k in range(len(model.links) - 1, -1, -1):
        i = at(k)
        begin, end = work.paths.first[i], work.paths.first[at(k + 1)]
        if begin == end:
            continue
        condense_rows(data.modal, model, i, begin, end, work)
        joint = model.links[i].joint
        if joint == SPHERICAL or joint == FREE:
            _through_several(model, data, work, i, begin, end, tau)
        else:
            _through_one(model, data, work, i, begin, end, tau)


@compile_kernel
def write_responses(work):
    """Write `S`, with the compliance of rows, and `free`, as they stand in the bundles after `respond`."""
    for p in range(len(work.between)):
        one, free = work.paths.bundles[at(p)], work.bundles[at(p)].free
        for k in range(one.count):
            i = at(one.rows[at(k)])
            row, work.free[i] = work.S[i], free[at(k)]
            for q in range(p + 1):
                other, S = work.paths.bundles[at(q)], work.between[at(p), at(q)].S
                for c in range(other.count):
                    j = at(other.rows[at(c)])
                    row[j] = work.S[j, i] = S[at(4 * k + c)]
            row[i] += work.compliance[i]


@compile_inline
def _act_on_ends(cons, model, data, work):
    """Let all rows push their ends."""
    none = _none(work)
    for k in range(len(work.bundles)):
        put_lanes(work.bundles[at(k)].free, 0, none)
        for q in range(k + 1):
            S = work.between[at(k), at(q)].S
            put_lanes(S, 0, none)
            put_lanes(S, 4, none)
            put_lanes(S, 8, none)
            put_lanes(S, 12, none)
    for k in range(work.paths.moving):
        _clear(work, work.paths.groups[at(k)].at_a)
        _clear(work, work.paths.groups[at(k)].at_b)
    for k in range(work.paths.moving):
        group, line = work.paths.groups[at(k)], work.groups[at(k)].line
        if group.bundle >= 0 and group.kind != COUPLER:
            f, total = get_lanes3(line, 0), work.bundles[at(group.bundle)].free
            _act_on_end(cons, model, data, work, total, group.at_b, group.b, f, get_lanes3(line, 24))
            f = (-1.0 * f[0], -1.0 * f[1], -1.0 * f[2])
            _act_on_end(cons, model, data, work, total, group.at_a, group.a, f, get_lanes3(line, 12))


@compile_inline
def _none(work):
    """Return zeros that the compiler does not know as such, so that it does not call the system to write them."""
    return four(work.tau[0])


@compile_inline
def _clear(work, p):
    """Take all forces off entry p."""
    none = _none(work)
    if p >= 0:
        put_lanes6(work.entries[at(p)].force, (none, none, none, none, none, none))
        for a in range(0, work.modal.shape[1], WIDTH):
            put_lanes(work.modal[p], a, none)


@compile_inline
def _act_on_end(cons, model, data, work, total, p, end, f, torque):
    """Let rows of a bundle, whose `free` is `total`, push an end at entry p."""
    link, own, free = cons.ends[at(end)].link, work.ends[at(end)], get_lanes(total, 0)
    if p < 0:
        put_lanes(total, 0, free + dot3(f, carried(data, get3(own.position), ZERO3)))
        return
    base, force = get9(data.links[at(link)].orientation), work.entries[at(p)].force
    f, t = transposed_times(base, f), transposed_times(base, torque)
    wrench = (f[0], f[1], f[2], t[0], t[1], t[2])
    put_lanes(total, 0, free + dot6(wrench, get6(own.bias)))
    for a in range(model.links[at(link)].modes):
        forces = work.modal[p]
        put_lanes(forces, 4 * a, get_lanes(forces, 4 * a) + dot6(wrench, get6(work.shape[end, a])))
    t = add3(t, cross(get3(own.arm), f))
    put_lanes6(force, add6(get_lanes6(force), (f[0], f[1], f[2], t[0], t[1], t[2])))


@compile_inline
def _through_one(model, data, work, i, begin, end, tau):
    """Let a joint of one axis, or of none, yield to the forces of its link's rows, and hand the rest to the parent."""
    link, own, g, speed = model.links[i], data.links[i], 0.0, 0.0
    if link.joint == REVOLUTE or link.joint == SLIDING:
        g = own.pivot[0]
        speed = g * (tau[link.u] - along_axis(link, get6(own.force)))
    if end == begin + 1:  # the common case, in which the loop would keep what is read once
        _through_axis(model, data, work, i, begin, end, g, speed)
    else:
        for p in range(begin, end):
            _through_axis(model, data, work, i, begin, p + 1, g, speed)


@compile_inline
def _through_axis(model, data, work, i, begin, end, g, speed):
    """Do as `_through_one` with the last of these entries; g is the inverse pivot, speed what the bias force gives."""
    link, own, p = model.links[i], data.links[i], end - 1
    entry, mine = work.paths.entries[at(p)], work.entries[at(p)]
    f, t = column(link, own.M, own.H, own.J)
    force = get_lanes6(mine.force)
    e = along_axis(link, force)
    if entry.factor != 0.0:
        e += entry.factor
    put_lanes(mine.drive, 0, e)
    force = axpy6(force, -g * e, (f[0], f[1], f[2], t[0], t[1], t[2]))
    _hand_on(model, data, work, i, entry, force, e * speed, get9(own.rotation), get3(own.arm), get6(own.bias))
    if g > 0.0:
        for q in range(begin, end):
            _add_products(work, entry.bundle, mine.drive, q, g)


@compile_inline
def _add_products(work, a, drive, q, g):
    """Add ``g drive drive_q^T`` to the responses of the rows of bundle a to those of entry q."""
    S, v = work.between[at(a), at(work.paths.entries[at(q)].bundle)].S, g * get_lanes(work.entries[at(q)].drive, 0)
    count = work.paths.bundles[at(a)].count
    put_lanes(S, 0, get_lanes(S, 0) + drive[0] * v)
    if count > 1:
        put_lanes(S, 4, get_lanes(S, 4) + drive[1] * v)
    if count > 2:
        put_lanes(S, 8, get_lanes(S, 8) + drive[2] * v)
        put_lanes(S, 12, get_lanes(S, 12) + drive[3] * v)


@compile_kernel
def _through_several(model, data, work, i, begin, end, tau):
    """Do as `_through_one` with a joint of several axes."""
    link, own, entries = model.links[i], data.links[i], work.paths.entries
    turn, arm, bias, M, H, J = get9(own.rotation), get3(own.arm), get6(own.bias), get6(own.M), get9(own.H), get6(own.J)
    speeds = speeds_from_bias(link, own, get6(own.force), tau)
    for p in range(begin, end):
        force, a = get_lanes6(work.entries[p].force), entries[p].bundle
        for k in range(work.paths.bundles[a].count):
            x = speeds_from_bias(link, own, sub6(ZERO6, get_lane6(work.entries[p].force, k)), work.tau)
            put_lane6(work.speeds, k, x)
            for q in range(begin, p + 1):
                S, other = work.between[a, entries[q].bundle].S, get_lanes6(work.entries[q].force)
                put_lanes(S, 4 * k, get_lanes(S, 4 * k) + dot6(other, x))
        left = sub6(force, inertia_times(M, H, J, get_lanes6(work.speeds)))
        _hand_on(model, data, work, i, entries[p], left, dot6(force, speeds), turn, arm, bias)


@compile_inline
def _hand_on(model, data, work, i, entry, force, free, turn, arm, bias):
    """Hand to the parent what is left of an entry's force, which counts with the bias of link i in `free`."""
    f, t = times(turn, (force[0], force[1], force[2])), times(turn, (force[3], force[4], force[5]))
    total = work.bundles[at(entry.bundle)].free
    free += get_lanes(total, 0) + dot6(force, bias)
    if entry.up < 0:
        free += dot3(f, get3(data.links[at(len(model.links))].acceleration))
    else:
        add_row_to_modes(data.modal, model, i, f, t, work.modal, entry)
        t, up = add3(t, cross(arm, f)), work.entries[at(entry.up)].force
        force = (f[0], f[1], f[2], t[0], t[1], t[2])
        if entry.adds:
            force = add6(get_lanes6(up), force)
        put_lanes6(up, force)
    put_lanes(total, 0, free)


@compile_kernel
def push(model, data, work):
    """Add the multipliers to the bias forces of the last `inward` and to ``work.tau``, as far as `forward` reads them.

    Of a link behind a joint of one axis it reads the force along the axis alone; see `push_links`.
    """
    for b in range(len(work.bundles)):
        n, i, found = work.paths.bundles[at(b)].count, work.paths.bundles[at(b)].rows, work.multiplier
        y, z = found[at(i[1])] if n > 1 else 0.0, found[at(i[2])] if n > 2 else 0.0
        each = lanes(found[at(i[0])], y, z, found[at(i[3])] if n > 3 else 0.0)
        put_lanes(work.bundles[at(b)].multiplier, 0, each)
    for p in range(len(work.entries)):
        entry, own = work.paths.entries[at(p)], work.entries[at(p)]
        multiplier = get_lanes(work.bundles[at(entry.bundle)].multiplier, 0)
        if entry.u >= 0:
            work.tau[at(entry.u)] += add_lanes(multiplier * get_lanes(own.drive, 0))
        else:
            _push_link(data.links[entry.link].force, own.force, multiplier)
        _push_modes(model, data, work, p)


@compile_kernel
def push_links(data, work):
    """Add the multipliers to the bias forces that `push` left as they were, for what joints carry; work may be None."""
    if work is None:
        return
    for p in range(len(work.entries)):
        entry = work.paths.entries[p]
        if entry.u >= 0:
            multiplier = get_lanes(work.bundles[entry.bundle].multiplier, 0)
            _push_link(data.links[entry.link].force, work.entries[p].force, multiplier)


@compile_inline
def _push_link(force, own, multiplier):
    """Add the multipliers of an entry to the bias force of its link."""
    for c in range(6):
        force[c] -= add_lanes(multiplier * get_lanes(own, 4 * c))


@compile_inline
def _push_modes(model, data, work, p):
    """Add the multipliers of entry p to the bias forces of its link's modes."""
    entry = work.paths.entries[at(p)]
    if model.links[at(entry.link)].modes > 0:
        bundle = work.paths.bundles[entry.bundle]
        for k in range(bundle.count):
            push_bias_of_modes(data.modal, model, entry.link, work.multiplier[bundle.rows[k]], work.modal, p, k)


@compile_kernel
def yield_to_multipliers(model, data, work):
    """Write what the multipliers alone accelerate, ``M^-1 G^T multiplier``, to ``work.step (nu,)``."""
    for i in range(len(model.links)):
        put6(data.links[i].force, ZERO6)
    clear_bias_of_modes(data.modal, model)
    push(model, data, work)
    forward_bias(model, data, work.tau, work.step)
    work.tau[:] = 0.0
