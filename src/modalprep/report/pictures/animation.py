"""Animation of a mode as a GIF or an MP4."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError, RenderError
from modalprep.extras import need
from modalprep.report.pictures import marks, render
from modalprep.report.pictures.body_parts import add_deformed, add_ghost, label_shifts
from modalprep.report.pictures.files import shot
from modalprep.report.scene.colour import node_colour
from modalprep.report.scene.record import Scene, scene_of

if TYPE_CHECKING:
    from PIL import Image

SIZE = (720, 540)  # both even, as required for video
PERIOD = 1.5  # s
WEBP = 75  # quality, %
REPEATS = 4  # periods in a video, which does not repeat


def animate_mode(
    body: FlexibleBody | Scene,
    mode: int,
    path: str | Path,
    *,
    colour: str = "displacement",
    frames: int = 24,
    size: tuple[int, int] = SIZE,
    title: str = "",
) -> Path:
    """Write one period of a mode as a GIF that repeats, or a few periods as an MP4.

    The colour is the current displacement or density of strain energy. The file is written completely or not at all.

    Parameters
    ----------
    body : FlexibleBody
    mode : int
        Counted from 1.
    path : path
        A .gif, or an .mp4 where the package imageio-ffmpeg is installed.
    colour : {"displacement", "energy"}
    frames : int
        Of one period.
    size : (int, int)
        Width and height in pixels; even numbers for an .mp4.
    title : str
        Instead of name, mode and frequency.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the body has no such mode or no such colour, or the file is of another kind.
    RenderError
        When the machine cannot draw, or cannot write an MP4.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> animate_mode(uniform_beam(modes=1), 1, "beam.avi")
    Traceback (most recent call last):
    modalprep.errors.InputError: cannot write beam.avi: an animation is a .gif, a .webp or an .mp4 file
    """
    path = check_target(path, frames)
    scene = scene_of(body)
    scale = render.shown_scale(scene, mode)
    images = _frames(scene, mode, scale, colour, frames, size, title or True)
    return write_frames(images, path, PERIOD, REPEATS)


def check_target(path: str | Path, frames: int = 2) -> Path:
    """Refuse an animation that cannot be written."""
    path = Path(path)
    if path.suffix.lower() not in (".gif", ".webp", ".mp4"):
        raise InputError(f"cannot write {path}: an animation is a .gif, a .webp or an .mp4 file")
    if frames < 2:
        raise InputError(f"frames = {frames} must be at least 2")
    need("pyvista", render.PICTURE)
    if path.suffix.lower() == ".mp4":
        need("imageio_ffmpeg", f"{path} (a .webp or a .gif does not)")
    return path


def write_frames(images: list[np.ndarray], path: Path, period: float, repeats: int = 1) -> Path:
    """Write images (height, width, 3) of a `period` (s) as a GIF or WebP that repeats, or `repeats` times as an MP4."""
    with atomic_path(path) as temporary:
        if path.suffix.lower() == ".gif":
            _write_gif(images, temporary, period)
        elif path.suffix.lower() == ".webp":
            _write_webp(images, temporary, period)
        else:
            _write_mp4(images * repeats, temporary, len(images) / period)
    return path


def _frames(
    body: Scene, mode: int, scale: float, colour: str, count: int, size: tuple[int, int], text: bool | str
) -> list[np.ndarray]:
    """Draw one period from rest, with both extremes in view."""
    amount = node_colour(body, mode, colour)
    swing = scale * body.shape[:, :, mode - 1]
    plotter = render.framed_plotter(
        body, size, np.concatenate([body.points + swing, body.points - swing]), mode, text=text
    )
    try:
        add_ghost(plotter, body)
        swept = [body.points + q * swing for q in (-1, 0, 1)]
        shifts = label_shifts(plotter, body, swept, body.interface_position)
        images = []
        for phase in np.linspace(0, 2 * np.pi, count, endpoint=False):
            q = np.sin(phase)
            add_deformed(plotter, body, mode, scale, amount * abs(q), q, shifts=shifts)
            images.append(shot(plotter))
        return images
    finally:
        plotter.close()


def _write_gif(images: list[np.ndarray], path: Path, period: float) -> None:
    """Write the frames in the colours of one palette, so that still parts do not flicker."""
    from PIL import Image

    palette = _palette(images[:: max(1, len(images) // 4)])
    first, *rest = (Image.fromarray(image).quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    each = round(1000 * period / len(images) / 10) * 10  # ms; the format counts in hundredths of a second
    first.save(path, save_all=True, append_images=rest, duration=max(20, each), loop=0, format="GIF")


def _write_webp(images: list[np.ndarray], path: Path, period: float) -> None:
    from PIL import Image

    first, *rest = (Image.fromarray(image) for image in images)
    each = max(20, round(1000 * period / len(images)))  # ms
    first.save(path, save_all=True, append_images=rest, duration=each, loop=0, quality=WEBP, method=4, format="WEBP")


def _palette(images: list[np.ndarray]) -> Image.Image:
    """Return 256 colours: the usual ones of the pictures, white, and the interfaces' mark in light and shade."""
    from PIL import Image, ImageColor

    mark = np.array(ImageColor.getrgb(marks.MARK))
    common = np.array(Image.fromarray(np.concatenate(images)).quantize(250).getpalette()).reshape(-1, 3)[:250]
    common[(common > 245).all(axis=1)] = 255  # averaging makes white slightly grey
    extra = np.concatenate([[[255] * 3], np.outer([0.6, 0.75, 0.9, 1.0, 1.15], mark).clip(0, 255)])
    colours = np.concatenate([common, extra]).astype(int)
    image = Image.new("P", (1, 1))
    image.putpalette(np.resize(colours, (256, 3)).ravel().tolist())
    return image


def _write_mp4(images: list[np.ndarray], path: Path, fps: float) -> None:
    import imageio_ffmpeg  # pyright: ignore[reportMissingImports]  # of the extra video

    height, width = images[0].shape[:2]
    try:
        writer = imageio_ffmpeg.write_frames(
            str(path),
            (width, height),
            fps=fps,
            quality=8,
            macro_block_size=2,
            ffmpeg_log_level="error",
        )
        writer.send(None)
        for image in images:
            writer.send(np.ascontiguousarray(image))
        writer.close()
    except (OSError, RuntimeError) as error:
        raise RenderError(f"ffmpeg did not write the MP4: {' '.join(str(error).split())[-300:]}") from error
