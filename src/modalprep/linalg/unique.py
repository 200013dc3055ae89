"""Modes that do not depend on how they were found: signs, and the vectors of repeated roots."""

from __future__ import annotations

import numpy as np

from modalprep.linalg.sparse import Matrix

REPEATED = 1e-8  # of w^2: modes of one root; static responses, of which bases consist, split them by 1e-9
ROUND_OFF = 2 * np.finfo(float).eps  # of the strain energy of K's diagonal alone: what splits them where K is stiff
TIE = 1e-6  # of the largest entry


def unique_modes(w2: np.ndarray, phi: np.ndarray, K: Matrix | np.ndarray) -> np.ndarray:
    """Return modes ``(n_dof, n)`` that do not depend on how they were found.

    Within a repeated root any rotation of the vectors is as good: the first is the one that moves most in the DOF in
    which the whole group moves most, the second likewise among what is orthogonal to it, and so on. Roots count as
    repeated if round-off may have split them: w^2 differs by `REPEATED`, or by less than the products with K are
    accurate (`ROUND_OFF`). Signs follow `unique_signs`.

    Parameters
    ----------
    w2 : (n,)
        (rad/s)^2, ascending.
    phi : (n_dof, n)
        M-orthonormal.
    K : (n_dof, n_dof)

    Examples
    --------
    >>> modes = unique_modes(np.array([1.0, 1.0]), np.array([[0.6, 0.8], [0.8, -0.6]]), np.eye(2))
    >>> bool(np.allclose(modes, np.eye(2)))
    True
    """
    return made_unique(w2, phi.copy(order="K"), K)


def made_unique(w2: np.ndarray, phi: np.ndarray, K: Matrix | np.ndarray) -> np.ndarray:
    """Return `unique_modes` in place of phi.

    Examples
    --------
    >>> made_unique(np.array([1.0]), np.array([[-1.0], [0.0]]), np.eye(2)).T
    array([[ 1., -0.]])
    """
    apart = np.diff(w2) > np.maximum(REPEATED * np.abs(w2[1:]), _round_off(phi, K)[1:])
    groups = np.split(np.arange(len(w2)), np.flatnonzero(apart) + 1)
    for group in (g for g in groups if len(g) > 1):
        for k in range(len(group) - 1):
            rest = group[k:]
            size = np.linalg.norm(phi[:, rest], axis=1)
            row = phi[np.argmax(size >= (1 - TIE) * size.max()), rest]
            phi[:, rest] = phi[:, rest] @ _turned_to(row)
    phi *= unique_signs(phi)
    return phi


def _round_off(phi: np.ndarray, K: Matrix | np.ndarray) -> np.ndarray:
    """Return about the round-off (n,) of w^2: each entry of K by itself has an energy far above that of the mode."""
    return ROUND_OFF * np.einsum("i,ij,ij->j", np.abs(K.diagonal()), phi, phi)


def _turned_to(row: np.ndarray) -> np.ndarray:
    """Orthogonal matrix whose first column is along `row` (Householder)."""
    v = row / np.linalg.norm(row)
    v[0] += np.copysign(1.0, v[0])
    return np.outer(v, v) * (2 / (v @ v)) - np.eye(len(row))


def unique_signs(phi: np.ndarray) -> np.ndarray:
    """Return the signs (n,) that make the first entry within 1e-6 of each column's largest positive.

    Examples
    --------
    >>> unique_signs(np.array([[1.0, 1.0], [-2.0, 0.5]]))
    array([-1.,  1.])
    """
    signs = np.ones(phi.shape[1])
    for k, column in enumerate(phi.T):  # one at a time needs no memory of the size of phi
        size = np.abs(column)
        if column[np.argmax(size >= (1 - TIE) * size.max())] < 0:
            signs[k] = -1.0
    return signs
