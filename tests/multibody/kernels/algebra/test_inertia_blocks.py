"""Inertias by axes against NumPy's products of the (6, 6) matrix [[M, H], [H', J]]."""

import numpy as np
import pytest

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.algebra.inertia_blocks import (
    all_blocks,
    blocks,
    blocks_times,
    column_parts,
    less_outer_blocks,
    parts,
    rotated,
    second_column,
    shifted,
)
from modalprep.multibody.kernels.algebra.tuples import get3, get6, get9, put6, put9

UPPER = np.triu_indices(3)
ROUND_OFF = 1e-14  # sums of up to 36 products of numbers of size one


@pytest.fixture
def inertia():
    """Symmetric (6, 6), and M, H, J as kernels have them."""
    whole = np.random.default_rng(0).standard_normal((6, 6))
    whole += whole.T
    return whole, whole[:3, :3][UPPER], whole[:3, 3:].ravel(), whole[3:, 3:][UPPER]


@compile_kernel
def _write(B, out):
    M, H, J = parts(B)
    put6(out, M)
    put9(out[6:], H)
    put6(out[15:], J)


def _matrix(out):
    """Return the (6, 6) of what `_write` wrote."""
    square = np.zeros((6, 6))
    square[:3, :3][UPPER], square[3:, 3:][UPPER], square[:3, 3:] = out[:6], out[15:], out[6:15].reshape(3, 3)
    return np.triu(square) + np.triu(square, 1).T


@compile_kernel
def _turned(M, H, J, R, out):
    _write(rotated(get9(R), blocks(get6(M), get9(H), get6(J))), out)


def test_turned_axes(inertia):
    matrix, *own = inertia
    R, out = np.random.default_rng(1).standard_normal((3, 3)), np.empty(21)
    _turned(*own, R.ravel(), out)
    both = np.kron(np.eye(2), R)
    np.testing.assert_allclose(_matrix(out), both @ matrix @ both.T, atol=100 * ROUND_OFF)


@compile_kernel
def _moved(M, H, J, r, out):
    _write(shifted(blocks(get6(M), get9(H), get6(J)), get3(r)), out)


def test_another_origin(inertia):
    matrix, *own = inertia
    r, out = np.array([0.7, -1.3, 0.4]), np.empty(21)
    _moved(*own, r, out)
    T = np.eye(6)
    T[:3, 3:] = [[0, r[2], -r[1]], [-r[2], 0, r[0]], [r[1], -r[0], 0]]
    np.testing.assert_allclose(_matrix(out), T.T @ matrix @ T, atol=10 * ROUND_OFF)


@compile_kernel
def _without_column(M, H, J, g, out):
    B = blocks(get6(M), get9(H), get6(J))
    nine = all_blocks(B)
    v = second_column(nine[2]), second_column(nine[5]), second_column(nine[8])
    _write(less_outer_blocks(B, g, v), out)
    f, t = column_parts(v)
    put6(out[21:], (f[0], f[1], f[2], t[0], t[1], t[2]))


def test_eliminated_column(inertia):
    matrix, *own = inertia
    out = np.empty(27)
    _without_column(*own, 0.3, out)
    assert out[21:].tolist() == matrix[:, 5].tolist()
    np.testing.assert_allclose(_matrix(out[:21]), matrix - 0.3 * np.outer(matrix[5], matrix[5]), atol=ROUND_OFF)


@compile_kernel
def _product(M, H, J, v, out):
    put6(out, blocks_times(blocks(get6(M), get9(H), get6(J)), get6(v)))


def test_product_with_a_spatial_vector(inertia):
    matrix, *own = inertia
    v, out = np.random.default_rng(2).standard_normal(6), np.empty(6)
    _product(*own, v, out)
    np.testing.assert_allclose(out, matrix @ v, atol=ROUND_OFF)
