"""Free beam under end thrust: frequencies up to flutter, its matrices, its frequencies as it burns."""

import numpy as np
import pytest
from numpy.polynomial import Legendre
from scipy.linalg import eigvals
from systems.shipped import shipped

import modalprep as mp

L, EI, MU = 30.0, 5e7, 200.0
UNIT = np.sqrt(EI / (MU * L**4))  # rad/s of lambda = 1


def galerkin(thrust, terms=16):
    """Squares of lambda, ascending, of a free beam that a follower force at its tail pushes, in Legendre polynomials.

    ``int w'' v'' - T int (1 - x) w' v' - T w'(0) v(0) = lambda^2 int w v``: the force has a side component -T w'(0).
    """
    points, weights = np.polynomial.legendre.leggauss(40)
    x, weights = (points + 1) / 2, weights / 2
    shapes = [Legendre.basis(k, domain=[0, 1]) for k in range(terms)]
    value, slope, curvature = (np.array([p.deriv(d)(x) if d else p(x) for p in shapes]) for d in range(3))
    tail = [np.array([p.deriv(d)(0.0) if d else p(0.0) for p in shapes]) for d in range(2)]
    K = (weights * curvature) @ curvature.T
    K = K - thrust * ((weights * (1 - x) * slope) @ slope.T + np.outer(tail[0], tail[1]))
    found = eigvals(K, (weights * value) @ value.T)
    return found[np.argsort(found.real)]


def flutter():
    """Thrust at which the two lowest vibrations meet: 109.689."""
    low, high = 109.0, 111.0
    while high - low > 1e-6:
        middle = (low + high) / 2
        low, high = (low, middle) if np.abs(galerkin(middle)[2:4].imag).max() > 1e-6 else (middle, high)
    return low


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    return shipped("thrusted-beam", tmp_path_factory.mktemp("thrusted-beam"))[0]


def lowest(system, thrust):
    """Eigenvalues of the two lowest vibrations, in units of lambda."""
    found = mp.system_modes(system, t=thrust).eigenvalue / UNIT
    return found[np.abs(found) > 1][:2]


@pytest.mark.parametrize("thrust", [0.0, 1.0, 7.2, 10.0, 40.0, 80.0, 109.0])
def test_frequencies_under_thrust(system, thrust):
    """The axial force is constant in each of 120 elements: 1e-4 of the compression, and near flutter ten times that."""
    expected = np.sqrt(galerkin(thrust)[2:4].real)
    assert lowest(system, thrust).imag == pytest.approx(expected, rel=1e-3 if thrust > 100 else 2e-4)


def test_without_geometric_stiffness_thrust_only_follows(system):
    assert abs(lowest(system.conventional(), 40).imag[0] / np.sqrt(galerkin(40)[2].real) - 1) > 0.1


def test_flutter(system):
    """Where two frequencies meet one motion grows; found by bisection, off by the square of the elements' size."""
    low, high = 109.0, 111.0
    assert np.abs(lowest(system, low).real).max() < 1e-6
    assert lowest(system, high).real.max() > 0.5
    while high - low > 1e-3:
        middle = (low + high) / 2
        low, high = (low, middle) if np.abs(lowest(system, middle).real).max() > 1e-6 else (middle, high)
    assert low == pytest.approx(flutter(), rel=2e-4)


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
        name="fuel",
        body="stage",
        levels=(mp.body.with_density_factor(full, 0.5),),
        mass=mp.multibody.deplete(full.m, full.m / 2, 3000),
    )
    burning = system.with_(depletions=(fuel,), loads=())
    still, thrusted = (UNIT * np.sqrt(galerkin(thrust)[2].real) for thrust in (0.0, 4e5 * L**2 / EI))
    for t, lighter in ((0.0, 1.0), (1.0, 2.0)):
        assert lowest(burning, t).imag[0] * UNIT == pytest.approx(still * np.sqrt(lighter), rel=1e-6)
    pushed = system.with_(depletions=(fuel,), loads=(system.loads[0].with_(force=(4e5, 0, 0)),))
    assert lowest(pushed, 0.0).imag[0] * UNIT == pytest.approx(thrusted, rel=2e-5)
    assert lowest(pushed, 1.0).imag[0] * UNIT == pytest.approx(thrusted * np.sqrt(2), rel=2e-5)
