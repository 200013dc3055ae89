"""Explicit Runge-Kutta method of order 8 with dense output of order 7.

DOP853 of Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I (1993), II.5 and II.6; error of orders
5 and 3 combined as there.
"""

from __future__ import annotations

from modalprep.jit import compile_kernel
from modalprep.multibody.evaluation.evaluate import GOOD, close, evaluate
from modalprep.multibody.integration.dop853_table import A_DENSE, C_DENSE, DENSE, FIFTH, STAGES, THIRD, A, B, C
from modalprep.multibody.integration.stepping import set_weights
from modalprep.multibody.kernels.algebra.tuples import copy


@compile_kernel
def explicit_step(eq, run, t, h):
    """Try a step from `y`, `ydot` to `new`, `newdot`; returns status and error relative to the tolerance."""
    K = run.K
    copy(run.ydot, K[0])
    for s in range(1, STAGES):
        _combine(run.y, K, A[s], s, h, run.new)
        run.count[0].evaluations += 1
        status = evaluate(eq, t + C[s] * h, run.new, K[s])
        if status != GOOD:
            return status, 0.0
    _combine(run.y, K, B, STAGES, h, run.new)
    run.count[0].evaluations += 1
    status = evaluate(eq, t + h, run.new, K[STAGES])
    if status != GOOD:
        return status, 0.0
    copy(K[STAGES], run.newdot)
    set_weights(eq.model, eq.linear, run, run.new, False)
    return GOOD, _error(run, h)


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
def explicit_rows(eq, run, t, h):
    """Write the dense output of an accepted step, before `y` moves on; three more evaluations, of closed loops."""
    K, rows, n = run.K, run.rows, len(run.y)
    for s in range(3):
        _combine(run.y, K, A_DENSE[s], STAGES + 1 + s, h, run.old)
        run.count[0].evaluations += 1
        if close(eq, t + C_DENSE[s] * h, run.old, 0.0, False) < 0:
            _combine(run.y, K, A_DENSE[s], STAGES + 1 + s, h, run.old)
        status = evaluate(eq, t + C_DENSE[s] * h, run.old, K[STAGES + 1 + s])
        if status != GOOD:
            return status
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
