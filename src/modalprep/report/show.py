"""Charts, scenes and films in a window or a notebook: `plot` and `animate` of the records."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modalprep.drawing import Film
from modalprep.errors import InputError, RenderError
from modalprep.report.pictures.animation import SIZE, animate_mode
from modalprep.report.pictures.mesh_picture import Body
from modalprep.report.pictures.render import drawing_problem, mesh_scene, mode_scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from modalprep.body.flexible_body import FlexibleBody
    from modalprep.multibody.model.system import System
    from modalprep.multibody.results.result import Result
    from modalprep.reduction.table import ModeTable

WINDOW = (1000, 750)


def histories(run: Result, channels: Sequence[str], axes: Axes | None, **options: Any) -> Axes:
    """Draw channels of a run over time."""
    from modalprep.report.plots import draw_histories

    axes = axes or _axes((9.0, 5.0))
    draw_histories(axes, {"run": run}, channels, **options)
    return axes


def effective_mass(table: ModeTable, axes: Axes | None) -> Axes:
    """Draw the effective masses of a table."""
    from modalprep.report.mass_chart import draw_effective_mass

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
    names = tuple(frame.name for frame in shown.interfaces)
    places = np.array([frame.position for frame in shown.interfaces]).reshape(-1, 3)
    name = Path(shown.source.get("mesh", "")).stem or "model"
    drawn = Body(name, shown.points, _structural(shown.cells), names, places)
    return _show(lambda off: mesh_scene(drawn, WINDOW, off_screen=off))


def body(shown: FlexibleBody, mode: int | None, colour: str) -> Any:
    """Show a body, or one of its modes."""
    if mode is None:
        return _show(lambda off: mesh_scene(shown, WINDOW, off_screen=off))
    return _show(lambda off: mode_scene(shown, mode, colour, WINDOW, off_screen=off))


def mode_film(shown: FlexibleBody, mode: int, colour: str) -> Film:
    """Draw one period of a mode."""
    return _film(lambda path: animate_mode(shown, mode, path, colour=colour, size=SIZE))


def system_film(system: System, run: Result, style: dict[str, Any], **options: Any) -> Film:
    """Draw a run of a system."""
    from modalprep.report.pictures.system_animation import animate_system
    from modalprep.report.pictures.system_parts import FilmStyle

    return _film(lambda path: animate_system(system, run, path, style=FilmStyle(**style), **options))


def _film(write) -> Film:
    with tempfile.TemporaryDirectory() as folder:
        return Film(write(Path(folder) / "film.gif").read_bytes())


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
    if problem := _display_problem():
        raise RenderError(problem)
    import pyvista

    return stage(bool(pyvista.OFF_SCREEN)).show()


def _display_problem() -> str | None:
    """Return why no scene can be shown, or None."""
    import pyvista

    if pyvista.OFF_SCREEN or "ipykernel" in sys.modules:
        return drawing_problem()
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return "there is no display for a window; write a file by modalprep.report.render_mode or render_mesh instead"
    return None
