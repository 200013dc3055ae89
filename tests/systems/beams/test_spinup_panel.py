"""Spin-up of a panel of shells and eccentric beams, against a cantilever beam of its whole cross-section."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from systems.shipped import run_shipped

E, RHO, LENGTH, MEASURED = 70e9, 2700.0, 1.2, 1.15  # the tip interface is the mean of x = 1.1 to 1.2
SKIN, STRINGER = 0.8 * 0.002, 4 * (2 * 0.02 * 0.002 + 0.021 * 0.002)  # m^2
STRINGER_I = 4 * (0.02 * 0.025**3 - 0.018 * 0.021**3) / 12  # m^4, about their own axis
AREA, DROP = SKIN + STRINGER, 0.0135
CENTROID = -DROP * STRINGER / (SKIN + STRINGER)  # z, m
EI = E * (STRINGER_I + 0.8 * 0.002**3 / 12 + SKIN * CENTROID**2 + STRINGER * (DROP + CENTROID) ** 2)
SPIN, DAMPING = 110.0, 0.01


def spin_up(t):
    """Rate (rad/s) and its derivative of the law in the pipeline file."""
    rising = t < 2
    rate = SPIN * (t / 2 - np.sin(np.pi * t) / (2 * np.pi)) if rising else SPIN
    return rate, SPIN * (1 - np.cos(np.pi * t)) / 2 if rising else 0.0


def integral(weight, a, b):
    return np.array([[(weight * p * q).integ()(1.0) for q in b] for p in a])


def beam_lag(time, stiffened=True, terms=5):
    """Ritz series ``x^2 ..`` of a beam off the axis: tension of the centrifugal field, its pull on the offset."""
    phi = [Polynomial.basis(k + 2) for k in range(terms)]
    one, x = Polynomial([1.0]), Polynomial([0, 1.0])
    mass = integral(one, phi, phi)
    curvature, slope = [p.deriv(2) for p in phi], [p.deriv() for p in phi]
    stiffness = EI / (RHO * AREA * LENGTH**4) * integral(one, curvature, curvature)
    tension = stiffened * integral(Polynomial([0.5, 0, -0.5]), slope, slope)
    w2, modes = eigh(stiffness, mass)
    tension = modes.T @ tension @ modes
    lever, lift = modes.T @ integral(x, phi, [one])[:, 0] * LENGTH, modes.T @ integral(one, phi, [one])[:, 0] * CENTROID

    def rate(t, z):
        q, v = np.split(z, 2)
        w, alpha = spin_up(t)
        force = -alpha * lever + w**2 * (lift + q - tension @ q)
        return np.concatenate([v, force - 2 * DAMPING * np.sqrt(w2) * v - w2 * q])

    z = solve_ivp(rate, (0, time[-1]), np.zeros(2 * terms), "Radau", time, rtol=1e-7, atol=1e-10, max_step=0.05).y
    return np.array([p(MEASURED / LENGTH) for p in phi]) @ modes @ z[:terms]


@pytest.fixture(scope="module")
def panel(tmp_path_factory):
    return run_shipped("spinup-panel", tmp_path_factory.mktemp("panel"))


def test_panel_lags_as_the_beam_does(panel):
    run = next(iter(panel.runs.values()))
    assert run.status == "done"
    assert run.stats["energy_error"] < 1e-5  # the tolerance of the run
    expected = beam_lag(run.time)
    # shear of skin and stringers: 0.3 % in the first frequency, 0.7 % in deflection; damping of other modes below that
    np.testing.assert_allclose(run["panel.tip.deflection.z"], expected, atol=0.015 * np.abs(expected).max())


def test_stringers_below_the_skin_keep_it_bent(panel):
    """At constant spin the centrifugal field pulls the centroid, 3.2 mm below the root, further down."""
    run = next(iter(panel.runs.values()))
    late = run["panel.tip.deflection.z"][run.time > 2.5]
    assert late.mean() == pytest.approx(beam_lag(np.array([0.0, 2.5, 3.0]))[1:].mean(), rel=0.03)
    assert np.ptp(late) < 0.01 * np.abs(late).max()


def test_conventional_theory_diverges(panel):
    run = list(panel.runs.values())[1]
    assert run.status == "diverged"
    found = np.interp([0.5, 1.0], run.time, run["panel.tip.deflection.z"])
    expected = beam_lag(np.array([0.0, 0.5, 1.0]), stiffened=False)[1:]
    np.testing.assert_allclose(found, expected, rtol=0.02)  # 0.7 % of stiffness, of which the spin takes a third
