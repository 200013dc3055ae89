"""Pictures: the body fills them, moves in them, and a machine that cannot draw says so."""

import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import modalprep as mp
from modalprep.errors import RenderError
from modalprep.report.pictures import render
from modalprep.report.pictures.animation import animate_mode
from modalprep.report.pictures.sheet import render_modes
from modalprep.report.scene.camera import view

needs_drawing = pytest.mark.usefixtures("drawing")


@pytest.fixture
def probe(monkeypatch):
    """Let a test replace the probe, and forget its answer afterwards."""
    monkeypatch.delenv(render.WINDOW, raising=False)

    def use(code):
        monkeypatch.setattr(render, "PROBE", code)
        render.drawing_problem.cache_clear()
        return render.drawing_problem()

    yield use
    monkeypatch.undo()
    render.drawing_problem.cache_clear()


def pixels(file) -> np.ndarray:
    with Image.open(file) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def box(file) -> tuple[float, float]:
    """Width and height of what is coloured, as shares of the picture: the text and the ghost are grey."""
    image = pixels(file)
    body = np.ptp(image, axis=2) > 40
    body[int(0.85 * len(image)) :] = False  # the colour bar and the axes
    rows, columns = np.flatnonzero(body.any(axis=1)), np.flatnonzero(body.any(axis=0))
    return np.ptp(columns) / image.shape[1], np.ptp(rows) / image.shape[0]


@needs_drawing
@pytest.mark.parametrize("name", ["cantilever", "block", "frame"])
def test_pictures_are_filled_by_the_body(name, request, tmp_path):
    body = request.getfixturevalue(name)
    for draw in (lambda file: render.render_mode(body, 1, file), lambda file: render.render_mesh(body, file)):
        file = draw(tmp_path / f"{name}.png")
        assert max(box(file)) > 0.6
        assert pixels(file).shape == (750, 1000, 3)


@needs_drawing
@pytest.mark.parametrize("mode", [1, 2, 3, 4])
def test_bending_of_a_beam_is_seen_from_its_side(cantilever, mode, tmp_path):
    width, height = box(render.render_mode(cantilever, mode, tmp_path / "m.png"))
    assert width > 0.8
    assert height > 0.12  # a largest displacement of 12 % of the length, in a picture 4 wide and 3 high


@needs_drawing
@pytest.mark.parametrize("name", ["cantilever", "block"])
def test_colour_is_the_displacement(name, request, tmp_path):
    image = pixels(render.render_mode(request.getfixturevalue(name), 1, tmp_path / "m.png"))[100:600]
    red, green, blue = np.moveaxis(image, 2, 0)
    violet, yellow = (blue > green + 40) & (red > green + 25), (green > blue + 80) & (red > blue + 80)
    assert violet.sum() > 300
    assert yellow.sum() > 300
    assert np.nonzero(violet)[1].mean() < np.nonzero(yellow)[1].mean()  # from the clamp to the free end


@needs_drawing
def test_a_plotter_of_many_modes_shows_each_as_its_own_plotter_does(cantilever, tmp_path):
    files = {mode: tmp_path / f"{mode}.png" for mode in (1, 2)}
    assert list(render_modes(cantilever, files)) == list(files.values())
    alone = pixels(render.render_mode(cantilever, 2, tmp_path / "alone.png"))
    other, same = (np.abs(pixels(files[mode]) - alone).mean() for mode in (1, 2))
    assert same < 0.1 < other  # of 255; a colour may be rounded in another way


@needs_drawing
def test_drawing_is_silent(cantilever, tmp_path, capfd):
    render.render_mode(cantilever, 1, tmp_path / "m.png")
    assert capfd.readouterr() == ("", "")


@needs_drawing
def test_modes_that_do_not_move_are_drawn(cantilever, tmp_path):
    still = cantilever.with_(shape=np.zeros_like(cantilever.shape), phi=np.zeros_like(cantilever.phi))
    assert render.render_mode(still, 1, tmp_path / "m.png").exists()


@needs_drawing
def test_animation_returns_to_its_start(cantilever, tmp_path):
    with Image.open(animate_mode(cantilever, 1, tmp_path / "a.gif", frames=8)) as image:
        assert image.n_frames == 8
        frames = []
        for k in range(8):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB")).astype(int))
    rest, up, back, down = (frames[k] for k in (0, 2, 4, 6))
    assert np.abs(rest - back).mean() < 0.1 < np.abs(up - down).mean()


@needs_drawing
def test_unknown_cells_are_named(cantilever, tmp_path):
    body = cantilever.with_(cells={"polygon": np.arange(16)[None]})
    with pytest.raises(RenderError, match="cells of type polygon cannot be drawn"):
        render.render_mesh(body, tmp_path / "m.png")
    assert list(tmp_path.iterdir()) == []


def test_wrong_requests_leave_nothing(cantilever, tmp_path):
    for mode in (0, 6):
        with pytest.raises(mp.InputError, match=f"no mode {mode}; its modes are 1 to 5"):
            render.render_mode(cantilever, mode, tmp_path / "m.png")
    with pytest.raises(mp.InputError, match=r"animation is a \.gif, a \.webp or an \.mp4"):
        animate_mode(cantilever, 1, tmp_path / "m.png")
    assert list(tmp_path.iterdir()) == []


@needs_drawing
def test_suffix_must_be_a_picture(cantilever, tmp_path):
    with pytest.raises(mp.InputError, match=r"\.png"):
        render.render_mode(cantilever, 1, tmp_path / "m.docx")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "no OpenGL"),
        ("import sys; sys.exit('import: libGL.so.1: cannot open shared object file')", "libGL.so.1: cannot open"),
        ("import sys; sys.exit('blank')", "no OpenGL"),
    ],
)
def test_machine_that_cannot_draw_says_what_to_install(probe, code, words, cantilever, tmp_path, capfd):
    problem = probe(code)
    assert words in problem
    assert "apt-get install libegl1" in problem
    with pytest.raises(RenderError, match="apt-get install"):
        render.render_mode(cantilever, 1, tmp_path / "m.png")
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_probe_that_hangs_ends(probe, monkeypatch):
    monkeypatch.setattr(render, "PATIENCE", 0.5)
    assert "within 0.5 s" in probe("import time; time.sleep(60)")


def test_second_kind_of_window_is_tried(probe):
    code = f"import os, sys; sys.exit(0 if '{render.WINDOW}' not in os.environ else 'no EGL')"
    assert probe(code) is None
    assert render.WINDOW not in render.os.environ


def test_probe_runs_once(probe, monkeypatch):
    assert probe("pass") is None
    monkeypatch.setattr(subprocess, "run", None)
    assert render.drawing_problem() is None


def test_probe_itself_is_one_attempt():
    done = subprocess.run([sys.executable, "-c", "import sys; sys.modules['vtkmodules'] = None\n" + render.PROBE],
                          capture_output=True, text=True)  # fmt: skip
    assert done.returncode == 1
    assert done.stderr.startswith("import: ")


def test_view_is_square_to_a_beam_and_its_motion(cantilever):
    for mode, axis in ((1, 1), (2, 2)):
        towards, up = view(cantilever.points, cantilever.shape[:, :, mode - 1])
        assert abs(towards[0]) < 1e-12
        assert up[axis] > 0.99
        np.testing.assert_allclose(np.cross(up, towards), [1, 0, 0], atol=1e-12)  # root left, tip right


def test_view_of_the_axial_mode_and_of_a_point():
    point = np.zeros((1, 3))
    line = np.linspace([0.0, 0, 0], [0, 0, 1], 4)
    for points, shape in ((point, None), (point, point), (line, line), (line, None)):
        towards, up = view(points, shape)
        np.testing.assert_allclose([towards @ towards, up @ up, towards @ up], [1, 1, 0], atol=1e-12)


def test_test_of_vtk_that_was_started_ahead_is_the_only_one(probe, monkeypatch, tmp_path):
    started = tmp_path / "started"
    monkeypatch.setattr(render, "PROBE", f"open({str(started)!r}, 'a').write('x')")
    monkeypatch.delenv(render.WINDOW, raising=False)
    render.drawing_problem.cache_clear()
    render.try_ahead()
    render.try_ahead()
    assert render.drawing_problem() is None
    assert started.read_text() == "x"
    render.try_ahead()
    assert not render._started
