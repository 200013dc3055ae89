"""``C^T A C`` that is not stored, for matrices of which the memory has no room for two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from modalprep.linalg.sparse import times

COLUMNS = 8  # of a product at a time


@dataclass(frozen=True, eq=False)
class Congruent:
    """The symmetric matrix ``C^T A C (m, m)``, multiplied as it is written.

    Attributes
    ----------
    A : (n, n) csr
    C : (n, m) csr

    Examples
    --------
    >>> A = Congruent(csr_array([[2.0, -1.0], [-1.0, 2.0]]), csr_array([[1.0], [1.0]]))
    >>> A @ np.ones(1), A.diagonal(), A.tocsr().toarray()
    (array([2.]), array([2.]), array([[2.]]))
    """

    A: csr_array
    C: csr_array

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        m = self.C.shape[1]
        return m, m

    def __matmul__(self, X: np.ndarray) -> np.ndarray:
        """Return ``C^T A C X``."""
        if X.ndim == 1:
            return self.C.T @ (self.A @ (self.C @ X))
        out = np.empty(X.shape)
        for k in range(0, X.shape[1], COLUMNS):
            own = slice(k, k + COLUMNS)
            out[:, own] = self.C.T @ times(self.A, times(self.C, X[:, own]))
        return out

    def diagonal(self) -> np.ndarray:
        """Return the diagonal (m,)."""
        return (self.C.multiply(self.A @ self.C)).sum(axis=0)

    def tocsr(self) -> csr_array:
        """Return the matrix, stored and sorted."""
        found = (self.C.T.tocsr() @ self.A @ self.C).tocsr()
        found.sort_indices()
        return found

    def less(self, other: Congruent, factor: float) -> Congruent:
        """Return this matrix less a multiple of another by the same C."""
        return Congruent((self.A - factor * other.A).tocsr(), self.C)


def stored(A: csr_array | Congruent) -> csr_array:
    """Return a matrix as it is stored.

    Examples
    --------
    >>> stored(csr_array([[2.0]])).nnz
    1
    """
    return A.tocsr()


def shifted(K: csr_array | Congruent, M: csr_array | Congruent, shift: float) -> csr_array | Congruent:
    """Return ``K - shift M``.

    Examples
    --------
    >>> shifted(csr_array([[2.0]]), csr_array([[1.0]]), 0.5).toarray()
    array([[1.5]])
    """
    if isinstance(K, Congruent) and isinstance(M, Congruent):
        return K.less(M, shift)
    return (stored(K) - shift * stored(M)).tocsr()
