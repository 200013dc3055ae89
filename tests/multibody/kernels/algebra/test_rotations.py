"""Cosine and sine of joints' angles against libm's in more digits (NumPy's long double)."""

import numpy as np
import pytest

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.algebra.rotations import MOST, cosine_sine

EXTENDED = np.finfo(np.longdouble).eps < 1e-18


@compile_kernel
def _all(angles, out):
    for i in range(len(angles)):
        out[0, i], out[1, i] = cosine_sine(angles[i])


def _found(angles):
    out = np.empty((2, len(angles)))
    _all(angles, out)
    return out


@pytest.mark.skipif(not EXTENDED, reason="NumPy's long double is double here")
@pytest.mark.parametrize("largest", [0.8, 10.0, 0.99 * MOST, 1e9])
def test_cosine_and_sine(largest):
    rng = np.random.default_rng(0)
    near = np.round(rng.uniform(-1, 1, 500) * largest / (np.pi / 2)) * (np.pi / 2)  # where one of them vanishes
    angles = np.concatenate([rng.uniform(-largest, largest, 5000), near, near + 1e-9 * rng.standard_normal(500)])
    wide = angles.astype(np.longdouble)
    expected, found = np.stack([np.cos(wide), np.sin(wide)]), _found(angles)
    # units of the last digit: the angle's rest has an error of a half, sums another; MOST has 1e-6 in QUARTER's tail
    assert np.all(abs(found - expected) <= 1.5 * np.spacing(abs(expected).astype(float)) + 1e-21)


def test_no_angle_is_no_rotation():
    with np.errstate(invalid="ignore"):  # of NumPy, where there is no numba
        out = _found(np.array([0.0, -0.0, 1e-300, np.nan, np.inf]))
    assert out[:, :3].tolist() == [[1.0, 1.0, 1.0], [0.0, 0.0, 1e-300]]
    assert np.isnan(out[:, 3:]).all()
