"""Charts, scenes and films in a window or a notebook: `plot` and `animate` of the records."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modalprep.drawing import Film, Page
from modalprep.errors import InputError, RenderError
from modalprep.extras import need
from modalprep.report.pictures.animation import animate_mode
from modalprep.report.pictures.mesh_picture import Body
from modalprep.report.pictures.render import PICTURE, drawing_problem, mesh_scene, mode_scene
from modalprep.report.view.page import view_body, view_mesh, view_run, view_still
from modalprep.suggest import refuse_unknown

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from modalprep.body.flexible_body import FlexibleBody
    from modalprep.multibody.model.system import System
    from modalprep.multibody.results.result import Result
    from modalprep.reduction.table import ModeTable

WINDOW = (1000, 750)
FILMS = ("webp", "gif")


def histories(run: Result, channels: Sequence[str], axes: Axes | None, **options: Any) -> Axes:
    """Draw channels of a run over time."""
    from modalprep.report.charts.figures import show_verbatim
    from modalprep.report.charts.plots import draw_histories

    axes = axes or _axes((9.0, 5.0))
    draw_histories(axes, {"run": run}, channels, **options)
    show_verbatim(axes)
    return axes


def effective_mass(table: ModeTable, axes: Axes | None) -> Axes:
    """Draw the effective masses of a table."""
    from modalprep.report.charts.mass_chart import draw_effective_mass

    axes = axes or _axes((9.0, 4.4))
    draw_effective_mass(axes, table)
    return axes


def _axes(size: tuple[float, float]) -> Axes:
    """Return the axes of a new figure of pyplot, which notebooks show by themselves."""
    from matplotlib import pyplot

    return pyplot.figure(figsize=size, layout="constrained").add_subplot()


def mesh(shown: Any) -> Any:
    """Show a mesh."""
    name = Path(shown.source).stem or "mesh"
    return _show(lambda off: mesh_scene(Body(name, shown.points, _structural(shown.cells)), WINDOW, off_screen=off))


def _structural(cells: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {kind: nodes for kind, nodes in cells.items() if kind != "vertex" and len(nodes)}


def model(shown: Any) -> Any:
    """Show an assembled model with its interfaces."""
    drawn = _model(shown)
    return _show(lambda off: mesh_scene(drawn, WINDOW, off_screen=off))


def _model(shown: Any) -> Body:
    names = tuple(frame.name for frame in shown.interfaces)
    places = np.array([frame.position for frame in shown.interfaces]).reshape(-1, 3)
    name = Path(shown.source.get("mesh", "")).stem or "model"
    return Body(name, shown.points, _structural(shown.cells), names, places)


def body(shown: FlexibleBody, mode: int | None, colour: str) -> Any:
    """Show a body, or one of its modes."""
    if mode is None:
        return _show(lambda off: mesh_scene(shown, WINDOW, off_screen=off))
    return _show(lambda off: mode_scene(shown, mode, colour, WINDOW, off_screen=off))


def mode_film(shown: FlexibleBody, mode: int, kind: str, **options: Any) -> Film:
    """Draw one period of a mode."""
    return _film(lambda path: animate_mode(shown, mode, path, **options), kind)


def system_film(system: System, run: Result, kind: str, style: dict[str, Any], **options: Any) -> Film:
    """Draw a run of a system."""
    from modalprep.report.pictures.system_animation import animate_system
    from modalprep.report.pictures.system_parts import FilmStyle

    return _film(lambda path: animate_system(system, run, path, style=FilmStyle(**style), **options), kind)


def mesh_view(shown: Any) -> Page:
    """Return a page with a mesh."""
    return _page(lambda path: view_mesh(shown, path))


def model_view(shown: Any) -> Page:
    """Return a page with an assembled model and its interfaces."""
    return _page(lambda path: view_still(_model(shown), path))


def body_view(shown: FlexibleBody) -> Page:
    """Return a page with a body and its modes."""
    return _page(lambda path: view_body(shown, path))


def system_view(shown: System, run: Result | None) -> Page:
    """Return a page with a run of a system, or with its start."""
    from modalprep.multibody.simulate import start_channels

    return _page(lambda path: view_run(shown, start_channels(shown) if run is None else run, path, name="system"))


def _page(write: Callable[[Path], Path]) -> Page:
    with tempfile.TemporaryDirectory() as folder:
        return Page(write(Path(folder) / "page.html").read_text(encoding="utf-8"))


def _film(write: Callable[[Path], Path], kind: str) -> Film:
    refuse_unknown(kind, FILMS, "animate: kind")
    with tempfile.TemporaryDirectory() as folder:
        return Film(write(Path(folder) / f"film.{kind}").read_bytes(), kind)


def system(shown: System, state: Result | None, time: float | None) -> Any:
    """Show a system at a time of a run, or at its start."""
    from modalprep.multibody.simulate import start_channels
    from modalprep.report.pictures.system_parts import FilmStyle
    from modalprep.report.pictures.system_scene import SystemScene

    state = start_channels(shown) if state is None else state
    scene = SystemScene(shown, _one_time(state, time), 1, FilmStyle())

    def stage(off_screen: bool):
        plotter = scene.stage(WINDOW, off_screen=off_screen)
        scene.place(plotter, 0)
        return plotter

    return _show(stage)


def _one_time(run: Result, time: float | None) -> Result:
    """Return the sample of a run nearest to a time, its last one by default."""
    if time is not None and not run.time[0] <= time <= run.time[-1]:
        raise InputError(f"time = {time:g} s lies outside the run, from {run.time[0]:g} to {run.time[-1]:g} s")
    k = len(run.time) - 1 if time is None else int(np.argmin(np.abs(run.time - time)))
    return run.with_(time=run.time[k : k + 1], channels={name: a[k : k + 1] for name, a in run.channels.items()})


def _show(stage) -> Any:
    """Show a scene in a notebook or a window, as pyvista is set to; `stage` makes the plotter."""
    need("pyvista", PICTURE)
    if problem := _display_problem():
        raise RenderError(problem)
    import pyvista

    return stage(bool(pyvista.OFF_SCREEN)).show()


def has_display() -> bool:
    """Say whether windows can be opened here; without a display browsers would open in the terminal."""
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _display_problem() -> str | None:
    """Return why no scene can be shown, or None."""
    import pyvista

    if pyvista.OFF_SCREEN or "ipykernel" in sys.modules:
        return drawing_problem()
    if not has_display():
        return "there is no display for a window; write a file by modalprep.report.render_mode or render_mesh instead"
    return None
