"""Names and titles of users are shown letter by letter: no formula of matplotlib or VTK, no rule of a legend."""

import ast
from importlib import import_module

import numpy as np
import pytest
from matplotlib import figure as plain
from matplotlib.backends.backend_agg import FigureCanvasAgg

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.report.charts.figures import Figure
from modalprep.report.charts.plots import error_plot, history_plot
from modalprep.report.pictures.marks import plainly

TEXTS = ["rate $x^$", "$^$", "i$x_{$", "$x^2$", "100 $ and 200 $", r"a \$ b $ c $"]


def pixels(kind, text, escape=False):
    """Return the picture of axes with a text everywhere; matplotlib's own escape is the second implementation."""
    written = text.replace("$", r"\$") if escape else text
    figure = kind(figsize=(5, 4), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], label=written)
    axes.set(title=written, xlabel=written, ylabel=written)
    axes.set_xticks([0, 1], [written, "b"])
    axes.annotate(written, (0.5, 0.5))
    axes.legend()
    figure.suptitle(written)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba()).copy()


@pytest.mark.parametrize("text", TEXTS)
def test_charts_show_dollars_as_they_are(text):
    assert np.array_equal(pixels(Figure, text), pixels(plain.Figure, text, escape=True))


def test_every_chart_is_such_a_figure(project):
    """No file of the package makes a figure of matplotlib itself, except that of pyplot, whose texts are set plain."""
    for file in (project / "src").rglob("*.py"):
        text = file.read_text()
        for node in ast.walk(ast.parse(text)) if "matplotlib" in text else ():
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("matplotlib"):
                names = {alias.name for alias in node.names}
                assert file.name in ("figures.py",) or not names & {"figure", "Figure"}, file


def test_histories_with_dollars_are_drawn(tmp_path):
    run = mp.Result(time=np.arange(3.0), channels={"a$^$.angle": np.arange(3.0)}, status="done", message="")
    reference = [{"label": "$^$", "t": [1.0], "y": [1.0]}]
    history_plot({"$^$": run, "b": run}, ["a$^$.angle"], tmp_path / "h.png", title="$x^$", reference=reference)
    axes = run.plot("a$^$.angle", title="rate $x^$")
    axes.figure.draw_without_rendering()


def test_legends_name_what_begins_with_an_underscore(tmp_path, monkeypatch):
    """matplotlib leaves such labels out of its legends."""
    from modalprep.report.charts import plots

    seen = []
    monkeypatch.setattr(plots, "save_figure", lambda figure, path: seen.append(figure.axes[0].get_legend()))
    error_plot({"_hub": ([1, 2], [1, 2]), "arm": ([1, 2], [2, 1])}, tmp_path / "e.png")
    assert [text.get_text().lstrip("\N{ZERO WIDTH SPACE}") for text in seen[0].get_texts()] == ["_hub", "arm"]


@pytest.mark.parametrize("text", TEXTS)
def test_vtk_finds_no_formula(text):
    import_module("vtkmodules.vtkRenderingFreeType")  # the implementation of the class below
    from vtkmodules.vtkRenderingCore import vtkTextRenderer

    assert vtkTextRenderer.GetInstance().DetectBackend(plainly(text)) == vtkTextRenderer.FreeType


def test_names_on_pictures_are_plain(drawing, tmp_path, capfd):
    """VTK warned, and drew no name at all, where it read a formula that is none."""
    body = uniform_beam(modes=1).with_(name="a$^$")
    mp.report.render_mode(body.with_(interface_name=("r$^$", "t$^$")), 1, tmp_path / "m.png")
    assert "MathText" not in "".join(capfd.readouterr())
