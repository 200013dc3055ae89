"""Axes of responses name their quantity, with SI prefixes where the unit takes them."""

import pytest

from modalprep.report.responses import _decade, _quantity


@pytest.mark.parametrize(("names", "unit", "shown", "random", "text"), [
    (["a", "b"], "N", "kN", False, "force (kN)"), (["a"], "N", "kN", False, "a (kN)"),
    (["a", "b"], "m/s^2", "m/s^2", True, "acceleration ((m/s²)²/Hz)"), (["a", "b"], "kg", "kg", False, "kg"),
    (["a", "b"], "N", "", False, "force"),
])  # fmt: skip
def test_an_axis_says_what_it_shows(names, unit, shown, random, text):
    assert _quantity(names, unit, shown, random=random) == text


def test_decades_have_prefixes_where_the_unit_takes_them():
    assert [_decade("N")(value, 0) for value in (1e-3, 1.0, 1e4)] == ["0.001 N", "1 N", "10 kN"]
    assert _decade("m/s^2")(1e4, 0) == "10000"
