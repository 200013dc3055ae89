"""Steps of the Rosenbrock method from the last to the first, in compiled code, as of the explicit one: theory 5.9.

The matrix of a stage is that of the run, whose factor the recursion leaves; friction and limits of joints, which make
it depend on the state before the step, are gone through in Python (rosenbrock.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.evaluation.evaluate import GOOD, hinge_slopes, load, solve_implicit
from modalprep.multibody.integration.rosenbrock import ALPHA, GAMMA, STAGES, WEIGHTS, G
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.articulated_body import kinematic
from modalprep.multibody.kernels.modal_dampers import subtract_damper_forces
from modalprep.multibody.kernels.tangents.pulled_rates import pull_lengths, pull_rates
from modalprep.sensitivity.solutions import accelerate
from modalprep.sensitivity.stages_back import (
    combine,
    keep_accelerations,
    keep_inertias,
    products,
    stage_of,
)


@by_address
class Implicit(NamedTuple):
    """Work of a step; (4, ...) of its stages."""

    rate: np.ndarray  # (4, nu) h sum g_ij of the accelerations before
    place: np.ndarray  # (4, nu) the same of the speeds, and h g times the own speed without its acceleration
    moved: np.ndarray  # (4, nx + nu + 1) the state with the speeds that move the coordinates
    bars: np.ndarray  # (4, nu) gradients by these speeds
    joints: np.ndarray  # (4, nu) forces of joints' elements
    by_linear: np.ndarray  # (2, nu) sum over the stages of the gradients by stiffness and damping
    total: np.ndarray  # (nu,)


@compile_kernel
def rosenbrock_back(stages, steps, count, back, work, bar):
    """Replace the gradient by the state at the end of `count` steps, ``bar (nx + nu,)``, by that at their begin.

    Returns GOOD, or the link whose pivot is not positive at a stage.
    """
    back.joints[0] = 0.0
    work.by_linear[:] = 0.0
    for k in range(count - 1, -1, -1):
        for c in range(len(bar)):
            bar[c] += steps.after[k, c]
        for i in range(STAGES):
            status = _evaluate(stage_of(stages, i), i, steps, k, back, work)
            if status != GOOD:
                return status
        combine(steps.y[k], back.rates, WEIGHTS, STAGES, steps.h[k], back.raw)
        _step_back(stages, steps, k, back, work, bar)
    return GOOD


@compile_kernel
def _evaluate(eq, i, steps, k, back, work):
    """Solve stage i of step k as the run does, and keep what is overwritten later; returns a status."""
    h, row = steps.h[k], STAGES * k + i
    nx, nu = eq.model.nx, len(eq.tau)
    y, rates = steps.states[row], back.rates[i]
    rate, place, moved = work.rate[i], work.place[i], work.moved[i]
    combine(steps.y[k], back.rates, ALPHA[i], i, h, y)
    rate[:] = place[:] = 0.0
    for j in range(i):
        for u in range(nu):
            rate[u] += h * GAMMA[i, j] * back.rates[j, nx + u]
            place[u] += h * GAMMA[i, j] * work.moved[j, nx + u]
    steps.time[row] = steps.t[k] + h * np.sum(ALPHA[i])
    load(eq, steps.time[row], y)
    if i == 0:
        hinge_slopes(eq)
    copy(eq.tau, work.joints[i])
    keep_inertias(eq, back.kept, i)
    copy(y, moved)
    for u in range(nu):
        moved[nx + u] = y[nx + u] + rate[u]
        place[u] += h * G * moved[nx + u]
    found = rates[nx : nx + nu]
    status = solve_implicit(eq, steps.time[row], y, h * G, h * h * G * G, rate, place, False, found)
    keep_accelerations(eq, back.kept, i)
    copy(found, steps.accelerations[row])
    for u in range(nu):
        moved[nx + u] += h * G * found[u]
    kinematic(eq.model, moved, rates)
    rates[nx + nu] = 0.0  # the work of loads is no state here
    return status


@compile_kernel
def _step_back(stages, steps, k, back, work, bar):
    """Go back over step k, whose stages are evaluated."""
    h, bars, speeds = steps.h[k], back.bars, work.bars
    nx, nu = stages.s0.model.nx, len(stages.s0.tau)
    pull_lengths(stages.s0.model, back.raw, bar)
    speeds[:] = 0.0
    for i in range(STAGES):
        for c in range(len(bar)):
            bars[i, c] = h * WEIGHTS[i] * bar[c]
    for i in range(STAGES - 1, -1, -1):
        eq, row = stage_of(stages, i), STAGES * k + i
        push = steps.push[row]
        _stage_back(eq, i, h, steps, row, back, work)
        subtract_damper_forces(eq.data.modal, eq.model, 1.0, push, work.total)
        for c in range(len(bar)):
            bar[c] += back.own[c]
        for j in range(i):
            a, g = h * ALPHA[i, j], h * GAMMA[i, j]
            for c in range(len(bar)):
                bars[j, c] += a * back.own[c]
            for u in range(nu):
                bars[j, nx + u] += g * (work.total[u] - eq.linear[1, u] * push[u])
                speeds[j, u] -= g * eq.linear[0, u] * push[u]


@compile_kernel
def _stage_back(eq, i, h, steps, row, back, work):
    """Write the gradient by the state of stage i to `own`, and that by its speeds without their acceleration."""
    model, push = eq.model, steps.push[row]
    nx, wide = model.nx, h * G
    bar, moved, total = back.bars[i], work.moved[i], work.total
    back.by_x[:] = back.by_u[:] = 0.0
    pull_rates(model, moved, bar, back.by_x, back.by_u, back.own)
    for u in range(len(push)):
        total[u] = work.bars[i, u] + back.own[nx + u]
        back.by_x[u] = bar[nx + u] + wide * total[u]
    accelerate(eq, back.by_x, push)
    for u in range(len(push)):
        found = steps.accelerations[row, u]
        back.joints[0] += push[u] * work.joints[i, u]
        work.by_linear[0, u] += push[u] * (work.place[i, u] + wide * wide * found)
        work.by_linear[1, u] += push[u] * (work.rate[i, u] + wide * found)
        total[u] -= wide * eq.linear[0, u] * push[u]
    products(eq, i, steps.time[row], push, back)
    pull_rates(model, moved, bar, back.by_x, back.by_u, back.own)
    for u in range(len(push)):
        back.own[nx + u] = total[u] - back.by_u[u]
