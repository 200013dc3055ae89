"""Multipliers of constraints: which rows are independent, and what all of them do (theory 5.4).

The pivoted factor of ``G M^-1 G^T`` (responses.py) costs O(m^3) and tells the redundant rows. M is the mass matrix, or
the effective one of an implicit step: that of the last `inward`.

Order of calls: `outward`, `world`, `constraint_residual`, `inward`, `constraint_accelerations`. Arguments as in
constraints.py.
"""

from __future__ import annotations

import numpy as np

from modalprep.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.lanes import WIDTH, get_lanes, put_lanes
from modalprep.multibody.kernels.algebra.tuples import at, copy
from modalprep.multibody.kernels.articulated_body import forward
from modalprep.multibody.kernels.closed_loops.constraints import SLIP
from modalprep.multibody.kernels.closed_loops.responses import push, respond

RANK_TOLERANCE = 1e-11  # squared sine between a row and those before it, in the metric: an angle of 3e-6 rad
STRAY = 10.0  # rows that depend on each other in closed loops are at angles up to so many times the gap of open ones
REGULAR, SINGULAR = 0.3, 0.2  # sines of independent rows: a step goes past a singular position, not into it
MOST_FRICTION_STEPS = 200  # iterations of friction and normal forces
FRICTION_SETTLED = 1e-13  # change of the friction at their end


@compile_kernel
def factorize(cons, work):
    """Write the pivoted factor ``U^T D^-1 U`` of S; rows beyond ``rank`` depend on those before them.

    Rows that depend on each other where the loops are closed do not quite at the stages of a step: more rows than in
    the last closed state (`hold_rank`) are independent only where they clearly are, by more than the loops are open.
    """
    n, U, order = _sort_movable(work), work.factor, work.order
    for k in range(n):
        row, into = work.S[at(order[at(k)])], U[at(k)]
        for j in range(k, n):
            into[at(j)] = row[at(order[at(j)])]
    work.rank[0], least = n, 1.0
    for k in range(n):
        best = _most_mobile(work, k, n)
        i, d, pivots = at(order[at(best)]), U[at(best), at(best)], U[at(k)]
        square = d / work.S[i, i]
        if not (square > RANK_TOLERANCE and (k < work.held[0] or _risen(work, n, _mobility(work, i, d)))):
            work.rank[0] = k
            break
        least = min(least, square)
        if best != k:
            _swap(work, k, best, n)
        g = 1.0 / d
        work.inverse[at(k)] = g
        for i in range(k + 1, n):
            f, row = g * pivots[at(i)], U[at(i)]
            for j in range(i, n, WIDTH):  # a few numbers after the row's end have room and no meaning
                put_lanes(row, j, get_lanes(row, j) - f * get_lanes(pivots, j))
    work.sine[0] = np.sqrt(least)


@compile_inline
def _most_mobile(work, k, n):
    """Return the row from k on that is left most: one that hardly moves has no sure direction."""
    best, most = k, -1.0
    for i in range(k, n):
        left = _mobility(work, at(work.order[at(i)]), work.factor[at(i), at(i)])
        if left > most * (1.0 + 1e-9):  # ties: the order given
            best, most = i, left
    return best


@compile_kernel
def _risen(work, n, left):
    """Whether what is `left` of a row clearly is no round-off: by more than the loops are open."""
    largest, gap = 0.0, violation(work, work.phi)
    for k in range(n):
        i = work.order[k]
        if work.compliance[i] == 0.0:
            largest = max(largest, _mobility(work, i, work.S[i, i]))
    return left > (STRAY * gap) ** 2 * largest


@compile_inline
def _sort_movable(work):
    """Put the rows that can move first in `order`; returns how many."""
    n, last = 0, len(work.order)
    for i in range(len(work.order)):
        if work.S[at(i), at(i)] > work.floor[at(i)]:
            work.order[at(n)] = i
            n += 1
        else:
            last -= 1
            work.order[at(last)] = i
    return n


@compile_kernel
def violation(work, values):
    """Return the largest of ``values (m,)`` but of compliant rows, lengths by the size of the system."""
    worst = 0.0
    for i in range(len(values)):
        size = abs(values[i]) * work.unit[i] if work.compliance[i] == 0.0 else 0.0
        if not size <= worst:  # NaN counts
            worst = size
    return worst


@compile_kernel
def near_singular(work):
    """Return whether the loops came from a regular closed state into a singular position, or near one; no of None."""
    if work is None:
        return False
    lost = work.rank[0] < work.held[0] or (work.rank[0] == work.held[0] and work.sine[0] < SINGULAR)
    return lost and work.sine[1] > REGULAR


@compile_inline
def _mobility(work, i, response):
    """Return a response of row i to a unit multiplier, lengths by the size of the system."""
    return response * work.unit[i] * work.unit[i]


@compile_kernel
def free_rank(work):
    """Let `factorize` decide the rank by itself; `work` may be None."""
    if work is not None:
        work.held[0] = len(work.order)


@compile_kernel
def hold_rank(work):
    """Take the rank of the last `factorize` as that of a closed state; `work` may be None."""
    if work is not None:
        work.held[0], work.sine[1] = work.rank[0], work.sine[0]


@compile_kernel
def _swap(work, k, i, n):
    """Exchange rows and columns k < i of the upper half of the factor."""
    U, order, a, b = work.factor, work.order, at(k), at(i)
    order[a], order[b] = order[b], order[a]
    U[a, a], U[b, b] = U[b, b], U[a, a]
    for j in range(k):
        c = at(j)
        U[c, a], U[c, b] = U[c, b], U[c, a]
    for j in range(k + 1, i):
        c = at(j)
        U[a, c], U[c, b] = U[c, b], U[a, c]
    for j in range(i + 1, n):
        c = at(j)
        U[a, c], U[b, c] = U[b, c], U[a, c]


@compile_kernel
def solve(work):
    """Solve ``S multiplier = -wanted``; redundant rows get none."""
    U, x, rank = work.factor, work.solution, work.rank[0]
    for k in range(rank, len(work.order)):
        work.multiplier[at(work.order[at(k)])] = 0.0
    for k in range(rank):
        x[at(k)] = -work.wanted[at(work.order[at(k)])]
    for k in range(rank):
        f, row = work.inverse[at(k)] * x[at(k)], U[at(k)]
        for i in range(k + 1, rank, WIDTH):  # what stands after the rank is not read
            put_lanes(x, i, get_lanes(x, i) - f * get_lanes(row, i))
    for k in range(rank - 1, -1, -1):
        b, row = x[at(k)], U[at(k)]
        for i in range(k + 1, rank):
            b -= row[at(i)] * x[at(i)]
        x[at(k)] = work.inverse[at(k)] * b
        work.multiplier[at(work.order[at(k)])] = x[at(k)]


@compile_kernel
def constraint_accelerations(cons, model, data, work, alpha, beta, tau, udot):
    """Write the accelerations ``udot (nu,)`` for which ``Phi'' + 2 alpha Phi' + beta^2 Phi = 0``.

    After `constraint_residual` and `inward`, in place of `forward`, whose arguments `tau` and `udot` are. alpha = beta
    = 0 with projection after steps; Baumgarte (1972) with both at some 5 to 50 1/s. Leaves the multipliers in `work`,
    and the data as a `forward` with them does, so that `node_acceleration` holds, and `reactions` after `push_links`.
    Without constraints (None) it is `forward`.
    """
    if cons is None:
        forward(model, data, tau, udot)
        return
    respond(cons, model, data, work, tau)
    for k in range(len(cons.rows)):
        i = at(k)
        work.wanted[i] = work.free[i] + work.bias[i] + 2.0 * alpha * work.rate[i] + beta * beta * work.phi[i]
        work.compliance[i] = 0.0
    act(cons, model, data, work, tau, udot)


@compile_inline
def act(cons, model, data, work, tau, udot):
    """Write the accelerations with multipliers that take `wanted` off the rows, after `respond`."""
    factorize(cons, work)
    solve(work)
    if work.paths.slides > 0:
        _apply_friction(cons, work)
    copy(tau, work.tau)
    push(model, data, work)
    forward(model, data, work.tau, udot)
    work.tau[:] = 0.0


@compile_kernel
def _apply_friction(cons, work):
    """Let rows of sliding resist by friction, until it agrees with the normal forces that it changes itself.

    Where it never does (a jam) the multipliers are not finite.
    """
    for i in range(len(cons.rows)):
        if cons.rows[i].kind == SLIP:
            work.goal[i] = 0.0
    change, size = np.inf, 0.0
    for _ in range(MOST_FRICTION_STEPS):
        change, size = 0.0, 0.0
        for i in range(len(cons.rows)):
            if cons.rows[i].kind == SLIP:
                f = _friction(cons, work, i)
                d = f - work.goal[i]
                work.goal[i] = f
                change, size = max(change, abs(d)), max(size, abs(f))
                for j in range(len(cons.rows)):
                    work.wanted[j] += work.S[j, i] * d
        if change <= FRICTION_SETTLED * size:
            break
        solve(work)
    for i in range(len(cons.rows)):
        if cons.rows[i].kind == SLIP:
            work.multiplier[i] = work.goal[i] if change <= FRICTION_SETTLED * size else np.nan


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


@compile_kernel
def constraint_power(work):
    """Power (W) of the prescribed values: what constraints that depend on time put into the system; 0 of None."""
    if work is None:
        return 0.0
    found = 0.0
    for i in range(len(work.push)):
        found += work.multiplier[i] * work.push[i]
    return found
