"""Mass matrix of a modal body: rigid part, coupling and its growth with the deflection, FORMULATION section 4."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.vectors import skew


def rigid_mass_matrix(m: float, s0: np.ndarray, E0: np.ndarray) -> np.ndarray:
    """Return ``[[m, -s0~], [s0~, J]]``, ``J = tr(E0) - E0`` (6, 6).

    Examples
    --------
    >>> rigid_mass_matrix(2.0, np.zeros(3), np.diag([1.0, 2, 3])).diagonal()
    array([2., 2., 2., 5., 4., 3.])
    """
    s = skew(s0)
    return np.block([[m * np.eye(3), -s], [s, np.trace(E0) * np.eye(3) - E0]])


def cross_moment(H: np.ndarray) -> np.ndarray:
    """Return ``int rho x cross phi (3, ...)`` of ``H[a, b] = int rho x_b phi_a (3, 3, ...)``.

    Examples
    --------
    >>> cross_moment(np.arange(9.0).reshape(3, 3))
    array([ 2., -4.,  2.])
    """
    return np.array([H[2, 1] - H[1, 2], H[0, 2] - H[2, 0], H[1, 0] - H[0, 1]])


def mass_matrix(body: FlexibleBody, q: np.ndarray) -> np.ndarray:
    """Return ``M(q) (6 + n, 6 + n)`` for velocity and spin of the frame (in B) and the modal rates.

    ``[[m, -s~, S(q)], [s~, J(q), C(q)], [S^T, C^T, 1]]``: FORMULATION section 4. ``T = V^T M(q) V / 2`` is the kinetic
    energy, exactly so for the linear displacements ``phi q`` of a body without geometric stiffness.

    Parameters
    ----------
    q : (n,)
        Modal coordinates, m sqrt(kg).

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> mass_matrix(uniform_beam(modes=2), np.zeros(2)).diagonal().round(1)[[0, 4, 7]]
    array([ 12., 400.,   1.])
    """
    PW = body.P + body.Kg_W
    S, L = body.S + body.Kg_A @ q, body.H + PW @ q
    half = body.H @ q + 0.5 * (PW @ q) @ q
    s = body.s0 + body.S @ q + 0.5 * (body.Kg_A @ q) @ q
    cross = np.vstack([S, cross_moment(L)])
    return np.block([[rigid_mass_matrix(body.m, s, body.E0 + half + half.T), cross], [cross.T, np.eye(body.n)]])
