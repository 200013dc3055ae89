"""A symmetric matrix whose few rows of some DOFs are kept apart from the large rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from modalprep.linalg.congruent import Congruent
from modalprep.linalg.sparse import times


@dataclass(frozen=True, eq=False)
class Bordered:
    """``[[A_bb, A_bi], [A_ib, A_ii]]``, its rows and columns in their places b and i.

    Attributes
    ----------
    inside : (n_i, n_i) csr or Congruent
    border : (n_b, n) csr
        The rows b.
    b : (n_b,) int
    i : slice or (n_i,) int

    Examples
    --------
    >>> A = Bordered(csr_array([[2.0]]), csr_array([[3.0, -1.0]]), np.array([0]), slice(1, 2))
    >>> A @ np.array([1.0, 1.0]), A.diagonal()
    (array([2., 1.]), array([3., 2.]))
    """

    inside: csr_array | Congruent
    border: csr_array
    b: np.ndarray
    i: slice | np.ndarray

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        n = self.border.shape[1]
        return n, n

    @property
    def coupling(self) -> csr_array:
        """``A_bi (n_b, n_i)``."""
        return self.border[:, self.i]

    def diagonal(self) -> np.ndarray:
        """Return the diagonal (n,)."""
        found = np.empty(self.shape[0])
        found[self.i] = self.inside.diagonal()
        found[self.b] = self.border[:, self.b].diagonal()
        return found

    def __matmul__(self, X: np.ndarray) -> np.ndarray:
        """Return ``A X``."""
        out = np.empty(X.shape)
        out[self.i] = times(self.inside, X[self.i]) if X.ndim == 2 else self.inside @ X[self.i]
        if len(self.b):
            out[self.i] += self.coupling.T @ X[self.b]
            out[self.b] = self.border @ X
        return out

    def tocsr(self) -> csr_array:
        """Return the matrix in one."""
        n, inside = self.shape[0], self.inside.tocsr().tocoo()
        i, border = np.arange(n)[self.i], self.border.tocoo()
        rows = [i[inside.coords[0]], self.b[border.coords[0]]]
        columns = [i[inside.coords[1]], border.coords[1]]
        side = self.coupling.tocoo()
        rows.append(i[side.coords[1]])
        columns.append(self.b[side.coords[0]])
        values = np.concatenate([inside.data, border.data, side.data])
        return csr_array((values, (np.concatenate(rows), np.concatenate(columns))), shape=(n, n))
