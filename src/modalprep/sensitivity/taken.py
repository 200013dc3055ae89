"""Steps as they are taken, kept by compiled code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.integration.driver import RUNNING, advance
from modalprep.multibody.kernels.algebra.tuples import copy


@by_address
class Taken(NamedTuple):
    """The last steps; rows of some at once."""

    filled: np.ndarray  # (1,) int, rows that are
    times: np.ndarray  # (k, 2) s, begin and end
    y: np.ndarray  # (k, nx + nu) states at the begin
    end: np.ndarray  # (k, nx + nu)
    udot: np.ndarray  # (k, nu) accelerations at the end
    algorithmic: np.ndarray  # (k, 2, nu)


def new_taken(rows: int, nx: int, nu: int) -> Taken:
    """Return room for so many steps."""
    return Taken(
        np.zeros(1, dtype=np.int64),
        np.empty((rows, 2)),
        np.empty((rows, nx + nu)),
        np.empty((rows, nx + nu)),
        np.empty((rows, nu)),
        np.empty((rows, 2, nu)),
    )


@compile_kernel
def advance_kept(eq, run, watch, taken, method, stop, most):
    """Do as `driver.advance`, at most as many steps as there is room for, and keep each."""
    nx, nu = eq.model.nx, len(eq.tau)
    taken.filled[0] = 0
    for _ in range(min(most, len(taken.times))):
        before = run.counters[0].steps
        code = advance(eq, run, watch, method, stop, 1)
        if run.counters[0].steps > before:
            k = taken.filled[0]
            taken.filled[0] = k + 1
            taken.times[k, 0], taken.times[k, 1] = run.clock[0].begin, run.clock[0].time
            copy(run.old[: nx + nu], taken.y[k])
            copy(run.y[: nx + nu], taken.end[k])
            copy(run.ydot[nx : nx + nu], taken.udot[k])
            for c in range(2):
                copy(run.K[1 + c, :nu], taken.algorithmic[k, c])
        if code != RUNNING:
            return code
    return RUNNING
