"""The page on paper: A4 sheets on which no text covers another, with header and footer; --pdf of the commands."""

import re
import shutil
import subprocess
from html import unescape

import pytest
from report.browser import needs_browser
from report.page_of_all import whole_page

from modalprep.cli import main
from modalprep.errors import InputError, OutputError
from modalprep.report.body_page import printing

WORD = re.compile(r'<word xMin="([\d.-]+)" yMin="([\d.-]+)" xMax="([\d.-]+)" yMax="([\d.-]+)">(.*?)</word>')
SIZE = re.compile(r'<page width="([\d.]+)" height="([\d.]+)">(.*?)</page>', re.DOTALL)
needs_poppler = pytest.mark.skipif(not shutil.which("pdftotext"), reason="no pdftotext: apt-get install poppler-utils")


@pytest.fixture(scope="module")
def sheets(tmp_path_factory, block):
    """The sheets of a page with every kind of section: size, and words with their boxes in points."""
    folder = tmp_path_factory.mktemp("paper")
    page = whole_page(block, folder)
    paper = printing.print_page(page, printing.find_browser())
    text = subprocess.run(["pdftotext", "-bbox", paper, "-"], capture_output=True, text=True, check=True).stdout
    return [
        (float(width), float(height), [(*map(float, box), word) for *box, word in WORD.findall(inside)])
        for width, height, inside in SIZE.findall(text)
    ]


@needs_browser
@needs_poppler
class TestPaper:
    """What stands on the sheets."""

    def test_no_word_covers_another(self, sheets):
        """The sum row of the selection used to lie on the text of the first sheet."""
        for number, (_, _, words) in enumerate(sheets, start=1):
            for k, (left, top, right, bottom, word) in enumerate(words):
                for x0, y0, x1, y1, other in words[k + 1 :]:
                    across = min(right, x1) - max(left, x0)
                    down = min(bottom, y1) - max(top, y0)  # boxes are as high as lines, which may touch
                    assert across < 0.5 or down < 0.45 * min(bottom - top, y1 - y0), (number, word, other)

    def test_sheets_are_a4_and_hold_every_word(self, sheets):
        for width, height, words in sheets:
            assert (width, height) == (pytest.approx(595, abs=1), pytest.approx(842, abs=1))
            for left, top, right, bottom, word in words:
                assert 30 < left < right < width - 30, word
                assert 15 < top < bottom < height - 15, word

    def test_every_sheet_has_its_name_date_and_number(self, sheets):
        for number, (_, height, words) in enumerate(sheets, start=1):
            head = " ".join(word for _, top, _, _, word in words if top < 48)
            foot = " ".join(word for _, top, _, _, word in words if top > height - 46)
            assert head == "block: modal body"
            assert re.fullmatch(rf"\d{{4}}-\d\d-\d\dT[\d:]+\+00:00 {number} / {len(sheets)}", foot)

    def test_sums_stand_once_and_the_folded_text_is_open(self, sheets):
        words = [unescape(word) for _, _, sheet in sheets for *_, word in sheet]
        text = " ".join(words)
        assert text.count("sum of kept") == 1
        assert text.count("'a.msh'") == 20
        for control in ("Play", "Reset view", "mass-by-group.csv"):
            assert control not in text


def test_no_browser_is_one_sentence_before_any_work(project, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="--pdf needs a Chromium"):
        printing.find_browser()
    for command in ("run", "modes"):
        file = project / "pipelines" / "half-beam.toml"
        assert main([command, str(file), "--output", str(tmp_path / "out"), "--pdf"]) == 2
        assert "none of chromium" in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()


def test_pipeline_without_a_page_refuses_a_pdf(project, tmp_path, capsys):
    text = (project / "pipelines" / "double-pendulum.toml").read_text(encoding="utf-8")
    file = tmp_path / "job.toml"
    file.write_text(re.sub(r"\[simulation\].*", "[analysis]\n", text, flags=re.DOTALL), encoding="utf-8")
    said = {(): "it has neither a body nor a [simulation]", ("--no-report",): "--no-report is given"}
    for more, why in said.items():
        assert main(["run", str(file), "--output", str(tmp_path / "out"), "--pdf", *more]) == 2
        assert f"makes no report page, as {why}; leave --pdf out" in " ".join(capsys.readouterr().err.split())


def test_browser_that_fails_leaves_nothing(tmp_path):
    page = tmp_path / "p.html"
    page.write_text("<p>a</p>", encoding="utf-8")
    with pytest.raises(OutputError, match=r"cannot write .*p\.pdf: .*did not print the page"):
        printing.print_page(page, shutil.which("false"))
    assert [file.name for file in tmp_path.iterdir()] == ["p.html"]


@needs_browser
def test_modes_prints_the_page(project, tmp_path, capsys):
    import json

    file = project / "pipelines" / "half-beam.toml"
    assert main(["modes", str(file), "--output", str(tmp_path), "--pdf", "--json"]) == 0
    page = json.loads(capsys.readouterr().out)["page"]
    assert (tmp_path / "half-beam" / "half-beam-modes.pdf").read_bytes().startswith(b"%PDF")
    assert page.endswith("half-beam-modes.html")
