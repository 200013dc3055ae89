"""Manipulator that unfolds: flexible boom with a payload, against rods with springs in their hinges."""

import numpy as np
import pytest
from systems.shipped import PIPELINES, run_shipped

from modalprep.pipeline.console import Reporter
from modalprep.pipeline.systems.systems import simulate_pipeline

LINK = 8.0
EI, MASS_PER_LENGTH = 6.895e10 * 4.8746e-9, 2766.67 * 7.3e-5
BOOM = '[bodies.boom]\npipeline = "manipulator-boom.toml"'
RODS = f"""
[bodies.hub]
mass = 1.0
inertia = [1, 1, 1]

[beams.boom]
length = 8.0
segments = 20
mass_per_length = {MASS_PER_LENGTH}
EI = {EI}
parent = "hub.root"
"""


@pytest.fixture(scope="module")
def manipulator(tmp_path_factory):
    return run_shipped("manipulator", tmp_path_factory.mktemp("manipulator"))


@pytest.fixture(scope="module")
def rods(tmp_path_factory):
    """The same with twenty rigid rods for the boom; their hinges turn as far as they like."""
    text = (PIPELINES / "manipulator.toml").read_text().partition("[[plots]]")[0]
    for old, new in {
        BOOM: RODS,
        "boom.root": "hub.root",
        '"boom.tip"': '"boom20.tip"',
        '"boom.tip.deflection", ': "",
        "compare_conventional = true": 'method = "explicit"',
    }.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path_factory.mktemp("rods") / "rods.toml"
    path.write_text(text)
    (run,) = simulate_pipeline(path, path.parent, Reporter(quiet=True)).runs.values()
    return run


def lag(run):
    """Payload across the direction in which the boom leaves the elbow, m."""
    shoulder, boom = run["shoulder.angle"], run["shoulder.angle"] + run["elbow.angle"]
    x, y = (run["payload.root.position"][:, :2] - LINK * np.stack([np.cos(shoulder), np.sin(shoulder)], 1)).T
    return y * np.cos(boom) - x * np.sin(boom)


def test_tip_moves_as_that_of_rods(manipulator, rods):
    run = next(iter(manipulator.runs.values()))
    assert run.status == rods.status == "done"
    assert max(run.stats["energy_error"], rods.stats["energy_error"]) < 1e-8
    expected = lag(rods)
    largest = np.abs(expected).max()
    assert largest == pytest.approx(1.07, rel=0.01)
    # modes are linear in the boom's frame: off by two squares of the largest slope, 1.07 m of 8 m
    np.testing.assert_allclose(lag(run), expected, atol=2 * (largest / LINK) ** 2 * largest)
    early = run.time < 6  # up to 0.32 m
    np.testing.assert_allclose(lag(run)[early], expected[early], atol=2 * (0.32 / LINK) ** 2)


def test_without_geometric_stiffness_it_is_half_as_far_again(manipulator, rods):
    conventional = list(manipulator.runs.values())[1]
    assert np.abs(lag(conventional)).max() > 1.5 * np.abs(lag(rods)).max()
    last = rods.time > 16
    assert np.abs(lag(conventional)[last]).max() > 2 * np.abs(lag(rods)[last]).max()
