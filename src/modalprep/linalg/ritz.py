"""Rayleigh-Ritz on a given space, accurate for its low modes however stiff the rest is."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

DEPENDENT = 1e-12  # share of strain energy that a combination of unit vectors must add to count as a direction


def ritz(KK: np.ndarray, MM: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``w^2`` (ascending) and V with ``V^T MM V = 1``, ``V^T KK V = diag(w^2)``.

    The vectors are scaled to unit strain energy and freed of dependent combinations (`DEPENDENT`), then the
    flexibility 1/w^2 is diagonalised: round-off is relative to the softest mode, not to the stiffest.

    Parameters
    ----------
    KK, MM : (k, k)
        ``X^T K X`` (positive definite) and ``X^T M X`` of the spanning vectors X.

    Examples
    --------
    >>> w2, V = ritz(np.diag([4.0, 1.0]), np.eye(2))
    >>> w2
    array([1., 4.])
    """
    if len(KK) == 0:
        return np.zeros(0), np.zeros((0, 0))
    scale = 1 / np.sqrt(np.diag(KK))
    share, Y = eigh(KK * scale * scale[:, None])
    new = share > DEPENDENT * share[-1]
    Z = scale[:, None] * (Y[:, new] / np.sqrt(share[new]))
    flexibility, Y = eigh(Z.T @ MM @ Z)
    order = np.argsort(-flexibility)
    return 1 / flexibility[order], Z @ (Y[:, order] / np.sqrt(flexibility[order]))
