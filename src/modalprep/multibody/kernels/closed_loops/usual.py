"""The usual mobility of rows, in other positions of the joints: beside it a row that loses its direction is seen.

Arguments as in constraints.py.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.articulated_body import outward_in_world
from modalprep.multibody.kernels.closed_loops.constraints import constraint_residual
from modalprep.multibody.kernels.closed_loops.factor import weigh
from modalprep.multibody.kernels.closed_loops.responses import inward_and_respond
from modalprep.multibody.kernels.joints import is_turn, move

POSITIONS = 3
GOLDEN = 0.6180339887498949  # multiples of it fill a circle evenly


@compile_kernel
def write_usual(cons, model, data, y, motion, t, work, rigid, size, place):
    """Write the largest mobility of each row in some positions of the joints, which need not close the loops.

    Parameters
    ----------
    rigid : float
        Of the metric ``1 + rigid K`` of the modes: so large that bodies hardly deflect.
    size : float
        Of the system, m.
    place : (ny,)
        Scratch.
    """
    work.usual[:] = 0.0
    for k in range(POSITIONS):
        elsewhere(model, k * len(work.step), size, work.step)
        copy(y, place)
        move(model, place, work.step, place)
        place[model.nx :] = 0.0
        outward_in_world(model, data, place, motion)
        constraint_residual(cons, model, data, place, motion, t, work, False)
        if inward_and_respond(cons, model, data, work, work.tau, None, 0.0, rigid) < 0:
            for p in range(len(work.paths.row)):
                i = work.paths.row[p]
                if i >= 0:
                    work.usual[i] = max(work.usual[i], work.bundles[p >> 2].S[5 * (p & 3)])
    weigh(work)


@compile_kernel
def elsewhere(model, first, size, step):
    """Write increments that turn each joint to somewhere else and shift it by up to a size, and no modes."""
    step[:] = 0.0
    for i in range(len(model.links)):
        link = model.links[i]
        for u in range(link.u, link.uq):
            share = (first + u + 1) * GOLDEN
            share -= np.floor(share) + 0.5
            step[u] = 2.0 * np.pi * share if is_turn(link, u) else 2.0 * size * share
