"""The step loop of all methods: control of the step, samples, events."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.callbacks import call_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.elements.half_turns import follow_turns, write_turns
from modalprep.multibody.evaluation.evaluate import FAILED_CALLBACK, GOOD, close, evaluate, evaluate_measured
from modalprep.multibody.integration.dop853 import explicit_rows, explicit_step
from modalprep.multibody.integration.generalized_alpha import alpha_accept, alpha_step
from modalprep.multibody.integration.limits import limited, next_end
from modalprep.multibody.integration.momentum import keep_momenta, remember_momenta, restore_momenta
from modalprep.multibody.integration.rosenbrock import rosenbrock_step
from modalprep.multibody.integration.stepping import (
    HALF_TURN,
    NOT_FINITE,
    OPEN,
    hermite_rows,
    interpolate,
    norm,
    set_weights,
)
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.closed_loops.singularities import (
    begin_step,
    came_near,
    ends_singular,
    keep_rank,
    reset_rank,
)
from modalprep.multibody.kernels.joints import normalise

EXPLICIT, ROSENBROCK, ALPHA = range(3)
ERROR_ORDER = (8.0, 3.0, 2.0)  # of the error estimate, in h
MOST_GROWTH = (6.0, 100.0, 2.0)
# in sizes of a body: deflections count by it at least, beside moving joints and where nothing else moves
LEAST_DEFLECTION, LEAST_ALONE = (0.01, 0.27, 0.01), (0.01, 0.05, 0.01)
RUNNING, REACHED, FULL, STOPPED, DIVERGED, COLLAPSED, RAISED, WOUND, NEAR, CUT = range(10)
SAFETY = (0.9, 0.85, 0.9)
LEAST_GROWTH = 0.2
FAILED_GROWTH = 0.5
# of a PI controller, over the order: Hairer and Wanner (1996), IV.2; little P where steps have to grow by decades
PROPORTIONAL, INTEGRAL = (0.4, 0.2, 0.4), (0.7, 1.0, 0.7)
LEAST_BEFORE = (1e-8, 0.1, 1e-8)  # error of the step before: a smaller one says that steps grow, not how they go on
SMALLEST, LEAST_FIRST = 1e-13, 1e-10  # step size, of the time; the first, of the time that is left
FIRST, BEFORE_OUTPUT = 1e-3, 0.1  # first step of the Rosenbrock method, of the time that is left and between outputs
FIRST_CUT = 0.01  # the least that it is cut to
FOLLOWS = 1e-3  # of the step before: a step that a singular position needs not be so short
UNKNOWN = 1e-6  # s, first step of what has no size
NEAREST = 1e-7  # of the time: steps do not come nearer to where a spring of rotations passes half a turn
TOO_FAR = 100.0  # body sizes of deflection: far beyond the validity of a modal body


@by_address
class Watch(NamedTuple):
    """What is looked at after every step."""

    times: np.ndarray  # output times, s
    samples: np.ndarray  # (rows, ny) states at the next of them
    size: np.ndarray  # (nx,) deflection per modal coordinate, in sizes of the body
    state: np.ndarray  # (nx + nu,) that of the equations, at which event functions are asked
    shared: np.ndarray  # (1,) SHARED, of the equations
    hook: np.ndarray  # (1,) int, address of the function that looks for events and writes `stop`; 0 without events
    stop: np.ndarray  # (1,) s, of the first event that ends the last step
    branches: np.ndarray  # (1,) int, whether `advance` returns NEAR after a step that came near a singular position
    cuts: np.ndarray  # (1,) int, whether `advance` returns CUT before it shortens a step to end at `stop`


@compile_kernel
def begin(eq, run, method, t, stop):
    """Start at a time from `run.y`: derivative, size of the first step; returns a status of `evaluate`."""
    normalise(eq.model, run.y)
    run.clock[0].time = t
    run.clock[0].begin = t
    run.clock[0].last_step = 0.0
    run.clock[0].error = 1.0
    run.clock[0].slow_share, run.clock[0].share_step = 1.0, 0.0
    run.clock[0].least_deflection = _least_deflection(eq.model, method)
    if len(run.kept) > 0:
        remember_momenta(eq, run, t)
    copy(run.y, run.old)
    run.rows[:] = 0.0
    run.counters[0].evaluations += 1
    reset_rank(eq.work)
    status = evaluate_measured(eq, t, run.y, run.ydot)
    keep_rank(eq.work)
    if status != GOOD:
        return status
    write_turns(eq.loads, eq.model, eq.data, run.turns[0])
    _keep_energy(eq, run)
    if run.clock[0].fixed_step > 0.0:
        run.clock[0].next_step = run.clock[0].fixed_step
        return GOOD
    return _first_size(eq, run, method, stop - t)


@compile_inline
def _keep_energy(eq, run):
    """Take the energy that was measured last as that of the state; its size is the largest so far."""
    run.clock[0].energy = eq.shared[0].energy
    run.clock[0].energy_size = max(run.clock[0].energy_size, eq.shared[0].energy_size)


@compile_kernel
def _least_deflection(model, method):
    modes = 0
    for i in range(len(model.links)):
        modes += model.links[i].modes
    return LEAST_DEFLECTION[method] if model.nx > modes else LEAST_ALONE[method]


@compile_kernel
def _first_size(eq, run, method, left):
    """First step size of Hairer, Norsett and Wanner (1993), II.4, but not below a floor.

    Modes at rest have no size yet: measured by their tolerance, accelerations alone would ask for 1e-14 of the run. The
    Rosenbrock method therefore tries a share of the run, without an output in it: there the interpolation has the
    accelerations of the start, with all vibrations.
    """
    set_weights(eq.model, eq.linear, run, run.y, True)
    if method == ROSENBROCK:
        run.clock[0].next_step = min(FIRST * left, BEFORE_OUTPUT * run.clock[0].output)
        return GOOD
    run.weight[-1] = 0.0
    d0, d1 = norm(run, run.y), norm(run, run.ydot)
    h = UNKNOWN if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    h = min(max(h, min(LEAST_FIRST * left, UNKNOWN)), left)
    copy(run.y, run.new)
    for k in range(len(run.y)):
        run.new[k] += h * run.ydot[k]
    run.counters[0].evaluations += 1
    status = evaluate(eq, run.clock[0].time + h, run.new, run.newdot)
    if status == GOOD:
        for k in range(len(run.y)):
            run.newdot[k] -= run.ydot[k]
        most = max(d1, norm(run, run.newdot) / h)
        guess = (0.01 / most) ** (1.0 / ERROR_ORDER[method]) if most > 1e-15 else max(1e-6, 1e-3 * h)
        run.clock[0].next_step = min(100.0 * h, left, guess)
    return status


@compile_kernel
def advance(eq, run, watch, method, stop, most):
    """Take up to `most` steps towards the time `stop`; returns why it ends, a code above.

    Samples of the last step are written first: after FULL it goes on where it was.
    """
    for _ in range(most):
        if not sample(eq.model, run, watch):
            return FULL
        t, h = run.clock[0].time, run.clock[0].next_step
        if t >= stop:
            return REACHED
        goal = next_end(run, t, stop)
        left = goal - t
        h = limited(run, method, t, h)
        if h > 0.5 * left:
            if watch.cuts[0] and goal == stop:
                return CUT
            h = left if h >= left * (1.0 - 1e-9) else 0.5 * left
        end = goal if h == left else t + h
        begin_step(eq.work, eq.implicit_work)
        status, error = _try(eq, run, method, t, h)
        passed = error <= 1.0 or run.clock[0].fixed_step > 0.0
        if status == GOOD and not error < np.inf:
            status = NOT_FINITE
        if status == GOOD and passed:
            status = _hold(eq, run, method, h, end, end == goal)
            if len(run.kept) > 0 and status == GOOD:
                keep_momenta(eq, run, end)
            if len(run.turns[0]) > 0 and status == GOOD:
                wound = follow_turns(eq.loads, eq.model, eq.data, run.turns[0], run.turns[1], h)
                if wound >= 0 and h < NEAREST * stop:
                    run.counters[0].cause = wound
                    return WOUND
                status = HALF_TURN if wound >= 0 else GOOD
            if status == GOOD and method == EXPLICIT and _is_interpolated(run, watch, end):
                status = explicit_rows(eq, run, t, h)
        if status == FAILED_CALLBACK:
            return RAISED
        if status != GOOD:
            run.counters[0].cause = status
            run.counters[0].halved += 1
            run.clock[0].error = 1.0
            run.clock[0].next_step = FAILED_GROWTH * h
        elif not passed:
            run.counters[0].rejected += 1
            run.counters[0].cause = GOOD
            least = FIRST_CUT if run.clock[0].last_step == 0.0 else LEAST_GROWTH
            run.clock[0].next_step = h * max(least, SAFETY[method] * error ** (-1.0 / ERROR_ORDER[method]))
            run.clock[0].error = -1.0
        else:
            wanted = run.clock[0].next_step
            _accept(eq, run, watch, method, h, end)
            _next_size(run, method, h, error)
            if end == goal < stop:
                run.clock[0].kink = end
                run.clock[0].next_step = max(run.clock[0].next_step, wanted)
            if _too_far(eq.model, watch, run):
                return DIVERGED
            if watch.hook[0]:
                code = _events(eq, run, watch)
                if code != RUNNING:
                    return code
            if watch.branches[0] and came_near(eq.work, eq.implicit_work):
                return NEAR
        if run.clock[0].next_step < SMALLEST * stop:
            return COLLAPSED
    return RUNNING


@compile_kernel
def _try(eq, run, method, t, h):
    if method == EXPLICIT:
        return explicit_step(eq, run, t, h)
    if method == ROSENBROCK:
        return rosenbrock_step(eq, run, t, h)
    return alpha_step(eq, run, t, h)


@compile_kernel
def _hold(eq, run, method, h, t, last):
    """Bring the trial `new` of a step to quaternions of length one and onto closed loops; returns a status.

    A step does not end in a singular position that it can pass, unless it is the `last`: there conditions lose their
    direction, and round-off decides the accelerations. After one that failed it may end nearer; one that ends there
    however short it is has begun there.
    """
    normalise(eq.model, run.new)
    if eq.cons is None:
        return GOOD
    moves = close(eq, t, run.new, 0.0 if method == EXPLICIT else 0.25 * h * h, method == EXPLICIT)
    if moves < 0:
        return OPEN
    if moves == 0 and method == ALPHA:  # which has no factor of `new`
        return GOOD
    status = GOOD
    if moves > 0 and method == EXPLICIT:
        run.counters[0].evaluations += 1
        status = evaluate_measured(eq, t, run.new, run.newdot)
    begun_there = h < FOLLOWS * run.clock[0].last_step
    if not last and not begun_there and ends_singular(eq.work, run.clock[0].error == 1.0):
        return OPEN
    keep_rank(eq.work)
    return status


@compile_kernel
def _accept(eq, run, watch, method, h, t):
    """Move on to the state `new` at time t, after `explicit_rows`, or with other dense output where it is asked for."""
    if method != EXPLICIT:
        _add_work(run, h)
        if _is_interpolated(run, watch, t):
            hermite_rows(run, h)
    if method == ALPHA:
        alpha_accept(eq, run)
    run.counters[0].steps += 1
    run.clock[0].begin, run.clock[0].last_step, run.clock[0].power_before = run.clock[0].time, h, run.ydot[-1]
    run.clock[0].time = t
    _keep_energy(eq, run)
    copy(run.y, run.old)
    copy(run.new, run.y)
    copy(run.newdot, run.ydot)
    set_weights(eq.model, eq.linear, run, run.y, True)


@compile_inline
def _is_interpolated(run, watch, t):
    """Whether a step to t will be: for events, or for an output."""
    return watch.hook[0] != 0 or _due(run, watch, t)


@compile_kernel
def _due(run, watch, t):
    """Whether an output falls on or before t, to round-off."""
    return run.counters[0].sampled < len(watch.times) and watch.times[run.counters[0].sampled] <= t * (1.0 + 1e-14)


@compile_kernel
def _add_work(run, h):
    """Work by the parabola through the power at both ends of the step and, without a kink there, at the one before."""
    p0, p1 = run.ydot[-1], run.newdot[-1]
    work = 0.5 * h * (p0 + p1)
    if run.clock[0].last_step > 0.0 and run.clock[0].time != run.clock[0].kink:
        g = run.clock[0].last_step
        work -= h * h * h / 6.0 * ((p1 - p0) / h - (p0 - run.clock[0].power_before) / g) / (h + g)
    run.new[-1] = run.y[-1] + work


@compile_kernel
def _next_size(run, method, h, error):
    """PI control; no growth after a rejected step."""
    if run.clock[0].fixed_step > 0.0:
        run.clock[0].next_step = min(run.clock[0].fixed_step, 2.0 * run.clock[0].next_step)
        return
    error = max(error, 1e-8)
    before = run.clock[0].error
    order = ERROR_ORDER[method]
    past = max(LEAST_BEFORE[method], abs(before))
    growth = SAFETY[method] * error ** (-INTEGRAL[method] / order) * past ** (PROPORTIONAL[method] / order)
    most = 1.0 if before < 0.0 else MOST_GROWTH[method]
    run.clock[0].next_step = h * min(most, max(LEAST_GROWTH, growth))
    run.clock[0].error = error


@compile_kernel
def sample(model, run, watch):
    """Write the samples of the last step; False when there is no more room."""
    while _due(run, watch, run.clock[0].time):
        if run.counters[0].buffered == len(watch.samples):
            return False
        interpolate(model, run, watch.times[run.counters[0].sampled], watch.samples[run.counters[0].buffered])
        run.counters[0].buffered += 1
        run.counters[0].sampled += 1
    return True


@compile_kernel
def _too_far(model, watch, run):
    """Whether a body's deflection is beyond all meaning; its link is then the cause."""
    for i in range(len(model.links)):
        far = 0.0
        for x in range(model.links[i].xq, model.links[i].xq + model.links[i].modes):
            far += abs(run.y[x]) * watch.size[x]
        if far > TOO_FAR:
            run.counters[0].cause = i
            return True
    return False


@compile_kernel
def place(eq, run, watch, t):
    """Write the state at a time within the last step to that of the equations."""
    _state_at(eq, run, t, watch.state)


@compile_kernel
def _state_at(eq, run, t, y):
    """Write the state that is recorded at a time within the last step, but for the projection onto closed loops."""
    interpolate(eq.model, run, t, y)
    if len(run.kept) > 0 and t >= run.kept[0].time:
        restore_momenta(eq, run, t, y, 0.0)


@compile_kernel
def _events(eq, run, watch):
    """Let Python look for events in the last step; where one ends it, that becomes its end."""
    call_address(watch.hook[0], run.clock[0].time)
    if watch.shared[0].raised != 0.0:
        return RAISED
    if watch.stop[0] < np.inf:
        _state_at(eq, run, watch.stop[0], run.new)
        copy(run.new, run.y)
        run.clock[0].time = watch.stop[0]
        return STOPPED
    return RUNNING
