"""What the multipliers of rows do to the links: bias forces, and the accelerations that these alone would give.

Arguments as in constraints.py.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, add_lanes, four, get_lanes, get_lanes6
from modalprep.multibody.kernels.algebra.rows import sums6
from modalprep.multibody.kernels.algebra.tuples import ZERO6, at, axpy6, get6, put6, sub6
from modalprep.multibody.kernels.articulated_body import forward_bias
from modalprep.multibody.kernels.closed_loops.constraints import constraint_residual
from modalprep.multibody.kernels.closed_loops.factor import take_multipliers
from modalprep.multibody.kernels.closed_loops.responses import inward_and_respond, respond
from modalprep.multibody.kernels.data import REVOLUTE
from modalprep.multibody.kernels.modal import clear_bias_of_modes, push_bias_of_modes


@compile_inline
def push(model, data, work):
    """Add the multipliers to the bias forces of the last `inward`, as far as `forward` reads them.

    Of a link behind a joint of one axis it reads the force along the axis alone; see `push_links`.
    """
    p = 0
    while p < len(work.entries):
        entry = work.paths.entries[at(p)]
        link = model.links[at(entry.link)]
        force = data.links[at(entry.link)].force
        if entry.u >= 0:
            _push_along(link, force, _along(work, p, entry.end))
        else:
            _push_link(work, p, entry.end, force)
        if link.modes > 0:
            for q in range(p, entry.end):
                _push_modes(model, data, work, q)
        p = entry.end


@compile_kernel
def push_links(cons, model, data, y, motion, t, work, tau):
    """Add the multipliers to the bias forces that `push` left as they were, for what joints carry; work may be None.

    Planar loops that were evaluated within their plane are measured in space first, and their `free` is lost; where
    all links move in it, these come to have inertias in space by an `inward` with joint forces ``tau (nu,)``.
    """
    if work is None:
        return
    if work.flat[0]:
        constraint_residual(cons, model, data, y, motion, t, work, True)
        if work.paths.in_plane:
            inward_and_respond(cons, model, data, work, tau, None, 0.0, 0.0)
            push(model, data, work)
        elif work.paths.planar:
            respond(cons, model, data, work, work.tau)
    for p in range(len(work.entries)):
        entry = work.paths.entries[p]
        force = data.links[work.paths.entries[p].link].force
        if entry.u >= 0:
            _push_link(work, p, p + 1, force)
            _push_along(model.links[entry.link], force, -_along(work, p, p + 1))


@compile_inline
def _multiplier(work, p):
    """Return the multipliers of an entry."""
    return get_lanes(work.solution, WIDTH * work.paths.entries[at(p)].bundle)


@compile_inline
def _along(work, p, end):
    """Return the force of the multipliers along a joint of one axis, of entries from p to before `end`."""
    total = four(0.0)
    for q in range(p, end):
        total = total + _multiplier(work, q) * get_lanes(work.entries[at(q)].drive, 0)
    return add_lanes(total)


@compile_inline
def _push_along(link, force, e):
    """Take the force e along a joint of one axis off the bias force of its link."""
    if link.joint == REVOLUTE:
        force[5] -= e
    else:
        share = e / (link.along * link.along + link.about * link.about)
        force[2] -= link.along * share
        force[5] -= link.about * share


@compile_inline
def _push_link(work, p, end, force):
    """Add the multipliers of entries from p to before `end` to the bias force of their link."""
    none = four(0.0)
    total = none, none, none, none, none, none
    for q in range(p, end):
        total = axpy6(total, _multiplier(work, q), get_lanes6(work.entries[at(q)].force))
    put6(force, sub6(get6(force), sums6(total)))


@compile_inline
def _push_modes(model, data, work, p):
    """Add the multipliers of entry p to the bias forces of its link's modes."""
    entry = work.paths.entries[at(p)]
    for k in range(entry.count):
        push_bias_of_modes(data.modal, model, entry.link, work.solution[WIDTH * entry.bundle + k], work.modal, p, k)


@compile_kernel
def yield_to_multipliers(model, data, work):
    """Write what the multipliers of the rows alone accelerate, ``M^-1 G^T multiplier``, to ``work.step (nu,)``."""
    take_multipliers(work)
    for i in range(len(model.links)):
        put6(data.links[i].force, ZERO6)
    clear_bias_of_modes(data.modal, model)
    push(model, data, work)
    forward_bias(model, data, work.tau, work.step)
