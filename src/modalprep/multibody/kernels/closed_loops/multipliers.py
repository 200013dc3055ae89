"""Multipliers of constraints: which rows are independent, and what all of them do (theory 5.4).

The pivoted factor of ``G M^-1 G^T`` (responses.py) costs O(m^3) and tells the redundant rows. M is the mass matrix, or
the effective one of an implicit step: that of the last `inward`.

Order of calls: `outward`, `world`, `constraint_residual`, `inward`, `constraint_accelerations`. Arguments as in
constraints.py.
"""

from __future__ import annotations

import numpy as np

from modalprep.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.lanes import WIDTH, get_lanes, lanes, put_lanes
from modalprep.multibody.kernels.algebra.tuples import at, copy
from modalprep.multibody.kernels.articulated_body import forward
from modalprep.multibody.kernels.closed_loops.constraints import SLIP
from modalprep.multibody.kernels.closed_loops.responses import push, respond, write_responses

RANK_TOLERANCE = 1e-11  # squared sine between a row and those before it, in the metric: an angle of 3e-6 rad
STRAY = 10.0  # rows that depend on each other in closed loops are at angles up to so many times the gap of open ones
REGULAR, SINGULAR = 0.3, 0.2  # sines of independent rows: a step goes past a singular position, not into it
DEEP = 0.01  # accelerations have the round-off of coordinates over the third power of the sine
MOST_FRICTION_STEPS = 200  # iterations of friction and normal forces
TAKEN, FIXED, GONE = -1e303, -1e302, -1e301  # in place of what is left of a row: in the factor; it cannot move; limit
FRICTION_SETTLED = 1e-13  # change of the friction at their end


@compile_kernel
def factorize(cons, work):
    """Write the pivoted factor ``L D^-1 L^T`` of S; rows beyond ``rank`` depend on those before them.

    It stands by places of rows in the bundles, which nothing exchanges. Rows that depend on each other where the loops
    are closed do not quite at the stages of a step: more rows than in the last closed state (`hold_rank`) are
    independent only where they clearly are, by more than the loops are open.
    """
    blocks = len(work.bundles)
    if blocks == 1:  # numbers that the compiler knows: it unrolls all loops
        _factorize(work, 1)
    elif blocks == 2:
        _factorize(work, 2)
    else:
        _factorize(work, blocks)


@compile_inline
def _factorize(work, blocks):
    """Do as `factorize` with so many bundles."""
    count, A = _copy_responses(work, blocks), work.rest
    rank, least = 0, 1.0
    while rank < count:
        p = _most_mobile(work, blocks)
        i, d = at(work.paths.row[p]), A[p, p]
        square = d / work.own[p]
        if not (square > RANK_TOLERANCE and (rank < work.held[0] or _risen(work, work.left[p]))):
            break
        least = min(least, square)
        work.order[at(rank)], work.places[at(rank)], work.inverse[at(rank)] = i, p, 1.0 / d
        work.left[p] = TAKEN
        rank += 1
        if rank < count:
            _eliminate(work, blocks, at(rank - 1), p)
    work.rank[0], work.sine[0] = rank, np.sqrt(least)
    for p in range(WIDTH * blocks):
        i = work.paths.row[at(p)]
        if i >= 0 and work.left[at(p)] != TAKEN:
            work.order[at(rank)] = i
            rank += 1


@compile_inline
def _copy_responses(work, blocks):
    """Write S, and what the rows have left; returns how many rows can move."""
    for p in range(blocks):
        for q in range(p + 1):
            S = work.between[at(p), at(q)].S
            for k in range(WIDTH):
                put_lanes(work.rest[at(WIDTH * p + k)], WIDTH * q, get_lanes(S, WIDTH * k))
    count = 0
    for p in range(WIDTH * blocks):
        i = work.paths.row[at(p)]
        work.left[at(p)] = FIXED
        if i >= 0:
            if work.compliance[at(i)] > 0.0:
                work.rest[at(p), at(p)] += work.compliance[at(i)]
            d = work.rest[at(p), at(p)]
            work.own[at(p)] = d
            if d > work.floor[at(i)]:
                work.left[at(p)] = _mobility(work, at(i), d)
                count += 1
    return count


@compile_inline
def _most_mobile(work, blocks):
    """Return the place of the row that is left most: one that hardly moves has no sure direction."""
    best, most = 0, GONE
    for p in range(WIDTH * blocks):
        left = work.left[at(p)]
        if left > most * (1.0 + 1e-9):  # ties: the order given
            best, most = p, left
    return at(best)


@compile_inline
def _eliminate(work, blocks, k, p):
    """Write column k of the factor, that of place p, and take it off the rows that are left."""
    A, L, g, block = work.rest, work.factor[k], work.inverse[k], p >> 2
    d = A[p, p]
    for q in range(blocks):
        i = at(WIDTH * q)
        if at(q) <= block:
            put_lanes(L, WIDTH * q, g * get_lanes(A[p], WIDTH * q))
        else:
            put_lanes(L, WIDTH * q, g * lanes(A[i, p], A[i + at(1), p], A[i + at(2), p], A[i + at(3), p]))
    for s in range(WIDTH * blocks):
        i = at(s)
        if work.left[i] > GONE:
            f, row = d * L[i], A[i]
            for q in range((s >> 2) + 1):
                put_lanes(row, WIDTH * q, get_lanes(row, WIDTH * q) - f * get_lanes(L, WIDTH * q))
            work.left[i] = _mobility(work, at(work.paths.row[i]), row[i])


@compile_kernel
def _risen(work, left):
    """Whether what is `left` of a row clearly is no round-off: by more than the loops are open."""
    largest, gap = 0.0, violation(work, work.phi)
    for p in range(len(work.left)):
        i = work.paths.row[p]
        if work.left[p] != FIXED and work.compliance[i] == 0.0:
            largest = max(largest, _mobility(work, i, work.own[p]))
    return left > (STRAY * gap) ** 2 * largest


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
def is_deep(work):
    """Return whether the loops are where round-off decides the accelerations; no of None."""
    if work is None:
        return False
    return work.rank[0] < work.held[0] or (work.rank[0] == work.held[0] and work.sine[0] < DEEP)


@compile_kernel
def is_near(work):
    """Return whether the loops have come near a singular position since the last closed state; no of None."""
    if work is None:
        return False
    nearer = work.sine[0] < REGULAR and work.sine[0] < 0.5 * work.sine[1]
    return work.rank[0] < work.held[0] or (work.rank[0] == work.held[0] and nearer)


@compile_kernel
def begins_regular(work):
    """Return whether the state of the last `factorize` is clearly not `is_deep`, and hold its rank; no of None."""
    if work is None:
        return False
    hold_rank(work)
    return work.sine[0] > 4.0 * DEEP


@compile_kernel
def near_singular(work, again):
    """Return whether the loops came from a regular closed state into a singular position, or near one; no of None.

    `again`: after a step that failed, only a position counts where round-off decides.
    """
    if work is None:
        return False
    if again:
        return is_deep(work) and work.sine[1] > SINGULAR
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
def solve(work):
    """Solve ``S multiplier = -wanted``; redundant rows get none."""
    for k in range(work.rank[0], len(work.order)):
        work.multiplier[at(work.order[at(k)])] = 0.0
    if work.rank[0] <= WIDTH:  # numbers that the compiler knows, as in `factorize`
        _solve(work, WIDTH)
    elif work.rank[0] <= 2 * WIDTH:
        _solve(work, 2 * WIDTH)
    else:
        _solve(work, work.rank[0])


@compile_inline
def _solve(work, most):
    """Do as `solve` with at most so many rows."""
    x, rank, places = work.solution, work.rank[0], work.places
    for k in range(most):
        if k < rank:
            b, p = -work.wanted[at(work.order[at(k)])], at(places[at(k)])
            for i in range(k):
                b -= work.factor[at(i), p] * x[at(i)]
            x[at(k)] = b
    for k in range(most - 1, -1, -1):
        if k < rank:
            b, column = work.inverse[at(k)] * x[at(k)], work.factor[at(k)]
            for i in range(k + 1, most):
                if i >= rank:
                    break
                b -= column[at(places[at(i)])] * x[at(i)]
            x[at(k)] = work.multiplier[at(work.order[at(k)])] = b


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
    for b in range(len(work.bundles)):
        bundle, free = work.paths.bundles[at(b)], work.bundles[at(b)].free
        for k in range(bundle.count):
            i = at(bundle.rows[at(k)])
            work.wanted[i] = free[at(k)] + work.bias[i] + 2.0 * alpha * work.rate[i] + beta * beta * work.phi[i]
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
    write_responses(work)
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
