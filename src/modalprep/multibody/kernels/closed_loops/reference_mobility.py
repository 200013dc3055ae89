"""Reference mobilities of the rows, in other positions of the joints: they show where a row loses its direction.

Arguments as in constraints.py.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.articulated_body import outward_in_world
from modalprep.multibody.kernels.closed_loops.constraints import constraint_residual
from modalprep.multibody.kernels.closed_loops.factor import update_weights
from modalprep.multibody.kernels.closed_loops.responses import inward_with_rows
from modalprep.multibody.kernels.joints import is_turn, move

SAMPLES = 3
GOLDEN = 0.6180339887498949  # its multiples fill a circle evenly


@compile_kernel
def write_reference_mobility(cons, model, data, y, motion, t, work, rigid, size, place):
    """Write the largest mobility of each row in some positions of the joints, where the loops may be open.

    Parameters
    ----------
    rigid : float
        Of the metric ``1 + rigid K`` of the modes: so large that bodies hardly deflect.
    size : float
        Of the system, m.
    place : (ny,)
        Scratch.
    """
    work.reference_mobility[:] = 0.0
    for k in range(SAMPLES):
        sample_step(model, k * len(work.step), size, work.step)
        copy(y, place)
        move(model, place, work.step, place)
        place[model.nx :] = 0.0
        outward_in_world(model, data, place, motion)
        constraint_residual(cons, model, data, place, motion, t, work, False)
        if inward_with_rows(cons, model, data, work, work.tau, None, 0.0, rigid) < 0:
            for p in range(len(work.paths.row)):
                i = work.paths.row[p]
                if i >= 0:
                    mobility = work.bundles[p >> 2].S[5 * (p & 3)]
                    work.reference_mobility[i] = max(work.reference_mobility[i], mobility)
    update_weights(work)


@compile_kernel
def sample_step(model, first, size, step):
    """Write a step that turns each joint by up to half a turn and shifts it by up to `size`; modes stay.

    `first` is the number of its first coordinate in a sequence that fills this range evenly.
    """
    step[:] = 0.0
    for i in range(len(model.links)):
        link = model.links[i]
        for u in range(link.u, link.uq):
            share = (first + u + 1) * GOLDEN
            share -= np.floor(share) + 0.5
            step[u] = 2.0 * np.pi * share if is_turn(link, u) else 2.0 * size * share
