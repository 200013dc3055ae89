"""Explicit Runge-Kutta method of order 8 with dense output of order 7.

DOP853 of Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I (1993), II.5 and II.6; error of orders
5 and 3 combined as there.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_kernel, compile_once
from modalprep.multibody.evaluation.evaluate import GOOD, close, evaluate, evaluate_measured
from modalprep.multibody.integration.dop853_table import A_DENSE, C_DENSE, DENSE, FIFTH, STAGES, THIRD, A, B, C
from modalprep.multibody.integration.stepping import OPEN, larger, set_weights
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.closed_loops.singularities import (
    begins_regular,
    is_nearly_singular,
    is_singular,
)

# Steps across a singular position are long and bent, which their output feels. Where one has too large an error, a
# stage is mostly too near to that position: a step that is a little shorter has it elsewhere.
ACROSS, MILD = 4.0, 4.0
# Errors of rates count by the largest so far. That says little where a light body was fast for a moment, where it would
# have crossed half of all places in a mean step. What such errors change is the energy: a step may then change it by a
# share of rtol, but is not cut further than a tolerance so many times smaller would cut it.
CROSSED, SHARE, TIGHTEST = 0.5, 0.003, 1e4
ROUND_OFF, TINY = 1e-13, 1e-300


@compile_kernel
def explicit_step(eq, run, t, h):
    """Try a step from `y`, `ydot` to `new`, `newdot`; returns status and error relative to the tolerance.

    Where a stage comes near a singular position of closed loops, its gap would spoil its accelerations: all stages are
    brought onto the loops, which makes them those of another field of derivatives with the same solutions.
    """
    status, near, deep = _stages(eq, run, t, h, False)
    if status == GOOD and near:
        status, _, deep = _stages(eq, run, t, h, True)
    if status != GOOD:
        return status, 0.0
    copy(run.K[STAGES], run.newdot)
    set_weights(eq.model, eq.linear, run, run.new, False)
    error = _error(run, h)
    if near:
        error *= ACROSS
        if error > 1.0 or (deep and _avoidable(eq, run, t)):
            error = MILD
    return GOOD, larger(error, min(_energy_error(eq, run, t), TIGHTEST * error))


@compile_once
def _stages(eq, run, t, h, closed):
    """Write all derivatives and `new`; returns a status, and whether a stage `is_nearly_singular` and `is_singular`."""
    K, near, deep = run.K, False, False
    copy(run.ydot, K[0])
    for s in range(1, STAGES + 1):
        _combine(run.y, K, A[s] if s < STAGES else B, s, h, run.new)
        time = t + C[s] * h if s < STAGES else t + h
        if closed and s < STAGES and close(eq, time, run.new, 0.0, False) < 0:
            return OPEN, near, deep
        run.counters[0].evaluations += 1
        if s < STAGES:
            status = evaluate(eq, time, run.new, K[s])
        else:
            status = evaluate_measured(eq, time, run.new, K[s])
        if status != GOOD:
            return status, near, deep
        near = near or is_nearly_singular(eq.work)
        deep = deep or is_singular(eq.work)
    return GOOD, near, deep


@compile_kernel
def _avoidable(eq, run, t):
    """Whether a shorter step has no stage where round-off decides: it begins clearly elsewhere, and may be shorter."""
    if run.clock[0].fixed_step > 0.0:
        return False
    run.counters[0].evaluations += 1
    return evaluate(eq, t, run.y, run.K[0]) == GOOD and begins_regular(eq.work)


@compile_kernel
def _combine(y, K, a, stages, h, out):
    """Write ``y + h sum a_j K_j`` to `out`."""
    copy(y, out)
    for j in range(stages):
        f = h * a[j]
        if f != 0.0:
            for k in range(len(out)):
                out[k] += f * K[j, k]


@compile_kernel
def _error(run, h):
    fifth = third = 0.0
    for k in range(len(run.y)):
        a = b = 0.0
        for j in range(STAGES + 1):
            a += FIFTH[j] * run.K[j, k]
            b += THIRD[j] * run.K[j, k]
        fifth += (a * run.weight[k]) ** 2
        third += (b * run.weight[k]) ** 2
    if fifth == 0.0 and third == 0.0:
        return 0.0
    return h * fifth / ((fifth + 0.01 * third) * len(run.y)) ** 0.5


@compile_kernel
def _energy_error(eq, run, t):
    """Return what a step from t loses or gains of the energy, over what it may; 0 where rates say enough."""
    shared, clock, size = eq.shared[0], run.clock[0], run.size[0]
    step = t / max(1.0, run.counters[0].steps)
    crossed = max(size.spin * step / max(1.0, size.angle), size.speed * step / max(size.travel, TINY))
    if not crossed > CROSSED:
        return 0.0
    most = SHARE * clock.rtol * max(clock.energy_size, shared.energy_size)
    return abs(shared.energy - clock.energy) / max(most, ROUND_OFF * shared.energy_sum, TINY)


@compile_kernel
def explicit_rows(eq, run, t, h):
    """Write the dense output of a step, before `y` moves on; three more evaluations, of closed loops.

    OPEN where round-off decides one of them, so near is it to a singular position, and a shorter step avoids that.
    """
    K = run.K
    rows = run.rows
    n = len(run.y)
    deep = False
    for s in range(3):
        _combine(run.y, K, A_DENSE[s], STAGES + 1 + s, h, run.old)
        run.counters[0].evaluations += 1
        if close(eq, t + C_DENSE[s] * h, run.old, 0.0, False) < 0:
            _combine(run.y, K, A_DENSE[s], STAGES + 1 + s, h, run.old)
        status = evaluate(eq, t + C_DENSE[s] * h, run.old, K[STAGES + 1 + s])
        if status != GOOD:
            return status
        deep = deep or is_singular(eq.work)
    if deep and _avoidable(eq, run, t):
        return OPEN
    for k in range(n):
        step = run.new[k] - run.y[k]
        rows[0, k] = step
        rows[1, k] = h * K[0, k] - step
        rows[2, k] = 2.0 * step - h * (run.newdot[k] + K[0, k])
        for r in range(4):
            v = 0.0
            for j in range(len(K)):
                v += DENSE[r, j] * K[j, k]
            rows[3 + r, k] = h * v
    return GOOD
