"""A run that starts at a change point of its closed loops, where its speeds must be those of one of the branches.

More speeds d keep the rows there, ``G d = 0``, than there are motions: no force changes the acceleration
``w^T G'(d) d`` of the row w that has lost its direction, so it must vanish too (branches.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.integration.branches import FLAT, SHIFT, ZERO, Course, Regular, Singular, tangents_of
from modalprep.multibody.kernels.articulated_body import outward
from modalprep.multibody.kernels.joints import move
from modalprep.multibody.kernels.newton_euler import required_forces

NEITHER = 1e-6  # of the kinetic energy: what belongs to neither branch by round-off and given digits


class Start(NamedTuple):
    """A change point at the start: row that loses its direction, tangents of two branches, the nearer one first.

    None where there are not just two. `share` is that of the kinetic energy which belonged to neither.
    """

    row: int
    tangents: tuple[np.ndarray, np.ndarray] | None  # (nu,) each
    share: float


def branching_start(loading: Loading, y: np.ndarray) -> Start | None:
    """Return the change point at which a closed start y (nx + nu,) is, whose speeds are brought onto the nearer branch.

    None of other starts. Nearer is meant in the mass matrix; at rest it is either of them. The row is no longer noted
    as redundant.
    """
    loops = loading.closed_loops
    left, work = loops.redundant, loops.work
    mobile = work.reference_mobility[left] > work.least_mobility[left]
    if not np.any(mobile):  # in no position
        return None
    course = Course(loading, (0.0, 0.0), (y, y), Regular(0, 0.0))
    u, sizes, v = np.linalg.svd(course.jacobian(y, 0.0))
    k = np.count_nonzero(sizes > ZERO * sizes.max(initial=0.0))
    lost = u[:, k:]
    null = v[k:].T
    w = _turning(course, y, lost, null, FLAT * sizes.max(initial=0.0)) if lost.size and null.size else None
    if w is None:
        return None
    row = int(left[np.argmax(np.abs(w[left]))])
    loops.note_redundant(left[left != row])
    bend = course.bend_at(y, 0.0, Singular(0.0, w, null[:, 0], null, np.zeros((len(y), 0))))
    tangents = None if course.driven else tangents_of(null, bend)
    if tangents is None:
        return Start(row, None, 0.0)
    one, other = tangents
    mass = _mass(course, y, null)
    speeds = y[course.nx :]
    energy = max(float(speeds @ null @ mass @ null.T @ speeds), 1e-300)
    (one_share, onto_one), (other_share, onto_other) = (
        _onto(a, b, null, mass, speeds, energy) for a, b in ((one, other), (other, one))
    )
    if one_share > other_share:
        one, other, one_share, onto_one = other, one, other_share, onto_other
    speeds[:] = onto_one
    return Start(row, (one, other), one_share)


def _turning(course: Course, y: np.ndarray, lost: np.ndarray, null: np.ndarray, least: float) -> np.ndarray | None:
    """Return the row (m,) of those `lost` that a motion of the null space brings back; None of redundant ones."""
    d = null @ np.random.default_rng(0).standard_normal(null.shape[1])
    d /= np.linalg.norm(d)
    ends = [y.copy(), y.copy()]
    for end, shift in zip(ends, (SHIFT, -SHIFT), strict=True):
        move(course.model, end, shift * d, end)
    one, two = (lost.T @ course.jacobian(end, 0.0) @ d for end in ends)
    turn = (one - two) / (2 * SHIFT)
    return lost @ turn / np.linalg.norm(turn) if np.linalg.norm(turn) > least else None


def _mass(course: Course, y: np.ndarray, null: np.ndarray) -> np.ndarray:
    """Return the mass matrix of the motions of a null space (n, n)."""
    found = []
    still = y.copy()
    out = np.zeros(null.shape[0])
    still[course.nx :] = 0.0
    for d in (np.zeros(len(out)), *null.T):
        outward(course.model, course.data, still, course.loading.prescribe(0.0, course.data))
        required_forces(course.model, course.data, d, out)
        found.append(null.T @ out)
    return np.array(found[1:]) - found[0]


def _onto(
    tangent: np.ndarray, other: np.ndarray, null: np.ndarray, mass: np.ndarray, speeds: np.ndarray, energy: float
) -> tuple[float, np.ndarray]:
    """Return the share of the energy that a tangent's branch does not allow, and the speeds without it."""
    across = null.T @ (other - (tangent @ other) * tangent)
    way = np.linalg.solve(mass, across)
    size = float(across @ null.T @ speeds)
    along = float(across @ way)
    return size**2 / along / energy, speeds - null @ way * (size / along)
