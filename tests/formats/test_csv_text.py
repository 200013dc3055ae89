"""Texts in CSV files: none that a spreadsheet would compute, and all of them back."""

import csv

import numpy as np
import pytest

import modalprep as mp
from modalprep.atomic import csv_text, text_of_csv, write_columns, write_table
from modalprep.formats import read_csv, write_csv
from modalprep.pipeline.study.write import write_study
from modalprep.report.body_page.table import Table

# OWASP, CSV Injection: a cell that begins with one of these is evaluated
BEGINS = "=+-@\t\r"
TEXTS = ["=1+1", "+a", "-arm.angle", "@sum(A1)", "\tx", "\ry", "'=1", "''-a", "'plain", "plain", "a=b", "", "$x$"]


@pytest.mark.parametrize("text", TEXTS)
def test_text_comes_back_and_is_no_formula(text):
    cell = csv_text(text)
    assert text_of_csv(cell) == text
    assert not cell.startswith(tuple(BEGINS))


@pytest.mark.parametrize("number", ["-1.5", "+2", "1e-3", "-inf", "nan"])
def test_numbers_stay_numbers(number):
    assert csv_text(number) == number


def cells(text):
    return [cell for row in csv.reader(text.splitlines()) for cell in row]


def test_no_table_has_a_formula(tmp_path):
    """All tables are written by these three; headings and cells."""
    table = write_table(["=1+1", "b"], [("-cmd", -1.0), ("@x", 2.0)], tmp_path / "a.csv")
    assert cells(table.read_text()) == ["'=1+1", "b", "'-cmd", "-1", "'@x", "2"]
    columns = write_columns({"=1+1": np.array([-1.0])}, tmp_path / "b.csv")
    assert cells(columns.read_text()) == ["'=1+1", "-1"]
    page = Table(name="t", columns=("=1+1", "b"), rows=[("+cmd", -1.0)]).csv()
    assert cells(page) == ["'=1+1", "b", "'+cmd", "-1.0"]


def test_nothing_else_writes_csv(project):
    writers = [file.name for file in (project / "src").rglob("*.py") if "csv.writer" in file.read_text()]
    assert sorted(writers) == ["atomic.py", "table.py", "write.py"]  # the last one of studies, with all digits


def test_channels_keep_their_names(tmp_path):
    channels = {"-a.angle": np.arange(2.0), "=b.position": np.ones((2, 3)), "'=c": np.zeros(2)}
    run = mp.Result(time=np.arange(2.0), channels=channels, status="", message="")
    assert set(read_csv(write_csv(run, tmp_path / "r.csv")).channels) == set(channels)


def test_texts_of_a_study_are_no_formulas(tmp_path):
    """Names of jobs and causes are texts of users; numbers, also negative ones, stay as they are."""
    rows = [{"job": "=1+1", "status": "failed", "cause": "@x", "quantities": {"tip_m": -1.0}}]
    write_study(rows, tmp_path)
    assert cells((tmp_path / "study.csv").read_text())[6:] == ["'=1+1", "failed", "", "'@x", "", "-1.0"]
