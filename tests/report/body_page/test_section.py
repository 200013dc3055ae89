"""Sections that other parts of the program add to the page of a body, and their tables."""

import base64
import csv
import io
import re

import pytest
from report.test_page import HOSTILE, outline

from modalprep.report import Section, Table, paragraph
from modalprep.report.page import BodyPage, write_page
from modalprep.verdicts.verdict import Requirement

ROWS = [("left, upper", 1 / 3, True, None), ("right", -2e-7, False, 4)]


@pytest.fixture
def struts():
    return Table(name="strut-forces", columns=("strut", "N (N)", "kept", "count"), rows=ROWS, total=("sum", 1, "", ""))


def downloads(text) -> dict[str, list[list[str]]]:
    """Return the rows of every CSV file that a page holds, by its name."""
    found = re.findall(r'download="([^"]*)" href="data:text/csv;base64,([^"]*)"', text)
    return {name: list(csv.reader(io.StringIO(base64.b64decode(data).decode()))) for name, data in found}


def test_csv_has_the_numbers_in_full(struts):
    rows = downloads(str(struts.html()))["strut-forces.csv"]
    assert rows[0] == ["strut", "N (N)", "kept", "count"]
    assert [float(row[1]) for row in rows[1:]] == [1 / 3, -2e-7, 1.0]
    assert [row[0::2] for row in rows[1:]] == [["left, upper", "yes"], ["right", "no"], ["sum", ""]]


def test_sections_stand_on_the_page_with_their_anchor(cantilever, struts, tmp_path):
    section = Section(title="Strut <forces>", anchor="struts", html=paragraph("a < b") + struts.html(),
                      requirements=[Requirement(name="margin", result="passed")])  # fmt: skip
    page = outline(write_page(BodyPage(cantilever, sections=[section]), tmp_path / "p.html"))
    assert ("section", "struts") in [(tag, attrs.get("id")) for tag, attrs in page.tags]
    for words in ("Strut <forces>", "a < b", "left, upper", "0.33333"):
        assert words in page.text


def test_texts_of_a_table_cannot_add_tags():
    clean = Table(name="a", columns=("x",), rows=[("y",)]).html()
    bad = Table(name="a", columns=(HOSTILE,), rows=[(HOSTILE,)], caption=HOSTILE).html()
    assert re.findall(r"<\w+", bad) == [*re.findall(r"<\w+", clean)[:1], "<p", *re.findall(r"<\w+", clean)[1:]]


def test_cells_that_fail_are_marked():
    table = Table(
        name="a", columns=("margin", "result"), rows=[("-0.1", "FAILED"), ("+0.1", "passed"), ("", "not checked")]
    )
    assert re.findall(r'<td(?: class="(\w+)")?>', table.html()) == ["bad", "bad", "", "good", "", "open"]
