"""A factor on disk, for a matrix whose factor the memory has no room for."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError
from modalprep.linalg.congruent import Congruent
from modalprep.linalg.forecast import Forecast, TooLarge, no_room, tell
from modalprep.linalg.memory import available_memory, give_back
from modalprep.linalg.mumps import Mumps, room
from modalprep.linalg.pardiso import LackOfMemory, equilibrium, upper
from modalprep.linalg.sparse import times

AT_A_TIME = 32  # right-hand sides, for each of which the whole factor is read
SHARE = 0.95  # of the disk that is free
RESIDUAL = 1e-9  # of a solution, over itself and its right-hand side, all equations scaled to unit diagonal


class OutOfCoreFactor:
    """``A = L D L^T`` by MUMPS, in temporary files.

    Every solution is checked by its residual.

    Attributes
    ----------
    negative : int
        Number of negative pivots: the eigenvalues of A below zero (Sylvester's inertia).
    forecast : Forecast
        What the factor was to need.
    block : int
        Right-hand sides to ask for at once, as the factor is read for each block: 16 take 1.3 times the time of 6.

    Parameters
    ----------
    A : (n, n) csr
        Kept, not copied.

    Raises
    ------
    TooLarge, LackOfMemory
        When the factor does not fit into the memory, or not on the disk.
    RuntimeError
        When the matrix is singular.
    AccuracyError
        When a solution does not satisfy its equations.
    """

    block = 16

    def __init__(self, A: csr_array | Congruent) -> None:
        self._A = A
        self._scale = equilibrium(A)[:, None]
        self._factor: Mumps | None = self._factorise()
        self.solve(np.random.default_rng(0).standard_normal(A.shape[0]))  # says whether it is right

    def fits_twice(self) -> bool:
        """Whether another one like it has room beside it."""
        return self.forecast.memory <= available_memory() and self.forecast.disk <= SHARE * room()

    def release(self) -> None:
        """Delete the files; the next solution computes the factor again."""
        if self._factor is not None:
            self._factor.close()
            self._factor = None
            give_back()

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B``.

        Raises
        ------
        AccuracyError
            When it does not satisfy the equations.
        InputError
            When the factor was released, and has no room any more.
        """
        columns = B[:, None] if B.ndim == 1 else B
        X = np.empty(columns.shape)
        for k in range(0, columns.shape[1], AT_A_TIME):
            own = slice(k, k + AT_A_TIME)
            X[:, own] = self._checked(columns[:, own])
        return X[:, 0] if B.ndim == 1 else X

    def _checked(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B`` of a few columns, when it satisfies the equations."""
        right = self._scale * B
        X = np.array(right, order="F")
        self._held().solve(X)
        left = np.linalg.norm(right - self._scale * times(self._A, self._scale * X), axis=0)
        size = np.linalg.norm(right, axis=0) + np.linalg.norm(X, axis=0)
        if not np.all(left <= RESIDUAL * size):
            raise AccuracyError(f"the factor on disk does not solve its equations (residual {np.max(left / size):.1e})")
        return self._scale * X

    def _held(self) -> Mumps:
        """Return the factor, computed again where it was released."""
        if self._factor is None:
            try:
                self._factor = self._factorise()
            except (TooLarge, LackOfMemory) as error:
                raise no_room(len(self._scale), str(error)) from None
        return self._factor

    def _factorise(self) -> Mumps:
        give_back()
        free = available_memory()
        matrix = _triangle(self._A, self._scale[:, 0])
        factor = Mumps(len(self._scale), *matrix)
        memory = factor.memory + sum(part.nbytes for part in matrix)
        self.forecast = Forecast(factor.operations, memory, free, disk=factor.disk, room=SHARE * room())
        del matrix
        try:
            if not self.forecast.fits:
                raise TooLarge(self.forecast)
            tell(self.forecast)
            factor.factorise()
        except BaseException:
            factor.close()
            raise
        self.negative = factor.negative
        return factor


def _triangle(A: csr_array | Congruent, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rows and columns, counted from 1, and entries of the scaled upper triangle."""
    entries, starts, columns = upper(A, scale, np.float64)
    columns += 1
    return np.repeat(np.arange(1, len(starts), dtype=np.int32), np.diff(starts)), columns, entries
