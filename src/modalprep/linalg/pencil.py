"""``K - shift M``, factorised at one shift after another."""

from __future__ import annotations

from copy import copy

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError
from modalprep.linalg.pardiso import PardisoFactor


class Pencil:
    """``K - shift M`` of symmetric matrices ``(n, n)``, by PARDISO, in an order of elimination that is known.

    Parameters
    ----------
    order : (n,) int32
        Of the factor at some shift.

    Raises
    ------
    MemoryError
        When the factor does not fit into the memory.
    """

    def __init__(self, K: csr_array, M: csr_array, order: np.ndarray) -> None:
        self._pattern = csr_array((np.abs(K) + np.abs(M)).tocsr())
        self._pattern.sort_indices()
        self._K, self._M = (_entries_on(A, self._pattern) for A in (K, M))
        self._factor = PardisoFactor(self._matrix(0.0), ready=False, order=order)

    def another(self) -> Pencil:
        """Return one with a factor of its own."""
        other = copy(self)
        other._factor = PardisoFactor(self._matrix(0.0), ready=False, order=self._factor.order)
        return other

    def at(self, shift: float) -> PardisoFactor:
        """Return the factor at a shift; the one before is no longer valid.

        Raises
        ------
        AccuracyError
            When the matrix is singular: the shift lies on a mode.
        """
        try:
            self._factor.refactorise(self._matrix(shift))
        except RuntimeError as error:
            raise AccuracyError(f"K - shift M is singular at {shift:.6g}: {error}") from error
        return self._factor

    def _matrix(self, shift: float) -> csr_array:
        pattern = self._pattern
        return csr_array((self._K - shift * self._M, pattern.indices, pattern.indptr), shape=pattern.shape)


def _entries_on(A: csr_array, pattern: csr_array) -> np.ndarray:
    """Return the entries of A at the places of a pattern that has them all."""
    A = A.sorted_indices()
    entries = np.zeros(pattern.nnz)
    entries[np.searchsorted(_places(pattern), _places(A))] = A.data
    return entries


def _places(A: csr_array) -> np.ndarray:
    return np.repeat(np.arange(A.shape[0], dtype=np.int64), np.diff(A.indptr)) * A.shape[1] + A.indices
