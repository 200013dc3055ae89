"""Rank of the constraints in a run, and how near their Jacobian comes to a singular position (theory 5.4).

The measure is the least sine between an independent row and those before it (factor.py). Arguments as in
constraints.py; `work` may be None.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel

REGULAR, NEARLY_SINGULAR = 0.3, 0.2  # sines: a step goes past a singular position, not into it
SINGULAR = 0.01  # accelerations have the round-off of coordinates over the third power of the sine
NOT_SINGULAR = 4.0 * SINGULAR  # from here a somewhat shorter step can pass a singular position at its end


@compile_inline
def _is_below(work, sine):
    """Return whether fewer rows are independent than in the last closed state, or as many with one below a sine."""
    return work.rank[0] < work.closed_rank[0] or (work.rank[0] == work.closed_rank[0] and work.sine[0] < sine)


@compile_kernel
def is_singular(work):
    """Return whether the loops are where round-off decides the accelerations."""
    if work is None:
        return False
    return _is_below(work, SINGULAR)


@compile_kernel
def is_nearly_singular(work):
    """Return whether the loops have come near a singular position since the last closed state."""
    if work is None:
        return False
    return _is_below(work, min(REGULAR, 0.5 * work.closed_sine[0]))


@compile_kernel
def begins_regular(work):
    """Return whether the state of the last factor is clearly not singular, and keep its rank."""
    if work is None:
        return False
    keep_rank(work)
    return work.sine[0] > NOT_SINGULAR


@compile_kernel
def ends_singular(work, again):
    """Return whether a step ends in a singular position, or near one, that another step can pass.

    `again`: after a step that failed, only a position counts where round-off decides.
    """
    if work is None:
        return False
    if is_singular(work) and work.closed_sine[0] > NOT_SINGULAR:
        return True
    return not again and _is_below(work, NEARLY_SINGULAR) and work.closed_sine[0] > REGULAR


@compile_kernel
def begin_step(work, implicit):
    """Reset the least sine of a step; `implicit` is the Work of implicit steps, or None."""
    if work is not None:
        work.least_sine[0] = 1.0
        if implicit is not None:
            implicit.least_sine[0] = 1.0


@compile_kernel
def came_near(work, implicit):
    """Return whether since `begin_step` the loops came so near a singular position that they may have passed it."""
    if work is None:
        return False
    least = work.least_sine[0]
    if implicit is not None and len(implicit.value) == len(work.value):  # no compliant rows
        least = min(least, implicit.least_sine[0])
    return least < REGULAR


@compile_kernel
def reset_rank(work):
    """Let the next factor find the rank without that of a closed state."""
    if work is not None:
        work.closed_rank[0] = len(work.order)


@compile_kernel
def keep_rank(work):
    """Take the rank and the sine of the last factor as those of a closed state."""
    if work is not None:
        work.closed_rank[0], work.closed_sine[0] = work.rank[0], work.sine[0]
