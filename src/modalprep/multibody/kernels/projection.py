"""Projection of states onto closed loops and motion constraints: theory 5."""

from __future__ import annotations

import numpy as np

from modalprep.jit import compile_kernel
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.articulated_body import inward, outward
from modalprep.multibody.kernels.constraints import constraint_residual
from modalprep.multibody.kernels.interfaces import world
from modalprep.multibody.kernels.joints import move
from modalprep.multibody.kernels.multipliers import (
    impose,
    violation,
)

CLOSED = 1e-11  # of lengths by the size of the system, and of angles: what Newton reaches in double precision
FINE, FINE_RATE = 1e-3, 1e-2  # of the tolerance: singular positions magnify what is left, so it should be round-off
SLOW = 0.25  # a gap of which a Newton step leaves so much is round-off


@compile_kernel
def project_positions(cons, model, data, y, motion, t, work, hinge, stiff, tolerance, most):
    """Bring the coordinates of y onto ``Phi(x, t) = 0`` by Newton steps, each the least change in its metric.

    Parameters
    ----------
    hinge : (nu,)
        Inertias added to the hinges, see `inward`: large where a coordinate should stay, else 0.
    stiff : float
        The metric's modal rows are ``1 + stiff K``.
    tolerance : float
        Of `violation`.
    most : int
        Newton steps.

    Returns
    -------
    steps : number of Newton steps, -1 when they do not reach the tolerance or the mass matrix is not positive
    """
    last = np.inf
    for k in range(most + 1):
        outward(model, data, y, motion)
        world(model, data)
        constraint_residual(cons, model, data, y, motion, t, work)
        worst = violation(work, work.phi)
        if worst <= FINE * tolerance or (worst <= tolerance and (k == most or worst > SLOW * last)):
            return k
        if k == most or not np.isfinite(worst):
            return -1
        copy(work.phi, work.wanted)
        if not _move(cons, model, data, work, hinge, stiff):
            return -1
        if worst > last:  # overshot: a shorter step
            for c in range(len(work.step)):
                work.step[c] *= 0.5
        last = worst
        move(model, y, work.step, y)
    return -1


@compile_kernel
def project_velocities(cons, model, data, y, work, hinge, stiff):
    """Bring the speeds of y onto ``Phi' = 0`` by the least change, after `constraint_residual`; False on failure."""
    copy(work.rate, work.wanted)
    moves = _move(cons, model, data, work, hinge, stiff)
    if moves:
        for k in range(len(work.step)):
            y[model.nx + k] += work.step[k]
    return moves


@compile_kernel
def _move(cons, model, data, work, hinge, stiff):
    if inward(model, data, work.tau, hinge, 0.0, stiff) >= 0:
        return False
    impose(cons, model, data, work)
    return True


@compile_kernel
def settle(cons, model, data, y, motion, t, work, hinge, stiff, tolerance, most):
    """Project coordinates and speeds of y, both to `tolerance`; returns how often it moved something, -1 on failure.

    For an integrator after an accepted step; arguments as `project_positions`. Without loops it does nothing.
    """
    if cons is None:
        return 0
    if len(cons.rows) == 0:
        return 0
    steps = project_positions(cons, model, data, y, motion, t, work, hinge, stiff, tolerance, most)
    if steps >= 0 and violation(work, work.rate) > FINE_RATE * tolerance:
        steps = steps + 1 if project_velocities(cons, model, data, y, work, hinge, stiff) else -1
    return steps
