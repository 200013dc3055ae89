"""Modal truncation vectors: the static response of the dropped modes."""

from __future__ import annotations

import numpy as np

from modalprep.linalg.blas import inner, subtract
from modalprep.linalg.ritz import ritz
from modalprep.linalg.sparse import times
from modalprep.reduction.clamped import Clamped

MOSTLY = 0.5  # share in truncation vectors from which a mode is one of them
BEYOND = 2.0  # times the end of a band: a truncation vector there amplifies by 1 / (1 - 1/4) at most
ENERGY = 1e-10  # relative to the largest load's static energy: less is round-off or no load


def truncation_vectors(
    clamped: Clamped, F: np.ndarray, w2: np.ndarray, Phi: np.ndarray, answers: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the pseudo-frequencies ``w^2 (k,)`` and vectors ``(n_i, k)`` that make the static responses to F exact.

    ``F_t = F - M Phi Phi^T F``, ``K X = F_t``, then ``(X^T K X) y = (X^T M X) y w^2``; the vectors ``X y`` are
    M-orthonormal among themselves and to the modes. Loads whose remaining static energy is below `ENERGY` of the
    largest load's are left out, and dependent combinations (`linalg.ritz`).
    Theory 3; Dickens, Nakagawa, Wittbrodt, Computers & Structures 62 (1997) 985.

    Parameters
    ----------
    clamped : Clamped
    F : (n_i, m)
        Loads on the interior DOFs, of comparable size (N).
    w2, Phi : (n,), (n_i, n)
        The kept modes.
    answers : (n_i, m) or None
        ``K^-1 F``, where it is known.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.clamped import clamp
    >>> clamped = clamp(cantilever_model())
    >>> tip = np.eye(60)[:, -5:-4]  # unit force along y on the last node
    >>> w2, X = truncation_vectors(clamped, tip, np.zeros(0), np.zeros((60, 0)))
    >>> bool(np.allclose(X @ (X.T @ tip / w2), clamped.factor.solve(tip)))
    True
    """
    if F.shape[1] == 0:
        return np.zeros(0), np.zeros((Phi.shape[0], 0))
    X = clamped.factor.solve(F) if answers is None else answers
    energy = np.einsum("ij,ij->j", F, X)
    X = subtract(X, Phi, inner(Phi, F) / w2[:, None])
    X = subtract(X, Phi, inner(Phi, times(clamped.M_ii, X)))  # repeated against round-off
    rest = np.einsum("ij,ij->j", X, times(clamped.K_ii, X))
    X = X[:, rest > ENERGY * max(energy.max(), np.finfo(float).tiny)]
    return ritz(X, clamped.K_ii, clamped.M_ii)
