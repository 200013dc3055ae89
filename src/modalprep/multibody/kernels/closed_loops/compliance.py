"""Springs, dampers and bushings of an implicit step as compliant constraints, beside the rows of closed loops.

They are rows with ``multiplier = -(c1 D + c2 K) (G u' - target)``: they add the compliance ``1 / (c1 D + c2 K)`` to
their diagonal element of ``G M^-1 G^T``, which is Woodbury's formula.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.tuples import axpy3, dot3, get3, get_angular
from modalprep.multibody.kernels.articulated_body import forward, spread
from modalprep.multibody.kernels.closed_loops.constraint_forces import multiplier_response
from modalprep.multibody.kernels.closed_loops.constraints import COUPLER, line_of_action
from modalprep.multibody.kernels.closed_loops.ends import end_accelerations
from modalprep.multibody.kernels.closed_loops.factor import solve, update_weights
from modalprep.multibody.kernels.closed_loops.multipliers import cancel_residual
from modalprep.multibody.kernels.closed_loops.responses import gather_responses


@compile_inline
def copy_loop_states(work, implicit):
    """Copy values, activity and closed rank of the rows of closed loops to the Work of implicit steps.

    Its first rows are those of the loops. `work` may be None.
    """
    if work is not None:
        implicit.closed_rank[0] = work.closed_rank[0] + len(implicit.value) - len(work.value)
        for i in range(len(work.value)):
            implicit.value[i], implicit.unit[i] = work.value[i], work.unit[i]
            implicit.least_mobility[i] = work.least_mobility[i]
            implicit.reference_mobility[i] = work.reference_mobility[i]


@compile_kernel
def set_targets(cons, model, data, work, c1, c2, places, by_rate, by_place):
    """Write compliance and target of the rows in an implicit step, after `constraint_residual` and before `inward`.

    The step has the matrix ``M + c1 D + c2 K`` and the force ``-D by_rate - K by_place``, both (nu,), of springs and
    bushings too. With `places`, rigid constraints are to be ``Phi = 0`` where a further ``c2 u' + by_place`` moves the
    coordinates; else their accelerations are constrained, and they have no target.
    """
    if cons is None:
        return
    compliant = _has_compliance(cons)
    if places or compliant:
        spread(model, data, by_place)
        end_accelerations(cons, model, data, work)
    for i in range(len(cons.rows)):
        moved = row_acceleration(cons, work, i, by_place)
        stiffness = cons.rows[i].stiffness
        if np.isinf(stiffness):
            work.compliance[i], work.target[i] = 0.0, -(moved + work.phi[i]) / c2
        else:
            work.compliance[i] = 1.0 / (c1 * cons.rows[i].damping + c2 * stiffness)
            work.target[i] = -work.compliance[i] * stiffness * moved
    update_weights(work)
    if not compliant:
        return
    spread(model, data, by_rate)
    end_accelerations(cons, model, data, work)
    for i in range(len(cons.rows)):
        work.target[i] -= work.compliance[i] * cons.rows[i].damping * row_acceleration(cons, work, i, by_rate)


@compile_inline
def _has_compliance(cons):
    """Return whether there are compliant rows."""
    for i in range(len(cons.rows)):
        if cons.rows[i].stiffness < np.inf:
            return True
    return False


@compile_kernel
def row_acceleration(cons, work, i, udot):
    """Return G u' of row i, by the accelerations of its ends or hinges."""
    if cons.rows[i].kind == COUPLER:
        total = 0.0
        for k in range(len(cons.terms)):
            if cons.terms[k].row == i and cons.terms[k].x >= 0:
                total += cons.terms[k].factor * udot[cons.terms[k].u]
        return total
    a = work.ends[cons.rows[i].a].acceleration
    b = work.ends[cons.rows[i].b].acceleration
    along = dot3(line_of_action(work, i, 0), axpy3(get3(b), -1.0, get3(a)))
    on_a = dot3(line_of_action(work, i, 3), get_angular(a))
    return along + on_a + dot3(line_of_action(work, i, 6), get_angular(b))


@compile_kernel
def implicit_accelerations(cons, model, data, work, places, tau, udot):
    """Write the accelerations of an implicit step with the multipliers, after `set_targets` and `inward_with_rows`.

    Where `places` is False, rigid constraints keep their accelerations zero as in `constraint_accelerations`. Without
    constraints it is `forward`.
    """
    if cons is None:
        forward(model, data, tau, udot)
        return
    gather_responses(work)
    for i in range(len(cons.rows)):
        work.residual[i] = work.free[i] + work.bias[i]
    if places or _has_compliance(cons):
        forward(model, data, tau, udot)
        spread(model, data, udot)
        end_accelerations(cons, model, data, work)
        for i in range(len(cons.rows)):
            if places or work.compliance[i] > 0.0:
                work.residual[i] = row_acceleration(cons, work, i, udot) - work.target[i]
    cancel_residual(cons, model, data, work, tau, udot)


@compile_kernel
def constrain_increment(cons, model, data, work, change):
    """Make an increment ``change (nu,)`` satisfy the rows, with the factor of the last `implicit_accelerations`."""
    if cons is None:
        return
    spread(model, data, change)
    end_accelerations(cons, model, data, work)
    for i in range(len(cons.rows)):
        work.residual[i] = row_acceleration(cons, work, i, change)
    solve(work)
    multiplier_response(model, data, work)
    for k in range(len(change)):
        change[k] += work.step[k]
