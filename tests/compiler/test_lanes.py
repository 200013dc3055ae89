"""Lanes of compiled code: what they do to four numbers is what NumPy does to an array of four."""

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from modalprep.compiler.jit import compile_kernel
from modalprep.compiler.lanes import (
    arrangement,
    four,
    get_lane6,
    get_lanes,
    get_lanes3,
    numbers,
    put_lanes,
    put_lanes3,
    sum_lanes,
)
from modalprep.multibody.kernels.algebra.matrices import times
from modalprep.multibody.kernels.algebra.tuples import cross, get3, get9

EXACT = 4 * np.finfo(float).eps  # sums of three products, with or without one rounding less


@compile_kernel
def _sum(a, b, f, out):
    x, y = get_lanes(a, 0), get_lanes(b, 1)
    y += x
    put_lanes(out, 0, x + y)
    put_lanes(out, 4, x - f)
    put_lanes(out, 8, f * y)
    put_lanes(out, 12, four(f) * (x * y))
    put_lanes(out, 16, x / f)


def test_operators_take_lanes_and_numbers():
    a, b = np.random.default_rng(0).standard_normal((2, 8))
    out = np.empty(20)
    _sum(a, b, 1.7, out)
    x, y = a[:4], b[1:5] + a[:4]
    expected = [x + y, x - 1.7, 1.7 * y, 1.7 * x * y, x / 1.7]
    np.testing.assert_allclose(out.reshape(5, 4), expected, rtol=EXACT, atol=EXACT)


@compile_kernel
def _sums_and_numbers(a, out):
    x, y, z, w = get_lanes(a, 0), get_lanes(a, 4), get_lanes(a, 8), get_lanes(a, 12)
    put_lanes(out, 0, sum_lanes(x, y, z, w))
    each = numbers(y)
    out[4], out[5], out[6], out[7] = each[3], each[2], each[1], each[0]


def test_sums_and_numbers():
    a, out = np.arange(16.0).reshape(4, 4) ** 2, np.empty(8)
    _sums_and_numbers(a.ravel(), out)
    np.testing.assert_array_equal(out.reshape(2, 4), [a.sum(axis=1), a[1][::-1]])  # whole numbers


swap_and_clear = arrangement(1, 0, 4, 2)


@compile_kernel
def _arrange(a, out):
    put_lanes(out, 0, swap_and_clear(get_lanes(a, 0)))


def test_arrangements():
    out = np.full(4, np.nan)
    _arrange(np.array([3.0, 5.0, 7.0, 11.0]), out)
    assert out.tolist() == [5.0, 3.0, 0.0, 7.0]


@compile_kernel
def _turn(R, r, vectors, out):
    turned = times(get9(R), get_lanes3(vectors, 0))
    put_lanes3(out, 0, turned)
    put_lanes3(out, 12, cross(get3(r), turned))


def test_functions_on_tuples_take_lanes():
    rng = np.random.default_rng(1)
    R, r, vectors, out = rng.standard_normal((3, 3)), rng.standard_normal(3), rng.standard_normal((3, 4)), np.empty(24)
    _turn(R.ravel(), r, vectors.ravel(), out)
    expected = R @ vectors
    np.testing.assert_allclose(out[:12].reshape(3, 4), expected, rtol=EXACT, atol=EXACT * 8)
    np.testing.assert_allclose(out[12:].reshape(3, 4), np.cross(r, expected.T).T, rtol=EXACT, atol=EXACT * 32)


@compile_kernel
def _lane(a, k, out):
    for c, x in enumerate(get_lane6(a, k)):
        out[c] = x


@pytest.mark.parametrize("k", [0, 2])
def test_a_lane_of_a_spatial_vector(k):
    a, out = np.arange(24.0), np.empty(6)
    _lane(a, k, out)
    assert out.tolist() == a.reshape(6, 4)[:, k].tolist()


def test_other_numbers_are_refused():
    """Lanes of a complex array would be half of its numbers."""

    @njit
    def doubled(a, b):
        put_lanes(b, 0, 2.0 * get_lanes(a, 0))

    with pytest.raises(TypingError, match="complex128"):
        doubled(np.zeros(8, complex), np.zeros(8, complex))
