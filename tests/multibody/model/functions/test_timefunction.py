"""Functions of time: tables against their expressions, order of the interpolation, jumps, bad input."""

import math
from itertools import pairwise

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody.kernels.time_tables import quintic, table
from modalprep.multibody.model.time_function import FOREVER, TimeFunction
from modalprep.multibody.packing.time_tables import tabulate

RAMP = [(15.0, "0.4*(t**2/2 + (7.5/pi)**2*(cos(pi*t/7.5) - 1))"), (FOREVER, "6*t - 45")]


def hermite(t):
    """Knots of sin(3t)."""
    return np.column_stack([t, np.sin(3 * t), 3 * np.cos(3 * t), -9 * np.sin(3 * t)])


@pytest.mark.parametrize(("column", "order"), [(0, 6), (1, 5), (2, 4)])
def test_order_of_the_interpolation(column, order):
    """Quintic Hermite: value, rate and acceleration converge with the interval to the powers 6, 5 and 4."""
    errors = []
    for intervals in (20, 40):
        knots = hermite(np.linspace(0, 2, intervals + 1))
        t = np.concatenate([np.linspace(a, b, 9) for a, b in pairwise(knots[:, 0])])
        rows = np.repeat(np.arange(intervals), 9)
        exact = hermite(t)[:, 1 + column]
        found = [quintic(knots[k], knots[k + 1], x)[column] for k, x in zip(rows, t, strict=True)]
        errors.append(np.abs(found - exact).max())
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)


@pytest.mark.parametrize("source", ["sin(t)", "exp(-t)*cos(20*t)", "1e6*t", "2.5", "t**3 - 2*t", RAMP])
def test_tables_are_the_functions(source):
    """To the errors that `tabulate` promises: 1e-12 of the value, 1e-9 of the acceleration."""
    function = TimeFunction(source)
    tables = tabulate([TimeFunction(1.0), function], 20.0)
    t = np.random.default_rng(0).uniform(0, 20, 500)
    exact = np.array([function(x) for x in t])
    found = np.array([table(tables, 1, x) for x in t])
    size = np.abs(exact).max(axis=0)
    assert np.all(np.abs(found - exact).max(axis=0) <= np.array([2e-12, 2e-11, 4e-9]) * size + 1e-13 * size[0])


@pytest.mark.parametrize(
    "function",
    [
        TimeFunction(2.5),
        TimeFunction("t - sin(t)"),
        TimeFunction(RAMP),
        TimeFunction.table([0, 1, 2, 2, 4], [1, -1, 3, 0, 5]),
        TimeFunction.sampled(math.cos, until=20.0),
    ],
    ids=["number", "expression", "pieces", "table", "sampled"],
)
def test_minus_turns_values_and_derivatives_over(function):
    for t in (0.5, 3.0, 18.0):
        assert (-function)(t) == tuple(-x for x in function(t))  # the sign of a float is exact
    assert (-function).breaks == function.breaks


def test_rate_is_the_derivative_of_the_table():
    """So that prescribed motions do no spurious work: the integral of the rate is the value, not up to 1e-12."""
    tables = tabulate([TimeFunction("sin(t)")], 3.0)
    a, b = tables.knots[5, 0], tables.knots[6, 0]
    x, w = np.polynomial.legendre.leggauss(3)
    t = (a + b) / 2 + (b - a) / 2 * x
    integral = (b - a) / 2 * sum(wk * table(tables, 0, tk)[1] for wk, tk in zip(w, t, strict=True))
    assert integral == pytest.approx(table(tables, 0, b)[0] - table(tables, 0, a)[0], rel=1e-13)


TRAPEZOID = [0, 1, 1.01, 2, 2.01, 10], [0, 0, 10, 10, 0, 0]


def test_points_are_joined_by_straight_lines():
    """A trapezoid stays one: numpy's linear interpolation, with the rate of the line on the right at a point."""
    tables = tabulate([TimeFunction.table(*TRAPEZOID)], 10.0)
    t = np.append(np.random.default_rng(0).uniform(0, 10, 500), TRAPEZOID[0][:-1])
    found = np.array([table(tables, 0, x) for x in t])
    np.testing.assert_allclose(found[:, 0], np.interp(t, *TRAPEZOID), atol=1e-12)  # 1e3 N m/s times 1e-15 s
    slopes = np.diff(TRAPEZOID[1]) / np.diff(TRAPEZOID[0])
    right = slopes[np.searchsorted(TRAPEZOID[0], t, side="right") - 1]
    np.testing.assert_allclose(found[:, 1], right, atol=1e-9)
    np.testing.assert_allclose(found[:, 2], 0, atol=1e-6)  # differences of values over 0.01 s squared


@pytest.mark.parametrize("seed", range(20))
def test_smooth_tables_never_overshoot(seed):
    """Between two points a monotone curve lies between them, and its rate is continuous (Fritsch and Butland, 1984)."""
    rng = np.random.default_rng(seed)
    t, values = np.cumsum(10.0 ** rng.uniform(-3, 0, 20)), rng.normal(size=20) * 10.0 ** rng.integers(-3, 3, 20)
    tables = tabulate([TimeFunction.table(t - t[0], values, smooth=True)], t[-1] - t[0])
    x = np.concatenate([np.linspace(a, b, 21) for a, b in pairwise(t - t[0])])
    found = np.array([table(tables, 0, time)[0] for time in x]).reshape(19, 21)
    slack = 1e-12 * np.abs(values).max()
    assert np.all(found >= np.minimum(values[1:], values[:-1])[:, None] - slack)
    assert np.all(found <= np.maximum(values[1:], values[:-1])[:, None] + slack)
    for time in (t - t[0])[1:-1]:
        before, after = (table(tables, 0, time + side)[1] for side in (-1e-12, 1e-12))
        assert after == pytest.approx(before, abs=1e-6 * np.abs(np.diff(values) / np.diff(t)).max())


def test_a_motion_through_points_is_smooth():
    """A motion keeps its cubic spline, or takes the monotone curve, whose acceleration jumps at the ends of pieces."""
    plain, named, monotone = (
        hinge(TimeFunction.table(*TRAPEZOID, **how)).motion for how in ({}, {"spline": True}, {"smooth": True})
    )
    assert [plain(t) for t in (0.5, 1.005)] == [named(t) for t in (0.5, 1.005)]
    assert monotone.breaks == TRAPEZOID[0][1:-1]
    assert 0 <= monotone(1.005)[0] <= 10
    assert plain(0.5)[0] < -100


def test_what_a_motion_does_between_its_points_is_told():
    system = mp.System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge(TimeFunction.table(*TRAPEZOID)),))
    (note,) = mp.simulate(system, t_end=1e-3).notes
    assert note.startswith("'hub': the cubic spline of its motion goes from -1.243e+04 to 25")
    assert "between points from 0 to 10" in note
    calm = hinge(TimeFunction.table(np.linspace(0, 1, 11), np.linspace(0, 1, 11) ** 2))
    assert not mp.simulate(system.with_(joints=(calm,)), t_end=1e-3).notes


def test_minus_and_factors_keep_the_kind_of_a_table():
    table = TimeFunction.table(*TRAPEZOID)
    assert hinge(-table).motion(0.5)[0] == -hinge(table).motion(0.5)[0]  # still lines, so a spline takes their place


def test_the_mass_of_a_table_has_the_rate_of_its_lines():
    """A mass loses what its table says, between any two points."""
    table, levels = TimeFunction.table([0, 1, 3], [12, 10, 9]), (uniform_beam(modes=1),)
    mass = mp.multibody.Depletion(name="fuel", body="arm", levels=levels, mass=table).mass
    assert [mass(t)[1] for t in (0.5, 2.0)] == [-2.0, -0.5]
    assert mass.breaks == [1.0]


def test_pulses_of_a_callable_are_resolved():
    """A Gauss pulse of 1 ms in 10 s: samples are as close as it asks for, and only there."""
    pulse = TimeFunction.sampled(lambda t: math.exp(-(((t - 5.0037) / 1e-3) ** 2)), until=10.0)
    assert pulse(5.0037)[0] == pytest.approx(1.0, abs=1e-11)  # what `sampled` promises
    assert pulse(5.0047)[0] == pytest.approx(math.exp(-1), abs=1e-11)
    assert len(pulse.pieces[0].knots) < 2000


def test_points_are_met_and_twice_differentiable():
    t = np.array([0.0, 0.5, 1.5, 2.0, 4.0])
    values = np.array([1.0, -1.0, 2.0, 0.0, 3.0])
    tables = tabulate([TimeFunction.table(t, values, spline=True)], 4.0)
    np.testing.assert_allclose([table(tables, 0, x)[0] for x in t], values, atol=1e-14)
    for x in t[1:-1]:
        before, after = (np.array(table(tables, 0, x + side)) for side in (-1e-9, 1e-9))
        np.testing.assert_allclose(before, after, atol=1e-7)  # 1e-9 s times a third derivative below 30


def test_callable_is_sampled():
    function = TimeFunction.sampled(lambda t: math.exp(-t) * math.sin(9 * t), until=5.0)
    tables = tabulate([function], 5.0)
    t = np.linspace(0, 5, 997)
    found = np.array([table(tables, 0, x) for x in t])
    value = np.exp(-t) * np.sin(9 * t)
    rate = np.exp(-t) * (9 * np.cos(9 * t) - np.sin(9 * t))
    assert np.abs(found[:, 0] - value).max() < 1e-11  # what `sampled` promises
    assert np.abs(found[:, 1] - rate).max() < 1e-7  # one order less, on intervals of 1e-2 s


def test_a_break_belongs_to_the_stretch_that_is_integrated():
    tables = tabulate([TimeFunction([(1.0, "2"), (FOREVER, "5")])], 3.0)
    assert table(tables, 0, 1.0)[0] == 5.0
    tables.middle[0] = 0.5
    assert table(tables, 0, 1.0)[0] == 2.0
    tables.middle[0] = 2.0
    assert table(tables, 0, 1.0)[0] == 5.0


def hinge(motion):
    return mp.Joint(name="hub", type="revolute", parent="ground", child="arm", motion=motion)


def test_prescribed_motion_may_change_its_acceleration():
    hinge(TimeFunction(RAMP))
    hinge(TimeFunction([(1.0, "t**2"), (FOREVER, "2*t - 1.0000000001")]))  # rounded constants are no jump


@pytest.mark.parametrize(
    ("pieces", "words"),
    [
        ([(2.0, "t"), (FOREVER, "t + 1")], "jumps at t = 2 s: its value is 2 before and 3 after"),
        ([(2.0, "t"), (FOREVER, "3*t - 4")], "jumps at t = 2 s: its rate is 1 before and 3 after"),
    ],
)
def test_prescribed_motion_must_not_jump(pieces, words):
    with pytest.raises(mp.InputError, match="joint 'hub': the prescribed motion " + words):
        hinge(TimeFunction(pieces))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: tabulate([TimeFunction("sin(1e9*t)")], 10.0), "varies too fast near t = 0 s"),
        (
            lambda: tabulate([TimeFunction("sqrt((t - 0.9)**2)")], 2.0),
            "at t = 0.9 s.*kinks as ends of pieces",
        ),
        (lambda: tabulate([TimeFunction("sqrt(t)")], 2.0), "no finite value, rate and acceleration at t = 0 s"),
        (lambda: tabulate([TimeFunction.table([0, 1], [0, 1])], 2.0), "ends at t = 1 s, the simulation at 2 s"),
        (lambda: tabulate([TimeFunction.table([1, 2], [0, 1])], 2.0), "begins at t = 1 s, but is needed from 0 s"),
        (lambda: TimeFunction.table([0, 2, 1], [0, 1, 2]), "at increasing times"),
        (lambda: TimeFunction.table([0, 1, 1], [0, 1, 2]), "two points or more on either side"),
        (lambda: TimeFunction.table([0, 1], [0, 1, 2]), "2 times and 3 values"),
        (lambda: TimeFunction.table([0, 1], [0, math.nan]), "not a finite number"),
        (lambda: TimeFunction.table([0, 1], [0, 1], smooth=True, spline=True), "give one of them"),
        (lambda: TimeFunction.sampled(math.sin, 1.0, shortest_event=0), "shortest_event = 0 must be a positive number"),
        (lambda: TimeFunction.sampled(lambda t: float(t > 0.3), 1.0), "do not resolve it"),
        (lambda: TimeFunction.sampled(lambda t: math.inf, 1.0), "not finite at t = 0 s"),
        (lambda: TimeFunction([(2.0, "t"), (1.0, "t")]), "must end at increasing times"),
        (lambda: TimeFunction((1.0, "t")), "1.0 is no piece .until, expression.; pieces are a list"),
        (lambda: TimeFunction([(2.0, "t")]), "the last piece must have no 'until'"),
        (lambda: TimeFunction("import os"), "not an expression of t"),
        (lambda: TimeFunction(math.nan), "not a finite number"),
    ],
)
def test_bad_functions_get_one_message(make, words):
    with pytest.raises(mp.InputError, match=words) as refused:
        make()
    assert "\n" not in str(refused.value)
