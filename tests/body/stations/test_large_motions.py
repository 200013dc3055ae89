"""Motions of bodies with stations by implicit methods, and periodic ones."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import large_cantilever

LENGTH = 10.0  # m


@pytest.fixture(scope="module")
def beam():
    """A stiff enough basis that explicit steps stay few."""
    return large_cantilever(modes=1, stations=4)


def released(beam):
    """Welded level, let go in three times the gravity of the earth: it passes half its length."""
    wall = mp.Joint(name="wall", type="weld", parent="ground", child="beam")
    return mp.System(bodies={"beam": beam}, joints=(wall,), gravity=np.array([0, -30.0, 0]))


def run(system, **options):
    return mp.simulate(system, t_end=1.0, output_step=0.1, **options)


@pytest.fixture(scope="module")
def exact(beam):
    return run(released(beam), method="explicit", rtol=1e-8)


def test_energy_is_kept_at_a_large_deflection(exact):
    assert np.abs(exact["beam.tip.position"][:, 1]).max() > 0.4 * LENGTH
    assert exact.stats["energy_error"] < 1e-9


@pytest.mark.parametrize(("method", "order", "limit"), [("rosenbrock", 3, 1e-6), ("generalised_alpha", 2, 2e-5)])
def test_implicit_methods_converge_to_the_explicit_one(beam, exact, method, order, limit):
    """By their orders in the step, of the largest of ten places of the tip over the length."""
    steps = (1e-3, 5e-4)  # a sixth and less of the period of the stiffest mode
    runs = [run(released(beam), method=method, step=step)["beam.tip.position"] for step in steps]
    coarse, fine = (np.abs(each - exact["beam.tip.position"]).max() / LENGTH for each in runs)
    assert fine < limit
    assert 0.8 < np.log2(coarse / fine) / order < 1.5


def test_a_periodic_motion_repeats_itself(beam):
    """A driven hinge: the tip deflects by a third of the length, and comes back to 1e-6 of it after a period."""
    rate = 2 * np.pi * 0.35
    damped = beam.with_(D=0.08 * np.pi * beam.frequency)
    motion = f"0.6*sin({rate}*t)"
    hinge = mp.Joint(name="h", type="revolute", parent="ground", child="beam", axis=(0, 0, 1), motion=motion)
    system = mp.System(bodies={"beam": damped}, joints=(hinge,), gravity=np.array([0, -3.0, 0]))
    period = 2 * np.pi / rate
    found = mp.simulate(system, t_end=2 * period, output_step=period / 4, start="periodic", period=period)
    tip = found["beam.tip.deflection"] / LENGTH
    assert np.linalg.norm(tip, axis=1).max() > 0.25
    np.testing.assert_allclose(tip[4:], tip[:5], atol=1e-6)
