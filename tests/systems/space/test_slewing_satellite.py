"""A free satellite turned by its wheel: rigid bus, flexible panels; linear theory of the turn, momentum, energy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from systems.shipped import run_shipped

BUS, OFFSET, WHEEL_TORQUE, HALF = 20.0, 0.5, 2.0, 5.0  # kg m^2 without the wheel, m, N m, s


@pytest.fixture(scope="module")
def satellite(tmp_path_factory):
    return run_shipped("slewing-satellite", tmp_path_factory.mktemp("satellite"))


def linear(panel, time):
    """Rate of the bus and modes of the right panel: ``I t'' - 2 p q'' = T``, ``q'' + D q' + K q = p t''``."""
    arm = OFFSET * panel.S[2] + panel.H[2, 0]  # int rho (x0 + x) phi_z; the left panel bends the other way
    inertia = BUS + 2 * (OFFSET**2 * panel.m + 2 * OFFSET * panel.s0[0] + panel.E0[0, 0])
    mass = np.block([[np.array([[inertia]]), -2 * arm[None]], [-arm[:, None], np.eye(len(arm))]])

    def rate(t, z, torque):
        q, v = z[: len(arm)], z[len(arm) + 1 :]
        return np.concatenate([v, np.linalg.solve(mass, np.concatenate([[torque], -panel.D * v - panel.K * q]))])

    z, last, parts = np.zeros(2 * len(arm) + 1), 0.0, []
    for end, torque in ((HALF, WHEEL_TORQUE), (2 * HALF, -WHEEL_TORQUE), (time[-1] + 1e-9, 0.0)):
        rows = time[(time >= last) & (time < end)]
        run = solve_ivp(rate, (last, end), z, args=(torque,), rtol=1e-9, atol=1e-12, dense_output=True)
        parts, z, last = [*parts, run.sol(rows)], run.y[:, -1], end
    z = np.hstack(parts)
    return z[len(arm)], z[: len(arm)], inertia


def test_turn_and_bending_are_those_of_linear_theory(satellite):
    (run,) = satellite.runs.values()
    panel = satellite.system.bodies["right"]
    rate, q, _ = linear(panel, run.time)
    # (rate / frequency of the panels)^2 = (0.23 / 1.6)^2: what spinning stiffens and softens the panels
    np.testing.assert_allclose(run["flight.angular_velocity"][:, 1], rate, atol=0.02 * np.abs(rate).max())
    bent = panel.phi[1, 2] @ q
    np.testing.assert_allclose(run["right.tip.deflection.z"], bent, atol=0.02 * np.abs(bent).max())


def test_turn_is_that_of_a_rigid_satellite_but_for_the_panels_swing(satellite):
    (run,) = satellite.runs.values()
    panel = satellite.system.bodies["right"]
    _, q, inertia = linear(panel, run.time)
    arm = OFFSET * panel.S[2] + panel.H[2, 0]
    turned = 2 * np.arcsin(run["bus.orientation"][-1, 2])
    rigid = WHEEL_TORQUE * HALF**2 / inertia
    assert turned == pytest.approx(rigid + 2 * arm @ q[:, -1] / inertia, abs=1e-3 * rigid)  # I t = 2 p q + int int T


def test_nothing_comes_from_outside(satellite):
    (run,) = satellite.runs.values()
    assert run.stats["energy_error"] < 1e-9
    wheel = 0.1 * np.abs(run["drive.rate"]).max()
    assert np.abs(run["momentum.angular"]).max() < 1e-9 * wheel
    assert np.abs(run["momentum.linear"]).max() < 1e-9 * wheel
    swing = run["right.tip.deflection.z"]
    np.testing.assert_allclose(run["left.tip.deflection.z"], -swing, atol=1e-8 * np.abs(swing).max())
    assert np.abs(swing).max() > 0.02
