"""Modal truncation vectors: the static answer that the dropped modes would have given."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from modalprep.reduction.clamped import Clamped

ENERGY = 1e-10  # of the largest load's static energy: what is smaller is round-off or no load at all
DEPENDENT = 1e-9  # static energy a combination of loads must add beyond those before it


def truncation_vectors(held: Clamped, F: np.ndarray, w2: np.ndarray, Phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the pseudo-frequencies ``w^2 (k,)`` and vectors ``(n_i, k)`` that make the static answers to F exact.

    ``F_t = F - M Phi Phi^T F``, ``K X = F_t``, then ``(X^T K X) y = (X^T M X) y w^2``; the vectors ``X y`` are
    M-orthonormal among themselves and to the modes. Loads whose remaining static energy is below `ENERGY` of the
    largest load's, and combinations below `DEPENDENT` of the rest, are left out.
    FORMULATION section 3; Dickens, Nakagawa, Wittbrodt, Computers & Structures 62 (1997) 985.

    Parameters
    ----------
    held : Clamped
    F : (n_i, m)
        Loads on the interior DOFs, of comparable size (N).
    w2, Phi : (n,), (n_i, n)
        The kept modes.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.clamped import clamp
    >>> held = clamp(cantilever_model())
    >>> tip = np.eye(60)[:, -5:-4]  # unit force along y on the last node
    >>> w2, X = truncation_vectors(held, tip, np.zeros(0), np.zeros((60, 0)))
    >>> bool(np.allclose(X @ (X.T @ tip / w2), held.factor.solve(tip)))
    True
    """
    if F.shape[1] == 0:
        return np.zeros(0), np.zeros((Phi.shape[0], 0))
    X = held.factor.solve(F)
    energy = np.einsum("ij,ij->j", F, X)
    X = X - Phi @ ((Phi.T @ F) / w2[:, None])
    X = X - Phi @ (Phi.T @ (held.M_ii @ X))  # once more against round-off
    rest = np.einsum("ij,ij->j", X, held.K_ii @ X)
    use = rest > ENERGY * max(energy.max(), np.finfo(float).tiny)
    X = X[:, use] / np.sqrt(rest[use])
    share, Y = eigh(X.T @ (held.K_ii @ X)) if X.shape[1] else (np.zeros(0), np.zeros((0, 0)))
    new = share > DEPENDENT * share.max(initial=0)
    Z = X @ (Y[:, new] / np.sqrt(share[new]))  # Z^T K Z = 1
    flexibility, Y = eigh(Z.T @ (held.M_ii @ Z)) if Z.shape[1] else (np.zeros(0), np.zeros((0, 0)))
    order = np.argsort(-flexibility)
    return 1 / flexibility[order], Z @ (Y[:, order] / np.sqrt(flexibility[order]))
