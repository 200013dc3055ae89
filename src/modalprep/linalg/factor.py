"""Sparse symmetric factorisation: oneMKL PARDISO where its wheel exists, MUMPS on disk, SciPy's SuperLU elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol, get_args

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import splu

from modalprep.errors import AccuracyError, InputError, NotInstalledError
from modalprep.linalg.congruent import Congruent, stored
from modalprep.linalg.forecast import TooLarge, no_room
from modalprep.linalg.mixed import IllConditioned, MixedFactor
from modalprep.linalg.mumps import HOW_TO_INSTALL, module
from modalprep.linalg.onemkl import library
from modalprep.linalg.out_of_core import OutOfCoreFactor
from modalprep.linalg.pardiso import LackOfMemory, PardisoFactor, equilibrium
from modalprep.linalg.solvers import Solver

RESIDUAL = 1e-6  # of a solution, over the right-hand side: below it the signs of a factor without exchanges are trusted
ROUND_OFF = 10 * np.finfo(float).eps  # of a solution, all equations scaled to unit diagonal: what its residual may be
REFINEMENTS = 3


class Factor(Protocol):
    """A factorised symmetric matrix."""

    @property
    def negative(self) -> int | None:
        """Number of eigenvalues below zero (Sylvester's inertia); None where the factorisation does not tell."""
        ...

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B`` for ``B (n,)`` or ``(n, k)``.

        Returns
        -------
        (n,) or (n, k) float
            Of the shape of B.
        """
        ...

    def release(self) -> None:
        """Free what can be computed again, as the next solution does."""
        ...

    def fits_twice(self) -> bool:
        """Say whether another one in double precision has room beside it.

        Returns
        -------
        bool
        """
        ...


class SuperLUFactor:
    """``A = L U`` by SciPy's SuperLU with its options for symmetric matrices.

    Its pivots cost three digits in thin shells, more or fewer by the order in which BLAS adds up. Solutions are refined
    until their residual is round-off (Higham, Accuracy and Stability of Numerical Algorithms, 2002, section 12.2).
    """

    def __init__(self, A: csr_array | Congruent) -> None:
        self._A = csc_array(stored(A))
        self._scale = equilibrium(A)
        self._lu = _splu(self._A, 0.01)

    @property
    def negative(self) -> int | None:
        """Number of negative pivots: of this factor if no rows were exchanged, else of one without exchanges."""
        exchanged = not np.array_equal(self._lu.perm_r, self._lu.perm_c)
        lu = _without_exchanges(self._A) if exchanged else self._lu
        return None if lu is None else int(np.sum(lu.U.diagonal() < 0))

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B``."""
        B = np.asfortranarray(B, dtype=float)
        X = self._lu.solve(B)
        for _ in range(REFINEMENTS):
            residual = B - self._A @ X
            if not np.any(self._size(residual, self._scale) > ROUND_OFF * self._size(X, 1 / self._scale)):
                break
            X += self._lu.solve(residual)
        return X

    def release(self) -> None:
        """Keep the factor: it fits into the memory."""

    def fits_twice(self) -> bool:
        """Of its memory nothing is known before."""
        return True

    @staticmethod
    def _size(X: np.ndarray, scale: np.ndarray) -> np.ndarray:
        """Return the norms of columns, each row times its scale: forces and moments count by their own stiffness."""
        return np.sqrt(scale**2 @ X**2)


def _splu(A: csc_array, threshold: float):
    return splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=threshold, options={"SymmetricMode": True})


def _without_exchanges(A: csc_array):
    """Return ``L D L^T`` of a matrix next to A, None where it may be so far from A that other signs are possible.

    It is the factor of A + E with ``E x = b - A x``. The signs are those of A as long as E is smaller than the
    smallest eigenvalue, which is about ``|b| / |x|`` for a random b: so the residual must be far below b.
    """
    try:
        lu = _splu(A, 0.0)
    except RuntimeError:  # a pivot is zero
        return None
    b = np.random.default_rng(0).standard_normal(A.shape[0])
    residual = np.linalg.norm(A @ lu.solve(b) - b)
    return lu if residual <= RESIDUAL * np.linalg.norm(b) else None


def factorise(
    A: csr_array | Congruent, solver: str = "auto", definite: bool = True, order: np.ndarray | None = None
) -> Factor:
    """Factorise a sparse symmetric matrix ``A (n, n)``.

    Parameters
    ----------
    A : csr
        Both triangles stored.
    solver : {"auto", "in_memory", "single", "out_of_core", "superlu"}
        ``in_memory`` (double precision) and ``single`` (`MixedFactor`) are PARDISO's, ``out_of_core`` is MUMPS';
        ``auto`` takes the first of them that is installed and fits, and SuperLU where PARDISO is not installed.
    definite : bool
        Whether A is positive definite, as `MixedFactor` needs it.
    order : (n,) int32
        `PardisoFactor.order` of a matrix of about the same pattern; MUMPS finds its own.

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
    NotInstalledError
        When PARDISO or MUMPS is asked for and not installed.

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
    if solver not in get_args(Solver):
        raise InputError(f"solver {solver!r} does not exist; known are {', '.join(get_args(Solver))}")
    missing = []
    for kind in _kinds(solver, definite, order):
        try:
            return kind(A)
        except (TooLarge, LackOfMemory, IllConditioned) as error:
            missing.append(str(error))
        except (InputError, AccuracyError):
            raise
        except (RuntimeError, ValueError) as error:
            raise AccuracyError(f"the {A.shape[0]} x {A.shape[0]} matrix is singular: {error}") from error
    besides = "" if module() else f"install MUMPS, which factorises on disk ({HOW_TO_INSTALL}), "
    raise no_room(A.shape[0], ", ".join(missing), besides)


def _kinds(solver: str, definite: bool, order: np.ndarray | None) -> list[Callable[..., Factor]]:
    """Return the kinds of factors to try, one after the other."""
    if solver == "out_of_core":
        if module() is None:
            raise NotInstalledError(f"MUMPS is not installed here: {HOW_TO_INSTALL}")
        return [OutOfCoreFactor]
    if solver in PARDISO and library() is None:
        raise NotInstalledError("PARDISO is not installed here: pip install 'modalprep[fast]', or take solver = 'auto'")
    if solver == "superlu" or library() is None:
        return [SuperLUFactor]
    if solver in PARDISO:
        return [partial(PARDISO[solver], order=order)]
    kinds = [partial(kind, order=order) for name, kind in PARDISO.items() if definite or name != "single"]
    return kinds if module() is None else [*kinds, OutOfCoreFactor]


PARDISO: dict[str, Callable[..., Factor]] = {
    "in_memory": PardisoFactor,
    "single": MixedFactor,
}  # in the order in which they are tried
