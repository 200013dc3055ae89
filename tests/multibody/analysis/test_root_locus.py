"""Root loci: the closed form of an oscillator with rate feedback, ``1 + k H = 0``, python-control's zeros."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.multibody import LinearSystem, root_locus
from modalprep.multibody.analysis.root_locus import zeros_of_loop


def linear(A, B, C, D=0.0):
    A, B, C = (np.asarray(x, dtype=float) for x in (A, B, C))
    states = tuple(f"z{k}" for k in range(len(A)))
    return LinearSystem(A=A, B=B, C=C, D=np.array([[D]]), states=states, inputs=("f",), outputs=("o",))


def two_masses(D=0.0):
    """Return two masses on springs with dampers, pushed and measured at the second one."""
    A = [[0, 0, 1, 0], [0, 0, 0, 1], [-200, 100, -0.4, 0.2], [100, -100, 0.2, -0.2]]
    return linear(A, [[0], [0], [0], [1]], [[0, 1.0, 0, 0.3]], D)


def test_rate_feedback_of_an_oscillator():
    """``s^2 + k s + 4``: on the circle of radius 2 up to k = 4, then apart on the real axis."""
    oscillator = linear([[0, 1], [-4, 0]], [[0], [1]], [[0, 1.0]])
    found = np.sort_complex(root_locus(oscillator, [0.0, 2.0, 5.0]))
    expected = [[-2j, 2j], [-1 - 3**0.5 * 1j, -1 + 3**0.5 * 1j], [-4, -1]]
    np.testing.assert_allclose(found, expected, atol=1e-14)


@pytest.mark.parametrize("D", [0.0, 0.02])
def test_each_branch_closes_the_loop(D):
    """``1 + k (C (s - A)^-1 B + D) = 0``, to the error of eigenvalues, and no branch jumps."""
    plant, gains = two_masses(D), np.geomspace(1e-1, 1e3, 400)
    branches = root_locus(plant, gains)
    for k, poles in zip(gains[::40], branches[::40], strict=True):
        for s in poles:
            loop = k * (plant.C @ np.linalg.solve(s * np.eye(4) - plant.A, plant.B) + D)[0, 0]
            assert loop == pytest.approx(-1, rel=1e-8)
    assert np.abs(np.diff(branches, axis=0)).max() < 0.1 * np.abs(branches).max()


def test_zeros_are_those_of_python_control():
    pytest.importorskip("control")
    plant = two_masses()
    expected = np.sort_complex(plant.to_control().zeros())
    np.testing.assert_allclose(np.sort_complex(zeros_of_loop(plant)), expected, rtol=1e-9)


def test_zeros_beside_poles_at_the_origin():
    """``(s + 3) / s^2``."""
    mass = linear([[0, 1], [0, 0]], [[0], [1]], [[3.0, 1.0]])
    np.testing.assert_allclose(zeros_of_loop(mass), [-3.0], rtol=1e-12)


def test_what_is_no_loop_is_refused():
    with pytest.raises(mp.InputError, match="the gain -2 makes 1 \\+ k D zero"):
        root_locus(two_masses(0.5), [-2.0])
    two = LinearSystem(A=np.eye(1), B=np.eye(1), C=np.ones((2, 1)), D=np.zeros((2, 1)), states=("z",), inputs=("f",),
                       outputs=("x", "y"))  # fmt: skip
    with pytest.raises(mp.InputError, match="1 inputs and 2 outputs came: name one of each"):
        root_locus(two, [1.0])
