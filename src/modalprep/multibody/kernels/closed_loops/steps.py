"""Steps of joints that close loops: no farther than linear equations hold, and off a dead point.

Arguments as in constraints.py.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.closed_loops.constraints import DISTANCE, POINT
from modalprep.multibody.kernels.closed_loops.usual import elsewhere
from modalprep.multibody.kernels.joints import is_turn, move

TURN = 0.5  # rad or sizes of the system: the most that a Newton step moves a joint


@compile_kernel
def shorten(cons, model, work):
    """Shorten a Newton step that would move a joint far: there its linear equations do not hold."""
    most, size = 1.0, np.inf
    for i in range(len(model.links)):
        for u in range(model.links[i].u, model.links[i].uq):
            if is_turn(model.links[i], u):
                most = max(most, abs(work.step[u]) / TURN)
            elif abs(work.step[u]) > 0.0:
                if size == np.inf:
                    size = _size(cons, work)
                most = max(most, abs(work.step[u]) / (TURN * size))
    if most > 1.0:
        for u in range(len(work.step)):
            work.step[u] /= most


@compile_kernel
def back_up(model, work, y):
    """Take the last step of the joints and modes back."""
    for u in range(len(work.step)):
        work.step[u] = -work.step[u]
    move(model, y, work.step, y)


@compile_kernel
def damp(work, share):
    """Add a share of its usual mobility to that of each row: steps become shorter, and turn to the steepest descent."""
    for p in range(len(work.paths.row)):
        i = work.paths.row[p]
        if i >= 0:
            work.bundles[p >> 2].compliance[p & 3] = work.compliance[i] + share * work.usual[i]


@compile_kernel
def _size(cons, work):
    """Return the size of the system by its rows, infinite where none holds a length."""
    for i in range(len(cons.rows)):
        if (cons.rows[i].kind == POINT or cons.rows[i].kind == DISTANCE) and work.unit[i] > 0.0:
            return 1.0 / work.unit[i]
    return np.inf


@compile_kernel
def nudge(model, hinge, share, size, work, y):
    """Move the joints, but not those that should stay, a share of a radian or of the size: away from a dead point."""
    if share == 0.0:
        return
    elsewhere(model, 0, size, work.step)
    for u in range(len(work.step)):
        work.step[u] *= share / np.pi if hinge[u] == 0.0 else 0.0
    move(model, y, work.step, y)
