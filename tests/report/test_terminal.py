"""Tables and sentences fit a terminal of any width, and no word is cut."""

import io

import pytest
from report.page_of_all import CHECKS
from rich.console import Console

import modalprep as mp
from modalprep.body.checks import CheckReport
from modalprep.correlation import body_modes, correlate
from modalprep.examples import uniform_beam
from modalprep.fe.generation.generate import GENERATORS
from modalprep.pipeline import console
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.report.check_tables import check_table
from modalprep.report.correlation.pairs import correlation_table
from modalprep.report.responses import peak_table
from modalprep.report.schema_tables import keys_of, schema_list, schema_page
from modalprep.report.tables import WIDE, body_summary, mode_table, shapes_table
from modalprep.report.terminal import print_text


def printed(draw, width, **options):
    """Return what is printed on a terminal so wide."""
    file = io.StringIO()
    draw(Console(file=file, width=width, height=50, color_system=None, **options))  # a dumb terminal has 80 columns
    return file.getvalue()


def reduced():
    return mp.craig_bampton(mp.examples.cantilever_model(elements=4, tip="fixed"), modes=3).table


def beam():
    return uniform_beam(modes=8)


def shaken():
    return mp.response.harmonic_response(beam(), {"base.z": 1.0}, [1.0, 2.0])


SCHEMA = Pipeline.model_json_schema()
TABLES = {
    "modes": lambda console: mode_table(reduced(), console),
    "body": lambda console: body_summary(beam(), console),
    "checks": lambda console: check_table(CheckReport(subject="beam.h5", checks=tuple(CHECKS)), console),
    "shapes": lambda console: shapes_table(GENERATORS.values(), console),
    "pairs": lambda console: correlation_table(correlate(body_modes(beam()), body_modes(beam())), console),
    "peaks": lambda console: peak_table("shaker", shaken(), console),
    "schema": lambda console: schema_list(SCHEMA, console),
    "schema of reduction": lambda console: schema_page(SCHEMA, "reduction", console),
    "schema of joints": lambda console: schema_page(SCHEMA, "joints", console),
    "schema of materials": lambda console: schema_page(SCHEMA, "materials", console),
}  # fmt: skip


def words(text):
    """The words of a table but its rules; a head that stands before each cell has a colon."""
    return {word.rstrip(":") for word in text.split() if not set(word) <= set("─")}


@pytest.mark.parametrize("name", TABLES)
def test_tables_fit_the_width_with_whole_words(name):
    """The words are those of a table without limit; that of the modes has fewer columns below `WIDE`."""
    for width in (60, 80, 120):
        text = printed(TABLES[name], width, force_terminal=True)
        assert max(map(len, text.splitlines())) <= width, width
        free = printed(TABLES[name], 1000 if name != "modes" or width >= WIDE else WIDE - 1)
        assert words(text) == words(free), width


@pytest.mark.parametrize("width", [60, 80, 120])
def test_every_word_of_the_schema_is_on_its_page(width):
    text = printed(TABLES["schema of reduction"], width).split()
    for key in keys_of(SCHEMA["$defs"]["ReductionTable"]):
        assert set(f"{key.name} {key.kind} {key.meaning}".split()) <= set(text) | {f"{key.name}:"}, key.name


def test_sentences_are_wrapped_at_words_on_a_terminal_and_not_in_a_log():
    said = "the mesh has /a/path/that/is/longer/than/the/terminal and more words than one line"
    lines = printed(lambda console: print_text(said, console), 30, force_terminal=True).splitlines()
    assert " ".join(line.strip() for line in lines) == said
    assert sum(len(line) > 30 for line in lines) == 1  # the path, which can be copied
    assert len(lines) == 3
    long = printed(
        lambda console: print_text("  /a/path/longer/than/the/terminal is there", console), 20, force_terminal=True
    )
    assert long.splitlines() == ["  /a/path/longer/than/the/terminal", "is there"]
    assert printed(lambda console: print_text(said, console), 30) == said + "\n"


def test_a_bar_names_the_stage_and_its_time(monkeypatch):
    """Three seconds of assembly, then two of reduction, by a clock that the test sets."""
    monkeypatch.setattr(console.time, "perf_counter", lambda: seconds[0])
    seconds, file = [0.0], io.StringIO()
    reporter = console.Reporter()
    reporter.console = Console(file=file, width=60, color_system=None, force_terminal=True)
    with reporter.progress("arm.toml: body", 4, stage="assembly") as reach:
        seconds[0] = 3.0
        reach(1, "reduction")
        seconds[0] = 5.0
        reach(4)
    lines = file.getvalue().splitlines()
    assert lines[0] == "arm.toml: body ..."
    assert any("reduction" in line and "100% 2 s" in line for line in lines)
    assert lines[-1].endswith("  assembly 3.0 s, reduction 2.0 s")


def test_a_log_has_one_line_for_a_bar(capsys):
    with console.Reporter().progress("arm.toml: body", 4, stage="assembly") as reach:
        reach(4, "reduction")
    assert capsys.readouterr().out == "arm.toml: body ...\n"


def test_a_log_has_tables_as_wide_as_they_need(capsys):
    """A file folds no row: the wide table of the modes has each candidate in one line, with its whole reason."""
    reporter, table = console.Reporter(), reduced()
    table = table.with_(reason=tuple(f"{reason}; {'words ' * 40}end {k}" for k, reason in enumerate(table.reason, 1)))
    mode_table(table, reporter.console)
    body_summary(beam(), reporter.console)
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    for k, (kind, reason) in enumerate(zip(table.kind, table.reason, strict=True), start=1):
        assert sum(line.startswith(f"{k} ") and kind in line and line.endswith(reason) for line in lines) == 1
    assert max(map(len, lines)) < 500
