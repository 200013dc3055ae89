"""Loads by which recoveries are judged: which there are, and their names."""

import numpy as np

from modalprep.examples import cantilever_model
from modalprep.linalg.modes import lowest_modes
from modalprep.reduction.clamped import clamp
from modalprep.reduction.recoveries.unit_loads import fixed_interface_loads


def test_loads_of_the_user_stand_last():
    """Six accelerations of the base, six of the held tip, then two loads of the user."""
    clamped = clamp(cantilever_model(4, tip="fixed"))
    w2, Phi, _ = lowest_modes(clamped.K_ii, clamped.M_ii, 3, factor=clamped.factor)
    push = np.eye(len(Phi))[:, [4, 7]]
    judged = fixed_interface_loads(clamped, w2, Phi, {"push": push})
    assert len(judged.label) == 14
    assert judged.label[-2:] == ("push", "push")
    np.testing.assert_array_equal(judged.moves, [True] * 12 + [False] * 2)
    np.testing.assert_allclose(judged.force[:, -2:], Phi.T @ push, atol=1e-12)
