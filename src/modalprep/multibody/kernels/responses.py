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
from modalprep.multibody.kernels.constraints import COUPLER
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
    """Write `S` and `free`, after `constraint_residual` and an `inward` with joint forces ``tau (nu,)``."""
    _act_on_ends(cons, model, data, work)
    work.S[:] = 0.0
    for i in range(len(model.links) - 1, -1, -1):
        begin, end = work.paths.first[i], work.paths.first[i + 1]
        if begin < end:
            condense_rows(data.modal, model, i, begin, end, work)
            _hand_on(model, data, work, i, begin, end, tau)
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


@compile_kernel
def _hand_on(model, data, work, i, begin, end, tau):
    """Eliminate the joint of link i from the forces of its rows, and hand what is left to the parent."""
    link, own, entries, ground = model.links[i], data.links[i], work.paths.entries, data.links[len(model.links)]
    P, turn, arm, bias = get6(own.force), get9(own.rotation), get3(own.arm), get6(own.bias)
    single = link.joint == REVOLUTE or link.joint == SLIDING
    several = link.joint == SPHERICAL or link.joint == FREE
    f, t = column(link, get6(own.M), get9(own.H), get6(own.J))
    held, g = (f[0], f[1], f[2], t[0], t[1], t[2]), own.pivot[0] if single else 0.0
    speed = g * (tau[link.u] - along_axis(link, P)) if single else 0.0
    speeds = speeds_from_bias(link, own, P, tau) if several else ZERO6
    for p in range(begin, end):
        force, free, up = get6(work.force[p]), work.free[entries[p].row], entries[p].up
        if single:
            e = along_axis(link, force) + entries[p].factor
            work.drive[p], free = e, free + e * speed
            force = axpy6(force, -g * e, held)
        elif several:
            x = speeds_from_bias(link, own, sub6(ZERO6, force), work.tau)
            for q in range(begin, p + 1):
                work.S[entries[p].row, entries[q].row] += dot6(x, get6(work.force[q]))
            free += dot6(force, speeds)
            force = sub6(force, inertia_times(own.M, own.H, own.J, x))
        free += dot6(force, bias)
        f, t = times(turn, (force[0], force[1], force[2])), times(turn, (force[3], force[4], force[5]))
        if up < 0:
            free += dot3(f, get3(ground.acceleration))
        else:
            add_row_to_modes(data.modal, model, i, f, t, work.modal[up])
            t = add3(t, cross(arm, f))
            put6(work.force[up], add6(get6(work.force[up]), (f[0], f[1], f[2], t[0], t[1], t[2])))
        work.free[entries[p].row] = free
    if single:
        _add_square(work, begin, end, g, work.drive)


@compile_inline
def _add_square(work, begin, end, g, e):
    """Add ``g e e'`` of the entries of a link to the lower half of `S`."""
    entries, first = work.paths.entries, work.paths.entries[begin].row
    if entries[end - 1].row - first == end - 1 - begin:
        for p in range(end - begin):
            f = g * e[begin + p]
            for q in range(p + 1):
                work.S[first + p, first + q] += f * e[begin + q]
        return
    for p in range(begin, end):
        for q in range(begin, p + 1):
            work.S[entries[p].row, entries[q].row] += g * e[p] * e[q]


@compile_kernel
def push(model, data, work):
    """Add the multipliers to the bias forces of the last `inward`, and to ``work.tau``, for `forward`."""
    entries = work.paths.entries
    for i in range(len(model.links)):
        for p in range(work.paths.first[i], work.paths.first[i + 1]):
            f = work.multiplier[entries[p].row]
            put6(data.links[i].force, axpy6(get6(data.links[i].force), -f, get6(work.force[p])))
            push_bias_of_modes(data.modal, model, i, f, work.modal[p])
            if entries[p].factor != 0.0:
                work.tau[model.links[i].u] += f * entries[p].factor


@compile_kernel
def yield_to_multipliers(model, data, work):
    """Write what the multipliers alone accelerate, ``M^-1 G^T multiplier``, to ``work.step (nu,)``."""
    for i in range(len(model.links)):
        put6(data.links[i].force, ZERO6)
    clear_bias_of_modes(data.modal, model)
    push(model, data, work)
    forward_bias(model, data, work.tau, work.step)
    work.tau[:] = 0.0
