"""Pictures of many modes of a body by one plotter: to make one takes longer than a picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from modalprep.body.flexible_body import FlexibleBody
from modalprep.report.pictures.files import write_shot
from modalprep.report.pictures.render import mode_scene, show_mode


def render_modes(
    body: FlexibleBody,
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
    plotter = None
    try:
        for mode, path in files.items():
            if plotter is None:
                plotter = mode_scene(body, mode, colour, size)
            else:
                show_mode(plotter, body, mode, colour)
            yield write_shot(plotter, path)
    finally:
        if plotter is not None:
            plotter.close()
