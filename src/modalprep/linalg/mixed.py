"""A factor in single precision, half as large, and conjugate gradients in double that restore the digits."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError
from modalprep.linalg.congruent import Congruent
from modalprep.linalg.forecast import Forecast
from modalprep.linalg.pardiso import PardisoFactor, equilibrium

RESIDUAL = 1e-13  # of the right-hand side, all equations scaled to unit diagonal
STAGNANT = 1e-7  # what very different stiffnesses may leave; more is refused
STEPS = 60


class IllConditioned(AccuracyError):
    """A factor in single precision does not lead to a solution; its text follows "the factor of the matrix"."""


class MixedFactor:
    """Solves with a positive definite matrix whose double-precision factor is too large for the memory.

    Preconditioned conjugate gradients (Saad, Iterative Methods for Sparse Linear Systems, 2003, algorithm 9.1), all
    right-hand sides at once. `negative` is None: single precision does not count eigenvalues.

    Raises
    ------
    IllConditioned
        When it does not solve for a trial right-hand side.
    """

    negative: int | None = None

    def __init__(self, A: csr_array | Congruent, order: np.ndarray | None = None) -> None:
        self._A = A
        self._scale = equilibrium(A)[:, None]
        self._single = PardisoFactor(A, np.float32, order)
        self.solve(np.random.default_rng(0).standard_normal(A.shape[0]))  # says whether it is accurate enough

    @property
    def forecast(self) -> Forecast:
        """What the factor was to need."""
        return self._single.forecast

    @property
    def order(self) -> np.ndarray:
        """Of elimination (n,)."""
        return self._single.order

    def release(self) -> None:
        """Free the memory of the factor; the next solution computes it again."""
        self._single.release()

    def fits_twice(self) -> bool:
        """It was taken because one in double precision has no room."""
        return False

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B``.

        Raises
        ------
        IllConditioned
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
            raise IllConditioned(f"is too ill-conditioned for single precision (residual {left.max():.1e})")
        return X
