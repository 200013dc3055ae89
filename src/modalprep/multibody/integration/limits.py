"""Limits of a step: the functions of time that it must not step over, and the step that the user allows."""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel

SHARE = (2.0, 0.5, 0.5)  # of a cell of `packing.step_bounds`, that a step of a method may take


@compile_kernel
def next_end(run, t, stop):
    """Return where a step has to end at the latest: at a kink of a function of time, or at `stop`."""
    k = _first_after(run.ends, t)
    return min(stop, run.ends[k]) if k < len(run.ends) else stop


@compile_kernel
def limited(run, method, t, h):
    """Return a step h from t, shortened to what each cell that it reaches allows."""
    cells = run.cells
    h = min(h, run.clock[0].longest)
    for k in range(max(0, _first_after(cells[:, 0], t) - 1), len(cells)):
        before = max(0.0, cells[k, 0] - t)
        if before >= h:
            break
        h = min(h, before + SHARE[method] * cells[k, 1])
    return h


@compile_inline
def _first_after(times, t):
    """Return the number of the first of ascending times that is later than t; how many there are if none is."""
    low = 0
    high = len(times)
    while low < high:
        middle = (low + high) // 2
        if times[middle] > t:
            high = middle
        else:
            low = middle + 1
    return low
