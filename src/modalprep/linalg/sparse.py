"""Products of sparse matrices with many columns, by the library that also factorises: SciPy's are of one thread."""

from __future__ import annotations

from ctypes import Structure, byref, c_double, c_int, c_int32, c_void_p
from typing import Protocol

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError
from modalprep.linalg.onemkl import address, library

AS_STORED, ZERO_BASED, GENERAL, BY_ROWS = 10, 0, 20, 101  # the library's names
LEAST = 4  # columns: fewer take less time than to call the library


class _Kind(Structure):
    """What the library is told of a matrix: its kind, triangle and diagonal."""

    _fields_ = (("kind", c_int), ("triangle", c_int), ("diagonal", c_int))


class Matrix(Protocol):
    """What can be multiplied with columns: a sparse matrix, or one that is not stored in one piece."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns."""
        ...

    def diagonal(self) -> np.ndarray:
        """Return the diagonal."""
        ...

    def __matmul__(self, X: np.ndarray, /) -> np.ndarray:
        """Return the product."""
        ...


def times(A: Matrix, X: np.ndarray) -> np.ndarray:
    """Return ``A X (m, k)``, stored by rows, of ``A (m, n)`` and ``X (n, k)``.

    Raises
    ------
    AccuracyError
        When the library cannot multiply: it lacks memory.

    Examples
    --------
    >>> times(csr_array(np.diag([1.0, 2.0])), np.ones((2, 5)))[:, 0]
    array([1., 2.])
    """
    return _product(A, X) if isinstance(A, csr_array) else np.ascontiguousarray(A @ X)


def _product(A: csr_array, X: np.ndarray) -> np.ndarray:
    mkl = library()
    if mkl is None or X.shape[1] < LEAST or not _readable(A, X):
        return np.ascontiguousarray(A @ X)
    X, out = np.ascontiguousarray(X), np.empty((A.shape[0], X.shape[1]))
    handle = c_void_p()
    columns = c_int32(X.shape[1])
    arrays = (address(A.indptr), address(A.indptr[1:]), address(A.indices), address(A.data))
    shape = (c_int32(A.shape[0]), c_int32(A.shape[1]))
    failed = mkl.mkl_sparse_d_create_csr(byref(handle), ZERO_BASED, *shape, *arrays)
    if not failed:
        kind = _Kind(GENERAL)
        one = c_double(1.0)
        zero = c_double(0.0)
        right = (BY_ROWS, address(X), columns, columns)
        result = (zero, address(out), columns)
        failed = mkl.mkl_sparse_d_mm(AS_STORED, one, handle, kind, *right, *result)
        mkl.mkl_sparse_destroy(handle)
    if failed:
        raise AccuracyError(f"the product of a sparse matrix with {X.shape[1]} columns failed: oneMKL error {failed}")
    return out


def _readable(A: csr_array, X: np.ndarray) -> bool:
    """Whether the library may read the arrays as they are; it would take integers of 64 bits for others."""
    integers = A.indices.dtype == A.indptr.dtype == np.int32
    return bool(integers and A.nnz and X.size and A.dtype == X.dtype == np.float64)
