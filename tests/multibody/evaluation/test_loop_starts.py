"""Where closed loops begin: at the closed position next to the start values, or with a sentence."""

import numpy as np
import pytest
from compare import assert_close

import modalprep as mp
from modalprep.errors import InputError
from modalprep.multibody.model.constraints import Closure, Coupler

BEND = np.arccos(0.75)  # of two bars of one metre whose ends are 1.5 m apart


def bar(name):
    frames = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
    return mp.rigid_body(name, mass=1.0, centre=[0.5, 0, 0], inertia=np.diag([0.01, 0.1, 0.1]), interfaces=frames)


def two_bars(angle=0.0, knee=0.0, apart=1.5, closures=(), **options):
    joints = (
        mp.Joint(name="p", type="revolute", parent="ground", child="a.root", angle=angle),
        mp.Joint(name="q", type="revolute", parent="a.tip", child="b.root", angle=knee),
    )
    pin = Closure(name="c", type="revolute", a="b.tip", b="ground", position=np.array([apart, 0, 0]), **options)
    return mp.System(bodies={"a": bar("a"), "b": bar("b")}, joints=joints, closures=(pin, *closures))


def start(system):
    run = mp.simulate(system, t_end=0.01)
    return run["p.angle"][0], run["q.angle"][0]


@pytest.mark.parametrize("angle", [0.001, -0.001, 1e-6, 1e-9, 0.0, 0.3])
def test_nearly_straight_bars_bend_and_do_not_wind_up(angle):
    """Newton's first step from there is 0.25 / angle; at the dead point itself there is none."""
    p, q = start(two_bars(angle))
    assert_close(abs(p), BEND, 1e-9)
    assert_close(q, -2 * p, 1e-9)
    assert p * angle >= 0 or abs(angle) < 1e-5  # to the side that they were on


def test_whole_turns_are_kept_where_they_are():
    """Angles are those nearest to the start values, which may be beyond a turn."""
    p, q = start(two_bars(4 * np.pi + 0.5, -6 * np.pi - 1.3))
    assert_close([p, q], [4 * np.pi + BEND, -6 * np.pi - 2 * BEND], 1e-9)


def test_a_far_start_is_refused_by_how_far_it_is():
    """Bars whose ends shall be 0.2 m apart: each turns by acos(0.1), the knee by twice that."""
    with pytest.raises(InputError, match=r"would move joint 'q' by 2\.94 rad from its start.* give .* or reach = 3\.2"):
        start(two_bars(0.001, apart=0.2))
    p, q = start(two_bars(0.001, apart=0.2, reach=3.2))
    assert_close([abs(p), q / p], [np.arccos(0.1), -2.0], 1e-9)


def test_a_coupler_can_ask_for_more():
    gear = Coupler(name="gear", factors={"p": 2.0, "q": 1.0}, value=0.0, reach=3.2)
    p, q = start(two_bars(0.001, apart=0.2, closures=(gear,)))
    assert_close([abs(p), q / p], [np.arccos(0.1), -2.0], 1e-9)


@pytest.mark.parametrize("reach", [0.0, -1.0, np.nan])
def test_a_reach_must_be_positive(reach):
    with pytest.raises(InputError, match="reach = .* must be positive"):
        two_bars(reach=reach)
