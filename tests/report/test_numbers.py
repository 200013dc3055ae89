"""The page has numbers as an engineer writes them: no exponents of a computer, no millihertz, units everywhere."""

import html
import re

import numpy as np
import pytest

from modalprep.examples import uniform_beam
from modalprep.multibody.results.envelopes import Envelope
from modalprep.report.body_page.parts import extremes_table
from modalprep.report.body_page.responses import fatigue_section, response_section
from modalprep.report.body_page.table import Table
from modalprep.report.numbers import number, quantity
from modalprep.report.page import BodyPage, write_page
from modalprep.report.responses import response_plot
from modalprep.response import SNCurve, harmonic_response, rainflow_damage, random_response

COMPUTER = re.compile(r"\d[eE][+-]?\d+\b|\bm(Hz|rad/s)\b")


def said(page):
    """The words of a page, without scripts, styles and data."""
    text = re.sub(
        r"<(script|style|pre).*?</\1>|<code>.*?</code>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL
    )
    return html.unescape(re.sub(r"<[^>]*>", " ", text))


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A beam of 0.6 Hz with responses of a few kN m and a damage of 1e-14."""
    folder, body = tmp_path_factory.mktemp("page"), uniform_beam(modes=4)
    at = np.geomspace(0.1, 20, 60)
    sine = harmonic_response(body, {"base.y": 9.80665}, at, damping=0.02)
    noise = random_response(body, {"base.y": 1.0}, band=(0.1, 20.0), damping=0.02)
    sections = [
        response_section(name, found, response_plot(found, folder / f"{name}.png"))
        for name, found in (("sine", sine), ("noise", noise))
    ]
    curve = SNCurve(stress=100e6, cycles=1e6, slope=5)
    slight = rainflow_damage(np.arange(3.0), np.array([2e4, -2e4, 2e4]), curve).with_(unit="Pa")
    sections.append(fatigue_section("weld", {"a": slight}))
    return write_page(BodyPage(body, sections=sections), folder / "beam.html")


def test_page_has_no_exponents_and_no_millihertz(page):
    text = said(page)
    checks = text.index("Sign-off")
    found = [text[max(0, m.start() - 30) : m.end() + 10] for m in COMPUTER.finditer(text[:checks])]
    assert found == []
    assert "0.6044" in text
    assert "over 10⁶ h" in text
    assert "below 10⁻⁶" in text


def test_response_has_interface_forces_accelerations_in_g_and_margins(page):
    text = " ".join(said(page).split())
    assert "Interface forces" in text
    assert re.search(r"base\.moment\.z [\d.]+ (kN|N) m", text)
    assert re.search(r"m/s² \([\d.]+ g\)", text)
    assert "margin of safety" in text


@pytest.mark.parametrize(("value", "unit", "text"), [
    (1.81e12, "", "1.81 \N{MULTIPLICATION SIGN} 10¹²"), (0.9314, "Hz", "0.9314 Hz"), (650.0, "%", "650 %"),
    (21520.0, "N", "21.52 kN"), (9999.0, "N", "9999 N"), (1.448e6, "Pa", "1.448 MPa"), (70e9, "Pa", "70 GPa"),
    (5e-4, "m", "0.5 mm"), (0.0, "N", "0 N"), (9.80665, "m/s^2", "9.807 m/s² (1 g)"), (float("nan"), "N", ""),
    (-2.0e-3, "m", "-2 mm"), (8000.0, "N m", "8000 N m"), (1e4, "N m", "10 kN m"),
])  # fmt: skip
def test_quantities_have_the_units_of_the_trade(value, unit, text):
    assert quantity(value, unit) == text


def test_a_number_keeps_its_digits():
    """Relative to the digits asked for: half a unit of the last one."""
    rng = np.random.default_rng(0)
    for value in rng.choice([-1, 1], 200) * 10 ** rng.uniform(-3.9, 6.9, 200):
        assert float(number(value, 5)) == pytest.approx(value, rel=0.51e-4)


def test_a_table_writes_powers_of_ten_and_its_file_all_digits():
    table = Table(name="t", columns=("a", "b"), rows=[(1.23456789e-9, 0.5e-3)], forms={"b": ".1e"})
    assert "1.2346 \N{MULTIPLICATION SIGN} 10⁻⁹" in table.html()
    assert "5.0 \N{MULTIPLICATION SIGN} 10⁻⁴" in table.html()
    assert "1.23456789e-09" in table.csv()


@pytest.mark.parametrize(("allowable", "cells", "bad"), [
    (5.0, ("5 N", "+0.25"), False), (2.0, ("2 N", "-0.5"), True), (None, ("none given", ""), False),
])  # fmt: skip
def test_extremes_stand_beside_what_is_allowed(allowable, cells, bad):
    """-4 N of 5 N leave 5/4 - 1, of 2 N 2/4 - 1."""
    one = np.ones((1, 1))
    strut = Envelope(body="a", name="strut", places=("1",), components=("N",), units=("N",), highest=3 * one,
                     lowest=-4 * one, highest_time=one, lowest_time=0 * one, allowable=allowable)  # fmt: skip
    table = extremes_table([strut])
    assert table.rows[0][-2:] == cells
    assert ('class="bad"' in table.html()) is bad
