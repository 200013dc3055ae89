"""Springs, dampers and bushings of an implicit step as compliant constraints, beside the rows of closed loops.

They are rows with ``multiplier = -(c1 D + c2 K) (G u' - aim)``: they add the compliance ``1 / (c1 D + c2 K)`` to their
element of ``G M^-1 G^T``, which is Woodbury's formula.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.tuples import axpy3, dot3, get3, get_angular
from modalprep.multibody.kernels.articulated_body import forward, spread
from modalprep.multibody.kernels.closed_loops.constraints import COUPLER, line
from modalprep.multibody.kernels.closed_loops.ends import observe_ends
from modalprep.multibody.kernels.closed_loops.factor import solve, weigh
from modalprep.multibody.kernels.closed_loops.multipliers import act
from modalprep.multibody.kernels.closed_loops.pushing import yield_to_multipliers
from modalprep.multibody.kernels.closed_loops.responses import write_responses


@compile_inline
def follow(work, compliant):
    """Let the rows of closed loops be as active among the compliant constraints as they are by themselves."""
    if work is not None:
        compliant.held[0] = work.held[0] + len(compliant.value) - len(work.value)
        for i in range(len(work.value)):
            compliant.value[i], compliant.unit[i] = work.value[i], work.unit[i]
            compliant.floor[i], compliant.usual[i] = work.floor[i], work.usual[i]


@compile_kernel
def aim(cons, model, data, work, c1, c2, places, by_rate, by_place):
    """Say what the rows aim at in an implicit step, after `constraint_residual` and before `inward`.

    The step has the matrix ``M + c1 D + c2 K`` and the force ``-D by_rate - K by_place``, both (nu,), of springs and
    bushings too. With `places` constraints aim at ``Phi = 0`` where a further ``c2 u' + by_place`` takes the
    coordinates; else they hold their accelerations, and aim at nothing.
    """
    if cons is None:
        return
    yields = _yields(cons)
    if places or yields:
        spread(model, data, by_place)
        observe_ends(cons, model, data, work)
    for i in range(len(cons.rows)):
        moved = along(cons, work, i, by_place)
        stiffness = cons.rows[i].stiffness
        if np.isinf(stiffness):
            work.compliance[i], work.goal[i] = 0.0, -(moved + work.phi[i]) / c2
        else:
            work.compliance[i] = 1.0 / (c1 * cons.rows[i].damping + c2 * stiffness)
            work.goal[i] = -work.compliance[i] * stiffness * moved
    weigh(work)
    if not yields:
        return
    spread(model, data, by_rate)
    observe_ends(cons, model, data, work)
    for i in range(len(cons.rows)):
        work.goal[i] -= work.compliance[i] * cons.rows[i].damping * along(cons, work, i, by_rate)


@compile_inline
def _yields(cons):
    """Whether there are compliant rows."""
    for i in range(len(cons.rows)):
        if cons.rows[i].stiffness < np.inf:
            return True
    return False


@compile_kernel
def along(cons, work, i, udot):
    """G u' of row i, by the accelerations of its ends or hinges."""
    if cons.rows[i].kind == COUPLER:
        found = 0.0
        for k in range(len(cons.terms)):
            if cons.terms[k].row == i and cons.terms[k].x >= 0:
                found += cons.terms[k].factor * udot[cons.terms[k].u]
        return found
    a, b = cons.rows[i].a, cons.rows[i].b
    v = axpy3(get3(work.ends[b].acceleration), -1.0, get3(work.ends[a].acceleration))
    found = dot3(line(work, i, 0), v) + dot3(line(work, i, 3), get_angular(work.ends[a].acceleration))
    return found + dot3(line(work, i, 6), get_angular(work.ends[b].acceleration))


@compile_kernel
def implicit_accelerations(cons, model, data, work, places, tau, udot):
    """Write the accelerations of an implicit step and let the rows act on them, after `aim` and `inward_of_closed`.

    Rows with compliance resist less. Where `places` is False, constraints hold their accelerations as in
    `constraint_accelerations`. Without constraints it is `forward`.
    """
    if cons is None:
        forward(model, data, tau, udot)
        return
    write_responses(work)
    for i in range(len(cons.rows)):
        work.wanted[i] = work.free[i] + work.bias[i]
    if places or _yields(cons):
        forward(model, data, tau, udot)
        spread(model, data, udot)
        observe_ends(cons, model, data, work)
        for i in range(len(cons.rows)):
            if places or work.compliance[i] > 0.0:
                work.wanted[i] = along(cons, work, i, udot) - work.goal[i]
    act(cons, model, data, work, tau, udot)


@compile_kernel
def restrain(cons, model, data, work, change):
    """Take off ``change (nu,)`` what the rows resist, with the factor of the last `implicit_accelerations`."""
    if cons is None:
        return
    spread(model, data, change)
    observe_ends(cons, model, data, work)
    for i in range(len(cons.rows)):
        work.wanted[i] = along(cons, work, i, change)
    solve(work)
    yield_to_multipliers(model, data, work)
    for k in range(len(change)):
        change[k] += work.step[k]
