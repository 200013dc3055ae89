"""What people look at: tables, charts, the page, pictures."""

import io
import re

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

import modalprep as mp
from modalprep.errors import RenderError
from modalprep.examples import uniform_beam
from modalprep.report.charts import plots
from modalprep.report.page import BodyPage, write_page
from modalprep.report.pictures import render
from modalprep.report.pictures.animation import animate_mode
from modalprep.report.tables import body_summary, mode_table

needs_drawing = pytest.mark.usefixtures("drawing")


@pytest.fixture(scope="module")
def beam():
    return uniform_beam(modes=6, keep="effective_mass > 5%", truncation=("inertia",))


@pytest.mark.parametrize("width", [80, 120])
def test_tables_fit_the_terminal(beam, width):
    console = Console(width=width, record=True, color_system=None, file=io.StringIO())
    mode_table(beam.modes, console)
    body_summary(beam, console)
    text = console.export_text()
    assert max(len(line) for line in text.splitlines()) <= width
    assert len(re.findall(r"fixed-interface", text)) == 6
    assert "61.3" in text  # effective mass of the first mode, %
    assert "12 kg" in text


def ink(file) -> float:
    """Share of pixels that are not background."""
    with Image.open(file) as image:
        pixels = np.asarray(image.convert("RGB"))
    return float(np.mean(np.any(pixels != 255, axis=2)))


def history(y, status="done"):
    return mp.Result(time=np.linspace(0, 1, len(y)), channels={"a": np.asarray(y)}, status=status, message="")


def test_diverging_run_does_not_set_the_limits():
    good, bad = history([0.0, -1.0, 0.0]), history([0.0, -50.0, -1e6], "diverged")
    low, high = plots._limits([good["a"]], 0.35)
    assert -2 < low < -1 < 0 < high < 1
    assert plots._limits([], 0.35) is None
    assert bad["a"].min() < low


def test_history_plot_is_drawn(tmp_path):
    runs = {"with": history([0.0, -1.0, 0.0]), "without": history([0.0, -50.0, -1e6], "diverged")}
    file = plots.history_plot(runs, ["a"], tmp_path / "h.png", reference=[{"label": "known", "t": [0.5], "y": [-1.0]}])
    assert 0.01 < ink(file) < 0.5


def test_page_is_self_contained_and_complete(beam, tmp_path):
    page = write_page(BodyPage(beam, checks=mp.check_body(beam), notes=["look here"]), tmp_path / "p.html")
    text = page.read_text()
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!data:|#)""", text)  # links within the page stay in it
    assert "look here" in text
    for reason in beam.modes.reason:
        assert reason.replace(">", "&gt;") in text
    for check in mp.check_body(beam):
        assert check.name in text
    assert text.count('<tr class="kept"') == beam.modes.kept.sum()
    assert text.count('<tr class="dropped"') == (~beam.modes.kept).sum() > 0


def test_names_are_escaped(beam, tmp_path):
    hostile = beam.with_(name="<script>alert(1)</script>")
    assert "<script>alert(1)" not in write_page(hostile, tmp_path / "p.html").read_text()


@needs_drawing
def test_pictures_show_the_body(beam, bracket_body, tmp_path):
    for body in (beam, bracket_body):
        # a beam is a thin line on a white page, the bracket fills some of it
        assert ink(render.render_mode(body, 1, tmp_path / "m.png")) > 0.01
        assert ink(render.render_mesh(body, tmp_path / "g.png")) > 0.01
    first, second = (render.render_mode(bracket_body, k, tmp_path / f"{k}.png").read_bytes() for k in (1, 2))
    assert first != second


@needs_drawing
def test_animation_moves(beam, tmp_path):
    file = animate_mode(beam, 1, tmp_path / "a.gif", frames=4)
    with Image.open(file) as image:
        assert image.n_frames == 4
        frames = []
        for k in range(4):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB")))
    assert np.any(frames[1] != frames[3])


def test_mode_that_does_not_exist(beam, tmp_path):
    with pytest.raises(mp.InputError, match=f"its modes are 1 to {beam.n}"):
        render.render_mode(beam, beam.n + 1, tmp_path / "m.png")
    assert list(tmp_path.iterdir()) == []


def test_machine_that_cannot_draw(beam, tmp_path, monkeypatch):
    monkeypatch.setattr(render, "PROBE", "import os; os.abort()")
    render.drawing_problem.cache_clear()
    try:
        with pytest.raises(RenderError, match="apt-get install libegl1"):
            render.render_mode(beam, 1, tmp_path / "m.png")
    finally:
        render.drawing_problem.cache_clear()
    assert list(tmp_path.iterdir()) == []
