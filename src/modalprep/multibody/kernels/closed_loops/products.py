"""What rows do to each other through a joint that yields to them: products that add up to ``G M^-1 G^T``.

Arguments as in constraints.py.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.compiler.lanes import four, get_lanes, get_lanes6, put_lanes, put_lanes6
from modalprep.multibody.kernels.algebra.tuples import at


@compile_inline
def add_products(S, count, drive, v):
    """Add ``drive v^T`` to responses, of so many rows."""
    put_lanes(S, 0, get_lanes(S, 0) + drive[0] * v)
    if count > 1:
        put_lanes(S, 4, get_lanes(S, 4) + drive[1] * v)
    if count > 2:
        put_lanes(S, 8, get_lanes(S, 8) + drive[2] * v)
        put_lanes(S, 12, get_lanes(S, 12) + drive[3] * v)


@compile_inline
def add_other_products(work, p, g):
    """Add what entry p and those before it at its link do to each other through its joint, of inverse pivot g."""
    entry = work.paths.entries[at(p)]
    drive = work.entries[at(p)].drive
    q = work.paths.entries[at(p)].begin
    while q < p:
        S = work.between[at(entry.bundle), at(work.paths.entries[at(q)].bundle)].S
        add_products(S, entry.count, drive, g * get_lanes(work.entries[at(q)].drive, 0))
        q += 1


@compile_inline
def yielded_to_free(own, scratch, force):
    """Return ``D^-1 force`` of a free joint for the forces of four rows; the scratch ``(24,)`` holds it too."""
    put_lanes6(scratch, force)
    _solve_free(own.pivot, scratch)
    return get_lanes6(scratch)


@compile_inline
def _solve_free(pivot, x):
    """Solve with the rows that `joints.factor_joint` wrote for a free joint; lanes ``x (24,)`` become the solution."""
    start = 0
    for a in range(6):
        g = 1.0 / pivot[start]
        found = get_lanes(x, 4 * a)
        for b in range(1, 6 - a):
            put_lanes(x, 4 * (a + b), get_lanes(x, 4 * (a + b)) - (g * pivot[start + b]) * found)
        start += 6 - a
    for a in range(5, -1, -1):
        start -= 6 - a
        found = get_lanes(x, 4 * a)
        for b in range(1, 6 - a):
            found = found - pivot[start + b] * get_lanes(x, 4 * (a + b))
        put_lanes(x, 4 * a, (1.0 / pivot[start]) * found)


@compile_inline
def clear(work, S):
    """Set sixteen responses to zero."""
    none = zeros(work)
    put_lanes(S, 0, none)
    put_lanes(S, 4, none)
    put_lanes(S, 8, none)
    put_lanes(S, 12, none)


@compile_inline
def zeros(work):
    """Return zeros that the compiler does not know as such, so that it does not call the system to write them."""
    return four(work.tau[0])
