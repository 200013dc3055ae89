"""Spacecraft with rotors, damper and slosh, against an independent integration of Kane's equations, and identities.

The state and the energies are those of a script of its own for this one spacecraft, with Kane's equations written out
in body axes; computed once for this test, to the digits given, and not published. Lagrange's equations of the same
spacecraft are compared in test_quasi_coordinates.py.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from systems.shipped import run_shipped


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    (run,) = run_shipped("spinning-spacecraft", tmp_path_factory.mktemp("spacecraft")).runs.values()
    return run


def at(run, t):
    return int(np.argmin(np.abs(run.time - t)))


def test_state_after_ten_seconds(run):
    row = at(run, 10.0)
    np.testing.assert_allclose(run["flight.angular_velocity"][row], [0.002092427, -0.080752711, 0.995074911], atol=1e-9)
    np.testing.assert_allclose(run["damper.displacement"][row], 0.0014365502, atol=1e-10)
    np.testing.assert_allclose(run["slosh.angle"][row], [0.2809038812, 0.0263140473], atol=1e-9)


def test_energy(run):
    energy = run["energy.kinetic"] + run["energy.stored"]
    np.testing.assert_allclose(energy[at(run, 0.0)], 616.1644153610, rtol=1e-12)
    np.testing.assert_allclose(energy[[at(run, 1.0), at(run, 10.0)]], [616.153497836, 615.584675575], rtol=1e-11)
    assert run.stats["energy_error"] < 1e-12


def test_friction_alone_takes_energy(run):
    lost = 6 * run["damper.speed"] ** 2 + 8 * (run["slosh.rate"] ** 2).sum(axis=1)
    np.testing.assert_allclose(run["power.input"], -lost, rtol=1e-12, atol=1e-15)


def test_momentum(run):
    """The published start velocity has nine decimals: 5e-7 N s remain, 1e-8 N m s about a point 0.02 m away."""
    size = np.linalg.norm(run["momentum.angular"], axis=1)
    np.testing.assert_allclose(size[0], 830.5464053631, rtol=3e-11)
    assert np.abs(run["momentum.linear"]).max() < 1e-6
    assert np.abs(run["momentum.angular"] - run["momentum.angular"][0]).max() < 1e-10 * size[0]


def test_wobble_ends_in_a_spin_about_the_momentum(run):
    bus = Rotation.from_quat(run["bus.orientation"], scalar_first=True)
    spin = bus.apply(run["flight.angular_velocity"].copy())
    apart = np.cross(spin, run["momentum.angular"])
    angle = np.linalg.norm(apart, axis=1) / np.linalg.norm(spin, axis=1) / np.linalg.norm(run["momentum.angular"][0])
    assert angle[0] > 0.02
    assert angle[at(run, 55.0) :].max() < 0.01 * angle[0]
    rest = [np.abs(run[name][-1]).max() for name in ("damper.speed", "slosh.rate")]
    assert max(rest) < 1e-3  # seen from the bus everything is nearly at rest
