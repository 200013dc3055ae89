"""Choices among four numbers, and rows of matrices in them, are those of NumPy."""

import numpy as np
import pytest

from modalprep.compiler.jit import compile_kernel
from modalprep.compiler.lanes import (
    above,
    first_at_least,
    get_lanes,
    get_rows9,
    larger,
    largest,
    put_lanes,
    put_rows9,
    with_lane,
)
from modalprep.multibody.kernels.algebra.matrices import times
from modalprep.multibody.kernels.algebra.tuples import get9

EXACT = 4 * np.finfo(float).eps  # sums of three products, with or without one rounding less


@compile_kernel
def _choices(a, out):
    x, y = get_lanes(a, 0), get_lanes(a, 4)
    out[0], out[1], out[2] = largest(x), first_at_least(x, largest(x)), first_at_least(x, np.inf)
    put_lanes(out, 4, above(x, y, -1.0))
    put_lanes(out, 8, with_lane(x, 2, 7.0))
    put_lanes(out, 12, with_lane(x, 4, 7.0))
    put_lanes(out, 16, larger(x, y))


@pytest.mark.parametrize("numbers_of", [[1.0, 3.0, 3.0, -2.0], [-4.0, -3.0, -5.0, -1.0]])
def test_choices_among_lanes(numbers_of):
    a, out = np.array([*numbers_of, 0.5, 3.5, 2.5, -2.5]), np.empty(20)
    _choices(a, out)
    x, y = a[:4], a[4:]
    assert out[0] == x.max()
    assert out[1] == x.argmax()  # the first of equal ones
    assert out[2] >= 4
    expected = [np.where(x > y, x, -1.0), [x[0], x[1], 7.0, x[3]], x, np.maximum(x, y)]
    np.testing.assert_array_equal(out[4:].reshape(4, 4), expected)


@compile_kernel
def _product(a, b, out):
    put_rows9(out, times(get9(a), get_rows9(b)))


def test_rows_of_a_matrix_stay_within_it():
    a, b = np.random.default_rng(0).standard_normal((2, 3, 3))
    out = np.full(10, 5.0)
    _product(a.ravel(), b.ravel(), out)
    np.testing.assert_allclose(out[:9].reshape(3, 3), a @ b, rtol=EXACT, atol=EXACT)
    assert out[9] == 5.0
