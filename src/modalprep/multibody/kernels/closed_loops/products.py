"""Contributions of one joint to ``S = G M^-1 G^T``: products of the joint forces of unit multipliers.

Arguments as in constraints.py.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.compiler.lanes import four, get_lanes, get_lanes6, put_lanes, put_lanes6
from modalprep.multibody.kernels.algebra.tuples import unsigned


@compile_inline
def add_outer_product(S, count, e, v):
    """Add ``e v^T`` to a block of S, of a number of rows."""
    put_lanes(S, 0, get_lanes(S, 0) + e[0] * v)
    if count > 1:
        put_lanes(S, 4, get_lanes(S, 4) + e[1] * v)
    if count > 2:
        put_lanes(S, 8, get_lanes(S, 8) + e[2] * v)
        put_lanes(S, 12, get_lanes(S, 12) + e[3] * v)


@compile_inline
def add_coupling(work, p, g):
    """Add the products of entry p with those before it at its link, whose joint of one axis has the inverse pivot g."""
    entry = work.paths.entries[unsigned(p)]
    e = work.entries[unsigned(p)].joint_force
    q = work.paths.entries[unsigned(p)].begin
    while q < p:
        S = work.between[unsigned(entry.bundle), unsigned(work.paths.entries[unsigned(q)].bundle)].S
        add_outer_product(S, entry.count, e, g * get_lanes(work.entries[unsigned(q)].joint_force, 0))
        q += 1


@compile_inline
def free_joint_response(own, scratch, force):
    """Return ``D^-1 force`` of a free joint for the forces of four rows; the scratch ``(24,)`` holds it too."""
    put_lanes6(scratch, force)
    _solve_free(own.pivot, scratch)
    return get_lanes6(scratch)


@compile_inline
def _solve_free(pivot, x):
    """Solve with the rows that `joints.free.eliminate` wrote; lanes ``x (24,)`` become the solution."""
    start = 0
    for a in range(6):
        g = 1.0 / pivot[start]
        value = get_lanes(x, 4 * a)
        for b in range(1, 6 - a):
            put_lanes(x, 4 * (a + b), get_lanes(x, 4 * (a + b)) - (g * pivot[start + b]) * value)
        start += 6 - a
    for a in range(5, -1, -1):
        start -= 6 - a
        value = get_lanes(x, 4 * a)
        for b in range(1, 6 - a):
            value = value - pivot[start + b] * get_lanes(x, 4 * (a + b))
        put_lanes(x, 4 * a, (1.0 / pivot[start]) * value)


@compile_inline
def clear_responses(work):
    """Set S and `free` of all bundles to zero."""
    for k in range(len(work.bundles)):
        own = work.bundles[unsigned(k)]
        put_lanes(own.free, 0, _zeros(work))
        _clear(work, own.S)
        for q in range(k):
            _clear(work, work.between[unsigned(k), unsigned(q)].S)


@compile_inline
def _clear(work, S):
    """Set a block of S to zero."""
    zeros = _zeros(work)
    put_lanes(S, 0, zeros)
    put_lanes(S, 4, zeros)
    put_lanes(S, 8, zeros)
    put_lanes(S, 12, zeros)


@compile_inline
def _zeros(work):
    """Return four zeros read from memory: of constants the compiler would make a slow call of memset."""
    return four(work.tau[0])
