"""Rayleigh-Ritz on a given space, accurate for its low modes however stiff the rest is."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh, solve_triangular

from modalprep.linalg.blas import inner, product, subtract
from modalprep.linalg.sparse import Matrix, times

DEPENDENT = 1e-12  # share of strain energy that a combination of unit vectors must add to count as a direction
SOFT = 1e-6  # 1/w^2 over that of the softest: what one diagonalisation finds with ten digits
MASSLESS = 1e-24  # 1/w^2 over that of the softest: a direction without mass, left out


def ritz(
    W: np.ndarray,
    K: Matrix,
    M: Matrix,
    rigid: np.ndarray | None = None,
    grams: tuple[np.ndarray, np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return ``w^2 (k,)`` (ascending) and the span X of W with ``X^T M X = 1``, ``X^T K X = diag(w^2)``.

    The vectors are scaled to unit strain energy and freed of dependent combinations (`DEPENDENT`), then the
    flexibility 1/w^2 is diagonalised: round-off is relative to the softest mode, not to the stiffest. Modes far
    above it (`SOFT`) are found again without it, as often as needed: a body that nearly is a mechanism has
    frequencies over many decades. Directions without mass are left out.

    Parameters
    ----------
    W : (n, k)
        Spanning vectors.
    K, M : (n, n) csr
        K positive definite on the span.
    rigid : (n, r)
        M-orthonormal vectors of no strain; they come first in X, with ``w^2 = 0``.
    grams : ((k, k), (k, k)) or None
        ``W^T K W`` and ``W^T M W``, where they are known.

    Examples
    --------
    >>> from scipy.sparse import csr_array
    >>> w2, X = ritz(np.eye(2), csr_array(np.diag([4.0, 1.0])), csr_array(np.eye(2)))
    >>> w2
    array([1., 4.])
    """
    found = np.zeros((len(W), 0)) if rigid is None else rigid
    top = 0.0
    w2 = [np.zeros(found.shape[1])]
    while W.shape[1]:
        for _ in range(2 if found.shape[1] else 0):
            W = subtract(W, found, inner(found, times(M, W)))
            grams = None
        flexibility, Y = _flexibility(*(grams or (inner(W, times(K, W)), inner(W, times(M, W)))))
        top = max(top, flexibility[0])
        if flexibility[0] <= MASSLESS * top:
            break
        soft = flexibility > SOFT * flexibility[0]
        w2.append(1 / flexibility[soft])
        new = product(W, Y[:, soft] / np.sqrt(flexibility[soft]))
        found = np.hstack([found, new]) if found.shape[1] else new
        W = product(W, Y[:, ~soft])
        grams = None
    return np.concatenate(w2), _orthonormal(found, M)


def _flexibility(KK: np.ndarray, MM: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``1/w^2`` (descending) and vectors of unit strain energy."""
    scale = 1 / np.sqrt(np.diag(KK))
    share, Y = eigh(KK * scale * scale[:, None])
    new = share > DEPENDENT * share[-1]
    Z = scale[:, None] * (Y[:, new] / np.sqrt(share[new]))
    flexibility, Y = eigh(Z.T @ MM @ Z)
    return flexibility[::-1], Z @ Y[:, ::-1]


def _orthonormal(X: np.ndarray, M: Matrix) -> np.ndarray:
    """Remove the last round-off, from the softest on, so that soft vectors hardly change."""
    if X.shape[1] == 0:
        return X
    upper = solve_triangular(np.linalg.cholesky(inner(X, times(M, X))), np.eye(X.shape[1]), lower=True).T
    return product(X, upper)
