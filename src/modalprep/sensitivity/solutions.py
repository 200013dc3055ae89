"""Accelerations that forces alone make, with the factor of the last evaluation; closed loops keep their conditions."""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.articulated_body import clear_wrenches, forward_bias, inward_bias
from modalprep.multibody.kernels.closed_loops.compliance import constrain_increment
from modalprep.multibody.kernels.modal import add_modal_loads


@compile_kernel
def accelerate(eq, force, out):
    """Write the accelerations of the tree that forces (nu,) alone make."""
    model, data = eq.model, eq.data
    clear_wrenches(model, data)
    add_modal_loads(data.modal, model, force)
    inward_bias(model, data, force)
    forward_bias(model, data, force, out)


@compile_inline
def accelerate_closed(loops, eq, force, out):
    """Write those of a system with `loops`, which may be None; its multipliers stay in the work."""
    accelerate(eq, force, out)
    if loops is not None:
        constrain_increment(eq.cons, eq.model, eq.data, eq.work, out)
