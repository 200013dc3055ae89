"""Analyses that need exact derivatives, of bodies with stations."""

import numpy as np
import pytest
from body.stations.statics import elastica
from compare import assert_close

import modalprep as mp
from modalprep.examples import large_cantilever

LENGTH = 10.0  # m


@pytest.fixture(scope="module")
def beam():
    return large_cantilever(modes=2, stations=8)


def clamped(beam, **options):
    hold = mp.Joint(name="clamp", type="weld", parent="ground", child="body")
    return mp.System(bodies={"body": beam}, joints=(hold,), **options)


def spinning(beam, rate):
    hub = mp.Joint(name="hub", type="revolute", parent="ground", child="body", axis=(0, 0, 1), motion=f"{rate}*t")
    return mp.System(bodies={"body": beam}, joints=(hub,))


def pushed(beam, w=0.4):
    """A dead force at the tip that bends the weaker way by w of the length."""
    load, _ = elastica(w)
    compliance = (beam.phi[1, 2] ** 2 / beam.K).sum()  # L^3 / (3 EI)
    force = np.array([0, 0, load * LENGTH / (3 * compliance)])
    return clamped(beam, loads=(mp.PointForce(name="push", at="body.tip", force=force),))


def test_about_a_slow_spin_it_is_the_linear_body(beam):
    """Stations keep the second order of the body, and centrifugal stiffening with it.

    What differs is of fourth order in the spin, by the stretch.
    """
    systems = [spinning(each, 1.0) for each in (beam, beam.with_(stations=None), beam.conventional())]
    found, expected, without = (mp.static_equilibrium(each, steady=True).stiffness[:2, :2] for each in systems)
    assert_close(found, expected, 1e-6)
    assert np.abs(without - expected).max() > 0.01 * np.abs(expected).max()


def test_stiffness_of_a_bent_body_is_symmetric(beam):
    """A dead force has a potential; the tip is where the elastica has it."""
    rest = mp.static_equilibrium(pushed(beam))
    assert_close(rest.stiffness, rest.stiffness.T, 1e-10)
    assert rest["body.tip.position"][2] == pytest.approx(0.4 * LENGTH, abs=2e-3 * LENGTH)
