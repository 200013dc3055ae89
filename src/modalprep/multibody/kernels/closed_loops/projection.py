"""Projection of states onto closed loops and motion constraints: theory 5.

The coordinates move in `trial`, data of its own, while the inertias and the factor of `data` stay as they are as long
as they are near enough: corrections are small, so that Newton steps with the first matrix hardly converge more slowly.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_kernel, compile_once
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.articulated_body import inward, outward, outward_in_world, outward_motion
from modalprep.multibody.kernels.closed_loops.constraints import COUPLER, DISTANCE, constraint_residual
from modalprep.multibody.kernels.closed_loops.factor import factorize, solve, violation
from modalprep.multibody.kernels.closed_loops.multipliers import REGULAR
from modalprep.multibody.kernels.closed_loops.pushing import yield_to_multipliers
from modalprep.multibody.kernels.closed_loops.responses import inward_and_respond, write_responses
from modalprep.multibody.kernels.closed_loops.steps import back_up, damp, nudge, shorten
from modalprep.multibody.kernels.closed_loops.usual import write_usual
from modalprep.multibody.kernels.data import FREE, SPEEDS, SPHERICAL
from modalprep.multibody.kernels.joints import move

CLOSED = 1e-11  # of lengths by the size of the system, and of angles: what Newton reaches in double precision
FINE, FINE_RATE = 1e-3, 1e-2  # of the tolerance: singular positions magnify what is left, so it should be round-off
SLOW = 0.25  # a gap of which a Newton step leaves so much is round-off
NEAR = 1e-5  # a gap across which the matrix of a Newton step need not be new
FAST = 0.01  # what a Newton step with an old matrix may leave of a gap
CLOSED_RATE = 1e-8  # of the largest rate: closed
MOST_STEPS = 60  # of an assembly
FAR = 0.01  # a gap beyond which a step that widens it is taken back, and damped: Levenberg and Marquardt
LEAST_DAMPING, STIFFER = 1e-3, 10.0  # in usual mobilities of a row, that are added to its own
NUDGES, NUDGE = 3, 0.05  # trials from a little beside a dead point, and how far beside in rad or sizes: once, twice, ..
HELD = 1e8  # how much heavier a coordinate is that should stay
DIAGONAL = (0, 3, 5)  # of a symmetric matrix

# A closure that holds two turns or three: conditions ``ea.eb = 0`` hold both ways round.
FACE = np.dtype(
    [
        ("a", np.int64),
        ("b", np.int64),  # ends
        ("row", np.int64),  # one of its rows
        ("whole", np.int64),  # whether it holds all three turns
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
        Inertias added to the hinges, see `inward`: large where a coordinate should stay, else 0.
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
        _measure(cons, model, trial, y, motion, t, work)
        worst = violation(work, work.phi)
        if worst > last and worst > FAR:
            back_up(model, work, y)
            _measure(cons, model, trial, y, motion, t, work)
            worst, last = last, np.inf
            damping = max(LEAST_DAMPING, STIFFER * damping)
            damp(work, damping)
        elif damping > 0.0:
            damping = damping / STIFFER if worst > FAR else 0.0
            damp(work, damping)
        if worst <= FINE * tolerance or (worst <= tolerance and (k == most or worst > SLOW * last)):
            return k
        if k == most or not np.isfinite(worst):
            damp(work, 0.0)
            return -1
        factored = factored and worst <= NEAR and worst <= FAST * last and work.sine[0] > REGULAR
        if not factored and not _factor(cons, model, data, y, motion, work, hinge, stiff):
            damp(work, 0.0)
            return -1
        factored = True
        copy(work.phi, work.wanted)
        solve(work)
        yield_to_multipliers(model, data, work)
        shorten(cons, model, work)
        if worst > last:  # overshot: a shorter step
            for c in range(len(work.step)):
                work.step[c] *= 0.5
        last = worst
        move(model, y, work.step, y)
    return -1


@compile_kernel
def project_velocities(cons, model, data, y, motion, work, hinge, stiff, tolerance, factored):
    """Bring the speeds of y onto ``Phi' = 0`` by the least change, after `project_positions`; False on failure.

    `factored` as there, but the factor is made anew where it leaves more than `tolerance` of a row: of one that was
    redundant where the loops were open. With the factor of a state nearby, something is left: `settle` repeats it.
    """
    copy(work.rate, work.wanted)
    if factored:
        solve(work)
        factored = work.sine[0] > REGULAR and _rest(work) <= tolerance
    if not factored:
        if not _factor(cons, model, data, y, motion, work, hinge, stiff):
            return False
        solve(work)
    yield_to_multipliers(model, data, work)
    for k in range(len(work.step)):
        y[model.nx + k] += work.step[k]
    return True


@compile_kernel
def _measure(cons, model, trial, y, motion, t, work):
    """Write what the rows of a state measure."""
    outward_motion(model, trial, y, motion)
    constraint_residual(cons, model, trial, y, motion, t, work, False)


@compile_kernel
def _rest(work):
    """Return what the multipliers of the last `solve` leave of its rows, see `violation`."""
    write_responses(work)
    for i in range(len(work.goal)):
        work.goal[i] = work.wanted[i]
        for j in range(len(work.goal)):
            work.goal[i] += work.S[i, j] * work.multiplier[j]
    return violation(work, work.goal)


@compile_kernel
def _factor(cons, model, data, y, motion, work, hinge, stiff):
    """Write the inertias at a state, and the factor of its rows, after `constraint_residual`; False on failure."""
    outward_in_world(model, data, y, motion)
    if inward_and_respond(cons, model, data, work, work.tau, hinge, 0.0, stiff) >= 0:
        return False
    factorize(work)
    return True


@compile_once
def settle(cons, model, data, trial, y, motion, t, work, hinge, stiff, tolerance, most, factored):
    """Project coordinates and speeds of y, both to `tolerance`; returns how often it moved something, -1 on failure.

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
        _measure(cons, model, trial, y, motion, t, work)
    return steps


@compile_kernel
def rate_slopes(cons, model, data, y, motion, t, work, out):
    """Write the derivatives of the rows' rates by the speeds to ``out (m, nu)``, exactly, as rates are linear in them.

    The prescribed `motion` must stand still; the speeds of y are overwritten.
    """
    for u in range(out.shape[1]):
        y[model.nx :] = 0.0
        y[model.nx + u] = 1.0
        _measure(cons, model, data, y, motion, t, work)
        for i in range(out.shape[0]):
            out[i, u] = work.rate[i] + work.push[i]


@compile_kernel
def assemble(cons, model, data, trial, y, motion, t, work, faces, kept, hinge, soft, size, found):
    """Write the consistent state nearest to y, in the mass matrix, to `found`; False where the loops do not close.

    Hinges of the links `kept` and modes at rest stay where the loops close without them.

    Parameters
    ----------
    faces : (nf,) FACE
        Closures that could close the other way round.
    kept : (nk,) int
        Links.
    hinge : (nu,)
        Scratch.
    soft : float
        1 / K of the softest mode.
    size : float
        Of the system, m.
    """
    write_usual(cons, model, data, y, motion, t, work, HELD * soft, size, found)
    _as_at_start(cons, model, data, y, motion, t, work)
    _keep(model, data, y, motion, kept, work, hinge)
    for away in range(NUDGES + 1):
        for attempt in range(3):
            copy(y, found)
            nudge(model, hinge, NUDGE * away, size, work, found)
            stiff = HELD * soft if attempt == 0 else soft
            own = work.tau if attempt == 2 else hinge
            if _closed(cons, model, data, trial, found, motion, t, work, faces, own, stiff, size):
                return True
    return False


@compile_kernel
def _as_at_start(cons, model, data, y, motion, t, work):
    """Take lengths and sums of joint coordinates that have no value from the start values."""
    measured = False
    for i in range(len(cons.rows)):
        if (cons.rows[i].kind == DISTANCE or cons.rows[i].kind == COUPLER) and cons.rows[i].table < 0:
            if not measured:
                _measure(cons, model, data, y, motion, t, work)
                measured = True
            work.value[i] += work.phi[i]


@compile_kernel
def _keep(model, data, y, motion, kept, work, hinge):
    """Write inertias that keep the coordinates of some links to `hinge`: each HELD times what the hinge carries."""
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
        for u in range(model.links[i].u, model.links[i].u + SPEEDS[joint]):
            hinge[u] = HELD * largest


@compile_kernel
def _closed(cons, model, data, trial, y, motion, t, work, faces, hinge, stiff, size):
    """Project coordinates and speeds of y; False where they do not come to be closed."""
    steps = project_positions(cons, model, data, trial, y, motion, t, work, hinge, stiff, CLOSED, MOST_STEPS, False)
    if steps < 0 or faces_away(faces, work):
        return False
    if not project_velocities(cons, model, data, y, motion, work, hinge, stiff, 0.0, False):
        return False
    _measure(cons, model, data, y, motion, t, work)
    fastest, push = 0.0, 0.0
    for k in range(model.nx, len(y)):
        fastest = max(fastest, abs(y[k]))
    for i in range(len(work.push)):
        push = max(push, abs(work.push[i]))
    return violation(work, work.rate) <= CLOSED_RATE * (fastest + push / size)


@compile_kernel
def faces_away(faces, work):
    """Whether the axes of a closure that holds agree, but point against each other, after `constraint_residual`."""
    for i in range(len(faces)):
        if work.unit[faces[i].row] > 0.0:
            turned = 0.0
            for k in range(1, 4):
                turned += _agreement(faces[i], work, k)
            if _agreement(faces[i], work, 0) < 0.0 or (faces[i].whole and turned < 2.0):
                return True
    return False


@compile_kernel
def _agreement(face, work, k):
    """Return the cosine between direction k of a face on both of its ends."""
    total = 0.0
    for r in range(3):
        in_a, in_b = 0.0, 0.0
        for c in range(3):
            in_a += work.ends[face.a].rotation[3 * r + c] * face.in_a[3 * k + c]
            in_b += work.ends[face.b].rotation[3 * r + c] * face.in_b[3 * k + c]
        total += in_a * in_b
    return total
