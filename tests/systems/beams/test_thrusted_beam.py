"""Free beam under end thrust: frequencies up to flutter, its matrices, its frequencies as it burns."""

import numpy as np
import pytest
from systems.shipped import shipped

import modalprep as mp

L, EI, MU = 30.0, 5e7, 200.0
UNIT = np.sqrt(EI / (MU * L**4))  # rad/s of lambda = 1
FREQUENCY = {  # thrust in EI / L^2: lambda_1, lambda_2; a Galerkin solution in 24 polynomials gives the same digits
    0: (22.3733, 61.6728),
    1: (22.2356, 61.4858),
    7.2: (21.371057, 60.308826),
    10: (20.9746, 59.7671),
    40: (16.5307, 53.4694),
    80: (11.6300, 42.6033),
    109: (20.3282, 25.9266),
}
FLUTTER = 109.68919


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    return shipped("thrusted-beam", tmp_path_factory.mktemp("thrusted-beam"))[0]


def lowest(system, thrust):
    """Eigenvalues of the two lowest vibrations, in units of lambda."""
    found = mp.system_modes(system, t=thrust).eigenvalue / UNIT
    return found[np.abs(found) > 1][:2]


@pytest.mark.parametrize("thrust", FREQUENCY)
def test_frequencies_under_thrust(system, thrust):
    """The axial force is constant in each of 120 elements: 1e-4 of the compression, and near flutter ten times that."""
    assert lowest(system, thrust).imag == pytest.approx(FREQUENCY[thrust], rel=1e-3 if thrust > 100 else 2e-4)


def test_without_geometric_stiffness_thrust_only_follows(system):
    assert abs(lowest(system.conventional(), 40).imag[0] / FREQUENCY[40][0] - 1) > 0.1


def test_flutter(system):
    """Where two frequencies meet one motion grows; found by bisection, off by the square of the elements' size."""
    low, high = 109.0, 111.0
    assert np.abs(lowest(system, low).real).max() < 1e-6
    assert lowest(system, high).real.max() > 0.5
    while high - low > 1e-3:
        middle = (low + high) / 2
        low, high = (low, middle) if np.abs(lowest(system, middle).real).max() > 1e-6 else (middle, high)
    assert low == pytest.approx(FLUTTER, rel=2e-4)


def test_stiffness_matrix_of_the_thrust(system):
    """``-T int (1 - x/L) phi_i' phi_j'`` of free-free modes, and slope and place of the follower force at the tail."""
    body = mp.body.in_mean_axes(system.bodies["stage"])
    tail = body.interface_name.index("tail")
    order = np.array([2.0, -2.0, -2.0]) / np.sqrt(body.m)  # displacement of the tail by mode
    sign = np.sign(order * body.phi[tail, 1, :3])
    place, slope = sign * body.phi[tail, 1, :3], sign * body.psi[tail, 2, :3]
    # the third mode of a basis of nine is good to 3e-4
    np.testing.assert_allclose(place, order, rtol=1e-3)
    np.testing.assert_allclose(slope * L * np.sqrt(body.m), [-9.2946, 15.7186, 21.9905], rtol=1e-3)
    Kg = body.Kg_A[0] / body.m + body.Kg_F[tail, 0]  # of a unit thrust
    found = -body.m * L * np.outer(sign, sign) * Kg[:3, :3]
    expected = [[24.7404, -22.2265, -17.6888], [-22.2265, 54.4623, 42.239], [-17.6888, 42.239, 93.4334]]
    np.testing.assert_allclose(found, expected, rtol=3e-3)


def test_frequencies_of_the_depleting_beam(system):
    """w ~ m^(-1/2) of uniform depletion; half the mass at 1 s, and the thrust at the start."""
    full = system.bodies["stage"]
    fuel = mp.multibody.Depletion(
        name="fuel", body="stage", levels=(mp.body.scaled(full, 0.5),), mass=mp.multibody.burn(full.m, full.m / 2, 3000)
    )
    burning = system.with_(depletions=(fuel,), loads=())
    for t, expected in ((0.0, 12.429611), (1.0, 17.578125)):
        assert lowest(burning, t).imag[0] * UNIT == pytest.approx(expected, rel=1e-6)
    pushed = system.with_(depletions=(fuel,), loads=(system.loads[0].with_(force=(4e5, 0, 0)),))
    assert lowest(pushed, 0.0).imag[0] * UNIT == pytest.approx(11.872809, rel=2e-5)
    assert lowest(pushed, 1.0).imag[0] * UNIT == pytest.approx(11.872809 * np.sqrt(2), rel=2e-5)
