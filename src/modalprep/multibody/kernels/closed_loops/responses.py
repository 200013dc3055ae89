"""What unit multipliers of all rows do in the recursion: ``G M^-1 G^T`` in one pass from the tips to the root.

A multiplier is a force on the ends of its row, which the recursion hands from link to link towards the ground as it
does with bias forces (theory 5.4): eliminated modes and joints leave less of it, by what they yield. What they yield to
one row moves another, and all of that together is ``G M^-1 G^T``. Only links between a row's ends and the ground have a
part in it.

Arguments as in constraints.py.
"""

from __future__ import annotations

from modalprep.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.matrices import inertia_times, times, transposed_times
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO6,
    add3,
    add6,
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

WIDE = 16  # rows at a link from which on vector instructions pay


@compile_kernel
def respond(cons, model, data, work, tau):
    """Write `S` and `free`, after `constraint_residual` and an `inward` with joint forces ``tau (nu,)``."""
    _act_on_ends(cons, model, data, work)
    work.S[:] = 0.0
    for i in range(len(model.links) - 1, -1, -1):
        begin, end = work.paths.first[i], work.paths.first[i + 1]
        if begin == end:
            continue
        condense_rows(data.modal, model, i, begin, end, work)
        joint = model.links[i].joint
        if joint == SPHERICAL or joint == FREE:
            _through_several(model, data, work, i, begin, end, tau)
        else:
            _through_one(model, data, work, i, begin, end, tau)
    for i in range(len(work.free)):
        for j in range(i):
            work.S[j, i] = work.S[i, j]


@compile_kernel
def _act_on_ends(cons, model, data, work):
    """Let all rows push their ends."""
    work.force[:] = 0.0
    work.modal[:] = 0.0
    for i in range(len(cons.rows)):
        work.free[i] = 0.0
        if cons.rows[i].kind != COUPLER:
            f = get3(work.lines[i].force)
            _act_on_end(cons, model, data, work, i, 0, cons.rows[i].a, (-f[0], -f[1], -f[2]), work.lines[i].torque_a)
            _act_on_end(cons, model, data, work, i, 1, cons.rows[i].b, f, work.lines[i].torque_b)


@compile_inline
def _act_on_end(cons, model, data, work, i, side, k, f, torque):
    p, link = work.paths.ends[i, side], cons.ends[k].link
    if p < 0:
        work.free[i] += dot3(f, carried(data, get3(cons.ends[k].position), (0.0, 0.0, 0.0)))
        return
    base, bias = get9(data.links[link].orientation), get6(work.ends[k].bias)
    f, t = transposed_times(base, f), transposed_times(base, get3(torque))
    work.free[i] += dot6((f[0], f[1], f[2], t[0], t[1], t[2]), bias)
    for a in range(model.links[link].modes):
        work.modal[p, a] += dot6((f[0], f[1], f[2], t[0], t[1], t[2]), get6(work.shape[k, a]))
    t = add3(t, cross(get3(work.ends[k].arm), f))
    put6(work.force[p], add6(get6(work.force[p]), (f[0], f[1], f[2], t[0], t[1], t[2])))


@compile_inline
def _through_one(model, data, work, i, begin, end, tau):
    """Let a joint of one axis, or of none, yield to the forces of its link's rows, and hand the rest to the parent."""
    link, own, entries = model.links[i], data.links[i], work.paths.entries
    f, t = column(link, get6(own.M), get9(own.H), get6(own.J))
    g, speed, held = 0.0, 0.0, (f[0], f[1], f[2], t[0], t[1], t[2])
    if link.joint == REVOLUTE or link.joint == SLIDING:
        g = own.pivot[0]
        speed = g * (tau[link.u] - along_axis(link, get6(own.force)))
    turn, arm, bias, drive = get9(own.rotation), get3(own.arm), get6(own.bias), work.drive[begin:end]
    for p in range(begin, end):
        force = get6(work.force[p])
        e = along_axis(link, force) + entries[p].factor
        drive[p - begin] = e
        _hand_on(model, data, work, i, p, axpy6(force, -g * e, held), e * speed, turn, arm, bias)
    if g > 0.0:
        first, many = entries[begin].row, end - begin
        if many >= WIDE and entries[end - 1].row - first == many - 1:  # none between them is missing
            for p in range(many):
                _add_to_row(work.S[first + p, first : first + p + 1], g * drive[p], drive)
        else:
            for p in range(begin, end):
                for q in range(begin, p + 1):
                    work.S[entries[p].row, entries[q].row] += g * work.drive[p] * work.drive[q]


@compile_kernel
def _through_several(model, data, work, i, begin, end, tau):
    """Do as `_through_one` with a joint of several axes."""
    link, own, entries = model.links[i], data.links[i], work.paths.entries
    turn, arm, bias, M, H, J = get9(own.rotation), get3(own.arm), get6(own.bias), get6(own.M), get9(own.H), get6(own.J)
    speeds = speeds_from_bias(link, own, get6(own.force), tau)
    for p in range(begin, end):
        force = get6(work.force[p])
        x = speeds_from_bias(link, own, sub6(ZERO6, force), work.tau)
        for q in range(begin, p + 1):
            work.S[entries[p].row, entries[q].row] += dot6(x, get6(work.force[q]))
        left = sub6(force, inertia_times(M, H, J, x))
        _hand_on(model, data, work, i, p, left, dot6(force, speeds), turn, arm, bias)


@compile_inline
def _hand_on(model, data, work, i, p, force, free, turn, arm, bias):
    """Hand to the parent what is left of entry p's force, which counts with the bias of link i in `free`."""
    f, t = times(turn, (force[0], force[1], force[2])), times(turn, (force[3], force[4], force[5]))
    free, up = free + dot6(force, bias), work.paths.entries[p].up
    if up < 0:
        free += dot3(f, get3(data.links[len(model.links)].acceleration))
    else:
        add_row_to_modes(data.modal, model, i, f, t, work.modal[up])
        t = add3(t, cross(arm, f))
        put6(work.force[up], add6(get6(work.force[up]), (f[0], f[1], f[2], t[0], t[1], t[2])))
    work.free[work.paths.entries[p].row] += free


@compile_inline
def _add_to_row(row, f, e):
    """Add ``f e`` to the beginning of a row of `S`."""
    for q in range(len(row)):
        row[q] += f * e[q]


@compile_kernel
def push(model, data, work):
    """Add the multipliers to the bias forces of the last `inward`, and to ``work.tau``, for `forward`."""
    entries = work.paths.entries
    for i in range(len(model.links)):
        total = get6(data.links[i].force)
        for p in range(work.paths.first[i], work.paths.first[i + 1]):
            f = work.multiplier[entries[p].row]
            if f != 0.0:  # that of redundant rows is zero
                total = axpy6(total, -f, get6(work.force[p]))
                push_bias_of_modes(data.modal, model, i, f, work.modal[p])
                if entries[p].factor != 0.0:
                    work.tau[model.links[i].u] += f * entries[p].factor
        put6(data.links[i].force, total)


@compile_kernel
def yield_to_multipliers(model, data, work):
    """Write what the multipliers alone accelerate, ``M^-1 G^T multiplier``, to ``work.step (nu,)``."""
    for i in range(len(model.links)):
        put6(data.links[i].force, ZERO6)
    clear_bias_of_modes(data.modal, model)
    push(model, data, work)
    forward_bias(model, data, work.tau, work.step)
    work.tau[:] = 0.0
