"""Flapping of a spinning blade with a tip mass: what the geometric stiffness of the force between bodies does."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from systems.shipped import run_shipped

import modalprep as mp

SPIN, MASS_RATIO = 3.0, 1.0
UNIT = np.sqrt(1.4e4 / (1.2 * 10.0**4))  # rad/s
MASS = 12.0
# axial force constant in each of 40 elements: frequency off by up to (1/40)^2 / 6 = 1e-4, over five periods 3e-3 rad
SWING = 5e-3
FLAP = {True: 3.5823, False: 2.1273}  # in UNIT; Bir (2010), and without the stiffness of the joint's force


def ritz(joint_stiffens, terms=8):
    """Mass (``mu L``) and stiffness (``EI / L^3``) of ``x^2 .. x^9``: blade, tip mass, centrifugal field."""
    phi = [Polynomial.basis(k + 2) for k in range(terms)]

    def integral(weight, order):
        slopes = [p.deriv(order) if order else p for p in phi]
        return np.array([[(weight * a * b).integ()(1.0) for a in slopes] for b in slopes])

    one, at_tip = Polynomial([1.0]), np.ones((terms, terms))
    pull = Polynomial([0.5, 0, -0.5]) + joint_stiffens * MASS_RATIO * one
    return integral(one, 0) + MASS_RATIO * at_tip, integral(one, 2) + SPIN**2 * integral(pull, 1)


def ritz_response(joint_stiffens, time):
    """Tip deflection (m) by the pulse ``2 sin(pi t)`` N of one second."""
    M, K = ritz(joint_stiffens)
    w2, modes = eigh(K, M)
    w2, tip = w2[:3] * UNIT**2, modes[:, :3].sum(axis=0)  # the pulse moves the higher ones by less than 1e-4

    def rate(t, z):
        force = 2 * np.sin(np.pi * t) if t < 1 else 0.0
        return np.concatenate([z[3:], tip * force / MASS - w2 * z[:3]])

    return tip @ solve_ivp(rate, (0, time[-1]), np.zeros(6), t_eval=time, rtol=1e-8, atol=1e-11, max_step=0.05).y[:3]


@pytest.fixture(scope="module")
def rotor(tmp_path_factory):
    return run_shipped("rotor-tip-mass", tmp_path_factory.mktemp("rotor"))


@pytest.mark.parametrize("joint_stiffens", FLAP)
def test_the_series_has_the_published_frequency(joint_stiffens):
    M, K = ritz(joint_stiffens)
    assert np.sqrt(eigh(K, M, eigvals_only=True)[0]) == pytest.approx(FLAP[joint_stiffens], abs=5e-4)


def test_force_between_bodies_stiffens(rotor):
    run, conventional = rotor.runs.values()
    expected = ritz_response(True, run.time)
    assert run.stats["energy_error"] < 1e-8
    np.testing.assert_allclose(run["blade.tip.deflection.y"], expected, atol=SWING * np.abs(expected).max())
    # the theory without any geometric stiffness stays behind from the first swing
    assert np.abs(conventional["blade.tip.deflection.y"]).max() > 1.5 * np.abs(expected).max()


def test_without_the_stiffness_of_that_force(rotor):
    """Only the matrices of the joint's force and moment are left out."""
    blade = rotor.system.bodies["blade"]
    bare = blade.with_(Kg_F=0 * blade.Kg_F, Kg_T=0 * blade.Kg_T)
    run = mp.simulate(rotor.system.with_(bodies=rotor.system.bodies | {"blade": bare}), t_end=8.0, rtol=1e-9)
    expected = ritz_response(False, run.time)
    np.testing.assert_allclose(run["blade.tip.deflection.y"], expected, atol=SWING * np.abs(expected).max())
