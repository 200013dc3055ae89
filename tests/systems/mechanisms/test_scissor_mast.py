"""Scissor mast: its height and the torque that unfolds it, in closed form, and the conditions that are too many."""

import numpy as np
import pytest
from systems.shipped import run_shipped

BAYS = 4


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return next(iter(run_shipped("scissor-mast", tmp_path_factory.mktemp("mast")).runs.values()))


def base(t):
    """Angle, rate and acceleration that the file prescribes."""
    turn, span = 2 * np.pi / 5, np.radians(50)
    return (
        np.radians(10) + span * (t / 5 - np.sin(turn * t) / (2 * np.pi)),
        span / 5 * (1 - np.cos(turn * t)),
        span / 5 * turn * np.sin(turn * t),
    )


def test_height_and_width(run):
    angle = base(run.time)[0]
    # loops are closed to 1e-11 of the size; 1e-10 measured
    np.testing.assert_allclose(run["a4.top.position.y"], BAYS * np.sin(angle), rtol=1e-9)
    np.testing.assert_allclose(run["a4.top.position.x"], np.cos(angle), rtol=1e-9)
    np.testing.assert_allclose(run["b4.top.position"][:, :2].T, [0 * angle, BAYS * np.sin(angle)], atol=1e-9)


def test_torque_of_the_motor(run):
    """Bars of bay k have their centres at ((1/2) cos, (k - 1/2) sin) and turn both by the angle of the base."""
    angle, rate, acceleration = base(run.time)
    arms = sum((k - 0.5) ** 2 for k in range(1, BAYS + 1))
    mass = 2 * (BAYS * np.sin(angle) ** 2 / 4 + arms * np.cos(angle) ** 2 + BAYS / 12)
    slope = 2 * (BAYS / 4 - arms) * np.sin(2 * angle)
    expected = mass * acceleration + slope * rate**2 / 2 + BAYS**2 * 9.81 * np.cos(angle)
    np.testing.assert_allclose(run["base.drive"], expected, rtol=1e-8)


def test_the_foot_stays_in_contact(run):
    """Moments about the pivot at rest, at both ends of the motion: foot cos = weight cos / 2 - torque of the motor."""
    expected = (BAYS - BAYS**2) * 9.81
    np.testing.assert_allclose(run["foot.force"][[0, -1]], [[0, expected, 0]] * 2, atol=1e-9 * abs(expected))
    assert run.stats["energy_error"] < 1e-8


@pytest.mark.parametrize("loop", ["right2", "right3", "right4"])
def test_conditions_out_of_the_plane_are_named(run, loop):
    note = next(part for part in run.message.split(";") if f"'{loop}'" in part)
    for direction in ("along (0, 0, 1)", "about (1, 0, 0)", "about (0, 1, 0)"):
        assert direction in note
    assert "along (1, 0, 0)" not in note
