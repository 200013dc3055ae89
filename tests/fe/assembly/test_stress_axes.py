"""The axes of stress components on curved shells: orthonormal and tangent to the mean surface."""

from types import SimpleNamespace

import numpy as np
import pytest

import modalprep as mp
from modalprep.fe.assembly.stress_recovery import _axes

SHELL = mp.Shell(thickness=0.01, material=mp.Material(E=2e11, nu=0.3, rho=7800.0))


@pytest.mark.parametrize("axis", [None, (1.0, 0.0, 0.0), (0.3, 0.5, 0.2)])
def test_axes_on_a_curved_patch_are_orthonormal(axis):
    """The mean of normals that lean by 50 degrees to both sides is shorter than one: cos 50."""
    lean = np.radians(50)
    frames = [np.array([[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]]) for a in (-lean, lean)]
    found = _axes(np.array(frames), SHELL, SimpleNamespace(axis=axis))
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(found[2], (0, 0, 1), atol=1e-14)
    given = np.array(axis or (1.0, 0, 0))
    np.testing.assert_allclose(np.cross(found[0], given - given[2] * found[2]), 0, atol=1e-14)
