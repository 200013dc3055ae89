"""What all step methods share: state of a run, error norms, dense output, groups of coordinates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.data import FREE, REVOLUTE, SLIDING, SPHERICAL
from modalprep.multibody.kernels.joints import normalise
from modalprep.multibody.kernels.spatial import add3, axpy3, cross, dot3, quaternion_rotation, times

# columns of Run.clock: time, next step size, error of the last step, its size and begin, the power there; size of a
# fixed step (0: adaptive), rtol, atol, rho_inf, length of the whole run
T, H, ERROR, LAST, BEGIN, POWER_BEFORE, FIXED, RTOL, ATOL, RHO, SPAN, CLOCK = range(12)
# columns of Run.count: steps, evaluations of the equations, rejected steps, steps that failed, samples in the buffer,
# samples in all, events in the buffer, why the last step failed
STEPS, EVALUATIONS, REJECTED, HALVED, SAMPLED, OUTPUT, FOUND, CAUSE, COUNT = range(9)
NOT_FINITE, NOT_CONVERGED, OPEN = -3, -4, -5  # beside the status of `evaluate`
# columns of Run.size: largest turn, rate of turn, travel, its rate, work; then modes and their rates, link by link
TURN, SPIN, PLACE, SPEED, WORK, SIZES = range(6)


class Run(NamedTuple):
    """State and scratch of an integration; `y` and `ydot` are those at ``clock[T]``."""

    y: np.ndarray  # (ny,) coordinates, speeds, work
    ydot: np.ndarray  # (ny,)
    old: np.ndarray  # (ny,) y at the begin of the last step
    new: np.ndarray  # (ny,) trial of a step
    newdot: np.ndarray  # (ny,)
    K: np.ndarray  # (16, ny) stages
    rows: np.ndarray  # (7, ny) dense output of the last step
    weight: np.ndarray  # (ny,) 1 / tolerance of each number
    size: np.ndarray  # (SIZES + 2 nl,) the largest so far
    clock: np.ndarray  # (CLOCK,)
    count: np.ndarray  # (COUNT,) int


def new_run(y: np.ndarray, links: int, rtol: float, atol: float, rho: float, fixed: float, span: float) -> Run:
    """Return the state of a run that begins at y."""
    ny = len(y)
    clock, count = np.zeros(CLOCK), np.zeros(COUNT, dtype=np.int64)
    clock[[FIXED, RTOL, ATOL, RHO, SPAN]] = fixed, rtol, atol, rho, span
    vectors = [np.zeros(ny) for _ in range(4)]
    size = np.zeros(SIZES + 2 * links)
    return Run(y.copy(), *vectors, np.zeros((16, ny)), np.zeros((7, ny)), np.ones(ny), size, clock, count)


@compile_kernel
def set_weights(eq, run, z, keep):
    """Fill `run.weight` by ``1 / (atol + rtol size)``, sizes by `run.size` and the state z; keep them if `keep`.

    Sizes are the largest so far: of the modes of a body, of all rates of turn, of all travels and their rates; a turn
    is measured by one radian at least, the rate of a mode by its deflection times its frequency. So what matters
    little, a mode of no effect or a hinge that happens to rest, does not hold the step.
    """
    model, size = eq.model, run.size
    nx = model.nx
    angle, spin, place, speed = max(1.0, size[TURN]), size[SPIN], size[PLACE], size[SPEED]
    for i in range(len(model.links)):
        joint, x, u = model.links[i].joint, model.links[i].x, nx + model.links[i].u
        if joint == REVOLUTE or (joint == SLIDING and model.links[i].about != 0.0):
            angle, spin = max(angle, abs(z[x])), max(spin, abs(z[u]))
        elif joint == SLIDING:
            place, speed = max(place, abs(z[x])), max(speed, abs(z[u]))
        elif joint == SPHERICAL:
            spin = max(spin, _largest(z, u, 3))
        elif joint == FREE:
            place, speed, spin = (
                max(place, _largest(z, x, 3)), max(speed, _largest(z, u, 3)), max(spin, _largest(z, u + 3, 3)),
            )  # fmt: skip
    work = max(size[WORK], abs(z[len(z) - 1]))
    if keep:
        size[TURN], size[SPIN], size[PLACE], size[SPEED], size[WORK] = angle, spin, place, speed, work
    for i in range(len(model.links)):
        joint, x, u = model.links[i].joint, model.links[i].x, nx + model.links[i].u
        turns = joint == SPHERICAL or model.links[i].about != 0.0
        travels = 3 if joint == FREE else 0 if turns else model.links[i].uq - model.links[i].u
        _weigh(run.weight, run.clock, x, travels, place)
        _weigh(run.weight, run.clock, u, travels, speed)
        _weigh(run.weight, run.clock, x + travels, model.links[i].xq - x - travels, angle)
        _weigh(run.weight, run.clock, u + travels, model.links[i].uq - model.links[i].u - travels, spin)
        n, xq, uq = model.links[i].modes, model.links[i].xq, nx + model.links[i].uq
        moved, rate = max(size[2 * i + SIZES], _largest(z, xq, n)), max(size[2 * i + SIZES + 1], _largest(z, uq, n))
        if keep:
            size[2 * i + SIZES], size[2 * i + SIZES + 1] = moved, rate
        _weigh(run.weight, run.clock, xq, n, moved)
        for a in range(n):
            fast = moved * np.sqrt(max(0.0, eq.linear[0, uq - nx + a]))
            _weigh(run.weight, run.clock, uq + a, 1, max(rate, fast))
    _weigh(run.weight, run.clock, len(z) - 1, 1, work)


@compile_inline
def _largest(z, first, count):
    found = 0.0
    for k in range(first, first + count):
        found = max(found, abs(z[k]))
    return found


@compile_inline
def _weigh(weight, clock, first, count, size):
    for k in range(first, first + count):
        weight[k] = 1.0 / (clock[ATOL] + clock[RTOL] * size)


@compile_kernel
def largest_error(model, run, e, modes):
    """Largest weighted error ``e (nu,)`` of the coordinates, as increments of the speeds' directions.

    modes: whether those of modal coordinates count.
    """
    worst = 0.0
    for i in range(len(model.links)):
        joint, x, u = model.links[i].joint, model.links[i].x, model.links[i].u
        for c in range(model.links[i].uq - u):
            k = x if joint == SPHERICAL else x + c
            worst = larger(worst, e[u + c] * run.weight[k])
        if modes:
            for c in range(model.links[i].modes):
                worst = larger(worst, e[model.links[i].uq + c] * run.weight[model.links[i].xq + c])
    return worst


@compile_inline
def larger(worst, value):
    """Return the larger of a size and ``|value|``; NaN is larger than all."""
    return worst if abs(value) <= worst or worst != worst else abs(value)


@compile_kernel
def norm(run, e):
    """Root mean square of a weighted error ``e (ny,)``."""
    total = 0.0
    for k in range(len(e)):
        total += (e[k] * run.weight[k]) ** 2
    return np.sqrt(total / len(e))


@compile_kernel
def move(model, place, y, d, out):
    """Move the coordinates of y by increments ``d (nu,)``: exponentials of the motion where a hinge turns freely."""
    for u in range(len(d)):
        if place[u] >= 0:
            out[place[u]] = y[place[u]] + d[u]
    for i in range(len(model.links)):
        joint, x, u = model.links[i].joint, model.links[i].x, model.links[i].u
        if joint == SPHERICAL:
            _turn(y, x, (d[u], d[u + 1], d[u + 2]), out)
        elif joint == FREE:
            r, w = (d[u], d[u + 1], d[u + 2]), (d[u + 3], d[u + 4], d[u + 5])
            ww = dot3(w, w)
            b, c = 0.5 - ww / 24.0, 1.0 / 6.0 - ww / 120.0
            if ww > 1e-6:
                angle = np.sqrt(ww)
                b, c = (1.0 - np.cos(angle)) / ww, (angle - np.sin(angle)) / (ww * angle)
            wr = cross(w, r)
            r = add3(r, axpy3((b * wr[0], b * wr[1], b * wr[2]), c, cross(w, wr)))
            r = times(quaternion_rotation((y[x + 3], y[x + 4], y[x + 5], y[x + 6])), r)
            out[x], out[x + 1], out[x + 2] = y[x] + r[0], y[x + 1] + r[1], y[x + 2] + r[2]
            _turn(y, x + 3, w, out)


@compile_kernel
def _turn(y, x, w, out):
    """Turn the quaternion at x by the rotation vector w of its own frame."""
    ww = dot3(w, w)
    c, s = 1.0 - ww / 8.0, 0.5 - ww / 48.0
    if ww > 1e-6:
        angle = np.sqrt(ww)
        c, s = np.cos(0.5 * angle), np.sin(0.5 * angle) / angle
    a, b = y[x], (y[x + 1], y[x + 2], y[x + 3])
    v = (s * w[0], s * w[1], s * w[2])
    e = axpy3(axpy3(cross(b, v), a, v), c, b)
    out[x] = c * a - dot3(b, v)
    out[x + 1], out[x + 2], out[x + 3] = e


@compile_kernel
def hermite_rows(run, h):
    """Write the cubic Hermite interpolation of a step from `y`, `ydot` to `new`, `newdot` to `run.rows`."""
    for k in range(len(run.y)):
        step = run.new[k] - run.y[k]
        run.rows[0, k] = step
        run.rows[1, k] = h * run.ydot[k] - step
        run.rows[2, k] = 2.0 * step - h * (run.newdot[k] + run.ydot[k])
    run.rows[3:] = 0.0


@compile_kernel
def interpolate(model, run, t, out):
    """State at t within the last step: ``y + s (r0 + (1 - s) (r1 + s (r2 + (1 - s) (...))))``."""
    h = run.clock[LAST]
    s = (t - run.clock[BEGIN]) / h if h > 0.0 else 1.0
    for k in range(len(out)):
        v = 0.0
        for j in range(6, -1, -1):
            v = (v + run.rows[j, k]) * (s if j % 2 == 0 else 1.0 - s)
        out[k] = run.old[k] + v
    normalise(model, out)
