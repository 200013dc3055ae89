"""Reduced matrices, checked: symmetric, finite, free of negative energies, and without strain in rigid motions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, eigh

from modalprep.errors import InputError
from modalprep.fe.assembly.matrix_checks import real_square, symmetric
from modalprep.supplied.integrals import Rigid

NEGATIVE = 1e-6  # eigenvalue of a matrix with unit diagonal: cards of seven digits
STRAIN = 1e-4  # force of a rigid motion over that of its absolute terms; cards of seven digits have 1e-6
UNEQUAL = 1e-4  # of the mass: difference between directions
SINGULAR = 1e-10  # of the largest eigenvalue of a scaled stiffness


def checked(A: Any, name: str, label: Callable[[int], str], rows: int | None = None) -> np.ndarray:
    """Return a dense symmetric matrix without negative eigenvalues.

    Raises
    ------
    InputError
        When it is not real, finite, square, symmetric or positive semidefinite, or has another size than `rows`.

    Examples
    --------
    >>> checked([[2.0, -1.0], [-1.0, 2.0]], "mass", str)
    array([[ 2., -1.],
           [-1.,  2.]])
    >>> checked([[1.0, 2.0], [2.0, -1.0]], "M", "row {}".format)
    Traceback (most recent call last):
    modalprep.errors.InputError: the M matrix has 1 negative diagonal entries, the lowest -1 for row 1; export it again
    """
    sparse = real_square(A, name)
    if rows is not None and sparse.shape[0] != rows:
        raise InputError(f"the {name} matrix has {sparse.shape[0]} rows, the stiffness {rows}; give both with the same")
    found = symmetric(sparse, name, label).toarray()
    lowest = _lowest(found)
    if not lowest >= -NEGATIVE:
        raise InputError(
            f"the {name} matrix is not positive: its scaled form has the eigenvalue {lowest:.3g}; export it again"
        )
    return found


def _lowest(A: np.ndarray) -> float:
    scale = np.sqrt(np.diag(A))
    scale = np.divide(1.0, scale, out=np.zeros(len(A)), where=scale > 0)
    try:
        return float(eigh(A * scale * scale[:, None], eigvals_only=True, subset_by_index=(0, 0))[0])
    except (LinAlgError, ValueError):
        return float("nan")


def rigid_motion(K: np.ndarray, R: np.ndarray, inner: np.ndarray, label: Callable[[int], str]) -> np.ndarray:
    """Return the rigid motions (rows, 6), with what the generalised coordinates `inner` do in them.

    In the form of Craig and Bampton they are at rest; in others they follow without strain.

    Raises
    ------
    InputError
        When the stiffness resists a rigid motion.

    Examples
    --------
    >>> K = np.array([[1.0, -1.0], [-1.0, 1.0]])  # the second row follows the first
    >>> rigid_motion(K, np.array([[1.0], [0.0]]), np.array([1]), str)[1]
    array([1.])
    """
    R = R.copy()
    if np.any(K[inner] @ R):
        scale = np.sqrt(np.maximum(np.diag(K)[inner], np.finfo(float).tiny))
        scaled = K[np.ix_(inner, inner)] / scale / scale[:, None]
        follow = np.linalg.pinv(scaled, rcond=SINGULAR, hermitian=True) @ ((K[inner] @ R) / scale[:, None])
        R[inner] = -follow / scale[:, None]
    force = np.abs(K @ R)
    terms = np.abs(K) @ np.abs(R)
    moved = force / np.maximum(terms, 1e-6 * terms.max(axis=1, keepdims=True).max(initial=0.0) + 1e-300)
    if moved.max(initial=0.0) > STRAIN:
        k, c = (int(x) for x in np.unravel_index(np.argmax(moved), moved.shape))
        what = f"{('translation along', 'rotation about')[c // 3]} {'xyz'[c % 3]}"
        raise InputError(
            f"the stiffness matrix resists a rigid {what} (most at {label(k)}, {moved.max():.1e} of its terms): the "
            "body is supported, or the positions, the axes or the order of its nodes are not those of the matrices"
        )
    return R


def rigid_mass(M: np.ndarray, R: np.ndarray, size: float) -> Rigid:
    """Return mass, first and second moment about the origin of the rigid motions.

    Raises
    ------
    InputError
        When the mass is not positive, or differs with the direction.

    Examples
    --------
    >>> rigid_mass(2 * np.eye(3), np.hstack([np.eye(3), np.zeros((3, 3))]), 1.0).m
    2.0
    """
    G = R.T @ M @ R
    m = float(np.trace(G[:3, :3]) / 3)
    along = ", ".join(f"{x:.6g}" for x in np.diag(G)[:3])
    if not m > 0:
        raise InputError(f"the mass matrix carries no mass: {along} kg along x, y, z; export it again")
    cross = G[:3, 3:]
    s0 = np.array([cross[1, 2] - cross[2, 1], cross[2, 0] - cross[0, 2], cross[0, 1] - cross[1, 0]]) / 2
    unequal = max(np.abs(G[:3, :3] - m * np.eye(3)).max(), np.abs(cross + cross.T).max() / size)
    if unequal > UNEQUAL * m:
        raise InputError(
            f"the mass matrix does not move every direction alike ({along} kg along x, y, z): the positions, the axes "
            "or the order of its nodes are not those of the matrices, or it lacks what supports hold"
        )
    J = (G[3:, 3:] + G[3:, 3:].T) / 2
    return Rigid(m, s0, np.trace(J) / 2 * np.eye(3) - J)


def loose(K: np.ndarray) -> np.ndarray:
    """Return the motions (n, r) without strain of a stiffness.

    Examples
    --------
    >>> loose(np.array([[1.0, -1.0], [-1.0, 1.0]])).shape
    (2, 1)
    """
    scale = np.sqrt(np.diag(K))
    scale = np.divide(1.0, scale, out=np.ones(len(K)), where=scale > 0)
    size, V = np.linalg.eigh(K * scale * scale[:, None])
    return scale[:, None] * V[:, size <= SINGULAR * size.max(initial=0.0)]
