"""Generalized-alpha method of order 2 in the order-n recursion, on the Lie group of the coordinates.

Chung and Hulbert (1993); Arnold and Bruels (2007) for the split of accelerations, Bruels, Cardona and Arnold (2012)
for turns about three axes and free bodies, which move by the exponential of their increment.

Newton's method on ``M(q) v' = F(q, v)`` with ``M + c1 D + c2 K`` for its matrix, D, K of modes and hinges: an iteration
is one recursion, ``(M + c1 D + c2 K) v'_new = F + (c1 D + c2 K) v'_old``, to which springs and bushings between bodies
are added as compliant rows. The iterations take care of the rest, rotations of their axes and of bodies, large
pretension; where they do not contract the step is halved. Closed loops hold their places at the end of the step.
"""

from __future__ import annotations

from typing import NamedTuple

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.evaluation.evaluate import (
    FAILED_CALLBACK,
    GOOD,
    hinge_slopes,
    keep_slow,
    load,
    power,
    smooth,
    solve_implicit,
)
from modalprep.multibody.integration.stepping import (
    NOT_CONVERGED,
    larger,
    largest_error,
    set_weights,
)
from modalprep.multibody.kernels.articulated_body import kinematic
from modalprep.multibody.kernels.joints import move

LEAST_ITERATIONS, MOST_ITERATIONS = 2, 12
PLACES = True
ITERATION_TOLERANCE = 0.03  # of the step's own tolerance
LEAST_SHARE = 1e-4  # of the tolerance for a step: of many more steps than 10 000 the errors do not all go one way
# by how much longer steps errors of slow motion are told from those of vibrations, and how often they are smoothed:
# of h omega = 0.5 there is 0.003 left, of 0.03 0.93
WIDE, SMOOTHINGS = 10.0, 3
ROUND_OFF = 1e-13  # of a coordinate: iterations do not come closer


@compile_kernel
def alpha_step(eq, run, t, h):
    """Try a step from `y`, `ydot` to `new`, `newdot`; returns status and error relative to the tolerance.

    Rows of K: 0 algorithmic less true acceleration at the begin, 1 algorithmic at the begin, 2 at the end, 3 true
    accelerations of the last iteration, 4 of this one, 5 and 6 scratch.
    """
    nx = eq.model.nx
    nu = len(eq.tau)
    p = _parameters(run.clock[0].rho_inf)
    c1 = p.c * p.gamma * h
    c2 = p.c * p.beta * h * h
    last, trial, rate, place = run.K[3], run.K[4], run.K[5], run.K[6]
    share = max(h / run.clock[0].span, LEAST_SHARE)
    least = ROUND_OFF / run.clock[0].rtol
    # the algorithmic acceleration belongs to a time that is shifted in proportion to the step
    ratio = h / run.clock[0].last_step if run.clock[0].last_step > 0.0 else 0.0
    for u in range(nu):  # stiff modes start from rest: their equation is linear, so they need no guess
        run.K[1, u] = run.ydot[nx + u] + ratio * run.K[0, u]
        last[u] = run.ydot[nx + u] / (1.0 + c1 * eq.linear[1, u] + c2 * eq.linear[0, u])
    change = 0.0
    for iteration in range(MOST_ITERATIONS):
        _place(eq, run, h, p)
        run.counters[0].evaluations += 1
        if not load(eq, t + h, run.new):
            return FAILED_CALLBACK, 0.0
        hinge_slopes(eq)
        for u in range(nu):
            rate[u], place[u] = -c1 * last[u], -c2 * last[u]
        status = solve_implicit(eq, t + h, run.new, c1, c2, rate[:nu], place[:nu], PLACES, trial[:nu])
        if status >= 0:
            return status, 0.0
        run.newdot[nx + nu] = power(eq, eq.implicit_work, run.new)
        for u in range(nu):
            place[u] = c2 * (trial[u] - last[u])
            last[u] = trial[u]
        set_weights(eq.model, eq.linear, run, run.new, False)
        before = change
        change = largest_error(eq.model, run, place[:nu], True)
        if iteration + 1 >= LEAST_ITERATIONS:
            left = change / before if before > 0.0 else 0.0
            if change <= least or change * left <= ITERATION_TOLERANCE * share * (1.0 - left):
                return GOOD, _finish(eq, run, t, h, share)
            if not left < 1.0:
                return NOT_CONVERGED, 0.0
    return NOT_CONVERGED, 0.0


class Parameters(NamedTuple):
    """Parameters of the method, and c: change of the algorithmic acceleration per change of the true one."""

    am: float
    af: float
    beta: float
    gamma: float
    c: float


@compile_inline
def _parameters(rho):
    am = (2.0 * rho - 1.0) / (rho + 1.0)
    af = rho / (rho + 1.0)
    gamma = 0.5 + af - am
    return Parameters(am, af, 0.25 * (gamma + 0.5) ** 2, gamma, (1.0 - af) / (1.0 - am))


@compile_kernel
def _place(eq, run, h, p):
    """Write the state at the end of the step, with the accelerations of the last iteration, to `new`."""
    nx = eq.model.nx
    nu = len(eq.tau)
    d = run.K[5]
    for u in range(nu):
        begin = run.K[1, u]
        end = p.c * run.K[3, u] + (p.af * run.ydot[nx + u] - p.am * begin) / (1.0 - p.am)
        d[u] = h * run.y[nx + u] + h * h * ((0.5 - p.beta) * begin + p.beta * end)
        run.new[nx + u] = run.y[nx + u] + h * ((1.0 - p.gamma) * begin + p.gamma * end)
        run.K[2, u] = end
    move(eq.model, run.y, d[:nu], run.new)


@compile_kernel
def _finish(eq, run, t, h, share):
    """Write the state of the last iteration and its derivative; returns the error of the step.

    The local error of the coordinates is ``h^3 v'' (beta + d / 2 - 1/6)``, d = am - af the shift of the algorithmic
    acceleration. It is filtered as in Hairer and Wanner (1996), IV.8, by ``(M + c1 D + c2 K)^-1 M``, or it would see
    ``h^2 w^2`` times the amplitude of a vibration that the step does not resolve. In every step it may use the whole
    tolerance. Errors of the hinges' slow motion add up besides, so they may use it by the step's share of the run; what
    vibrates, bounded by its amplitude, is taken off them by the filter of a longer step.
    """
    nx = eq.model.nx
    nu = len(eq.tau)
    p = _parameters(run.clock[0].rho_inf)
    _place(eq, run, h, p)
    kinematic(eq.model, run.new, run.newdot)
    factor = h * h * (p.beta + 0.5 * (p.am - p.af) - 1.0 / 6.0)
    for u in range(nu):
        run.newdot[nx + u] = run.K[3, u]
        run.K[5, u] = factor * (run.K[2, u] - run.K[1, u])
    error, scratch = run.K[5, :nu], run.K[6, :nu]
    c1 = p.c * p.gamma * h
    c2 = p.c * p.beta * h * h
    smooth(eq, c1, c2, error, scratch)
    whole = largest_error(eq.model, run, error, True)
    slow = largest_error(eq.model, run, error, False)
    if slow > share and whole <= 1.0:
        run.counters[0].evaluations += 1
        keep_slow(eq, t + h, run.new, WIDE * c1, WIDE * WIDE * c2, SMOOTHINGS, error, scratch)
        slow = largest_error(eq.model, run, error, False)
    return larger(whole, slow / share)


@compile_kernel
def alpha_accept(eq, run):
    """Keep what the next step needs, after a step was accepted."""
    nx = eq.model.nx
    for u in range(len(eq.tau)):
        run.K[0, u] = run.K[2, u] - run.newdot[nx + u]
