"""All modes of a body: in one picture, or each in its own by one plotter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.report.pictures import render
from modalprep.report.pictures.body_parts import add_deformed, add_ghost
from modalprep.report.pictures.files import refuse_suffix, save_image, shot, write_shot
from modalprep.report.scene.colour import WORDS, node_colour, refuse_colour
from modalprep.report.scene.record import Scene, scene_of
from modalprep.report.tables import hertz

TILE = (480, 360)
CAPTION, HEAD, EDGE = 40, 84, 12  # heights and margin in pixels
INK, LINE = "#1d2733", "#c3ccd4"


def contact_sheet(
    body: FlexibleBody | Scene, path: str | Path, *, colour: str = "displacement", columns: int | None = None
) -> Path:
    """Draw a thumbnail of every mode with its number and frequency, in colour over the undeformed body.

    Parameters
    ----------
    body : FlexibleBody
    path : path
        A .png or .jpg file.
    colour : {"displacement", "energy"}
    columns : int, optional
        Pictures in a row; by default the sheet is slightly wider than high.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the body is rigid or has no such colour, or the file is neither .png nor .jpg.
    RenderError
        When the machine cannot draw.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> contact_sheet(uniform_beam(modes=1), "modes.txt")
    Traceback (most recent call last):
    modalprep.errors.InputError: cannot write modes.txt: a picture is one of .png, .jpg, .jpeg
    """
    from PIL import Image, ImageDraw

    refuse_suffix(path)
    if not body.n:
        raise InputError(f"body {body.name!r} has no modes to draw; it is rigid")
    scene = scene_of(body)
    refuse_colour(scene, colour)
    columns = max(1, min(body.n, columns or int(np.ceil(np.sqrt(1.2 * body.n)))))
    rows = -(-body.n // columns)
    wide = TILE[0] + EDGE
    high = TILE[1] + CAPTION + EDGE
    sheet = Image.new("RGB", (columns * wide + EDGE, HEAD + rows * high), "white")
    pen = ImageDraw.Draw(sheet)
    _add_head(sheet, pen, scene, colour)
    for k in range(body.n):
        _add_tile(sheet, pen, scene, k + 1, colour, (EDGE + k % columns * wide, HEAD + k // columns * high))
    return save_image(np.asarray(sheet), path)


def _add_tile(sheet, pen, body: Scene, mode: int, colour: str, corner: tuple[int, int]) -> None:
    from PIL import Image, ImageFont

    left, top = corner
    sheet.paste(Image.fromarray(_picture(body, mode, colour)), corner)
    pen.rectangle((left, top, left + TILE[0], top + TILE[1] + CAPTION), outline=LINE)
    pen.line((left, top + TILE[1], left + TILE[0], top + TILE[1]), fill=LINE)
    words = f"mode {mode}    {hertz(body.frequency[mode - 1])} Hz"
    pen.text((left + 12, top + TILE[1] + 6), words, fill=INK, font=ImageFont.load_default(22))


def _picture(body: Scene, mode: int, colour: str) -> np.ndarray:
    """Draw one mode without text."""
    scale = render.shown_scale(body, mode)
    amount = node_colour(body, mode, colour)
    plotter = render.framed_plotter(body, TILE, render.bent(body, mode, scale), mode, text=False)
    try:
        add_ghost(plotter, body)
        add_deformed(plotter, body, mode, scale, amount)
        return shot(plotter)
    finally:
        plotter.close()


def _add_head(sheet, pen, body: Scene, colour: str) -> None:
    """Write name and number of modes and, if there is room, the colour legend."""
    from matplotlib import colormaps
    from PIL import Image, ImageFont

    font, small = ImageFont.load_default(30), ImageFont.load_default(20)
    title = f"{body.name}    {body.n} mode{'s' * (body.n > 1)}"
    pen.text((EDGE + 4, 8), title, fill=INK, font=font)
    ramp = (255 * colormaps["viridis"](np.linspace(0, 1, 120))[:, :3]).astype(np.uint8)
    sheet.paste(Image.fromarray(np.tile(ramp, (14, 1, 1))), (EDGE + 24, 54))
    pen.text((EDGE + 4, 48), "0", fill=INK, font=small)
    pen.text((EDGE + 152, 48), f"1   {WORDS[colour]} of the mode", fill=INK, font=small)


def render_modes(
    body: FlexibleBody | Scene,
    files: Mapping[int, str | Path],
    *,
    colour: str = "displacement",
    size: tuple[int, int] = (1000, 750),
) -> Iterator[Path]:
    """Draw modes (counted from 1) as `render_mode` does, each into its file, and yield the file.

    Raises
    ------
    InputError, RenderError
        As those of `render_mode`.
    """
    scene = scene_of(body)
    plotter = None
    try:
        for mode, path in files.items():
            if plotter is None:
                plotter = render.mode_scene(scene, mode, colour, size)
            else:
                render.show_mode(plotter, scene, mode, colour)
            yield write_shot(plotter, path)
    finally:
        if plotter is not None:
            plotter.close()
