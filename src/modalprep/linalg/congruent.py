"""``C^T A C`` that is not stored, for matrices of which the memory has no room for two."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, vstack

from modalprep.linalg.sparse import times

COLUMNS = 8  # of a product at a time
ROWS = 50_000  # of the matrix at a time


@dataclass(frozen=True, eq=False)
class Congruent:
    """The symmetric matrix ``C^T (A - s B) C (m, m)``, multiplied as it is written.

    Attributes
    ----------
    A : (n, n) csr
    C : (n, m) csr
    B : (n, n) csr or None
        None stands for zero.
    s : float

    Examples
    --------
    >>> A = Congruent(csr_array([[2.0, -1.0], [-1.0, 2.0]]), csr_array([[1.0], [1.0]]))
    >>> A @ np.ones(1), A.diagonal(), A.tocsr().toarray()
    (array([2.]), array([2.]), array([[2.]]))
    """

    A: csr_array
    C: csr_array
    B: csr_array | None = None
    s: float = 0.0

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        m = self.C.shape[1]
        return m, m

    def __matmul__(self, X: np.ndarray) -> np.ndarray:
        """Return the product with ``X (m,)`` or ``(m, k)``."""
        columns = X[:, None] if X.ndim == 1 else X
        out = np.empty(columns.shape)
        for k in range(0, columns.shape[1], COLUMNS):
            own = slice(k, k + COLUMNS)
            out[:, own] = self._product(columns[:, own])
        return out[:, 0] if X.ndim == 1 else out

    def _product(self, X: np.ndarray) -> np.ndarray:
        Y = times(self.C, X)
        found = times(self.A, Y)
        if self.B is not None:
            found -= self.s * times(self.B, Y)
        return self.C.T @ found

    def diagonal(self) -> np.ndarray:
        """Return the diagonal (m,)."""
        return np.concatenate([rows.diagonal(first) for first, rows in self.by_rows()])

    def by_rows(self) -> Iterator[tuple[int, csr_array]]:
        """Yield, for some rows at a time, the number of the first and these rows, stored and sorted."""
        for first, C in row_blocks(self.C.T.tocsr()):
            rows = C @ self.A
            if self.B is not None:
                rows -= self.s * (C @ self.B)
            found = (rows @ self.C).tocsr()
            found.sort_indices()
            yield first, found

    def tocsr(self) -> csr_array:
        """Return the matrix, stored and sorted."""
        return vstack([rows for _, rows in self.by_rows()], format="csr")

    def less(self, other: Congruent, factor: float) -> Congruent:
        """Return this matrix, whose `B` is None, less a multiple of another by the same C."""
        return Congruent(self.A, self.C, other.A, factor)


def row_blocks(A: csr_array | Congruent) -> Iterator[tuple[int, csr_array]]:
    """Yield, for some rows of a matrix at a time, the number of the first and these rows, stored.

    Examples
    --------
    >>> [(first, rows.shape) for first, rows in row_blocks(csr_array(np.eye(3)))]
    [(0, (3, 3))]
    """
    if isinstance(A, Congruent):
        yield from A.by_rows()
        return
    for first in range(0, A.shape[0], ROWS):
        yield first, A[first : first + ROWS]


def bound(A: csr_array | Congruent, X: np.ndarray) -> np.ndarray:
    """Return ``|A| |X|``, of absolute values, for ``X (n,)`` or ``(n, k)``: over it, round-off is a part of `A X`.

    Examples
    --------
    >>> bound(csr_array([[2.0, -1.0], [-1.0, 2.0]]), np.array([1.0, 1.0]))
    array([3., 3.])
    """
    return np.concatenate([abs(rows) @ np.abs(X) for _, rows in row_blocks(A)])


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
