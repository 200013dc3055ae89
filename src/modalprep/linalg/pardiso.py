"""oneMKL PARDISO: symmetric indefinite factorisation in memory.

Schenk, Gärtner, Future Generation Computer Systems 20 (2004) 475. Called straight in the library that pypardiso
finds: its own `solve` compares and copies the matrix each time, which for a few right-hand sides costs more than
solving.
"""

from __future__ import annotations

import weakref
from contextlib import suppress
from ctypes import CDLL, byref, c_int32

import numpy as np
from scipy.sparse import csr_array

from modalprep.linalg.congruent import Congruent, row_blocks
from modalprep.linalg.forecast import Forecast, TooLarge, no_room, tell
from modalprep.linalg.memory import available_memory, give_back
from modalprep.linalg.onemkl import SYMMETRIC_INDEFINITE, address, installed_library
from modalprep.linalg.sparse import Matrix

ANALYSE, FACTORISE, SOLVE, RELEASE = 11, 22, 33, -1
GIVEN, WANTED = 1, 2  # of the order of elimination
ERRORS = {-4: "zero pivot", -8: "too many nonzeros for 32-bit integers"}
LACK_OF_MEMORY = -2  # its error
ORDER, REFINEMENT, PERTURBATION, SINGLE, ZERO_BASED = 4, 7, 9, 27, 34  # places in the array of options, counted from 0
COUNT_OPERATIONS = 18  # -1 asks for it
PIVOT = (
    13  # pivots below 1e-13 of the largest entry are perturbed; the default of 1e-8 changes thin shells beside thick
)
PEAK, PERMANENT, FACTOR, NEGATIVE = 14, 15, 16, 22  # it reports: kB, kB, kB, pivots
PERTURBED = 13  # it reports: pivots


class LackOfMemory(MemoryError):
    """The library got less memory than it asked for; its text follows "the factor of the matrix"."""


class PardisoFactor:
    """``A = L D L^T`` by oneMKL PARDISO.

    Attributes
    ----------
    negative : int
        Number of negative pivots: the eigenvalues of A below zero (Sylvester's inertia).
    order : (n,) int32
        Of elimination.
    forecast : Forecast
        What the factor was to need.

    Parameters
    ----------
    A : (n, n) csr
        Kept, not copied.
    dtype : float64 or float32
        float32 needs half the memory and gives some six digits.
    order : (n,) int32
        Of another matrix of about the same pattern. Finding one takes most of the time of the analysis.

    Raises
    ------
    TooLarge
        When the factor does not fit into the memory.
    RuntimeError, ValueError
        When the matrix is singular.
    """

    def __init__(self, A: csr_array | Congruent, dtype: type = np.float64, order: np.ndarray | None = None) -> None:
        self._A = A
        self._dtype = dtype
        self._n = A.shape[0]
        self._scale = equilibrium(A)
        self.order = np.empty(self._n, dtype=np.int32) if order is None else order
        self._ordered = order is not None
        self._held = False
        self._factorise()

    def fits_twice(self) -> bool:
        """Whether another one like it has room beside it."""
        return self.forecast.memory <= available_memory()

    def release(self) -> None:
        """Free the memory of the factor; the next solution computes it again."""
        if self._held:
            self._free()
            self._held = False
            give_back()

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B``.

        Raises
        ------
        InputError
            When the factor was released, and does not fit into the memory any more.
        """
        if not B.size:  # which the library refuses
            return np.zeros(B.shape)
        try:
            return self._solution(B)
        except (TooLarge, LackOfMemory) as error:
            raise no_room(self._n, str(error)) from None

    def _solution(self, B: np.ndarray) -> np.ndarray:
        if not self._held:
            self._factorise()
        scale = self._scale if B.ndim == 1 else self._scale[:, None]
        right = np.multiply(scale, B, out=np.empty(B.shape, dtype=self._dtype, order="F"), casting="same_kind")
        X = np.empty_like(right)
        self._call(SOLVE, right, X)
        return np.multiply(scale, X, out=right if self._dtype is np.float64 else None)

    def _factorise(self) -> None:
        give_back()
        free = available_memory()
        matrix = upper(self._A, self._scale, self._dtype)
        self._matrix: tuple[np.ndarray | None, ...] = matrix
        del matrix
        self._analyse(free)
        self._call(FACTORISE)
        self._held = True
        self.negative = int(self._options[NEGATIVE])
        if not self._options[PERTURBED]:  # only these need refinement, with the matrix itself
            self._matrix = (None,) * 3

    def _analyse(self, free: float) -> None:
        """Find the order and the pattern of the factor; refuse it where it has no room."""
        self._handle = np.zeros(64, dtype=np.int64)
        self._options = np.zeros(64, dtype=np.int32)
        self._free = weakref.finalize(self, _release, installed_library(), self._handle, self._options)
        self._choose()
        self._call(ANALYSE)
        self._ordered = True
        self.forecast = self._forecast(free)
        if not self.forecast.fits:
            self._free()
            raise TooLarge(self.forecast)
        tell(self.forecast)

    def _choose(self) -> None:
        options = self._options
        installed_library().pardisoinit(address(self._handle), byref(c_int32(SYMMETRIC_INDEFINITE)), address(options))
        options[REFINEMENT] = 0  # only where pivots had to be perturbed
        if self._dtype is np.float64:
            options[PERTURBATION] = PIVOT
        options[ZERO_BASED] = 1
        options[SINGLE] = self._dtype is np.float32
        options[ORDER] = GIVEN if self._ordered else WANTED
        options[COUNT_OPERATIONS] = -1

    def _forecast(self, free: float) -> Forecast:
        """Return what the analysis says of the factor, where so much memory was free before."""
        peak, permanent, factor = (1024.0 * self._options[place] for place in (PEAK, PERMANENT, FACTOR))
        operations = 1e6 * float(self._options[COUNT_OPERATIONS])
        return Forecast(operations, max(peak, permanent + factor), free, single=self._dtype is np.float32)

    def _call(self, phase: int, B: np.ndarray | None = None, X: np.ndarray | None = None) -> None:
        columns = B.shape[1] if B is not None and B.ndim == 2 else 1
        try:
            _pardiso(
                installed_library(),
                self._handle,
                self._options,
                phase,
                self._n,
                (*self._matrix, self.order),
                columns,
                B,
                X,
            )
        except BaseException:
            self.release() if self._held else self._free()
            raise


def _pardiso(mkl, handle, options, phase: int, n: int, matrix=(None,) * 4, columns: int = 1, B=None, X=None) -> None:
    """Call the library; raise RuntimeError with its reason when it fails."""
    one = byref(c_int32(1))
    error = c_int32(0)
    sizes = [byref(c_int32(v)) for v in (SYMMETRIC_INDEFINITE, phase, n)]
    a, ia, ja, order = (address(part) for part in matrix)
    tail = (byref(c_int32(columns)), address(options), byref(c_int32(0)), address(B), address(X), byref(error))
    mkl.pardiso(address(handle), one, one, *sizes, a, ia, ja, order, *tail)
    if error.value == LACK_OF_MEMORY:
        raise LackOfMemory("needs more memory than the system gave")
    if error.value:
        raise RuntimeError(ERRORS.get(error.value, f"PARDISO error {error.value}"))


def _release(mkl: CDLL, handle: np.ndarray, options: np.ndarray) -> None:
    """Free a factor; what the library may say of a factor that failed does not matter."""
    with suppress(RuntimeError, LackOfMemory):
        _pardiso(mkl, handle, options, RELEASE, 0)


def upper(A: csr_array | Congruent, scale: np.ndarray, dtype: type) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Entries, row starts and columns of the scaled upper triangle, sorted as the library wants them."""
    if not isinstance(A, Congruent):
        A.sort_indices()
    counts: list[np.ndarray] = []
    columns: list[np.ndarray] = []
    entries: list[np.ndarray] = []
    for first, part in row_blocks(A):
        row = np.repeat(np.arange(first, first + part.shape[0]), np.diff(part.indptr))
        keep = part.indices >= row
        row, column = row[keep], part.indices[keep]
        counts.append(np.bincount(row - first, minlength=part.shape[0]))
        columns.append(column.astype(np.int32))
        entries.append((part.data[keep] * scale[row] * scale[column]).astype(dtype))
    starts = np.cumsum([0, *_joined(counts)])
    if not np.all(np.diff(starts)):
        raise ValueError("it has an empty row")  # which the library does not survive
    return _joined(entries), starts.astype(np.int32), _joined(columns)


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    """Return arrays one after the other, and empty the list that has held them."""
    found = np.concatenate(parts)
    parts.clear()
    return found


def equilibrium(A: Matrix) -> np.ndarray:
    """Return the scales (n,) that make the diagonal 1.

    PARDISO perturbs pivots below 1e-8 of the largest entry, which soft parts beside stiff ones have.

    Examples
    --------
    >>> equilibrium(csr_array(np.diag([4.0, 100.0])))
    array([0.5, 0.1])
    """
    diagonal = np.abs(A.diagonal())
    return 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
