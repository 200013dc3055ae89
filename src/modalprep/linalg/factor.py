"""Sparse symmetric factorisation: oneMKL PARDISO where its wheel exists, SciPy's SuperLU elsewhere."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import splu

from modalprep.errors import AccuracyError, InputError
from modalprep.linalg.memory import BUDGET, available_memory
from modalprep.linalg.mixed import MixedFactor
from modalprep.linalg.pardiso import PardisoFactor, library


class Factor(Protocol):
    """A factorised symmetric matrix.

    Attributes
    ----------
    negative : int or None
        Number of eigenvalues below zero (Sylvester's inertia); None where the factorisation does not tell.
    """

    negative: int | None

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B`` for ``B (n,)`` or ``(n, k)``.

        Returns
        -------
        (n,) or (n, k) float
            Of the shape of B.
        """
        ...


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


def factorise(A: csr_array, solver: str = "auto", definite: bool = True) -> Factor:
    """Factorize a sparse symmetric matrix ``A (n, n)``.

    Parameters
    ----------
    A : csr
        Both triangles stored.
    solver : {"auto", "pardiso", "superlu"}
        ``auto`` takes PARDISO where it is installed.
    definite : bool
        Whether A is positive definite: then a factor in single precision serves where one in double precision does
        not fit into the memory (`MixedFactor`).

    Returns
    -------
    Factor
        With a method ``solve(B)``.

    Raises
    ------
    AccuracyError
        When the matrix is singular to the last digit.
    InputError
        When the factor does not fit into the memory.

    References
    ----------
    O. Schenk, K. Gärtner, Solving unsymmetric sparse systems of linear equations with PARDISO, Future Gener. Comput.
    Syst. 20 (2004) 475.
    X. S. Li, An overview of SuperLU, ACM Trans. Math. Softw. 31 (2005) 302.

    Examples
    --------
    >>> A = csr_array(np.array([[2.0, -1.0], [-1.0, 2.0]]))
    >>> factorise(A).solve(np.array([1.0, 1.0]))
    array([1., 1.])
    """
    if solver == "pardiso" and library() is None:
        raise AccuracyError("PARDISO is not installed here; take solver = 'auto' or 'superlu'")
    kinds = [PardisoFactor, MixedFactor] if definite else [PardisoFactor]
    if solver == "superlu" or library() is None:
        kinds = [SuperLUFactor]
    needed = 0.0
    for kind in kinds:
        try:
            return kind(A)
        except MemoryError as error:
            needed = error.args[0] if error.args else 0.0
        except (RuntimeError, ValueError) as error:
            raise AccuracyError(f"the {A.shape[0]} x {A.shape[0]} matrix is singular: {error}") from error
    raise InputError(
        f"the factor of the {A.shape[0]} x {A.shape[0]} matrix needs {needed / 2**30:.2g} GiB of memory and "
        f"{available_memory() / 2**30:.2g} GiB may be used: take a coarser mesh, split the model into components, "
        f"or raise {BUDGET}"
    )
