"""Constraint forces of the multipliers: in the bias forces of the links, and the accelerations due to them alone.

Arguments as in constraints.py.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, add_lanes, four, get_lanes, get_lanes6
from modalprep.multibody.kernels.algebra.rows import sums6
from modalprep.multibody.kernels.algebra.tuples import ZERO6, axpy6, get6, put6, sub6, unsigned
from modalprep.multibody.kernels.articulated_body import forward_bias
from modalprep.multibody.kernels.closed_loops.constraints import constraint_residual
from modalprep.multibody.kernels.closed_loops.factor import scatter_multipliers
from modalprep.multibody.kernels.closed_loops.responses import inward_with_rows
from modalprep.multibody.kernels.modal import clear_bias_of_modes, push_bias_of_modes
from modalprep.multibody.model.joint_types import REVOLUTE


@compile_inline
def apply_multipliers(model, data, work):
    """Subtract the constraint forces from the bias forces of the last `inward`, as far as `forward` reads them.

    Of a link behind a joint of one axis it reads the component along the axis alone; see `complete_bias_forces`.
    """
    p = 0
    while p < len(work.entries):
        entry = work.paths.entries[unsigned(p)]
        link = model.links[unsigned(entry.link)]
        force = data.links[unsigned(entry.link)].force
        if entry.u >= 0:
            _subtract_along(link, force, _joint_force(work, p, entry.end))
        else:
            _subtract_wrench(work, p, entry.end, force)
        if link.modes > 0:
            for q in range(p, entry.end):
                _subtract_modal(model, data, work, q)
        p = entry.end


@compile_kernel
def complete_bias_forces(cons, model, data, y, motion, t, work, tau):
    """Subtract the other components of the constraint forces too, for what joints carry; `work` may be None.

    After an evaluation in the plane, rows and articulated inertias are first written in space, by an `inward` with
    joint forces ``tau (nu,)``.
    """
    if work is None:
        return
    if work.in_plane[0]:
        constraint_residual(cons, model, data, y, motion, t, work, True)
        inward_with_rows(cons, model, data, work, tau, None, 0.0, 0.0)
        apply_multipliers(model, data, work)
    for p in range(len(work.entries)):
        entry = work.paths.entries[p]
        force = data.links[work.paths.entries[p].link].force
        if entry.u >= 0:
            _subtract_wrench(work, p, p + 1, force)
            _subtract_along(model.links[entry.link], force, -_joint_force(work, p, p + 1))


@compile_inline
def _multiplier(work, p):
    """Return the multipliers of an entry."""
    return get_lanes(work.solution, WIDTH * work.paths.entries[unsigned(p)].bundle)


@compile_inline
def _joint_force(work, p, end):
    """Return the constraint force along a joint of one axis, of entries from p to before `end`."""
    total = four(0.0)
    for q in range(p, end):
        total = total + _multiplier(work, q) * get_lanes(work.entries[unsigned(q)].joint_force, 0)
    return add_lanes(total)


@compile_inline
def _subtract_along(link, force, e):
    """Subtract a force e along a joint of one axis from the bias force of its link."""
    if link.joint == REVOLUTE:
        force[5] -= e
    else:
        share = e / (link.along * link.along + link.about * link.about)
        force[2] -= link.along * share
        force[5] -= link.about * share


@compile_inline
def _subtract_wrench(work, p, end, force):
    """Subtract the constraint forces of entries from p to before `end` from the bias force of their link."""
    none = four(0.0)
    total = none, none, none, none, none, none
    for q in range(p, end):
        total = axpy6(total, _multiplier(work, q), get_lanes6(work.entries[unsigned(q)].force))
    put6(force, sub6(get6(force), sums6(total)))


@compile_inline
def _subtract_modal(model, data, work, p):
    """Subtract the modal constraint forces of entry p from the bias forces of its link's modes."""
    entry = work.paths.entries[unsigned(p)]
    for k in range(entry.count):
        push_bias_of_modes(data.modal, model, entry.link, work.solution[WIDTH * entry.bundle + k], work.modal, p, k)


@compile_kernel
def multiplier_response(model, data, work):
    """Write the accelerations due to the multipliers alone, ``M^-1 G^T multiplier``, to ``work.step (nu,)``."""
    scatter_multipliers(work)
    for i in range(len(model.links)):
        put6(data.links[i].force, ZERO6)
    clear_bias_of_modes(data.modal, model)
    apply_multipliers(model, data, work)
    forward_bias(model, data, work.tau, work.step)
