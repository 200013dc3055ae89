"""Rosenbrock-W method of order 3 in the order-n recursion: ROS34PW2 of Rang and Angermann (2005).

The matrix A of the method holds what is linear and may be stiff, stiffness and damping of modes, hinges, and of
springs and bushings between bodies: ``A = [0 1; -M^-1 K, -M^-1 D]``. A stage is then one recursion, ``(M + h g D +
h^2 g^2 K) kv = F - D rv - K (h g s + rs)`` with ``rv = h sum g_ij kv_j``, ``rs = h sum g_ij s_j`` and the speeds
``s = v + rv`` of the stage; its coordinates move with ``s + h g kv``. M and K are those of the stage, not of the step:
this adds ``h^3 sum b_i a_i g_i A' f`` to the error of a step, -0.0025 of a third-order term, so that the observed order
is 3. Rotation is outside A, hence explicit: when fast it reduces the order of unresolved modes, and so do turns of the
axes of stiff springs and bushings, for which generalized-alpha is the method.

The error of a step is that of its coordinates and of its slow speeds. An error of a speed matters by the error of place
that it leads to: of a slow motion that grows with time, of a vibration it is in the coordinates already. So vibrations
are taken off the error of the speeds, by the filter of Hairer and Wanner (1996), IV.8, whose step is here the time of
the slow motion: a filter of the step's own length lets a step that has become short stay short. The share of the error
that it leaves holds for the next few steps. Deflections count in sizes of the body, so that vibrations below the
tolerance, which the method damps, do not hold the step. Errors of steps add up until the end of the run, but those of a
vibration only as long as its phase is followed that far: beyond, each step resolves it, and its error counts less.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.evaluation.evaluate import (
    FAILED_CALLBACK,
    GOOD,
    evaluate,
    hinge_slopes,
    keep_slow,
    load,
    solve_implicit,
)
from modalprep.multibody.integration.stepping import larger, set_weights
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.articulated_body import kinematic

G = 0.43586652150845900
ALPHA = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [0.87173304301691801, 0.0, 0.0, 0.0],
        [0.84457060015369423, -0.11299064236484185, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ]
)
GAMMA = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [-0.87173304301691801, 0.0, 0.0, 0.0],
        [-0.90338057013044082, 0.054180672388095326, 0.0, 0.0],
        [0.24212380706095346, -1.2232505839045147, 0.54526025533510214, 0.0],
    ]
)
WEIGHTS = np.array([0.24212380706095346, -1.2232505839045147, 1.5452602553351020, 0.43586652150845900])
EMBEDDED = np.array([0.37810903145819369, -0.096042292212423178, 0.5, 0.21793326075422950])
STAGES = 4
NEGLIGIBLE = 0.01  # times the tolerance: vibrations need not be taken off a smaller error of the speeds
CAUTION = 6.0  # of the errors of steps: they add up
FOLLOWED = 0.2  # w^4 h^3 T of a vibration in a run of T: it loses 0.026 times that of its amplitude, half a per cent
NOT_FOLLOWED = 0.35  # share by which the errors of faster ones count: they do not add up
SHARED, LONGER, SURE = 5, 1.2, 0.7  # steps that share a filter, none longer by more than this, of an error below this
LEAST_WIDE, SLOW = 10.0, 0.3  # the filter's step: times the step's own, times the time of the slow motion


@compile_kernel
def rosenbrock_step(eq, run, t, h):
    """Try a step from `y` to `new` and, if it passes, `newdot`; returns status and error relative to the tolerance."""
    for i in range(STAGES):
        status = _stage(eq, run, t, h, i)
        if status != GOOD:
            return status, 0.0
    nx = eq.model.nx
    nu = len(eq.tau)
    error = run.rows[0]
    scratch = run.rows[1]
    copy(run.y, run.new)
    error[:] = 0.0
    for i in range(STAGES):
        for k in range(nx + nu):
            run.new[k] += h * WEIGHTS[i] * run.K[i, k]
            error[k] += h * (WEIGHTS[i] - EMBEDDED[i]) * run.K[i, k]
    set_weights(eq.model, eq.linear, run, run.new, False)
    worst = _place_error(eq, run, h, error)
    slow = _slow_error(eq, run, t, h, worst, error[nx : nx + nu], scratch[:nu])
    error = CAUTION * larger(worst, slow)
    if run.clock[0].fixed_step == 0.0 and not error <= 1.0:
        return GOOD, error
    run.counters[0].evaluations += 1
    return evaluate(eq, t + h, run.new, run.newdot), error


@compile_kernel
def _slow_error(eq, run, t, h, worst, error, scratch):
    """Largest weighted error of the slow speeds, beside that of the coordinates; its share holds for a few steps."""
    clock = run.clock[0]
    nx = eq.model.nx
    weight = run.weight[nx : nx + len(error)]
    whole = _largest(error, weight, 0, len(error))
    most = 1.0 / CAUTION if eq.model.modal is None else larger(worst, NEGLIGIBLE)  # without modes, little to take off
    if clock.fixed_step > 0.0 or not whole > most:
        return whole
    slow = clock.slow_share * whole
    if not CAUTION * worst <= 1.0:  # rejected already
        return slow
    if run.counters[0].shared < SHARED and h <= LONGER * clock.share_step and CAUTION * slow <= SURE:
        run.counters[0].shared += 1
        return slow
    run.counters[0].evaluations += 1
    wide = max(LEAST_WIDE * h * G, SLOW * _slow_time(run))
    keep_slow(eq, t + h, run.new, wide, wide * wide, 1, error, scratch)
    slow = _largest(error, weight, 0, len(error))
    clock.slow_share = slow / whole
    clock.share_step = h
    run.counters[0].shared = 0
    return slow


@compile_inline
def _slow_time(run):
    """Time (s) in which an error of the speeds moves the joints by as much as the same share of their tolerance."""
    size = run.size[0]
    time = run.clock[0].span
    if size.spin * time > size.angle:
        time = size.angle / size.spin
    if size.speed * time > size.travel:
        time = size.travel / size.speed
    return time


@compile_kernel
def _place_error(eq, run, h, error):
    """Largest weighted error of the coordinates; that of vibrations which are not followed to the end counts less."""
    worst, links = 0.0, eq.model.links
    limit = FOLLOWED / (h * h * h * run.clock[0].span)
    for i in range(len(links)):
        worst = larger(worst, _largest(error, run.weight, links[i].x, links[i].xq))
        for a in range(links[i].modes):
            x = links[i].xq + a
            squared = eq.linear[0, links[i].uq + a]
            share = 1.0 if squared * squared <= limit else max(NOT_FOLLOWED, limit / (squared * squared))
            worst = larger(worst, share * error[x] * run.weight[x])
    return worst


@compile_inline
def _largest(error, weight, begin, end):
    worst = 0.0
    for k in range(begin, end):
        worst = larger(worst, error[k] * weight[k])
    return worst


@compile_kernel
def _stage(eq, run, t, h, i):
    """Solve stage i for its row of K; its speeds stand in row 3 + i of `rows`."""
    nx = eq.model.nx
    nu = len(eq.tau)
    y = run.new
    row = run.K[i]
    rate = run.rows[1]
    place = run.rows[2]
    speed = run.rows[3 + i]
    copy(run.y, y)
    rate[:] = place[:] = 0.0
    for j in range(i):
        for k in range(nx + nu):
            y[k] += h * ALPHA[i, j] * run.K[j, k]
        for u in range(nu):
            rate[u] += h * GAMMA[i, j] * run.K[j, nx + u]
            place[u] += h * GAMMA[i, j] * run.rows[3 + j, u]
    t_stage = t + h * np.sum(ALPHA[i])
    run.counters[0].evaluations += 1
    if not load(eq, t_stage, y):
        return FAILED_CALLBACK
    if i == 0:
        hinge_slopes(eq)
    for u in range(nu):
        speed[u] = y[nx + u] + rate[u]
        place[u] += h * G * speed[u]
    kv = row[nx : nx + nu]
    status = solve_implicit(eq, t_stage, y, h * G, h * h * G * G, rate[:nu], place[:nu], False, kv)
    for u in range(nu):
        speed[u] += h * G * kv[u]
        y[nx + u] = speed[u]
    kinematic(eq.model, y, row)
    return status
