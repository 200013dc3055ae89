"""The process that draws beside other work draws the same, and whatever goes wrong there, it is drawn here."""

import pytest

from modalprep.pipeline import pictures
from modalprep.pipeline.console import Reporter
from modalprep.report import painter
from modalprep.report.painter import Painter
from modalprep.report.pictures import render
from modalprep.report.pictures.sheet import render_modes

READ = "import pickle, sys; print('ready', flush=True); pickle.load(sys.stdin.buffer)"
FAILURES = {
    "ends at once": "pass",
    "crashes": "import os; os.abort()",
    "says something else": "print('no')",
    "does not read": "print('ready', flush=True)",
    "draws nothing": READ,
    "draws half": f"{READ}; print('drawn', flush=True)",
}


@pytest.fixture
def untried(monkeypatch):
    """Let a test start a painter as a process that has not drawn yet does."""
    monkeypatch.setattr(render, "_trusted", [])
    monkeypatch.setattr(pictures, "is_untested", lambda: True)


@pytest.mark.usefixtures("drawing", "untried")
def test_pictures_are_those_of_this_process(cantilever, tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "render_mesh", None)  # not called
    here, there = {1: tmp_path / "1.png", 2: tmp_path / "2.png"}, tmp_path / "there"
    with pictures.pictures_beside(2) as drawn:
        drawn.begin(cantilever, there / "c.h5")
        found = drawn.draw(cantilever, there / "c.h5", Reporter(quiet=True))
    assert render._trusted
    render.render_mesh(cantilever, tmp_path / "mesh.png")
    list(render_modes(cantilever, here))
    assert found.mesh.read_bytes() == (tmp_path / "mesh.png").read_bytes()
    assert [found.modes[k].read_bytes() for k in (1, 2)] == [here[k].read_bytes() for k in (1, 2)]


@pytest.mark.usefixtures("untried")
@pytest.mark.parametrize("code", FAILURES.values(), ids=FAILURES)
def test_pictures_are_drawn_here_after_a_failure_there(code, cantilever, tmp_path, monkeypatch):
    monkeypatch.setattr(painter, "PAINT", code)
    monkeypatch.setattr(pictures, "render_mesh", lambda body, file: drawn_here.append(file.name))
    monkeypatch.setattr(pictures, "render_modes", lambda body, files: map(drawn_here.append, files))
    drawn_here = []
    with pictures.pictures_beside(1) as drawn:
        drawn.begin(cantilever, tmp_path / "c.h5")
        drawn.draw(cantilever, tmp_path / "c.h5", Reporter(quiet=True))
    assert drawn_here == ["c-mesh.png", 1]


@pytest.mark.usefixtures("untried")
def test_process_ends_with_the_run(monkeypatch):
    """Also one that neither listens nor ends when it is asked to."""
    monkeypatch.setattr(painter, "GRACE", 0.1)
    deaf = "import signal as s, time; s.signal(s.SIGTERM, s.SIG_IGN); print('ready', flush=True); time.sleep(60)"
    monkeypatch.setattr(painter, "PAINT", deaf)
    with pictures.pictures_beside(1) as drawn:
        assert drawn.painter._process.stdout.readline() == b"ready\n"
    assert drawn.painter._process.poll() is not None


def test_painter_that_never_answers_is_given_up(cantilever, tmp_path, monkeypatch):
    monkeypatch.setattr(painter, "PAINT", "import time; time.sleep(60)")
    monkeypatch.setattr(render, "PATIENCE", 0.1)
    asked = Painter()
    asked.begin(cantilever, tmp_path / "m.png", {})
    assert list(asked.drawn()) == []
    asked.close()


def test_only_the_first_run_of_a_process_has_a_painter(monkeypatch):
    monkeypatch.setattr(render, "_trusted", [True])
    monkeypatch.setattr(pictures, "Painter", None)  # not called
    with pictures.pictures_beside(3) as drawn:
        assert drawn.painter is None
    monkeypatch.setattr(pictures, "is_untested", None)
    with pictures.pictures_beside("none") as drawn:
        assert drawn.painter is None
