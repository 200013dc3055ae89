"""Projection of states onto closed loops and motion constraints, and their assembly at the start: theory 5.4.

Iterations have kinematics of their own, in `trial`. Inertias and the factor stay in `data` as long as the state is near
theirs: corrections are small, so that Newton's method converges hardly more slowly with the first matrix.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_kernel, compile_once
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.articulated_body import inward, outward, outward_in_world, outward_motion
from modalprep.multibody.kernels.closed_loops.constraint_forces import multiplier_response
from modalprep.multibody.kernels.closed_loops.constraints import COUPLER, DISTANCE, constraint_residual
from modalprep.multibody.kernels.closed_loops.factor import factorise, solve, violation
from modalprep.multibody.kernels.closed_loops.reference_mobility import write_reference_mobility
from modalprep.multibody.kernels.closed_loops.responses import gather_responses, inward_with_rows
from modalprep.multibody.kernels.closed_loops.singularities import REGULAR
from modalprep.multibody.kernels.closed_loops.steps import damp, leave_dead_point, limit_step, undo_step
from modalprep.multibody.kernels.joints import move
from modalprep.multibody.model.joint_types import FREE, SPHERICAL

CLOSED = 1e-11  # tolerance of lengths relative to the size of the system, and of angles: near round-off
FINE, FINE_RATE = 1e-3, 1e-2  # of the tolerance: aimed at, as singular positions magnify what is left
SLOW = 0.25  # a Newton step that leaves more of a gap has come to round-off
NEAR = 1e-5  # largest gap for which a Newton step may use an old matrix
FAST = 0.01  # share of a gap that a Newton step with an old matrix may leave
CLOSED_RATE = 1e-8  # tolerance of rates, of the largest speed
MOST_STEPS = 60  # of an assembly
FAR = 0.01  # a gap beyond which a step that widens it is undone, and damped (Levenberg and Marquardt)
LEAST_DAMPING, MORE_DAMPING = 1e-3, 10.0  # in reference mobilities of a row; its growth
TRIALS, OFFSET = 3, 0.05  # starts beside a dead point, and their distance in rad or sizes: once, twice, ..
PENALTY = 1e8  # factor on the inertia of coordinates that should stay
DIAGONAL = (0, 3, 5)  # of a symmetric matrix

# Directions of a closure with two rows or three of ANGLE: these, ``ea.eb = 0``, hold for reversed directions too.
ORIENTATION = np.dtype(
    [
        ("a", np.int64),
        ("b", np.int64),  # ends
        ("row", np.int64),  # one of its rows
        ("fixed", np.int64),  # whether all three rotations are constrained
        ("in_a", np.float64, 12),
        ("in_b", np.float64, 12),  # its axis, then x, y, z: in the axes of the links of its ends
    ]
)


@compile_kernel
def project_positions(cons, model, data, trial, y, motion, t, work, hinge, stiff, tolerance, most, factored):
    """Bring the coordinates of y onto ``Phi(x, t) = 0`` by Newton steps, each the least change in its metric.

    Parameters
    ----------
    data : Data
        Of the inertias.
    trial : Data
        Another, for the kinematics.
    hinge : (nu,)
        Inertias added to the joints, see `inward`: large where a coordinate should stay, else 0.
    stiff : float
        The metric's modal rows are ``1 + stiff K``.
    tolerance : float
        Of `violation`.
    most : int
        Newton steps.
    factored : bool
        Whether `data` and `work` hold the inertias of this metric and their factor at a state near y.

    Returns
    -------
    steps : number of Newton steps, -1 when they do not reach the tolerance or the mass matrix is not positive
    """
    last, damping = np.inf, 0.0
    for k in range(most + 1):
        _residual(cons, model, trial, y, motion, t, work)
        worst = violation(work, work.phi)
        if worst > last and worst > FAR:
            undo_step(model, work, y)
            _residual(cons, model, trial, y, motion, t, work)
            worst, last = last, np.inf
            damping = max(LEAST_DAMPING, MORE_DAMPING * damping)
            damp(work, damping)
        elif damping > 0.0:
            damping = damping / MORE_DAMPING if worst > FAR else 0.0
            damp(work, damping)
        if worst <= FINE * tolerance or (worst <= tolerance and (k == most or worst > SLOW * last)):
            return k
        if k == most or not np.isfinite(worst):
            damp(work, 0.0)
            return -1
        factored = factored and worst <= NEAR and worst <= FAST * last and work.sine[0] > REGULAR
        if not factored and not _factorise_at(cons, model, data, y, motion, work, hinge, stiff):
            damp(work, 0.0)
            return -1
        factored = True
        copy(work.phi, work.residual)
        solve(work)
        multiplier_response(model, data, work)
        limit_step(cons, model, work)
        if worst > last:  # overshot: a shorter step
            for c in range(len(work.step)):
                work.step[c] *= 0.5
        last = worst
        move(model, y, work.step, y)
    return -1


@compile_kernel
def project_velocities(cons, model, data, y, motion, work, hinge, stiff, tolerance, factored):
    """Bring the speeds of y onto ``Phi' = 0`` by the least change, after `project_positions`; False on failure.

    `factored` as there, but the factor is computed again where it leaves more than `tolerance` of a row, as of one that
    was redundant where the loops were open. That of a state nearby leaves a little: `project_state` repeats the step.
    """
    copy(work.rate, work.residual)
    if factored:
        solve(work)
        factored = work.sine[0] > REGULAR and _remaining_violation(work) <= tolerance
    if not factored:
        if not _factorise_at(cons, model, data, y, motion, work, hinge, stiff):
            return False
        solve(work)
    multiplier_response(model, data, work)
    for k in range(len(work.step)):
        y[model.nx + k] += work.step[k]
    return True


@compile_kernel
def _residual(cons, model, trial, y, motion, t, work):
    """Write Phi and Phi' of all rows at a state."""
    outward_motion(model, trial, y, motion)
    constraint_residual(cons, model, trial, y, motion, t, work, False)


@compile_kernel
def _remaining_violation(work):
    """Return what the multipliers of the last `solve` leave of the `residual`, see `violation`."""
    gather_responses(work)
    for i in range(len(work.target)):
        work.target[i] = work.residual[i]
        for j in range(len(work.target)):
            work.target[i] += work.S[i, j] * work.multiplier[j]
    return violation(work, work.target)


@compile_kernel
def _factorise_at(cons, model, data, y, motion, work, hinge, stiff):
    """Write the inertias and the factor of the rows at a state, after `constraint_residual`; False on failure."""
    outward_in_world(model, data, y, motion)
    if inward_with_rows(cons, model, data, work, work.tau, hinge, 0.0, stiff) >= 0:
        return False
    factorise(work)
    return True


@compile_once
def project_state(cons, model, data, trial, y, motion, t, work, hinge, stiff, tolerance, most, factored):
    """Project coordinates and speeds of y, both to `tolerance`; returns the number of changes, -1 on failure.

    For an integrator after an accepted step; arguments as `project_positions`. Without loops it does nothing.
    """
    if cons is None:
        return 0
    if len(cons.rows) == 0:
        return 0
    steps = project_positions(cons, model, data, trial, y, motion, t, work, hinge, stiff, tolerance, most, factored)
    old = steps > 0 and not factored  # the factor is that of a state before the coordinates moved
    fine = FINE_RATE * tolerance
    last = np.inf
    while steps >= 0 and violation(work, work.rate) > fine and violation(work, work.rate) < SLOW * last:
        last = violation(work, work.rate)
        moves = project_velocities(cons, model, data, y, motion, work, hinge, stiff, fine, factored or old)
        steps = steps + 1 if moves else -1
        if not old:
            break
        _residual(cons, model, trial, y, motion, t, work)
    return steps


@compile_kernel
def rate_slopes(cons, model, data, y, motion, t, work, out):
    """Write the derivatives of the rows' rates by the speeds to ``out (m, nu)``, exactly, as rates are linear in them.

    The prescribed `motion` must stand still; the speeds of y are overwritten.
    """
    for u in range(out.shape[1]):
        y[model.nx :] = 0.0
        y[model.nx + u] = 1.0
        _residual(cons, model, data, y, motion, t, work)
        for i in range(out.shape[0]):
            out[i, u] = work.rate[i] + work.driven_rate[i]


@compile_kernel
def assemble(cons, model, data, trial, y, motion, t, work, orientations, kept, hinge, soft, size, out):
    """Write the consistent state nearest to y, in the mass matrix, to `out`; False where the loops do not close.

    Joints of the links `kept` and modes at rest stay where the loops close without them.

    Parameters
    ----------
    orientations : (no,) ORIENTATION
        Of closures that could close with reversed directions.
    kept : (nk,) int
        Links.
    hinge : (nu,)
        Scratch.
    soft : float
        1 / K of the softest mode.
    size : float
        Of the system, m.
    """
    write_reference_mobility(cons, model, data, y, motion, t, work, PENALTY * soft, size, out)
    _take_start_values(cons, model, data, y, motion, t, work)
    _penalise(model, data, y, motion, kept, work, hinge)
    for trials in range(TRIALS + 1):
        for attempt in range(3):
            copy(y, out)
            leave_dead_point(model, hinge, OFFSET * trials, size, work, out)
            stiff = PENALTY * soft if attempt == 0 else soft
            own = work.tau if attempt == 2 else hinge
            if _close(cons, model, data, trial, out, motion, t, work, orientations, own, stiff, size):
                return True
    return False


@compile_kernel
def _take_start_values(cons, model, data, y, motion, t, work):
    """Take lengths and sums of joint coordinates that are not prescribed from the start values."""
    measured = False
    for i in range(len(cons.rows)):
        if (cons.rows[i].kind == DISTANCE or cons.rows[i].kind == COUPLER) and cons.rows[i].table < 0:
            if not measured:
                _residual(cons, model, data, y, motion, t, work)
                measured = True
            work.value[i] += work.phi[i]


@compile_kernel
def _penalise(model, data, y, motion, kept, work, hinge):
    """Write added inertias of the joints of the links `kept` to `hinge`: PENALTY times what each joint carries."""
    hinge[:] = 0.0
    if len(kept) == 0:
        return
    outward(model, data, y, motion)
    inward(model, data, work.tau, hinge, 0.0, 0.0)
    for i in kept:
        joint = model.links[i].joint
        largest = 0.0
        turns = model.links[i].about != 0.0
        for k in range(3):
            if joint == FREE or joint == SPHERICAL or (turns and k == 2):
                largest = max(largest, abs(data.links[i].J[DIAGONAL[k]]))
            if joint == FREE or (joint != SPHERICAL and not turns and k == 2):
                largest = max(largest, abs(data.links[i].M[DIAGONAL[k]]))
        for u in range(model.links[i].u, model.links[i].uq):
            hinge[u] = PENALTY * largest


@compile_kernel
def _close(cons, model, data, trial, y, motion, t, work, orientations, hinge, stiff, size):
    """Project coordinates and speeds of y; False where the loops stay open."""
    steps = project_positions(cons, model, data, trial, y, motion, t, work, hinge, stiff, CLOSED, MOST_STEPS, False)
    if steps < 0 or is_reversed(orientations, work):
        return False
    if not project_velocities(cons, model, data, y, motion, work, hinge, stiff, 0.0, False):
        return False
    _residual(cons, model, data, y, motion, t, work)
    fastest, driven = 0.0, 0.0
    for k in range(model.nx, len(y)):
        fastest = max(fastest, abs(y[k]))
    for i in range(len(work.driven_rate)):
        driven = max(driven, abs(work.driven_rate[i]))
    return violation(work, work.rate) <= CLOSED_RATE * (fastest + driven / size)


@compile_kernel
def is_reversed(orientations, work):
    """Return whether the directions of an active closure are parallel but opposite, after `constraint_residual`."""
    for i in range(len(orientations)):
        own = orientations[i]
        if work.unit[own.row] > 0.0:
            trace = 0.0
            for k in range(1, 4):
                trace += _cosine(own, work, k)
            if _cosine(own, work, 0) < 0.0 or (own.fixed and trace < 2.0):
                return True
    return False


@compile_kernel
def _cosine(orientation, work, k):
    """Return the cosine between direction k on both ends."""
    total = 0.0
    for r in range(3):
        in_a, in_b = 0.0, 0.0
        for c in range(3):
            in_a += work.ends[orientation.a].rotation[3 * r + c] * orientation.in_a[3 * k + c]
            in_b += work.ends[orientation.b].rotation[3 * r + c] * orientation.in_b[3 * k + c]
        total += in_a * in_b
    return total
