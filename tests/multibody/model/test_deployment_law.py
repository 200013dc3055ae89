"""When a deployed length leaves a range, and with which stage a deployment starts; lengths by hand."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.multibody.model.deployment import IN, LEAST, OUT, Change
from modalprep.multibody.model.deployment_law import alignment_angle, first_stage, next_exit, samples, smooth_intervals
from modalprep.multibody.model.time_function import FOREVER


def boom(law, **options):
    given = {"name": "boom", "parent": "ground", "length": 9.0, "segments": 9, "mass_per_length": 1.0}
    return mp.multibody.Deployment(**given | {"deployed_length": law} | options)


def exit_of(law, bounds, t=0.0, t_end=2.0):
    d = boom(law)
    return next_exit(d, 3, bounds, t, samples(d, t_end))


@pytest.mark.parametrize(
    ("law", "bounds", "change"),
    [
        ("0.5 + t", (0.0, 1.0), Change(0.5, 3, OUT)),
        ("1.5 - 0.5*t", (1.0, 2.0), Change(1.0, 3, IN)),
        ("0.5", (0.0, 1.0), Change(FOREVER, 3, "")),
        ("0.5 + 0.5*sin(pi*t/2)", (0.0, 1.0), Change(FOREVER, 3, "")),  # touches the bound, and stays inside
        ("0.5 - 0.5*sin(pi*t/2)", (0.0, 1.0), Change(FOREVER, 3, "")),
        ("1 + t", (0.0, 1.0), Change(0.0, 3, OUT)),  # begins on the bound
    ],
)
def test_the_next_exit(law, bounds, change):
    found = exit_of(law, bounds)
    assert found[1:] == change[1:]
    assert found.t == pytest.approx(change.t, abs=2e-4)  # on a bound: to a sample of 20,000 in 2 s


def test_exits_before_the_time_do_not_count():
    """A length that goes out at 0.5 s and comes back at 1.5 s has left at 1 s, and is outside."""
    law = "0.5 + 1*sin(pi*t/2)"
    inside = [t for t in np.linspace(0, 2, 9) if 0 <= 0.5 + np.sin(np.pi * t / 2) <= 1]
    assert exit_of(law, (0.0, 1.0)).t == pytest.approx(1 / 3, rel=1e-12)  # sin = 1/2
    assert inside[-1] == 2.0
    assert exit_of(law, (0.0, 1.0), t=1.99).t == FOREVER
    assert exit_of("1 + t", (0.0, 1.0), t=5e-5).t == 5e-5  # between two samples, and outside already


@pytest.mark.parametrize(
    ("law", "rods"), [("0.5", 1), ("1 + t", 2), ("1 - 0.1*t", 1), ("1 + 1e-12*t", 2), ("9", 9), ("0*t", 1), ("1", 1)]
)
def test_the_first_stage(law, rods):
    """On a boundary between rods it is the one into which the length moves."""
    assert first_stage(boom(law)).rods == rods


def test_a_rod_is_free_from_its_least_length_on():
    """A shorter one is locked; that of a beam never is."""
    laws = [f"1 + {share * LEAST}" for share in (0.99, 1.01)]
    assert [first_stage(boom(law)).locked for law in laws] == [True, False]
    assert not first_stage(boom(laws[0], EI=1.0)).locked


def test_samples_begin_at_once():
    times, length = samples(boom([(1.0, "0.5 + t"), (FOREVER, "1.5")]), 2.0)
    np.testing.assert_allclose(length, np.minimum(0.5 + times, 1.5), rtol=1e-14)


@pytest.mark.parametrize("law", ["-1e-6 + t", "9 + 1e-6"])
def test_a_start_outside_of_the_boom_is_refused(law):
    with pytest.raises(mp.InputError, match="at the start, but length = 9 m"):
        first_stage(boom(law))


def test_intervals_end_where_the_rate_jumps():
    """At 1 s the rate goes on, at 2 s it jumps from 1 to 0."""
    law = [(1.0, "t"), (2.0, "1 + (t - 1)"), (FOREVER, "2")]
    assert [until for until, _ in smooth_intervals(boom(law))] == [2.0, FOREVER]
    with pytest.raises(mp.InputError, match="jumps from 1 to 1.5 m at t = 1 s"):
        smooth_intervals(boom([(1.0, "t"), (FOREVER, "t + 0.5")]))


def test_the_alignment_begins_with_the_angle_and_rate_and_ends_at_rest():
    """Cubic in between: continuous with its rate at both ends."""
    tilt = alignment_angle(2.0, 0.1, -0.3, 0.5)
    np.testing.assert_allclose(tilt(2.0)[:2], (0.1, -0.3), rtol=1e-12)
    np.testing.assert_allclose(tilt(2.0 - 1e-6)[0], 0.1 + 0.3e-6, rtol=1e-9)
    np.testing.assert_allclose(tilt(2.5 - 1e-7)[:2], 0.0, atol=1e-6)
    assert alignment_angle(2.0, 0.0, 0.0, 0.5) is None
    assert alignment_angle(2.0, 0.0, 0.1, 0.5) is not None
