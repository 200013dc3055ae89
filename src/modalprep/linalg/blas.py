"""Products of tall matrices, and eigenvalues, by the library that also factorises.

NumPy's OpenBLAS and oneMKL keep threads of their own; called in turns, each waits for cores on which the other's
threads still spin.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from ctypes import byref, c_char, c_double, c_int32
from functools import cache

import numpy as np
from scipy.linalg import LinAlgError
from scipy.linalg import eigh as scipy_eigh
from threadpoolctl import ThreadpoolController

from modalprep.linalg.onemkl import address, library

BY_COLUMNS = 102  # LAPACKE's name of Fortran's order
NARROW, ROWS = 16, 20_000  # columns and rows of pieces that stay in the cache: the library packs the whole of A instead


def inner(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Return ``A^T B (m, k)`` of ``A (n, m)`` and ``B (n, k)``.

    Examples
    --------
    >>> inner(np.eye(3)[:, :2], np.arange(6.0).reshape(3, 2))
    array([[0., 1.],
           [2., 3.]])
    """
    return _multiply(1.0, A.T, B, 0.0, np.empty((A.shape[1], B.shape[1]), order="F"))


def add_inner_alone(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> None:
    """Add ``A^T B`` of ``A (n, m)`` and ``B (n, k)`` to ``C (m, k)``, by the calling thread alone.

    For callers that share the work among threads of their own.

    Examples
    --------
    >>> C = np.ones((2, 3))
    >>> add_inner_alone(np.eye(3)[:, :2], np.arange(9.0).reshape(3, 3), C)
    >>> C
    array([[1., 2., 3.],
           [4., 5., 6.]])
    """
    mkl = library()
    before = mkl.MKL_Set_Num_Threads_Local(1) if mkl else 0
    _multiply(1.0, A.T, B, 1.0, C)
    if mkl:
        mkl.MKL_Set_Num_Threads_Local(before)


@contextmanager
def one_numpy_thread(*, beside_mkl: bool = False) -> Iterator[None]:
    """Let NumPy and SciPy use one thread in a product meanwhile, in this whole process.

    For callers whose own threads need the cores; with `beside_mkl` only where oneMKL makes the large products.

    Examples
    --------
    >>> with one_numpy_thread():
    ...     np.ones((2, 3)) @ np.ones(3)
    array([3., 3.])
    """
    if beside_mkl and library() is None:
        yield
        return
    _limit().change(1)
    try:
        yield
    finally:
        _limit().change(-1)


class _Limit:
    """Limits OpenBLAS to one thread while any caller asks for it; only the thread that sets a limit can lift it."""

    def __init__(self) -> None:
        self._libraries = ThreadpoolController().select(internal_api="openblas")
        self._thread = ThreadPoolExecutor(1)
        self._held = ExitStack()
        self._askers = 0

    def change(self, askers: int) -> None:
        """Count callers that ask for the limit (1) or no longer do (-1)."""
        self._thread.submit(self._change, askers).result()

    def _change(self, askers: int) -> None:
        if self._askers == 0:
            self._held.enter_context(self._libraries.limit(limits=1))
        self._askers += askers
        if self._askers == 0:
            self._held.close()


@cache
def _limit() -> _Limit:
    return _Limit()


if hasattr(os, "register_at_fork"):  # a forked process has none of its parent's threads
    os.register_at_fork(after_in_child=_limit.cache_clear)


def share_threads(jobs: int) -> ThreadPoolExecutor:
    """Return threads for some jobs at a time, as many as the library may use, in each of which it uses its share.

    Examples
    --------
    >>> with share_threads(2) as pool:
    ...     pool.submit(inner, np.eye(2), np.eye(2)).result()
    array([[1., 0.],
           [0., 1.]])
    """
    mkl = library()
    if mkl is None:
        return ThreadPoolExecutor(jobs)
    most = mkl.MKL_Get_Max_Threads()
    share = max(1, most // jobs)
    return ThreadPoolExecutor(min(jobs, most), initializer=mkl.MKL_Set_Num_Threads_Local, initargs=(share,))


def product(A: np.ndarray, B: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
    """Return ``A B (n, k)`` of ``A (n, m)`` and ``B (m, k)``, stored as A is, or in `out`.

    Examples
    --------
    >>> product(np.eye(2), np.array([[1.0], [2.0]])).ravel()
    array([1., 2.])
    """
    if out is None:
        out = np.empty((A.shape[0], B.shape[1]), order="C" if A.flags.c_contiguous else "F")
    return _multiply(1.0, A, B, 0.0, out)


def subtract(W: np.ndarray, A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Return ``W - A B (n, k)`` of ``A (n, m)`` and ``B (m, k)``.

    Examples
    --------
    >>> subtract(np.ones((2, 1)), np.eye(2), np.array([[1.0], [2.0]])).ravel()
    array([ 0., -1.])
    """
    return deduct(W.copy(order="K"), A, B)


def deduct(W: np.ndarray, A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Subtract ``A B (n, k)`` of ``A (n, m)`` and ``B (m, k)`` from W itself, and return it.

    Examples
    --------
    >>> W = np.ones((2, 1))
    >>> deduct(W, np.eye(2), np.array([[1.0], [2.0]])) is W
    True
    >>> W.ravel()
    array([ 0., -1.])
    """
    if not B.shape[1] <= NARROW < A.shape[1]:
        return _multiply(-1.0, A, B, 1.0, W)
    for row in range(0, len(A), ROWS):
        rows = slice(row, row + ROWS)
        for k in range(0, A.shape[1], NARROW):
            _multiply(-1.0, A[rows, k : k + NARROW], B[k : k + NARROW], 1.0, W[rows])
    return W


def eigh(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the eigenvalues (n,), ascending, and orthonormal eigenvectors (n, n) of a symmetric matrix.

    Raises
    ------
    LinAlgError
        When it does not converge: A is not finite.

    Examples
    --------
    >>> eigh(np.diag([2.0, 1.0]))[0]
    array([1., 2.])
    """
    mkl = library()
    if mkl is None or not A.size:
        return scipy_eigh(A)
    vectors = np.array(A, dtype=float, order="F")
    values = np.empty(len(A))
    n = c_int32(len(A))
    if mkl.LAPACKE_dsyevd(c_int32(BY_COLUMNS), c_char(b"V"), c_char(b"L"), n, address(vectors), n, address(values)):
        raise LinAlgError("eigenvalues of a symmetric matrix did not converge")
    return values, vectors


def _multiply(alpha: float, A: np.ndarray, B: np.ndarray, beta: float, C: np.ndarray) -> np.ndarray:
    """Set ``C = alpha A B + beta C`` and return it; matrices stored by rows or by columns are not copied."""
    mkl = library()
    if mkl is None or C.size == 0 or A.shape[1] == 0:
        C[:] = alpha * (A @ B) + (beta * C if beta else 0.0)
        return C
    left, right, out = (B.T, A.T, C.T) if C.flags.c_contiguous else (A, B, C)  # C^T = B^T A^T
    (turned, left), (other, right) = _stored(left), _stored(right)
    sizes = [byref(c_int32(v)) for v in (*out.shape, A.shape[1])]
    leading = [byref(c_int32(_leading(M))) for M in (left, right, out)]
    one, before = byref(c_double(alpha)), byref(c_double(beta))
    flags = [byref(c_char(flag)) for flag in (turned, other)]
    mkl.dgemm(
        *flags, *sizes, one, address(left), leading[0], address(right), leading[1], before, address(out), leading[2]
    )
    return C


def _stored(A: np.ndarray) -> tuple[bytes, np.ndarray]:
    """Return whether the library has to transpose, and what it finds stored by columns."""
    for flag, stored in ((b"N", A), (b"T", A.T)):
        if A.dtype == float and stored.strides[0] == A.itemsize and _leading(stored) >= len(stored):
            return flag, stored
    return b"N", np.asfortranarray(A, dtype=float)


def _leading(A: np.ndarray) -> int:
    """Return the distance of columns in numbers."""
    return A.strides[1] // A.itemsize if A.shape[1] > 1 else len(A)
