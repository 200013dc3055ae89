"""Double pendulum of point masses, against its closed-form equations; its second hinge angle is relative."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from systems.shipped import run_shipped, shipped

import modalprep as mp


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    return shipped("double-pendulum", tmp_path_factory.mktemp("pendulum"))[0]


def from_rest(system, upper, lower):
    shoulder, elbow = system.joints
    return system.with_(joints=(shoulder.with_(angle=upper), elbow.with_(angle=lower - upper)))


def rods(run, t):
    """Angles of both rods from the vertical, and their rates."""
    row = np.argmin(np.abs(run.time - t))
    a, b, ad, bd = (run[f"{name}"][row] for name in ("shoulder.angle", "elbow.angle", "shoulder.rate", "elbow.rate"))
    return [a, a + b, ad, ad + bd]


def test_small_swings(system):
    found = 2 * np.pi * mp.system_modes(from_rest(system, 0.0, 0.0)).frequency
    # accuracy of the linear equations; both frequencies are exact
    np.testing.assert_allclose(found, np.sqrt((2 + np.array([-1, 1]) * np.sqrt(2)) * 9.81), rtol=1e-9)


def integrated(upper, lower, times, g=9.81):
    """Rows of angles from the vertical and rates, from rest; unit masses and lengths: Lagrange's equations."""

    def rates(t, z):
        a, b, ad, bd = z
        mass = np.array([[2.0, np.cos(a - b)], [np.cos(a - b), 1.0]])
        force = [-np.sin(a - b) * bd**2 - 2 * g * np.sin(a), np.sin(a - b) * ad**2 - g * np.sin(b)]
        return [ad, bd, *np.linalg.solve(mass, force)]

    start = [upper, lower, 0.0, 0.0]
    return solve_ivp(rates, (0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-13).y.T


def test_from_the_horizontal(tmp_path):
    (run,) = run_shipped("double-pendulum", tmp_path).runs.values()
    expected = integrated(np.pi / 2, np.pi / 2, [1.0, 2.0])
    # both integrations are good to 1e-10, which the motion multiplies by ten a second
    np.testing.assert_allclose(rods(run, 1.0), expected[0], atol=2e-9)
    np.testing.assert_allclose(rods(run, 2.0), expected[1], atol=5e-9)
    assert run.stats["energy_error"] < 1e-9
    reach = np.linalg.norm(run["lower.bob.position"] - run["upper.bob.position"], axis=1)
    np.testing.assert_allclose(reach, 1.0, rtol=1e-14)


def test_from_a_small_angle(system):
    run = mp.simulate(from_rest(system, 0.1, -0.1), t_end=1.0, output_step=1.0, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(rods(run, 1.0), integrated(0.1, -0.1, [1.0])[0], atol=1e-9)
