"""Tables of the terminal: every row, no broken line, no markup from names."""

import io
import re
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

import modalprep as mp
from modalprep.body.stress import StressModes
from modalprep.examples import cantilever_model
from modalprep.pipeline.batch.console import jobs_table
from modalprep.pipeline.console import Reporter
from modalprep.report.tables import body_summary, hertz, mode_table, shapes_table, summary_rows


def printed(show, thing, width) -> str:
    console = Console(width=width, color_system=None, file=io.StringIO(), highlight=False)
    show(thing, console)
    return console.file.getvalue()


@pytest.mark.parametrize("width", [80, 100, 105, 120])
def test_every_candidate_has_its_row(block, width):
    text = printed(mode_table, block.modes, width)
    assert max(map(len, text.splitlines())) <= width
    starts = [re.match(r" *(\d+)  (fixed|constraint|truncation)", line) for line in text.splitlines()]
    assert [int(start[1]) for start in starts if start] == list(range(1, len(block.modes.kind) + 1))
    assert "…" not in text
    assert "nan" not in text


def test_wide_table_has_six_directions_and_their_sums(cantilever):
    lines = printed(mode_table, cantilever.modes, 120).splitlines()
    assert lines[1].split() == ["kind", "Hz", "x", "y", "z", "rx", "ry", "rz", "sum", "kept", "reason"]
    total = next(line for line in lines if "sum of kept" in line).split()
    assert total[3:] == ["25.0", "66.7", "75.0", "5.0", "95.6", "91.1"]  # y: 60 + 60/9, z: 60 + 60/4, rz: 90 + 90/81


def test_narrow_table_names_the_largest_directions(cantilever):
    text = printed(mode_table, cantilever.modes, 80)
    assert "60.0 y  90.0 rz" in text
    assert "sum of kept, %:" in text


def test_running_sum_counts_kept_rows_of_the_same_direction(cantilever):
    lines = printed(mode_table, cantilever.modes, 120).splitlines()
    fourth = next(line for line in lines if line.strip().startswith("4 "))
    assert fourth.split()[:6] == ["4", "fixed-interface", "24", ".", ".", "15.0"]
    assert "75.0  yes" in fourth


def test_last_line_counts_each_kind(cantilever):
    last = " ".join(printed(mode_table, cantilever.modes, 120).split())
    assert "7 of 9 candidate vectors kept: 4 of 6 modes with fixed interfaces, 2 of 2 constraint" in last


def test_frequencies_of_fixed_interfaces_are_said_to_be_so(cantilever):
    """A beam with both ends held has other frequencies than the body that its root alone holds."""
    words = "Fixed-interface modes have these frequencies with every fixed interface held"
    model = cantilever_model(tip="fixed")
    reduction = mp.craig_bampton(model, modes=2)
    candidates = reduction.table.frequency[np.array(reduction.table.kind) == "fixed-interface"]
    assert candidates.min() > 2 * reduction.frequency.min()  # 22.4 against 3.5 of sqrt(EI / m) / L^2
    assert words in printed(mode_table, reduction.table, 120)
    assert words not in printed(mode_table, mp.craig_bampton(cantilever_model(), modes=2).table, 120)


def test_empty_table_is_no_error(cantilever):
    table = cantilever.modes.with_(
        kind=(), frequency=np.zeros(0), effective_mass=np.zeros((0, 6)), kept=np.zeros(0, dtype=bool), reason=()
    )
    assert "0 of 0 candidate vectors kept" in printed(mode_table, table, 80)


def test_names_are_not_markup(cantilever):
    named = cantilever.with_(name="[red]arm[/]", interface_name=("[/b]", "tip [1]"))
    table = named.modes.with_(reason=("[link=x]why[/link]",) * 9)
    text = printed(body_summary, named, 100) + printed(mode_table, table, 120)
    for name in ("[red]arm[/]", "[/b]", "tip [1]", "[link=x]why[/link]"):
        assert name in text


def test_names_of_shapes_jobs_and_bodies_are_not_markup():
    parameter = SimpleNamespace(name="[b]size[/b]", default=1.0, unit="m", meaning="[i]mean[/i] edge", choices=("[x]",))
    shape = SimpleNamespace(name="[red]plate", meaning="[/] flat", groups=("[u]",), parameters={"size": parameter})
    text = printed(shapes_table, [shape], 120)
    job = {
        "job": "[red]a",
        "pipeline": "a.toml",
        "values": {"[b]key": "[/]1"},
        "ran": False,
        "status": "done",
        "cause": "",
    }
    text += printed(jobs_table, [job], 120)
    for name in ("[b]size[/b]", "[i]mean[/i] edge", "[x]", "[red]plate", "[/] flat", "[u]", "[red]a", "[b]key", "[/]1"):
        assert name in text


def test_reporter_prints_text_as_it_is(capsys):
    reporter = Reporter()
    reporter.say("[grid] of :warning:.toml")
    reporter.console.print("[analysis]")
    assert capsys.readouterr().out == "[grid] of :warning:.toml\n[analysis]\n"
    reporter.console = Console(file=io.StringIO(), width=100, force_terminal=True, color_system=None)
    with reporter.progress("[grid]", 1.0) as reach:
        reach(1.0)
    assert "[grid]" in reporter.console.file.getvalue()


@pytest.mark.parametrize("width", [60, 80, 120])
def test_summary_fits_and_lists_interfaces_and_frequencies(cantilever, width):
    text = printed(body_summary, cantilever, width)
    assert max(map(len, text.splitlines())) <= width
    for words in ("12 kg", "(0.5, 0, 0) m", "interface root (root)", "interface tip", "2, 4, 6, 8, 10 Hz"):
        assert words in text


def test_products_of_inertia_are_shown_where_there_are_any(cantilever):
    assert "products" not in str(summary_rows(cantilever))
    E0 = np.array([[4.0, 1, 0], [1, 0.01, 0], [0, 0, 0.01]])
    assert ("products, xy xz yz", "(-1, 0, 0) kg m²") in summary_rows(cantilever.with_(E0=E0))


def test_points_of_stress_are_listed_where_there_are_any(cantilever):
    assert "stress at" not in dict(summary_rows(cantilever))
    at = StressModes(position=np.zeros(3), axes=np.eye(3), components=("xx",), modes=np.zeros((1, cantilever.n)))
    many = cantilever.with_(stress={f"p{k}": at for k in range(42)})
    assert dict(summary_rows(many))["stress at"].endswith("p38, p39 and 2 more")
    few = cantilever.with_(stress={"a": at, "b": at})
    assert dict(summary_rows(few))["stress at"] == "a, b"


def test_frequencies_have_no_exponent():
    assert [hertz(f) for f in (0.001, 13404.2, 231359.4)] == ["0.001", "13404", "231359"]


def test_margins_of_a_job_are_said_below_the_table():
    failed = mp.Requirement(name="fatigue weld", result="FAILED", says="largest damage 2 of 1, at seam")
    row = {
        "job": "a",
        "pipeline": "a.toml",
        "values": {},
        "ran": True,
        "status": "done",
        "cause": "",
        "verdict": mp.Verdict.of([failed]).summary(),
    }
    lines = printed(jobs_table, [row], 120).splitlines()
    assert lines[-1] == "a: fatigue weld: largest damage 2 of 1, at seam"
    assert any(line.split()[:3] == ["a", "done", "FAIL"] for line in lines)
