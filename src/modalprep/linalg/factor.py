"""Sparse symmetric factorization: oneMKL PARDISO where its wheel exists, SciPy's SuperLU elsewhere."""

from __future__ import annotations

import weakref
from typing import Protocol

import numpy as np
from scipy.sparse import csc_array, csr_array, csr_matrix, triu
from scipy.sparse.linalg import splu

from modalprep.errors import AccuracyError


class Factor(Protocol):
    """A factorized symmetric matrix."""

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B`` for ``B (n,)`` or ``(n, k)``."""
        ...


class PardisoFactor:
    """``A = L D L^T`` by oneMKL PARDISO (symmetric indefinite).

    Attributes
    ----------
    negative : int
        Number of negative pivots: the eigenvalues of A below zero (Sylvester's inertia).
    """

    def __init__(self, A: csr_array) -> None:
        from pypardiso import PyPardisoSolver

        upper = csr_matrix(triu(A, format="csr"))  # PARDISO reads the upper triangle, sorted, of a csr matrix
        upper.sort_indices()
        self._A = upper
        self._solver = PyPardisoSolver(mtype=-2)
        self._solver.factorize(upper)
        self.negative = int(self._solver.get_iparm(23))
        weakref.finalize(self, self._solver.free_memory, everything=True)

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B``."""
        return self._solver.solve(self._A, np.asfortranarray(B, dtype=float))


class SuperLUFactor:
    """``A = L U`` by SciPy's SuperLU with its options for symmetric matrices."""

    def __init__(self, A: csr_array) -> None:
        self._lu = splu(
            csc_array(A), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True}
        )

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B``."""
        return self._lu.solve(np.asfortranarray(B, dtype=float))


def factorize(A: csr_array, solver: str = "auto") -> Factor:
    """Factorize a sparse symmetric matrix ``A (n, n)``.

    Parameters
    ----------
    A : csr
        Both triangles stored.
    solver : {"auto", "pardiso", "superlu"}
        ``auto`` takes PARDISO where it is installed.

    Raises
    ------
    AccuracyError
        When the matrix is singular to the last digit.

    Examples
    --------
    >>> A = csr_array(np.array([[2.0, -1.0], [-1.0, 2.0]]))
    >>> factorize(A).solve(np.array([1.0, 1.0]))
    array([1., 1.])
    """
    if solver == "auto":
        solver = "pardiso" if _has_pardiso() else "superlu"
    try:
        return PardisoFactor(A) if solver == "pardiso" else SuperLUFactor(A)
    except (RuntimeError, ValueError) as error:
        raise AccuracyError(f"the {A.shape[0]} x {A.shape[0]} matrix is singular: {error}") from error


def _has_pardiso() -> bool:
    try:
        from pypardiso import PyPardisoSolver

        PyPardisoSolver(mtype=-2)
    except (ImportError, OSError):
        return False
    return True
