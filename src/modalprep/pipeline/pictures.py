"""The pictures of a body's mesh and modes, drawn beside the other work of a run."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import RenderError
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.drawn import Drawn, not_drawn
from modalprep.report.painter import Painter
from modalprep.report.pictures.render import is_untested, render_mesh, try_ahead
from modalprep.report.pictures.sheet import render_modes

MOST = 2e8  # bytes of the mode shapes that another process holds too


class Pictures:
    """The pictures that a pipeline file wants: `begin` once there is a body, `draw` when they are needed.

    Parameters
    ----------
    wanted : "none", "kept" or int
        Number of modes.
    painter : Painter or None
        Who draws beside the other work.
    """

    def __init__(self, wanted: str | int, painter: Painter | None = None) -> None:
        self.wanted, self.painter = wanted, painter

    def begin(self, body: FlexibleBody, file: Path) -> None:
        """Let the painter begin with a body and its modal file."""
        if self.painter and body.shape.nbytes < MOST:
            self.painter.begin(body, *self._files(body, file))

    def draw(self, body: FlexibleBody, file: Path, reporter: Reporter) -> Drawn:
        """Draw what the painter has not drawn, or report in one line why not."""
        mesh_picture, pictures = self._files(body, file)
        if not pictures:
            return Drawn()
        with reporter.progress("pictures", len(pictures), unit="modes") as done:
            try:
                for mode in self._drawn(body, mesh_picture, pictures):
                    done(mode)
            except RenderError as error:
                return not_drawn(error, reporter)
        reporter.files += [mesh_picture, *pictures.values()]
        reporter.say(f"  wrote {len(pictures)} mode pictures {file.stem}-mode-*.png")
        return Drawn(mesh=mesh_picture, modes=pictures)

    def _drawn(self, body: FlexibleBody, mesh_picture: Path, pictures: dict[int, Path]) -> Iterator[int]:
        """Yield the number of modes that are drawn, from 0 for the mesh."""
        if self.painter and (yield from self.painter.drawn()):
            return
        render_mesh(body, mesh_picture)
        for mode, _ in zip(pictures, render_modes(body, pictures), strict=True):
            yield mode

    def _files(self, body: FlexibleBody, file: Path) -> tuple[Path, dict[int, Path]]:
        count = min(counted(self.wanted, body.n), body.n)
        modes = {mode: file.with_name(f"{file.stem}-mode-{mode:02d}.png") for mode in range(1, count + 1)}
        return file.with_name(f"{file.stem}-mesh.png"), modes


@contextmanager
def pictures_beside(wanted: str | int) -> Iterator[Pictures]:
    """Yield the pictures of a run; on Linux with two processors, a process prepares to draw them, the first time."""
    painter = None
    if wanted not in ("none", 0):
        with suppress(OSError):
            painter = Painter() if is_untested() and sys.platform == "linux" and (os.cpu_count() or 1) > 1 else None
        if painter is None:
            try_ahead()
    try:
        yield Pictures(wanted, painter)
    finally:
        if painter:
            painter.close()


def counted(wanted: str | int, modes: int) -> int:
    """Return the number of modes to draw.

    Examples
    --------
    >>> counted("kept", 12), counted("none", 12), counted(8, 12)
    (12, 0, 8)
    """
    return wanted if isinstance(wanted, int) else {"none": 0, "kept": modes}[wanted]
