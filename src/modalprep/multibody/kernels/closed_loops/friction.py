"""Coulomb friction of constraints with sliding (SLIP rows): theory 5.4.

Arguments as in constraints.py.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.closed_loops.constraints import SLIP
from modalprep.multibody.kernels.closed_loops.factor import solve
from modalprep.multibody.kernels.closed_loops.responses import gather_responses

MOST_ITERATIONS = 200  # of friction and normal forces
CONVERGED = 1e-13  # relative change of the friction in the last iteration


@compile_kernel
def apply_friction(cons, work):
    """Iterate friction and normal forces, which depend on each other, after `solve`.

    Where they do not converge (a jam) the multipliers are not finite.
    """
    gather_responses(work)
    for i in range(len(cons.rows)):
        if cons.rows[i].kind == SLIP:
            work.target[i] = 0.0  # here the friction force
    converged = False
    for _ in range(MOST_ITERATIONS):
        converged = _iterate(cons, work)
        if converged:
            break
        solve(work)
    for i in range(len(cons.rows)):
        if cons.rows[i].kind == SLIP:
            work.multiplier[i] = work.target[i] if converged else np.nan


@compile_kernel
def _iterate(cons, work):
    """Update the friction by the normal forces, and the right-hand side by the friction; returns if it converged."""
    change, size = 0.0, 0.0
    for i in range(len(cons.rows)):
        if cons.rows[i].kind == SLIP:
            f = _friction(cons, work, i)
            d = f - work.target[i]
            work.target[i] = f
            change, size = max(change, abs(d)), max(size, abs(f))
            for j in range(len(cons.rows)):
                work.residual[j] += work.S[j, i] * d
    return change <= CONVERGED * size


@compile_kernel
def _friction(cons, work, i):
    """Coulomb friction ``-mu N tanh(v / sliding) v_i / v`` along row i, N of the other rows of its closure."""
    normal, slip = 0.0, 0.0
    for j in range(len(cons.rows)):
        if cons.rows[j].a == cons.rows[i].a:
            if cons.rows[j].kind == SLIP:
                slip += work.rate[j] * work.rate[j]
            else:
                normal += work.multiplier[j] * work.multiplier[j]
    if slip == 0.0:
        return 0.0
    slip = np.sqrt(slip)
    resistance = cons.rows[i].friction * np.sqrt(normal) * np.tanh(slip / cons.rows[i].sliding)
    return -resistance * work.rate[i] / slip
