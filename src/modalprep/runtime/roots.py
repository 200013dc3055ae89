"""The kernels that C calls: derivatives and channels of a state, the check of a step, and the step loop itself."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.elements.half_turns import follow_turns, write_turns
from modalprep.multibody.evaluation.evaluate import GOOD, close, evaluate
from modalprep.multibody.integration.driver import DIVERGED, WOUND, _too_far, advance, begin
from modalprep.multibody.integration.stepping import OPEN
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.closed_loops.singularities import keep_rank, reset_rank
from modalprep.multibody.kernels.joints import normalise
from modalprep.multibody.results.channels import Columns
from modalprep.multibody.results.observation import observe


@by_address
class Outside(NamedTuple):
    """What C reads and writes, and the columns of the channels (`Columns`)."""

    y: np.ndarray  # (ny,) coordinates, speeds and work: that of the run
    state: np.ndarray  # (ny,) the same with quaternions of length one, on closed loops
    ydot: np.ndarray  # (ny,)
    row: np.ndarray  # (width,) channels
    joints: np.ndarray
    wrenches: np.ndarray
    bodies: np.ndarray
    closures: np.ndarray
    elements: np.ndarray
    motions: np.ndarray
    momenta: np.ndarray
    part: np.ndarray
    reactions: np.ndarray
    sums: np.ndarray


@compile_kernel
def derive(eq, out, t):
    """Write `state` and `ydot` of `y`; returns a status of `evaluate`, or OPEN where loops cannot be closed."""
    copy(out.y, out.state)
    normalise(eq.model, out.state)
    if close(eq, t, out.state, 0.0, False) < 0:
        return OPEN
    return evaluate(eq, t, out.state, out.ydot)


@compile_kernel
def channels(eq, out, t):
    """Write the channels to `row`, after `derive`; the data are then those of no evaluation."""
    columns = Columns(
        out.joints,
        out.wrenches,
        out.bodies,
        out.closures,
        out.elements,
        out.motions,
        out.momenta,
        out.part,
        out.reactions,
        out.sums,
    )
    observe(eq, columns, t, out.state, out.ydot, out.row)


@compile_kernel
def enter(eq, out, run, t):
    """Begin at a time, for steps of another integrator: the turns of springs are those of `y`."""
    reset_rank(eq.work)
    status = derive(eq, out, t)
    keep_rank(eq.work)
    if status == GOOD:
        write_turns(eq.loads, eq.model, eq.data, run.turns[0])
    return status


@compile_kernel
def complete(eq, out, run, watch, t, h):
    """Look at a step of another integrator; returns GOOD, DIVERGED, WOUND or a status of `derive`."""
    if _too_far(eq.model, watch, run):
        return DIVERGED
    status = derive(eq, out, t)
    keep_rank(eq.work)
    if status == GOOD and follow_turns(eq.loads, eq.model, eq.data, run.turns[0], run.turns[1], h) >= 0:
        return WOUND
    return status


ROOTS = {
    "derive": derive,
    "channels": channels,
    "enter": enter,
    "complete": complete,
    "begin": begin,
    "advance": advance,
}
