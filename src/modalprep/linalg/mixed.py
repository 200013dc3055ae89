"""A factor in single precision, half as large, and conjugate gradients in double that restore the digits."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError
from modalprep.linalg.pardiso import PardisoFactor, equilibrium

RESIDUAL = 1e-13  # of the right-hand side, all equations scaled to unit diagonal
STAGNANT = 1e-7  # what very different stiffnesses may leave; more is refused
STEPS = 60


class MixedFactor:
    """Solves with a positive definite matrix whose double-precision factor is too large for the memory.

    Preconditioned conjugate gradients (Saad, Iterative Methods for Sparse Linear Systems, 2003, algorithm 9.1), all
    right-hand sides at once. `negative` is None: single precision does not count eigenvalues.
    """

    negative: int | None = None

    def __init__(self, A: csr_array) -> None:
        self._A = A
        self._scale = equilibrium(A)[:, None]
        self._single = PardisoFactor(A, np.float32)

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B``.

        Raises
        ------
        AccuracyError
            When it does not converge.
        """
        columns = B[:, None] if B.ndim == 1 else B
        X = self._scale * self._conjugate_gradients(self._scale * columns)
        return X[:, 0] if B.ndim == 1 else X

    def _conjugate_gradients(self, B: np.ndarray) -> np.ndarray:
        size = np.maximum(np.linalg.norm(B, axis=0), np.finfo(float).tiny)
        X = np.zeros_like(B)
        R = B.copy()
        P = np.zeros_like(B)
        rz = np.ones(B.shape[1])
        left = np.linalg.norm(R, axis=0) / size
        for _ in range(STEPS):
            k = np.flatnonzero(~(left <= RESIDUAL))
            if not len(k):
                return X
            Z = self._single.solve(R[:, k] / self._scale) / self._scale
            rz[k], before = np.einsum("ij,ij->j", R[:, k], Z), rz[k]
            P[:, k] = Z + P[:, k] * (rz[k] / before)
            AP = self._scale * (self._A @ (self._scale * P[:, k]))
            step = rz[k] / np.einsum("ij,ij->j", P[:, k], AP)
            X[:, k] += P[:, k] * step
            R[:, k] -= AP * step
            left[k] = np.linalg.norm(R[:, k], axis=0) / size[k]
        if not np.all(left <= STAGNANT):
            raise AccuracyError(
                f"the model is too large for the memory in double precision, and too ill-conditioned for single "
                f"(residual {left.max():.1e}): use a machine with more memory, or a coarser mesh"
            )
        return X
