"""Steps of the Newton iterations that close loops: their limits, damping, and a start beside a dead point.

Arguments as in constraints.py.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.closed_loops.constraints import DISTANCE, POINT
from modalprep.multibody.kernels.closed_loops.reference_mobility import sample_step
from modalprep.multibody.kernels.joints import is_turn, move

TURN = 0.5  # rad or sizes of the system: the most that a Newton step moves a joint


@compile_kernel
def limit_step(cons, model, work):
    """Shorten a Newton step that moves a joint farther than linear equations hold."""
    most, size = 1.0, np.inf
    for i in range(len(model.links)):
        for u in range(model.links[i].u, model.links[i].uq):
            if is_turn(model.links[i], u):
                most = max(most, abs(work.step[u]) / TURN)
            elif abs(work.step[u]) > 0.0:
                if size == np.inf:
                    size = _system_size(cons, work)
                most = max(most, abs(work.step[u]) / (TURN * size))
    if most > 1.0:
        for u in range(len(work.step)):
            work.step[u] /= most


@compile_kernel
def undo_step(model, work, y):
    """Undo the last step of the joints and modes."""
    for u in range(len(work.step)):
        work.step[u] = -work.step[u]
    move(model, y, work.step, y)


@compile_kernel
def damp(work, share):
    """Add a share of its reference mobility to that of each row: steps turn to the steepest descent, and shorten."""
    for p in range(len(work.paths.row)):
        i = work.paths.row[p]
        if i >= 0:
            work.bundles[p >> 2].compliance[p & 3] = work.compliance[i] + share * work.reference_mobility[i]


@compile_kernel
def _system_size(cons, work):
    """Return the size of the system by the unit of its rows, infinite where none constrains a length."""
    for i in range(len(cons.rows)):
        if (cons.rows[i].kind == POINT or cons.rows[i].kind == DISTANCE) and work.unit[i] > 0.0:
            return 1.0 / work.unit[i]
    return np.inf


@compile_kernel
def leave_dead_point(model, hinge, share, size, work, y):
    """Move the joints by a share of a radian or of the size, but not those that should stay (`hinge` not zero)."""
    if share == 0.0:
        return
    sample_step(model, 0, size, work.step)
    for u in range(len(work.step)):
        work.step[u] *= share / np.pi if hinge[u] == 0.0 else 0.0
    move(model, y, work.step, y)
