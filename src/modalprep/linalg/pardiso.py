"""oneMKL PARDISO: symmetric indefinite factorisation, in memory or on disk.

Schenk, Gärtner, Future Generation Computer Systems 20 (2004) 475. Called straight in the library that pypardiso
finds: its own `solve` compares and copies the matrix each time, which for a few right-hand sides costs more than
solving.
"""

from __future__ import annotations

import os
import weakref
from contextlib import suppress
from ctypes import CDLL, byref, c_int32, c_void_p
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array

from modalprep.linalg.memory import available_memory

SYMMETRIC_INDEFINITE = -2
REPRODUCIBLE = "AUTO"  # oneMKL's conditional numerical reproducibility: else its sums depend on where arrays lie
WAITING = "5"  # ms that idle threads of the library keep a core; its 200 keep loops of other threads waiting
ANALYSE, FACTORISE, SOLVE, RELEASE = 11, 22, 33, -1
GIVEN, WANTED = 1, 2  # of the order of elimination
ERRORS = {-2: "not enough memory", -4: "zero pivot", -8: "too many nonzeros for 32-bit integers"}
ORDER, REFINEMENT, PERTURBATION, SINGLE, ZERO_BASED = 4, 7, 9, 27, 34  # places in the array of options, counted from 0
PIVOT = (
    13  # pivots below 1e-13 of the largest entry are perturbed; the default of 1e-8 changes thin shells beside thick
)
PEAK, PERMANENT, FACTOR, NEGATIVE = 14, 15, 16, 22  # it reports: kB, kB, kB, pivots


class PardisoFactor:
    """``A = L D L^T`` by oneMKL PARDISO.

    Attributes
    ----------
    negative : int
        Number of negative pivots: the eigenvalues of A below zero (Sylvester's inertia).
    order : (n,) int32
        Of elimination.

    Parameters
    ----------
    A : (n, n) csr
    dtype : float64 or float32
        float32 needs half the memory and gives some six digits.
    order : (n,) int32
        Of another matrix of about the same pattern. Finding one takes most of the time of the analysis.

    Raises
    ------
    MemoryError
        When the factor does not fit into the memory; its first argument is the number of bytes it needs.
    RuntimeError, ValueError
        When the matrix is singular.
    """

    def __init__(self, A: csr_array, dtype: type = np.float64, order: np.ndarray | None = None) -> None:
        self._scale = equilibrium(A)
        self._dtype = dtype
        self._n, (self._entries, self._rows, self._columns) = A.shape[0], _upper(A, self._scale, dtype)
        self._handle = np.zeros(64, dtype=np.int64)
        self._options = np.zeros(64, dtype=np.int32)
        _mkl().pardisoinit(address(self._handle), byref(c_int32(SYMMETRIC_INDEFINITE)), address(self._options))
        self._options[REFINEMENT] = 0  # only where pivots had to be perturbed
        if dtype is np.float64:
            self._options[PERTURBATION] = PIVOT
        self._options[ZERO_BASED] = 1
        self._options[SINGLE] = dtype is np.float32
        self._options[ORDER] = WANTED if order is None else GIVEN
        self.order = np.empty(self._n, dtype=np.int32) if order is None else order
        weakref.finalize(self, _release, self._handle, self._options)
        self._call(ANALYSE)
        needed = 1024.0 * max(self._options[PEAK], self._options[PERMANENT] + self._options[FACTOR])
        if needed > available_memory():
            raise MemoryError(needed)
        self._call(FACTORISE)
        self.negative = int(self._options[NEGATIVE])

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B``."""
        if not B.size:  # which the library refuses
            return np.zeros(B.shape)
        scale = self._scale if B.ndim == 1 else self._scale[:, None]
        right = np.multiply(scale, B, out=np.empty(B.shape, dtype=self._dtype, order="F"), casting="same_kind")
        X = np.empty_like(right)
        self._call(SOLVE, right, X)
        return np.multiply(scale, X, out=right if self._dtype is np.float64 else None)

    def _call(self, phase: int, B: np.ndarray | None = None, X: np.ndarray | None = None) -> None:
        columns = B.shape[1] if B is not None and B.ndim == 2 else 1
        matrix = (self._entries, self._rows, self._columns, self.order)
        _pardiso(self._handle, self._options, phase, self._n, matrix, columns, B, X)


def _pardiso(handle, options, phase: int, n: int, matrix=(None,) * 4, columns: int = 1, B=None, X=None) -> None:
    """Call the library; raise RuntimeError with its reason when it fails."""
    one = byref(c_int32(1))
    error = c_int32(0)
    sizes = [byref(c_int32(v)) for v in (SYMMETRIC_INDEFINITE, phase, n)]
    a, ia, ja, order = (address(part) for part in matrix)
    tail = (byref(c_int32(columns)), address(options), byref(c_int32(0)), address(B), address(X), byref(error))
    _mkl().pardiso(address(handle), one, one, *sizes, a, ia, ja, order, *tail)
    if error.value:
        raise RuntimeError(ERRORS.get(error.value, f"PARDISO error {error.value}"))


def _release(handle: np.ndarray, options: np.ndarray) -> None:
    _pardiso(handle, options, RELEASE, 0)


def _upper(A: csr_array, scale: np.ndarray, dtype: type) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Entries, row starts and columns of the scaled upper triangle, sorted as the library wants them."""
    A.sort_indices()
    rows = np.repeat(np.arange(A.shape[0], dtype=np.int32), np.diff(A.indptr))
    keep = A.indices >= rows
    rows = rows[keep]
    columns = A.indices[keep].astype(np.int32)
    starts = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=A.shape[0]))])
    if not np.all(np.diff(starts)):
        raise ValueError("it has an empty row")  # which the library does not survive
    return (A.data[keep] * scale[rows] * scale[columns]).astype(dtype), starts.astype(np.int32), columns


def address(array: np.ndarray | None) -> c_void_p | None:
    """Return the address of an array, for the library.

    Examples
    --------
    >>> address(None) is None
    True
    """
    return None if array is None else c_void_p(array.ctypes.data)


def equilibrium(A: csr_array) -> np.ndarray:
    """Return the scales (n,) that make the diagonal 1.

    PARDISO perturbs pivots below 1e-8 of the largest entry, which soft parts beside stiff ones have.

    Examples
    --------
    >>> equilibrium(csr_array(np.diag([4.0, 100.0])))
    array([0.5, 0.1])
    """
    diagonal = np.abs(A.diagonal())
    return 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))


@cache
def library() -> CDLL | None:
    """Return oneMKL's library where pypardiso and its wheel are installed, else None."""
    _remove_empty_registration()
    os.environ.setdefault("KMP_BLOCKTIME", WAITING)
    os.environ.setdefault("MKL_CBWR", REPRODUCIBLE)
    if path := _listed():
        os.environ.setdefault("PYPARDISO_MKL_RT", path)
    try:
        from pypardiso import PyPardisoSolver

        path = PyPardisoSolver(mtype=SYMMETRIC_INDEFINITE).libmkl._name
    except (ImportError, OSError):
        return None
    os.environ.setdefault("PYPARDISO_MKL_RT", path)
    return CDLL(path)


def _mkl() -> CDLL:
    mkl = library()
    assert mkl is not None  # who factorises by PARDISO has asked for it
    return mkl


def _remove_empty_registration() -> None:
    """Remove the empty file that an ended process of the same number has left, for instance on a full disk.

    The OpenMP library of oneMKL registers itself in shared memory by the number of its process; it takes a file that
    is there for whole, and reading an empty one ends the process by a bus error.
    """
    left = Path(f"/dev/shm/__KMP_REGISTERED_LIB_{os.getpid()}_{getattr(os, 'getuid', int)()}")
    with suppress(OSError):
        if left.stat().st_size == 0:
            left.unlink()


def _listed() -> str | None:
    """Return the library's file by the list of its wheel; pypardiso would search the whole environment for it."""
    with suppress(PackageNotFoundError):
        for file in files("mkl") or ():
            if "mkl_rt" in file.name and (found := Path(file.locate())).is_file():
                return str(found.resolve())
    return None
