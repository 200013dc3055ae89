"""Animations and the sheet of all modes: they move, hold every mode, and are whole or absent."""

import sys

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import modalprep as mp
from modalprep.cli.commands import app
from modalprep.errors import RenderError
from modalprep.formats.modalfile import write_body
from modalprep.report.pictures import animation, render, sheet
from modalprep.report.pictures.animation import animate_mode
from modalprep.report.pictures.sheet import contact_sheet

needs_drawing = pytest.mark.usefixtures("drawing")


def colourful(image) -> np.ndarray:
    pixels = np.asarray(image.convert("RGB")).astype(int)
    return np.ptp(pixels, axis=2) > 40


@needs_drawing
def test_gif_repeats_in_its_period_and_does_not_flicker(block, tmp_path):
    with Image.open(animate_mode(block, 1, tmp_path / "a.gif", frames=8)) as image:
        assert image.info["loop"] == 0
        assert image.info["duration"] == 190  # ms, an eighth of 1.5 s in hundredths
        assert image.size == animation.SIZE
        frames = []
        for k in range(image.n_frames):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB")).astype(int))
    assert len(frames) == 8
    corner = np.array([frame[:60, :400] for frame in frames])  # the title
    assert (corner.max(axis=0) - corner.min(axis=0)).max() == 0
    assert (frames[0][-1] == 255).all()  # the background is white
    red, green, blue = np.moveaxis(frames[2], 2, 0)
    assert ((red > 150) & (green < 0.6 * red) & (blue < 0.2 * red)).sum() > 20  # the marks of the interfaces
    assert np.abs(frames[2] - frames[6]).mean() > 0.5


@needs_drawing
def test_mp4_without_its_package_is_refused_in_a_message(block, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(RenderError, match=r"\.gif does not\) needs imageio-ffmpeg: pip install 'modalprep\[video\]'"):
        animate_mode(block, 1, tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []


@needs_drawing
def test_mp4_is_written(block, tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="imageio-ffmpeg is not installed")
    file = animate_mode(block, 1, tmp_path / "a.mp4", frames=6)
    count, seconds = ffmpeg.count_frames_and_secs(str(file))
    assert count == 6 * animation.REPEATS
    assert seconds == pytest.approx(animation.PERIOD * animation.REPEATS, rel=0.05)


def test_animation_needs_two_frames(block, tmp_path):
    with pytest.raises(mp.InputError, match="frames = 1 must be at least 2"):
        animate_mode(block, 1, tmp_path / "a.gif", frames=1)


@needs_drawing
def test_failed_write_leaves_nothing(block, tmp_path, monkeypatch):
    def fail(images, path, period):
        path.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(animation, "_write_gif", fail)
    with pytest.raises(mp.InputError, match="No space left"):
        animate_mode(block, 1, tmp_path / "a.gif", frames=2)
    assert list(tmp_path.iterdir()) == []


@needs_drawing
@pytest.mark.parametrize("columns", [None, 2])
def test_sheet_has_a_picture_of_every_mode(cantilever, columns, tmp_path):
    with Image.open(contact_sheet(cantilever, tmp_path / "s.png", columns=columns)) as image:
        colour = colourful(image)
    wide, high = sheet.TILE[0] + sheet.EDGE, sheet.TILE[1] + sheet.CAPTION + sheet.EDGE
    across = columns or 3
    rows = -(-5 // across)
    assert colour.shape == (sheet.HEAD + rows * high, across * wide + sheet.EDGE)
    filled = [
        colour[sheet.HEAD + r * high :, sheet.EDGE + c * wide :][: sheet.TILE[1], : sheet.TILE[0]].sum() > 300
        for r in range(rows)
        for c in range(across)
    ]
    assert filled == [True] * 5 + [False] * (rows * across - 5)


def test_sheet_of_a_rigid_body_is_refused(cantilever, tmp_path):
    rigid = cantilever.with_(K=np.zeros(0), shape=np.zeros((21, 3, 0)))
    with pytest.raises(mp.InputError, match="no modes to draw; it is rigid"):
        contact_sheet(rigid, tmp_path / "s.png")


def test_machine_that_cannot_draw_is_reported(block, tmp_path, monkeypatch):
    monkeypatch.setattr(render, "drawing_problem", lambda: "VTK finds no OpenGL")
    for draw, file in ((contact_sheet, "s.png"), (lambda body, path: animate_mode(body, 1, path), "a.gif")):
        with pytest.raises(RenderError, match="no OpenGL"):
            draw(block, tmp_path / file)
    assert list(tmp_path.iterdir()) == []


@needs_drawing
@pytest.mark.parametrize(("options", "file"), [
    (["--sheet"], "cantilever-modes.png"),
    (["--animate", "--mode", "2"], "cantilever-mode-02.gif"),
    (["--mode", "0"], "cantilever-mode-00.png"),
])  # fmt: skip
def test_command_draws_into_a_file_of_its_name(cantilever, options, file, tmp_path, monkeypatch):
    write_body(cantilever, tmp_path / "cantilever.h5")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(animate_mode.__kwdefaults__, "frames", 3)  # of 24: the others are tested above
    done = CliRunner().invoke(app, ["render", "cantilever.h5", *options])
    assert done.exit_code == 0, done.output
    assert (tmp_path / file).stat().st_size > 1000


def test_command_makes_one_thing_at_a_time(cantilever, tmp_path):
    body = write_body(cantilever, tmp_path / "cantilever.h5")
    done = CliRunner().invoke(app, ["render", str(body), "--sheet", "--animate"])
    assert isinstance(done.exception, mp.InputError)
    assert "give one of them" in str(done.exception)
