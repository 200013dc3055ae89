"""Steps of the explicit method from the last to the first, in compiled code: theory 5.9.

A stage costs one evaluation, whose factor of the mass matrix stays in the data of the stage, one solution with it, and
one product with the derivatives of the inverse dynamics (kernels/tangents/pulled_back.py): no matrix is made. What the
factor and the solution overwrite, inertias and accelerations of the links and modes, is kept beside.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.elements import hinge
from modalprep.multibody.evaluation.evaluate import GOOD, Equations, load, respond
from modalprep.multibody.integration.dop853_table import STAGES, A, B, C
from modalprep.multibody.kernels.algebra.tuples import copy, get6, put6
from modalprep.multibody.kernels.newton_euler import required_forces
from modalprep.multibody.kernels.tangents.data import Sweep
from modalprep.multibody.kernels.tangents.outward import outward_tangents
from modalprep.multibody.kernels.tangents.pulled_back import Pulled, pull_inward, pull_outward
from modalprep.multibody.kernels.tangents.pulled_rates import pull_lengths, pull_rates
from modalprep.sensitivity.closing_back import closing_back
from modalprep.sensitivity.force_back import Ends, forces_back
from modalprep.sensitivity.loops_back import LoopEnds, keep_forces, keep_stage, loops_back
from modalprep.sensitivity.solutions import accelerate_closed


@by_address
class Stages(NamedTuple):
    """The equations of motion with data of their own for each stage of a step."""

    s0: Equations
    s1: Equations
    s2: Equations
    s3: Equations
    s4: Equations
    s5: Equations
    s6: Equations
    s7: Equations
    s8: Equations
    s9: Equations
    s10: Equations
    s11: Equations


@by_address
class Steps(NamedTuple):
    """Steps on the way back, and what is found at their stages."""

    t: np.ndarray  # (k,) s, begin
    h: np.ndarray  # (k,) s
    y: np.ndarray  # (k, nx + nu + 1) states at the begin
    after: np.ndarray  # (k, nx + nu) what is added to the gradient by the state at the end
    time: np.ndarray  # (12 k,) s, of the stages
    states: np.ndarray  # (12 k, nx + nu + 1)
    accelerations: np.ndarray  # (12 k, nu)
    push: np.ndarray  # (12 k, nu) gradients by the generalised forces


@by_address
class Kept(NamedTuple):
    """Of each stage, axes of the links: what is overwritten after the evaluation."""

    inertia: np.ndarray  # (12, nl, 16) M[0], H, J of the link's own body
    acceleration: np.ndarray  # (12, nl, 6)
    M_rf: np.ndarray  # (12, nf, 6, N)
    qdd: np.ndarray  # (12, nf, N)


@by_address
class Back(NamedTuple):
    """Work of a step."""

    kept: Kept
    work: Sweep
    pulled: Pulled
    ends: Ends | None  # of force elements
    loops: LoopEnds | None
    rates: np.ndarray  # (12, nx + nu + 1) of the stages
    bars: np.ndarray  # (12, nx + nu) gradients by them
    raw: np.ndarray  # (nx + nu + 1,) state at the end, quaternions as they came
    by_x: np.ndarray  # (nu,)
    by_u: np.ndarray  # (nu,)
    own: np.ndarray  # (nx + nu,) gradient by the state of a stage
    joints: np.ndarray  # (1,) sum over the stages of push times the forces of joints' elements


@compile_inline
def stage_of(all, i):
    """Return the equations of stage i."""
    if i < 6:
        if i < 3:
            return all.s0 if i == 0 else all.s1 if i == 1 else all.s2
        return all.s3 if i == 3 else all.s4 if i == 4 else all.s5
    if i < 9:
        return all.s6 if i == 6 else all.s7 if i == 7 else all.s8
    return all.s9 if i == 9 else all.s10 if i == 10 else all.s11


@compile_kernel
def steps_back(stages, steps, count, back, bar):
    """Replace the gradient by the state at the end of `count` steps, ``bar (nx + nu,)``, by that at their begin.

    Returns GOOD, or the link whose pivot is not positive at a stage.
    """
    back.joints[0] = 0.0
    for k in range(count - 1, -1, -1):
        for c in range(len(bar)):
            bar[c] += steps.after[k, c]
        status = closing_back(back.loops, stages.s0, steps, k, back, bar)
        if status == GOOD:
            status = evaluate_stages(stages, steps, k, back)
        if status != GOOD:
            return status
        _step_back(stages, steps, k, back, bar)
    return GOOD


@compile_kernel
def evaluate_stages(stages, steps, k, back):
    """Write states and rates of the stages of step k, and its end."""
    h, begin = steps.h[k], steps.y[k]
    nx, nu = stages.s0.model.nx, len(stages.s0.tau)
    for i in range(STAGES):
        row = STAGES * k + i
        state, rates = steps.states[row], back.rates[i]
        combine(begin, back.rates, A[i], i, h, state)
        steps.time[row] = steps.t[k] + C[i] * h
        _expect_rank(back.loops, stages.s0.work, stage_of(stages, i).work, i)
        status = evaluate_stage(stage_of(stages, i), back.kept, i, steps.time[row], state, rates)
        if status != GOOD:
            return status
        copy(rates[nx : nx + nu], steps.accelerations[row])
    combine(begin, back.rates, B, STAGES, h, back.raw)
    return GOOD


@compile_inline
def _expect_rank(loops, first, work, i):
    """Let the factor of stage i have the rank of that of the first, whose state is closed."""
    if loops is not None:
        work.closed_rank[0] = len(work.order) if i == 0 else first.rank[0]


@compile_kernel
def evaluate_stage(eq, kept, i, t, y, ydot):
    """Evaluate stage i as `evaluate`, and keep what is overwritten later."""
    load(eq, t, y)
    keep_inertias(eq, kept, i)
    status = respond(eq, t, y, ydot)
    ydot[eq.model.nx + len(eq.tau)] = 0.0  # the work of loads is no state here
    keep_accelerations(eq, kept, i)
    return status


@compile_kernel
def keep_inertias(eq, kept, i):
    """Keep the inertias of stage i, after `load`."""
    for k in range(len(eq.model.links)):
        own, out = eq.data.links[k], kept.inertia[i, k]
        out[0] = own.M[0]
        for c in range(9):
            out[1 + c] = own.H[c]
        for c in range(6):
            out[10 + c] = own.J[c]
    _keep_rows(eq.data.modal, kept, i)


@compile_inline
def _keep_rows(modal, kept, i):
    if modal is not None:
        for s in range(len(modal.M_rf)):
            for c in range(6):
                copy(modal.M_rf[s, c], kept.M_rf[i, s, c])


@compile_kernel
def keep_accelerations(eq, kept, i):
    """Keep the accelerations of links and modes of stage i."""
    for k in range(len(eq.model.links)):
        put6(kept.acceleration[i, k], get6(eq.data.links[k].acceleration))
    _keep_rates(eq.data.modal, kept, i)


@compile_inline
def _keep_rates(modal, kept, i):
    if modal is not None:
        for s in range(len(modal.qdd)):
            copy(modal.qdd[s], kept.qdd[i, s])


@compile_kernel
def restore(eq, kept, i):
    """Put back what was kept of stage i."""
    data = eq.data
    for k in range(len(eq.model.links)):
        own, x = data.links[k], kept.inertia[i, k]
        own.M[0] = x[0]
        for c in range(9):
            own.H[c] = x[1 + c]
        for c in range(6):
            own.J[c] = x[10 + c]
        put6(own.acceleration, get6(kept.acceleration[i, k]))
    _restore_modes(data.modal, kept, i)


@compile_inline
def _restore_modes(modal, kept, i):
    if modal is not None:
        for s in range(len(modal.M_rf)):
            for c in range(6):
                copy(kept.M_rf[i, s, c], modal.M_rf[s, c])
            copy(kept.qdd[i, s], modal.qdd[s])


@compile_kernel
def combine(y, rates, a, count, h, out):
    """Write ``y + h sum a_j rates_j`` to `out`."""
    copy(y, out)
    for j in range(count):
        f = h * a[j]
        if f != 0.0:
            for k in range(len(out)):
                out[k] += f * rates[j, k]


@compile_kernel
def _step_back(stages, steps, k, back, bar):
    """Go back over step k, whose stages are evaluated."""
    h, bars = steps.h[k], back.bars
    pull_lengths(stages.s0.model, back.raw, bar)
    for i in range(STAGES):
        for c in range(len(bar)):
            bars[i, c] = h * B[i] * bar[c]
    for i in range(STAGES - 1, -1, -1):
        _stage_back(stage_of(stages, i), i, steps, STAGES * k + i, back, bars[i])
        for c in range(len(bar)):
            bar[c] += back.own[c]
        for j in range(i):
            f = h * A[i, j]
            if f != 0.0:
                for c in range(len(bar)):
                    bars[j, c] += f * back.own[c]


@compile_kernel
def _stage_back(eq, i, steps, row, back, bar):
    """Write the gradient by the state of stage i to `own`, by that of its rates."""
    nx, push = eq.model.nx, steps.push[row]
    keep_forces(back.loops, eq)
    accelerate_closed(back.loops, eq, bar[nx : nx + len(push)], push)
    keep_stage(back.loops, eq, row)
    products(eq, i, steps.time[row], push, back)
    for u in range(len(push)):
        back.joints[0] += push[u] * eq.tau[u]
    pull_rates(eq.model, steps.states[row], bar, back.by_x, back.by_u, back.own)


@compile_kernel
def products(eq, i, t, push, back):
    """Write what push (nu,) makes of the derivatives by coordinates and speeds at stage i, after its solution."""
    restore(eq, back.kept, i)
    outward_tangents(eq.model, eq.data, back.work)
    pulled_products(eq, t, push, back)


@compile_kernel
def pulled_products(eq, t, push, back):
    """Write such products after `outward_tangents` of an evaluation that has not been solved with."""
    pull_outward(eq.model, eq.data, back.work, back.pulled, push)
    forces_back(back.ends, eq, t, back.work, back.pulled)
    loops_back(back.loops, eq, back.work, back.pulled)
    pull_inward(eq.model, eq.data, back.work, back.pulled, back.by_x, back.by_u)
    for u in range(len(push)):
        back.by_x[u] -= eq.slope[0, u] * push[u]
        back.by_u[u] -= eq.slope[1, u] * push[u]


@compile_kernel
def force_rows(eq, steps, rows, force):
    """Write the forces (rows, nu) that the accelerations of so many stages need beyond the loads."""
    for r in range(rows):
        load(eq, steps.time[r], steps.states[r])
        required_forces(eq.model, eq.data, steps.accelerations[r], force[r])
        for u in range(len(eq.tau)):
            force[r, u] -= eq.tau[u]


@compile_kernel
def hinge_product(eq, steps, rows):
    """Return the sum over so many stages of their gradients times the forces of joints' elements."""
    total = 0.0
    for r in range(rows):
        eq.tau[:] = 0.0
        hinge.apply(eq.loads.hinges, eq.loads.environment, eq.model, steps.states[r], steps.time[r], eq.tau, eq.slope)
        for u in range(len(eq.tau)):
            total += steps.push[r, u] * eq.tau[u]
    return total
