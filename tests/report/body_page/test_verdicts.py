"""The box at the top of the page, the contents, and the kinds of notes."""

import re

import numpy as np
import pytest
from report.test_page import outline

from modalprep.body.checks import Check
from modalprep.multibody.results.envelopes import Envelope
from modalprep.reduction import notes as of_reduction
from modalprep.report import Section, paragraph
from modalprep.report.page import BodyPage, write_page
from modalprep.verdicts.notes import kind_of
from modalprep.verdicts.verdict import Requirement

GOOD, BAD = Check("mass", 1e-12, 1e-9, "body = mesh"), Check("modal mass", 2e-3, 1e-7, "P sums to 1")
WIDE = Check("kinetic energy", 1.0, 1e-9, "the field is not known", required=False)


def envelope(highest):
    high = np.array([[highest]])
    return Envelope(body="a", name="strut", places=("1",), components=("N",), units=("N",), highest=high, lowest=-high,
                    highest_time=np.zeros((1, 1)), lowest_time=np.zeros((1, 1)), allowable=5.0)  # fmt: skip


def box(body, tmp_path, **options) -> str:
    """Return the text of the box."""
    text = write_page(BodyPage(body, **options), tmp_path / "p.html").read_text(encoding="utf-8")
    return re.search(r'<div class="box .*?</header>', text, re.DOTALL)[0]


def test_box_passes_only_what_was_checked(cantilever, tmp_path):
    assert ">NOT CHECKED<" in box(cantilever, tmp_path)
    assert "0 not met, 1 not checked" in box(cantilever, tmp_path, checks=[GOOD])  # the error was not measured
    assert ">PASS<" in box(cantilever, tmp_path, checks=[GOOD])


@pytest.mark.parametrize(
    ("options", "link", "name"),
    [
        ({"checks": [GOOD, BAD]}, "#check-2", "modal mass"),
        ({"checks": [GOOD], "envelopes": [envelope(6.0)]}, "#recovered", "margin of a.strut N"),
        ({"errors": {"e": ([1.0, 2.0], [1e-9, 1e-3])}, "error_limits": {"e": 1e-4}}, "#errors", "error of e"),
        ({"sections": [Section(title="Sine", anchor="sine", html=paragraph("x"),
                               requirements=[Requirement(name="notch", result="FAILED")])]}, "#sine", "notch"),
    ],
)  # fmt: skip
def test_every_failure_is_named_with_a_link_that_leads_somewhere(cantilever, tmp_path, options, link, name):
    said = box(cantilever, tmp_path, **options)
    assert ">FAIL<" in said
    assert f'<a href="{link}">{name}</a>' in said
    assert link[1:] in [attrs.get("id") for _, attrs in outline(tmp_path / "p.html").tags]


def test_failure_without_a_place_is_named(cantilever, tmp_path):
    audit = Requirement(name="audit of the run", result="FAILED", says="energy balance 1e-2")
    assert "<b>audit of the run</b>: energy balance 10⁻²" in box(cantilever, tmp_path, requirements=[audit])


def test_what_is_beyond_a_limit_that_is_not_required_is_a_warning(cantilever, tmp_path):
    said = box(cantilever, tmp_path, checks=[GOOD, WIDE])
    assert ">PASS WITH WARNINGS<" in said
    assert "<li>kinetic energy: 1.0, limit 10⁻⁹: the field is not known</li>" in said
    assert "1 requirement met, 0 not met, 1 not checked, 1 warning." in said


def test_margins_and_errors_within_their_limits_pass(cantilever, tmp_path):
    said = box(cantilever, tmp_path, envelopes=[envelope(4.0)], errors={"e": ([1.0], [1e-9])}, error_limits={"e": 1e-4})
    assert "2 requirements met, 0 not met, 0 not checked" in said


def test_contents_lead_to_every_section(cantilever, tmp_path):
    page = outline(write_page(BodyPage(cantilever, checks=[GOOD], errors={"e": ([1, 2], [3, 4])}), tmp_path / "p.html"))
    ids = [attrs["id"] for _, attrs in page.tags if "id" in attrs]
    assert len(ids) == len(set(ids))
    links = [attrs["href"][1:] for tag, attrs in page.tags if tag == "a" and attrs["href"].startswith("#")]
    assert set(links) <= set(ids)
    sections = [attrs["id"] for tag, attrs in page.tags if tag == "section"]
    assert set(sections) <= set(links)
    assert sections[:2] == ["in-short", "body"]
    assert {"inputs", "modes-of-the-body", "mode-selection", "mac-section", "errors", "checks", "provenance"} <= set(
        sections
    )


def test_good_news_of_the_reduction_is_no_warning():
    """The functions that write the notes, so that another wording there shows here."""
    counted = of_reduction.completeness(np.arange(1.0, 4.0), "a dense solver leaves none out", "fixed-interface")
    assert [kind_of(note) for note in counted] == ["notes"]
    from modalprep.examples import cantilever_model
    from modalprep.reduction.craig_bampton import craig_bampton

    table = craig_bampton(cantilever_model(), modes=4, keep="mode > 1").table
    assert [kind_of(note) for note in of_reduction.dropped_in_band(table, 1.0)] == ["warnings"]
    few = craig_bampton(cantilever_model(), modes=4, keep=[1], truncation=())
    mixed = of_reduction.pseudo_resonances(few.table, (2 * np.pi * few.table.frequency[1:2] / 2) ** 2)
    assert [kind_of(note) for note in mixed] == ["warnings"]
    assert [kind_of(note) for note in of_reduction.fewer_modes(239, 1000, "fixed-interface")] == ["notes"]
    assert kind_of("1 quad cell is warped") == "warnings"


def test_warnings_stand_in_the_box_and_other_notes_below(cantilever, tmp_path):
    notes = ["all 3 fixed-interface modes below 9 Hz were found (a)", "its mass is implausible", "rebuilt: P"]
    said = box(cantilever, tmp_path, notes=notes, checks=[GOOD])
    assert ">PASS WITH WARNINGS<" in said
    assert re.findall(r"<li>(its mass is implausible|rebuilt: P)</li>", said) == notes[1:]
    text = (tmp_path / "p.html").read_text(encoding="utf-8")
    assert re.findall(r'<div class="notes"><p><b>Notes</b></p>\s*<ul>\s*<li>(.*?)</li>\s*</ul>', text) == notes[:1]
