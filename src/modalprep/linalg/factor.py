"""Sparse symmetric factorization: oneMKL PARDISO where its wheel exists, SciPy's SuperLU elsewhere."""

from __future__ import annotations

import os
import weakref
from functools import cache
from typing import Protocol

import numpy as np
from scipy.sparse import csc_array, csr_array, csr_matrix, diags_array, triu
from scipy.sparse.linalg import splu

from modalprep.errors import AccuracyError


class Factor(Protocol):
    """A factorized symmetric matrix.

    Attributes
    ----------
    negative : int or None
        Number of eigenvalues below zero (Sylvester's inertia); None where the factorization does not tell.
    """

    negative: int | None

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

        self._scale = _equilibrium(A)
        D = diags_array(self._scale)
        upper = csr_matrix(triu(D @ A @ D, format="csr"))  # PARDISO reads the upper triangle, sorted, of a csr matrix
        upper.sort_indices()
        self._A = upper
        self._solver = PyPardisoSolver(mtype=-2)
        self._solver.factorize(upper)
        self.negative = int(self._solver.get_iparm(23))
        weakref.finalize(self, self._solver.free_memory, everything=True)

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B``."""
        scale = self._scale if B.ndim == 1 else self._scale[:, None]
        return scale * self._solver.solve(self._A, np.asfortranarray(scale * B, dtype=float))


def _equilibrium(A: csr_array) -> np.ndarray:
    """Scale to unit diagonal: PARDISO perturbs pivots below 1e-8 of the largest entry, soft parts beside stiff ones."""
    diagonal = np.abs(A.diagonal())
    return 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))


class SuperLUFactor:
    """``A = L U`` by SciPy's SuperLU with its options for symmetric matrices."""

    def __init__(self, A: csr_array) -> None:
        self._lu = splu(
            csc_array(A), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True}
        )
        symmetric = np.array_equal(self._lu.perm_r, self._lu.perm_c)  # then U is D L^T
        self.negative = int(np.sum(self._lu.U.diagonal() < 0)) if symmetric else None

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
    if solver == "pardiso" and not _has_pardiso():
        raise AccuracyError("PARDISO is not installed here; take solver = 'auto' or 'superlu'")
    if solver == "auto":
        solver = "pardiso" if _has_pardiso() else "superlu"
    try:
        return PardisoFactor(A) if solver == "pardiso" else SuperLUFactor(A)
    except (RuntimeError, ValueError) as error:
        raise AccuracyError(f"the {A.shape[0]} x {A.shape[0]} matrix is singular: {error}") from error


@cache
def _has_pardiso() -> bool:
    """Whether oneMKL loads; its place is kept, because each solver would search the whole environment for it."""
    try:
        from pypardiso import PyPardisoSolver

        os.environ.setdefault("PYPARDISO_MKL_RT", PyPardisoSolver(mtype=-2).libmkl._name)
    except (ImportError, OSError):
        return False
    return True
