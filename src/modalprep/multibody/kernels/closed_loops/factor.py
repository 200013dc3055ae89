"""The pivoted factor of ``S = G M^-1 G^T`` (responses.py), which tells which rows are independent (theory 5.4).

All numbers stand by places of the rows in the bundles, four of one bundle in one vector: nothing is exchanged. The
factor is made column by column: of S, each step reads the column of the pivot only.

Arguments as in constraints.py.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import (
    WIDTH,
    above,
    first_at_least,
    four,
    get_lanes,
    lanes,
    larger,
    largest,
    put_lanes,
    with_lane,
)
from modalprep.multibody.kernels.algebra.tuples import at

RANK_TOLERANCE = 1e-11  # squared sine between a row and those before it, in the metric: an angle of 3e-6 rad
STRAY = 10.0  # rows that depend on each other in closed loops are at angles up to so many times the gap of open ones
TIES = 1.0 - 1e-9  # of rows that are left as much as the most mobile one, the first
# Of its usual mobility: a row that has less is about to lose its direction by itself, at a dead point. With a tenth
# fine steps come too near to one: Goldberg's linkage at 1e-9 was 3e-6 rad off. With one, Bennett's takes half more.
VANISHED = 0.3
TAKEN, FIXED = -1e303, -1e302  # in place of what is left of a row: it is in the factor; it cannot move


@compile_kernel
def weigh(work):
    """Write how the rows in the bundles count, after changes of ``unit``, ``floor``, ``usual`` or ``compliance``."""
    for p in range(len(work.paths.row)):
        i = work.paths.row[p]
        own = work.bundles[p >> 2]
        if i >= 0:
            own.weight[p & 3] = work.unit[i] * work.unit[i]
            own.floor[p & 3] = work.floor[i]
            own.usual[p & 3] = VANISHED * work.usual[i]
            own.compliance[p & 3] = work.compliance[i]


@compile_kernel
def factorize_and_solve(work):
    """Do as `factorize`, then as `solve_given`."""
    blocks = len(work.bundles)
    if blocks == 1:  # numbers that the compiler knows: it unrolls loops
        _factorize_and_solve(work, 1)
    elif blocks == 2:
        _factorize_and_solve(work, 2)
    elif blocks == 3:
        _factorize_and_solve(work, 3)
    elif blocks == 4:
        _factorize_and_solve(work, 4)
    else:
        _factorize_and_solve(work, blocks)


@compile_inline
def _factorize_and_solve(work, blocks):
    """Do as `factorize_and_solve` with so many bundles."""
    _factorize(work, blocks, True)
    _solve_back(work, blocks)


@compile_kernel
def factorize(work):
    """Write the pivoted factor ``L D L^T`` of S; rows beyond ``rank`` depend on those before them.

    Rows that depend on each other where the loops are closed do not quite at the stages of a step: more rows than in
    the last closed state (`hold_rank`) are independent only where they clearly are, by more than the loops are open.
    """
    _factorize(work, len(work.bundles), False)


@compile_inline
def _factorize(work, blocks, solving):
    """Do as `factorize` with so many bundles; if `solving`, solve with L meanwhile, see `_solve_step`.

    A pivot is mostly at the place of the last time, which the machine reads before it knows.
    """
    _begin(work, blocks)
    rank, least = 0, 1.0
    while rank < WIDTH * blocks:
        p = work.places[at(rank)]
        found = _most_mobile(work, blocks)
        if found != p:
            if found < 0:
                break
            work.places[at(rank)] = found
            continue
        d = work.rest[at(p)]
        square = d / work.own[at(p)]
        if not (square > RANK_TOLERANCE and (rank < work.held[0] or _risen(work, p))):
            break
        least = min(least, square)
        k = at(rank)
        g = 1.0 / d
        work.order[k] = work.paths.row[at(p)]
        work.inverse[k] = g
        _eliminate(work, blocks, rank, p, g)
        if solving:
            _solve_step(work, blocks, rank, p, g)
        rank += 1
    work.rank[0] = rank
    work.sine[0] = np.sqrt(least)
    work.sine[2] = min(work.sine[2], work.sine[0]) if rank >= work.held[0] else 0.0


@compile_inline
def _begin(work, blocks):
    """Write the diagonal of S, at least a share of what is usual, and what the rows have left."""
    for q in range(blocks):
        S = work.bundles[at(q)].S
        own = work.bundles[at(q)]
        d = lanes(S[0], S[5], S[10], S[15]) + get_lanes(own.compliance, 0)
        put_lanes(work.own, WIDTH * q, larger(d, get_lanes(own.usual, 0)))
        put_lanes(work.rest, WIDTH * q, above(d, get_lanes(own.floor, 0), FIXED))


@compile_inline
def _most_mobile(work, blocks):
    """Return the place of the row that is left most, -1 of none: one that hardly moves has no sure direction."""
    each = _left(work, 0)
    for q in range(1, blocks):
        each = larger(each, _left(work, q))
    most = largest(each)
    if most > 0.0:
        for q in range(blocks):
            k = first_at_least(_left(work, q), TIES * most)
            if k < WIDTH:
                return WIDTH * q + k
    return -1


@compile_inline
def _left(work, q):
    """Return what is left of the mobility of the rows of a bundle, lengths by the size of the system."""
    return get_lanes(work.rest, WIDTH * q) * get_lanes(work.bundles[at(q)].weight, 0)


@compile_inline
def _eliminate(work, blocks, k, p, g):
    """Write column k of ``L D`` and of L, that of place p and inverse pivot g, and take it off what rows have left.

    Two bundles at a time: sums of one would wait for each other.
    """
    for q in range(0, blocks - 1, 2):
        one = _column(work, at(q), at(p))
        two = _column(work, at(q + 1), at(p))
        for j in range(_most(blocks, k)):
            if j >= k:
                break
            f = work.factor[at(j)][at(p)]
            other = work.columns[at(j)]
            one = one - f * get_lanes(other, WIDTH * q)
            two = two - f * get_lanes(other, WIDTH * q + WIDTH)
        _take_off(work, k, p, g, q, one)
        _take_off(work, k, p, g, q + 1, two)
    if blocks & 1:
        one = _column(work, at(blocks - 1), at(p))
        for j in range(_most(blocks, k)):
            if j >= k:
                break
            one = one - work.factor[at(j)][at(p)] * get_lanes(work.columns[at(j)], WIDTH * (blocks - 1))
        _take_off(work, k, p, g, blocks - 1, one)


@compile_inline
def _most(blocks, count):
    """Return how often a loop of a `count` runs at most: a number that the compiler knows where it shall unroll."""
    return WIDTH * blocks if blocks <= 2 else count


@compile_inline
def _take_off(work, k, p, g, q, column):
    """Write column k for bundle q, and take it off what is left of its rows."""
    share = g * column
    put_lanes(work.columns[at(k)], WIDTH * q, column)
    put_lanes(work.factor[at(k)], WIDTH * q, share)
    left = get_lanes(work.rest, WIDTH * q) - share * column
    put_lanes(work.rest, WIDTH * q, with_lane(left, p - WIDTH * q, TAKEN))


@compile_inline
def _column(work, q, p):
    """Return the responses of the rows of bundle q to that at place p."""
    block = p >> 2
    k = p & 3
    if q == block:
        return get_lanes(work.bundles[q].S, WIDTH * k)
    if q < block:
        return get_lanes(work.between[block, q].S, WIDTH * k)
    S = work.between[q, block].S
    return lanes(S[k], S[at(4) + k], S[at(8) + k], S[at(12) + k])


@compile_kernel
def _risen(work, place):
    """Whether what is left of the row at a place clearly is no round-off: by more than the loops are open."""
    most = 0.0
    gap = violation(work, work.phi)
    for p in range(len(work.rest)):
        own = work.bundles[p >> 2]
        if work.rest[p] != FIXED and own.compliance[p & 3] == 0.0:
            most = max(most, work.own[p] * own.weight[p & 3])
    return work.rest[place] * work.bundles[place >> 2].weight[place & 3] > (STRAY * gap) ** 2 * most


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
def solve(work):
    """Solve ``S multiplier = -wanted``; redundant rows get none."""
    for p in range(len(work.paths.row)):
        i = work.paths.row[at(p)]
        work.given[at(p)] = -work.wanted[i] if i >= 0 else 0.0
    solve_given(work)


@compile_kernel
def solve_given(work):
    """Solve with ``given`` in place of ``-wanted``, which stands by places; it is overwritten."""
    _solve(work, len(work.bundles))


@compile_inline
def _solve(work, blocks):
    """Do as `solve_given` with so many bundles."""
    for k in range(WIDTH * blocks):
        if k >= work.rank[0]:
            break
        _solve_step(work, blocks, k, work.places[at(k)], work.inverse[at(k)])
    _solve_back(work, blocks)


@compile_inline
def _solve_step(work, blocks, k, p, g):
    """Write number k of the solution with L and D, and take its column, that of place p, off the right-hand side."""
    y = work.given[at(p)]
    work.halfway[at(k)] = y * g
    for q in range(blocks):
        column = get_lanes(work.factor[at(k)], WIDTH * q)
        put_lanes(work.given, WIDTH * q, get_lanes(work.given, WIDTH * q) - y * column)


@compile_inline
def _solve_back(work, blocks):
    """Write the multipliers, from the last pivot to the first; each is taken off those before it at once."""
    rank = work.rank[0]
    none = four(0.0)
    one, two = none, none  # whole vectors, which are read as such at once
    for q in range(blocks):
        put_lanes(work.solution, WIDTH * q, none)
    for k in range(_most(blocks, rank) - 1, -1, -1):
        if k >= rank:
            continue
        x, p = work.halfway[at(k)], work.places[at(k)]
        if blocks > 2:
            work.solution[at(p)] = x
        else:
            one = with_lane(one, p, x)
            two = with_lane(two, p - WIDTH, x)
        for j in range(k):
            work.halfway[at(j)] -= work.factor[at(j)][at(p)] * x
    if blocks <= 2:
        put_lanes(work.solution, 0, one)
    if blocks == 2:
        put_lanes(work.solution, WIDTH, two)
    for p in range(WIDTH * blocks):
        i = work.paths.row[at(p)]
        if i >= 0:
            work.multiplier[at(i)] = work.solution[at(p)]


@compile_kernel
def take_multipliers(work):
    """Write the multipliers of the rows to their places."""
    for p in range(len(work.paths.row)):
        i = work.paths.row[p]
        work.solution[p] = work.multiplier[i] if i >= 0 else 0.0
