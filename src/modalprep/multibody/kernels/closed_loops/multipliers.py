"""Accelerations with the multipliers of constraints, and the power of these (theory 5.4).

The mass matrix M is that of the last `inward`: that of the bodies, or the effective one of an implicit step. Order of
calls: `outward_in_world`, `constraint_residual`, `inward_with_rows` (responses.py), `constraint_accelerations`.
Arguments as in constraints.py.
"""

from __future__ import annotations

from functools import partial

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.articulated_body import forward
from modalprep.multibody.kernels.closed_loops.constraint_forces import apply_multipliers
from modalprep.multibody.kernels.closed_loops.factor import factorise, scatter_multipliers, solve, solve_multipliers
from modalprep.multibody.kernels.closed_loops.friction import apply_friction


@partial(compile_kernel, forceinline=True)
def constraint_accelerations(cons, model, data, work, tau, udot):
    """Write the accelerations ``udot (nu,)`` for which ``Phi'' = 0``, in place of `forward`.

    After `constraint_residual` and `inward_with_rows`. Leaves the multipliers in `work`, and the data as a `forward`
    with them does, so that `node_acceleration` holds, and `reactions` after `complete_bias_forces`.
    """
    if work.paths.slides > 0:
        _accelerations_with_friction(cons, model, data, work, tau, udot)
        return
    solve_multipliers(work)
    apply_multipliers(model, data, work)
    forward(model, data, tau, udot)


@compile_kernel
def _accelerations_with_friction(cons, model, data, work, tau, udot):
    """Do as `constraint_accelerations` where rows have friction."""
    for p in range(len(work.paths.row)):
        i = work.paths.row[p]
        if i >= 0:
            work.residual[i] = work.bundles[p >> 2].free[p & 3] + work.bias[i]
    cancel_residual(cons, model, data, work, tau, udot)


@compile_kernel
def cancel_residual(cons, model, data, work, tau, udot):
    """Write the accelerations with multipliers that cancel the `residual` of the rows, after `inward_with_rows`."""
    factorise(work)
    solve(work)
    if work.paths.slides > 0:
        apply_friction(cons, work)
        scatter_multipliers(work)
    apply_multipliers(model, data, work)
    forward(model, data, tau, udot)


@compile_inline
def constraint_power(cons, work, motion):
    """Power (W) of the prescribed values: what constraints that depend on time put into the system; 0 of None.

    A coupler does no work of its own. At prescribed joints the drives do the work of its force, which counts here.
    """
    power = 0.0
    if cons is None:
        return power
    for k in range(len(cons.terms)):
        if cons.terms[k].x < 0:
            power -= _term_force(cons, work, k) * motion[cons.terms[k].link, 1]
    if work.paths.driven == 0:
        return power
    for i in range(len(work.driven_rate)):
        power += work.multiplier[i] * work.driven_rate[i]
    return power


@compile_kernel
def coupler_force(cons, work, link):
    """Return the force or torque of couplers along the prescribed joint of a link; 0 of None."""
    force = 0.0
    if cons is None:
        return force
    for k in range(len(cons.terms)):
        if cons.terms[k].link == link and cons.terms[k].x < 0:
            force += _term_force(cons, work, k)
    return force


@compile_inline
def _term_force(cons, work, k):
    """Return the force of a coupler along the joint of its term k."""
    return cons.terms[k].factor * work.multiplier[cons.terms[k].row]
