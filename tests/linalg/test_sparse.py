"""Products of sparse matrices with many columns against SciPy's, for every way in which the arrays may be stored."""

import numpy as np
import pytest
from scipy.sparse import csr_array, random_array

from modalprep.linalg.onemkl import library
from modalprep.linalg.sparse import times

A = random_array((60, 40), density=0.1, format="csr", rng=np.random.default_rng(0))


def stored(integers, numbers=np.float64):
    matrix = A.astype(numbers)
    matrix.indices, matrix.indptr = A.indices.astype(integers), A.indptr.astype(integers)
    return matrix


@pytest.mark.parametrize("matrix", [stored(np.int32), stored(np.int64), stored(np.int32, np.float32), A.T.tocsc().T])
@pytest.mark.parametrize("order", "CF")
@pytest.mark.parametrize("columns", [0, 1, 12])
def test_products_are_those_of_scipy(matrix, order, columns):
    X = np.asarray(np.random.default_rng(1).standard_normal((40, columns)), order=order)
    found = times(matrix, X)
    assert found.flags.c_contiguous
    np.testing.assert_allclose(found, matrix @ X, rtol=0, atol=1e-14)  # sums of some four terms of order 1


def test_empty_matrices_and_columns_of_others():
    """A matrix without entries, and some columns of an array, which are not side by side in memory."""
    X = np.random.default_rng(2).standard_normal((40, 12))
    np.testing.assert_array_equal(times(csr_array((60, 40)), X), np.zeros((60, 12)))
    np.testing.assert_allclose(times(stored(np.int32), X[:, ::2]), A @ X[:, ::2], rtol=0, atol=1e-14)


@pytest.mark.skipif(library() is None, reason="oneMKL has no wheel here")
def test_library_multiplies_what_it_can_read(monkeypatch):
    """SciPy is left for few columns and for integers of 64 bits, which the library would read as pairs of 32."""
    called = []

    class Watched:
        def __getattr__(self, name):
            called.append(name)
            return getattr(library(), name)

    monkeypatch.setattr("modalprep.linalg.sparse.library", Watched)
    for matrix, columns, count in ((stored(np.int32), 8, 1), (stored(np.int32), 2, 0), (stored(np.int64), 8, 0)):
        called.clear()
        times(matrix, np.ones((40, columns)))
        assert called.count("mkl_sparse_d_mm") == count
