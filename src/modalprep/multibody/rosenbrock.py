"""Rosenbrock-W method of order 3 in the order-n recursion: ROS34PW2 of Rang and Angermann (2005).

The matrix A of the method holds what is linear and may be stiff, modal and hinge stiffness and damping:
``A = [0 1; -M^-1 K, -M^-1 D]``. A stage is then one recursion, ``(M + h g D + h^2 g^2 K) k = F - h g K r - h sum g_ij
(K kq_j + D kv_j)`` with ``kq = r + h g kv``. M is that of the stage, not of the step: this adds
``h^3 sum b_i a_i g_i A' f`` to the error of a step, -0.0025 of a third-order term, so that the observed order is 3.
Rotation, bushings and springs between bodies are outside A, hence explicit: they limit the step where they are
stiff, and fast rotation reduces the order of unresolved modes.
"""

from __future__ import annotations

import numpy as np

from modalprep.jit import compile_merged
from modalprep.multibody.algebra import copy
from modalprep.multibody.evaluate import FAILED_CALLBACK, GOOD, evaluate, hinge_slopes, load, solve_implicit
from modalprep.multibody.kernel import kinematic
from modalprep.multibody.layout import NX
from modalprep.multibody.stepping import EVALUATIONS, norm, set_weights

G = 0.43586652150845900
ALPHA = np.array([
    [0.0, 0.0, 0.0, 0.0],
    [0.87173304301691801, 0.0, 0.0, 0.0],
    [0.84457060015369423, -0.11299064236484185, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
])  # fmt: skip
GAMMA = np.array([
    [0.0, 0.0, 0.0, 0.0],
    [-0.87173304301691801, 0.0, 0.0, 0.0],
    [-0.90338057013044082, 0.054180672388095326, 0.0, 0.0],
    [0.24212380706095346, -1.2232505839045147, 0.54526025533510214, 0.0],
])  # fmt: skip
WEIGHTS = np.array([0.24212380706095346, -1.2232505839045147, 1.5452602553351020, 0.43586652150845900])
EMBEDDED = np.array([0.37810903145819369, -0.096042292212423178, 0.5, 0.21793326075422950])
STAGES = 4


@compile_merged
def rosenbrock_step(model, run, t, h):
    """Try a step from `y`, `ydot` to `new`, `newdot`; returns status and error relative to the tolerance."""
    for i in range(STAGES):
        status = _stage(model, run, t, h, i)
        if status != GOOD:
            return status, 0.0
    error = run.rows[0]
    copy(run.y, run.new)
    error[:] = 0.0
    for i in range(STAGES):
        for k in range(len(run.y)):
            run.new[k] += h * WEIGHTS[i] * run.K[i, k]
            error[k] += h * (WEIGHTS[i] - EMBEDDED[i]) * run.K[i, k]
    run.count[EVALUATIONS] += 1
    status = evaluate(model, t + h, run.new, run.newdot)
    set_weights(model.tree, run, run.new, False)
    run.weight[-1] = 0.0  # the work comes by quadrature
    return status, norm(run, error)


@compile_merged
def _stage(model, run, t, h, i):
    """Solve stage i for its row of K."""
    nx, nu = model.tree.ints[0, NX], len(model.tau)
    y, rest, force = run.new, run.rows[1], run.newdot[:nu]
    copy(run.y, y)
    rest[:] = 0.0
    for j in range(i):
        for k in range(nx + nu):
            y[k] += h * ALPHA[i, j] * run.K[j, k]
            rest[k] += h * GAMMA[i, j] * run.K[j, k]
    run.count[EVALUATIONS] += 1
    if not load(model, t + h * np.sum(ALPHA[i]), y):
        return FAILED_CALLBACK
    if i == 0:
        hinge_slopes(model)
    row = run.K[i]
    kinematic(model.tree, y, row)
    for u in range(nu):
        stiffness, damping, x = model.linear[0, u], model.linear[1, u], model.place[u]
        force[u] = -damping * rest[nx + u]
        if x >= 0:
            row[x] += rest[nx + u]
            force[u] -= stiffness * (h * G * row[x] + rest[x])
    status = solve_implicit(model, h * G, h * h * G * G, force, row[nx : nx + nu])
    for u in range(nu):
        if model.place[u] >= 0:
            row[model.place[u]] += h * G * row[nx + u]
    return status
