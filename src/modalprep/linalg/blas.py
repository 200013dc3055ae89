"""Products of tall matrices, and eigenvalues, by the library that also factorises.

NumPy's OpenBLAS and oneMKL keep threads of their own; called in turns, each waits for cores on which the other's
threads still spin.
"""

from __future__ import annotations

from ctypes import byref, c_char, c_double, c_int32

import numpy as np
from scipy.linalg import LinAlgError
from scipy.linalg import eigh as scipy_eigh

from modalprep.linalg.pardiso import at, library

BY_COLUMNS = 102  # LAPACKE's name of Fortran's order


def inner(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Return ``A^T B (m, k)`` of ``A (n, m)`` and ``B (n, k)``.

    Examples
    --------
    >>> inner(np.eye(3)[:, :2], np.arange(6.0).reshape(3, 2))
    array([[0., 1.],
           [2., 3.]])
    """
    if library() is None:
        return A.T @ B
    A, B = np.asfortranarray(A), np.asfortranarray(B)
    C = np.empty((A.shape[1], B.shape[1]), order="F")
    return _gemm(b"T", 1.0, A, B, 0.0, C)


def inner_alone(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Return ``A^T B (m, k)`` of ``A (n, m)`` and ``B (n, k)``, stored by rows, by the calling thread alone.

    For callers that share the work among threads of their own.

    Examples
    --------
    >>> inner_alone(np.eye(3)[:, :2], np.arange(6.0).reshape(3, 2))
    array([[0., 1.],
           [2., 3.]])
    """
    if library() is None:
        return A.T @ B
    A, B = np.ascontiguousarray(A), np.ascontiguousarray(B)
    before = library().MKL_Set_Num_Threads_Local(1)
    C = _gemm(b"N", 1.0, B.T, A.T, 0.0, np.empty((B.shape[1], A.shape[1]), order="F"), b"T").T
    library().MKL_Set_Num_Threads_Local(before)
    return C


def product(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Return ``A B (n, k)`` of ``A (n, m)`` and ``B (m, k)``.

    Examples
    --------
    >>> product(np.eye(2), np.array([[1.0], [2.0]])).ravel()
    array([1., 2.])
    """
    if library() is None:
        return A @ B
    A, B = np.asfortranarray(A), np.asfortranarray(B)
    return _gemm(b"N", 1.0, A, B, 0.0, np.empty((A.shape[0], B.shape[1]), order="F"))


def subtract(W: np.ndarray, A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Return ``W - A B (n, k)`` of ``A (n, m)`` and ``B (m, k)``.

    Examples
    --------
    >>> subtract(np.ones((2, 1)), np.eye(2), np.array([[1.0], [2.0]])).ravel()
    array([ 0., -1.])
    """
    if library() is None:
        return W - A @ B
    return _gemm(b"N", -1.0, np.asfortranarray(A), np.asfortranarray(B), 1.0, np.array(W, order="F"))


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
    if library() is None or not A.size:
        return scipy_eigh(A)
    vectors, values, n = np.array(A, dtype=float, order="F"), np.empty(len(A)), c_int32(len(A))
    if library().LAPACKE_dsyevd(c_int32(BY_COLUMNS), c_char(b"V"), c_char(b"L"), n, at(vectors), n, at(values)):
        raise LinAlgError("eigenvalues of a symmetric matrix did not converge")
    return values, vectors


def _gemm(
    turned: bytes, alpha: float, A: np.ndarray, B: np.ndarray, beta: float, C: np.ndarray, other_turned: bytes = b"N"
) -> np.ndarray:
    """``C = alpha op(A) op(B) + beta C``, all stored by columns."""
    length = B.shape[0 if other_turned == b"N" else 1]
    if C.size == 0 or length == 0:
        C[:] = beta * C if beta else 0.0
        return C
    sizes = [byref(c_int32(v)) for v in (*C.shape, length)]
    leading = [byref(c_int32(M.strides[1] // M.itemsize if M.shape[1] > 1 else M.shape[0])) for M in (A, B, C)]
    one, other = byref(c_double(alpha)), byref(c_double(beta))
    flags = [byref(c_char(flag)) for flag in (turned, other_turned)]
    library().dgemm(*flags, *sizes, one, at(A), leading[0], at(B), leading[1], other, at(C), leading[2])
    return C
