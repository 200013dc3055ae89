"""Pivoted factor ``L D L^T`` of ``S = G M^-1 G^T`` (responses.py), which tells the independent rows (theory 5.4).

Vectors are by lanes of the bundles, four rows of one bundle in one vector; rows are never exchanged. The factor is
left-looking: each step reads of S the column of its pivot only.

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
from modalprep.multibody.kernels.algebra.tuples import unsigned

RANK_TOLERANCE = 1e-11  # squared sine between a row and those before it, in the metric M: an angle of 3e-6 rad
GAP_FACTOR = 10.0  # rows redundant in a closed state are at angles of up to so many gaps where the loops are open
TIES = 1.0 - 1e-9  # rows whose mobilities differ by less are taken in their order
# Share of its reference mobility below which a row is about to lose its direction, at a dead point. With 0.1 small
# steps come too near to one: Goldberg's linkage at 1e-9 was 3e-6 rad off. With 1, Bennett's takes half more steps.
VANISHING = 0.3
USED, IMMOBILE = -1e303, -1e302  # mark in `remaining` rows that have been pivots, and rows that cannot move


@compile_kernel
def update_weights(work):
    """Copy the weights, mobility limits and compliance of the rows to the bundles, after any of them has changed."""
    for p in range(len(work.paths.row)):
        i = work.paths.row[p]
        own = work.bundles[p >> 2]
        if i >= 0:
            own.weight[p & 3] = work.unit[i] * work.unit[i]
            own.least_mobility[p & 3] = work.least_mobility[i]
            own.reference_mobility[p & 3] = VANISHING * work.reference_mobility[i]
            own.compliance[p & 3] = work.compliance[i]


@compile_kernel
def solve_multipliers(work):
    """Write the multipliers for which ``Phi''`` of all rows is zero, after `inward_with_rows`; factorises S."""
    blocks = len(work.bundles)
    for q in range(blocks):
        own = work.bundles[unsigned(q)]
        put_lanes(work.rhs, WIDTH * q, -1.0 * (get_lanes(own.free, 0) + get_lanes(own.bias, 0)))
    if blocks == 1:  # constants, for which the compiler unrolls loops
        _factorise_and_solve(work, 1)
    elif blocks == 2:
        _factorise_and_solve(work, 2)
    elif blocks == 3:
        _factorise_and_solve(work, 3)
    elif blocks == 4:
        _factorise_and_solve(work, 4)
    else:
        _factorise_and_solve(work, blocks)


@compile_inline
def _factorise_and_solve(work, blocks):
    """Write the factor, and the multipliers of `rhs`, for a number of bundles."""
    _factorise(work, blocks, True)
    _solve_back(work, blocks)


@compile_kernel
def factorise(work):
    """Write the pivoted factor ``L D L^T`` of S; rows beyond ``rank`` depend on those before them.

    Rows that are redundant where the loops are closed are not exactly so at the stages of a step, where they are open.
    There more rows than in the last closed state (`keep_rank`) count as independent only by more than these gaps.
    """
    _factorise(work, len(work.bundles), False)


@compile_inline
def _factorise(work, blocks, solving):
    """Do as `factorise` with a number of bundles; if `solving`, with the forward substitution of `rhs`.

    Pivots are mostly those of the last factor: read from memory, they are predicted before the search for them ends.
    """
    _initialise(work, blocks)
    rank, least = 0, 1.0
    while rank < WIDTH * blocks:
        p = work.pivots[unsigned(rank)]
        pivot = _most_mobile(work, blocks)
        if pivot != p:
            if pivot < 0:
                break
            work.pivots[unsigned(rank)] = pivot
            continue
        d = work.remaining[unsigned(p)]
        square = d / work.diagonal[unsigned(p)]
        if not (square > RANK_TOLERANCE and (rank < work.closed_rank[0] or _exceeds_gaps(work, p))):
            break
        least = min(least, square)
        k = unsigned(rank)
        g = 1.0 / d
        work.order[k] = work.paths.row[unsigned(p)]
        work.inverse[k] = g
        _eliminate(work, blocks, rank, p, g)
        if solving:
            _substitute(work, blocks, rank, p, g)
        rank += 1
    work.rank[0] = rank
    work.sine[0] = np.sqrt(least)
    work.least_sine[0] = min(work.least_sine[0], work.sine[0]) if rank >= work.closed_rank[0] else 0.0


@compile_inline
def _initialise(work, blocks):
    """Write the diagonal of S, at least a share of the reference mobilities, and the Schur complement before pivots."""
    for q in range(blocks):
        S = work.bundles[unsigned(q)].S
        own = work.bundles[unsigned(q)]
        d = lanes(S[0], S[5], S[10], S[15]) + get_lanes(own.compliance, 0)
        put_lanes(work.diagonal, WIDTH * q, larger(d, get_lanes(own.reference_mobility, 0)))
        put_lanes(work.remaining, WIDTH * q, above(d, get_lanes(own.least_mobility, 0), IMMOBILE))


@compile_inline
def _most_mobile(work, blocks):
    """Return the lane of the row with the largest weighted Schur complement; -1 if none is left that can move."""
    each = _weighted(work, 0)
    for q in range(1, blocks):
        each = larger(each, _weighted(work, q))
    most = largest(each)
    if most > 0.0:
        for q in range(blocks):
            k = first_at_least(_weighted(work, q), TIES * most)
            if k < WIDTH:
                return WIDTH * q + k
    return -1


@compile_inline
def _weighted(work, q):
    """Return the Schur complement of the rows of a bundle, lengths relative to the size of the system."""
    return get_lanes(work.remaining, WIDTH * q) * get_lanes(work.bundles[unsigned(q)].weight, 0)


@compile_inline
def _eliminate(work, blocks, k, p, g):
    """Write column k of ``L D`` and of L, of the pivot in lane p with the inverse g, and update the Schur complement.

    Two bundles at a time, as the sums of one are a chain of dependent operations.
    """
    for q in range(0, blocks - 1, 2):
        one = _column(work, unsigned(q), unsigned(p))
        two = _column(work, unsigned(q + 1), unsigned(p))
        for j in range(_bound(blocks, k)):
            if j >= k:
                break
            f = work.factor[unsigned(j)][unsigned(p)]
            other = work.columns[unsigned(j)]
            one = one - f * get_lanes(other, WIDTH * q)
            two = two - f * get_lanes(other, WIDTH * q + WIDTH)
        _store_column(work, k, p, g, q, one)
        _store_column(work, k, p, g, q + 1, two)
    if blocks & 1:
        one = _column(work, unsigned(blocks - 1), unsigned(p))
        for j in range(_bound(blocks, k)):
            if j >= k:
                break
            one = one - work.factor[unsigned(j)][unsigned(p)] * get_lanes(
                work.columns[unsigned(j)], WIDTH * (blocks - 1)
            )
        _store_column(work, k, p, g, blocks - 1, one)


@compile_inline
def _bound(blocks, count):
    """Return an upper bound of a `count`: a constant for few bundles, so that the compiler unrolls the loop."""
    return WIDTH * blocks if blocks <= 2 else count


@compile_inline
def _store_column(work, k, p, g, q, column):
    """Write column k for the rows of bundle q, and subtract it from their Schur complement."""
    share = g * column
    put_lanes(work.columns[unsigned(k)], WIDTH * q, column)
    put_lanes(work.factor[unsigned(k)], WIDTH * q, share)
    remaining = get_lanes(work.remaining, WIDTH * q) - share * column
    put_lanes(work.remaining, WIDTH * q, with_lane(remaining, p - WIDTH * q, USED))


@compile_inline
def _column(work, q, p):
    """Return the elements of S for the rows of bundle q in the column of lane p."""
    block = p >> 2
    k = p & 3
    if q == block:
        return get_lanes(work.bundles[q].S, WIDTH * k)
    if q < block:
        return get_lanes(work.between[block, q].S, WIDTH * k)
    S = work.between[q, block].S
    return lanes(S[k], S[unsigned(4) + k], S[unsigned(8) + k], S[unsigned(12) + k])


@compile_kernel
def _exceeds_gaps(work, lane):
    """Return whether the Schur complement of the row in a lane is more than the gaps of open loops make it."""
    most = 0.0
    gap = violation(work, work.phi)
    for p in range(len(work.remaining)):
        own = work.bundles[p >> 2]
        if work.remaining[p] != IMMOBILE and own.compliance[p & 3] == 0.0:
            most = max(most, work.diagonal[p] * own.weight[p & 3])
    return work.remaining[lane] * work.bundles[lane >> 2].weight[lane & 3] > (GAP_FACTOR * gap) ** 2 * most


@compile_kernel
def violation(work, values):
    """Return the largest of ``values (m,)`` of rigid rows, lengths relative to the size of the system."""
    worst = 0.0
    for i in range(len(values)):
        size = abs(values[i]) * work.unit[i] if work.compliance[i] == 0.0 else 0.0
        if not size <= worst:  # NaN counts
            worst = size
    return worst


@compile_kernel
def solve(work):
    """Solve ``S multiplier = -residual``; the multipliers of redundant rows are zero."""
    blocks = len(work.bundles)
    for p in range(len(work.paths.row)):
        i = work.paths.row[unsigned(p)]
        work.rhs[unsigned(p)] = -work.residual[i] if i >= 0 else 0.0
    for k in range(work.rank[0]):
        _substitute(work, blocks, unsigned(k), work.pivots[unsigned(k)], work.inverse[unsigned(k)])
    _solve_back(work, blocks)


@compile_inline
def _substitute(work, blocks, k, p, g):
    """Do step k of the forward substitution with ``L D``, of the pivot in lane p with the inverse g."""
    y = work.rhs[unsigned(p)]
    work.reduced[unsigned(k)] = y * g
    for q in range(blocks):
        column = get_lanes(work.factor[unsigned(k)], WIDTH * q)
        put_lanes(work.rhs, WIDTH * q, get_lanes(work.rhs, WIDTH * q) - y * column)


@compile_inline
def _solve_back(work, blocks):
    """Write the multipliers by back substitution with ``L^T``."""
    rank = work.rank[0]
    none = four(0.0)
    one, two = none, none  # of few rows the solution stays in registers
    for q in range(blocks):
        put_lanes(work.solution, WIDTH * q, none)
    for k in range(_bound(blocks, rank) - 1, -1, -1):
        if k >= rank:
            continue
        x, p = work.reduced[unsigned(k)], work.pivots[unsigned(k)]
        if blocks > 2:
            work.solution[unsigned(p)] = x
        else:
            one = with_lane(one, p, x)
            two = with_lane(two, p - WIDTH, x)
        for j in range(k):
            work.reduced[unsigned(j)] -= work.factor[unsigned(j)][unsigned(p)] * x
    if blocks == 1 or blocks == 2:
        put_lanes(work.solution, 0, one)
    if blocks == 2:
        put_lanes(work.solution, WIDTH, two)
    for p in range(WIDTH * blocks):
        i = work.paths.row[unsigned(p)]
        if i >= 0:
            work.multiplier[unsigned(i)] = work.solution[unsigned(p)]


@compile_kernel
def scatter_multipliers(work):
    """Write the multipliers of the rows to their lanes."""
    for p in range(len(work.paths.row)):
        i = work.paths.row[p]
        work.solution[p] = work.multiplier[i] if i >= 0 else 0.0
