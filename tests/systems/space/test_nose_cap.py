"""A package strikes the wall of a nose cap, slides and leaves: impulses by the mobilities of two rigid bodies."""

import numpy as np
import pytest
from systems.shipped import run_shipped

FRICTION = 0.25


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    (run,) = run_shipped("nose-cap", tmp_path_factory.mktemp("cap")).runs.values()
    return run


def mobility(run, row, body, mass, inertia, point):
    """``1/m + lever lever' / J`` of a point in the plane (2, 2), and the point's velocity."""
    r = (run[f"{body}.{point}.position"] - run[f"{body}.centre.position"])[row, :2]
    lever = np.array([-r[1], r[0]])
    velocity = run[f"{body}.centre.velocity"][row, :2] + run[f"{body}.angular_velocity"][row, 2] * lever
    return np.eye(2) / mass + np.outer(lever, lever) / inertia, velocity, lever


def test_the_impact_is_that_of_two_free_bodies(run):
    (impact,) = run.impacts["touch"]
    row = np.searchsorted(run.time, impact.t)  # before; the state after is the next
    assert run.time[row] == run.time[row + 1] == impact.t
    S, v, lever = mobility(run, row, "package", 25.0, 0.8, "shoe")
    arm = (run["package.shoe.position"] - run["cap.centre.position"])[row, :2]
    turn = np.array([-arm[1], arm[0]])
    S = S + np.eye(2) / 40.0 + np.outer(turn, turn) / 4.0
    v = v - run["cap.centre.velocity"][row, :2] - run["cap.angular_velocity"][row, 2] * turn
    angle = 2 * np.arctan2(run["cap.orientation"][row, 3], run["cap.orientation"][row, 0])
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    assert across @ v > 0.5  # towards the wall
    assert impact.sticks == {"wall": False}
    push = -across - FRICTION * np.sign(along @ v) * along  # of the wall on the package
    p = (across @ v) / -(across @ S @ push) * push
    found = impact.impulse["wall.force"][0] * along + impact.impulse["wall.force"][1] * across
    np.testing.assert_allclose(found, p, rtol=1e-9)
    assert impact.energy_loss == pytest.approx(-p @ (v + S @ p / 2), rel=1e-9)
    assert np.diff(run["energy.kinetic"][row : row + 2])[0] == pytest.approx(-impact.energy_loss, rel=1e-9)
    change = np.diff(run["package.centre.velocity"][row : row + 2], axis=0)[0, :2]
    np.testing.assert_allclose(25.0 * change, p, rtol=1e-9)
    assert np.diff(run["package.angular_velocity"][row : row + 2, 2])[0] == pytest.approx(lever @ p / 0.8, rel=1e-9)


def test_the_package_slides_under_friction_until_the_mouth(run):
    begin, end = run.events["touch"][0], run.events["leave"][0]
    assert begin < end
    slides = (run.time > begin + 1e-9) & (run.time < end - 1e-9)
    force = run["wall.force"]
    np.testing.assert_allclose(force[slides, 0], -FRICTION * np.abs(force[slides, 1]), rtol=1e-6)
    assert np.all(force[slides, 1] < 0)  # it is pressed on the wall all the way
    assert not np.any(force[run.time > end + 1e-9])
    shoe = run.relative_to("cap")["package.shoe.position"]
    np.testing.assert_allclose(shoe[slides, 1], 0.15, atol=1e-9)
    assert np.interp(end, run.time, shoe[:, 0]) == pytest.approx(0.6, abs=1e-6)


def test_momentum_grows_by_the_pull_alone(run):
    (impact,) = run.impacts["touch"]
    row = np.searchsorted(run.time, impact.t)
    for name in ("momentum.linear", "momentum.angular"):
        np.testing.assert_allclose(run[name][row + 1], run[name][row], atol=1e-12 * np.abs(run[name]).max())
    pull = run["momentum.linear"][0] + np.outer(run.time, [400, 200, 0])
    np.testing.assert_allclose(run["momentum.linear"], pull, rtol=1e-9, atol=1e-9)
    assert run.stats["energy_error"] < 1e-7
