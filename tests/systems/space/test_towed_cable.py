"""A towed cable in rods against the continuous cable in steady tow, and the ship's way there."""

import tomllib

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from systems.shipped import PIPELINES, run_shipped

import modalprep as mp
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.systems.read import read_system


def continuous_cable(speed=2.0, length=300.0, weight=5.0, end=500.0, diameter=0.02, normal=1.2, tangential=0.01):
    """Trail, depth, angle (rad) to the horizontal and tension (N) at the ship of a cable in steady tow.

    ``T' = W sin p + k_t cos^2 p``, ``T p' = W cos p - k_n sin^2 p`` from the lower end, where `end` (N) pulls straight
    down, to the ship: forces on an element along and across it.
    """
    across = 1025.0 / 2 * normal * diameter * speed**2
    along = 1025.0 / 2 * tangential * np.pi * diameter * speed**2

    def rates(s, y):
        T, p = y[:2]
        bend = (weight * np.cos(p) - across * np.sin(p) ** 2) / T
        return [weight * np.sin(p) + along * np.cos(p) ** 2, bend, np.cos(p), np.sin(p)]

    T, p, x, z = solve_ivp(rates, (0.0, length), [end, np.pi / 2, 0.0, 0.0], rtol=1e-10, atol=1e-12).y[:, -1]
    return x, z, p, T


TRAIL, DEPTH, ANGLE, TENSION = continuous_cable()


def towed(count):
    """The system of the pipeline file, its cable cut into `count` rods."""
    path = PIPELINES / "towed-cable.toml"
    data = tomllib.loads(path.read_text())
    chain, ratio = data["chains"]["cable"], 30 / count
    segment = chain["segment"]
    chain["count"], segment["mass"] = count, segment["mass"] * ratio
    segment["inertia"] = [0.0, *[segment["inertia"][1] * ratio**3] * 2]
    segment["centre"], segment["interfaces"]["tip"] = [5 * ratio, 0.0, 0.0], [10 * ratio, 0.0, 0.0]
    data["forces"]["weight"]["at"] = f"cable{count}.tip"
    return read_system(Loaded(path, Pipeline.model_validate(data).with_chains()), None, Reporter(quiet=True))


def steady(count):
    """Trail, depth, and angle at the ship (extrapolated from the middles of the first rods)."""
    rest = mp.static_equilibrium(towed(count), t=100.0, steady=True)
    assert rest.stable
    angle = np.pi - np.cumsum([rest.joints[f"cable{k}"][0] for k in range(1, count + 1)])
    length = 300.0 / count
    return np.array([length * np.cos(angle).sum(), length * np.sin(angle).sum(), 1.5 * angle[0] - 0.5 * angle[1]])


def test_steady_tow_is_that_of_a_continuous_cable():
    """Rods are tangents of its curve: the error is of second order in their length, four times less with 60 than 30.

    Not quite yet, for the cable turns by the weight within two rods of ten metres: T / kn = 10 m.
    """
    coarse, fine = steady(30), steady(60)
    exact = np.array([TRAIL, DEPTH, ANGLE])
    np.testing.assert_allclose(fine, exact, rtol=1e-3)
    np.testing.assert_allclose(np.log2((coarse - exact)[:2] / (fine - exact)[:2]), 2.0, atol=0.2)
    np.testing.assert_allclose((4 * fine - coarse)[:2] / 3, exact[:2], rtol=1e-4)


def test_the_ship_gets_under_way(tmp_path):
    (run,) = run_shipped("towed-cable", tmp_path).runs.values()
    trail, _, depth = -run.relative_to("ship")["cable30.tip.position"][-1]
    found = steady(30)
    np.testing.assert_allclose([trail, depth], found[:2], rtol=5e-4)  # what is left of the transient
    assert np.linalg.norm(run["cable1.force"][-1]) == pytest.approx(TENSION, rel=5e-3)  # rods of 10 m
    assert run.stats["energy_error"] < 1e-5
