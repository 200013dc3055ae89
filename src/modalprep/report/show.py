"""`plot`, `view` and `animate` of the records, by the type of the record: `drawing` calls them."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import singledispatch
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.drawing import Animated, Film, Page, Plotted, Viewed
from modalprep.ensemble.record import PERCENTILES, Ensemble
from modalprep.errors import InputError, RenderError
from modalprep.extras import need
from modalprep.multibody.analysis.root_locus import root_locus
from modalprep.multibody.analysis.state_space import LinearSystem, frequency_response
from modalprep.multibody.model.system import System
from modalprep.multibody.preparation import start_channels
from modalprep.multibody.results.result import Result
from modalprep.multibody.rotors.campbell import Campbell
from modalprep.reduction.cyclic.modes import CyclicModes
from modalprep.reduction.table import ModeTable
from modalprep.report.charts.figures import show_verbatim
from modalprep.report.charts.mass_chart import draw_effective_mass
from modalprep.report.charts.plots import draw_histories
from modalprep.report.cyclic import draw_cyclic
from modalprep.report.ensemble import draw_bands
from modalprep.report.linear import (
    chosen_loop,
    draw_bode,
    draw_nyquist,
    draw_root_locus,
    telling_frequencies,
    telling_gains,
)
from modalprep.report.pictures.animation import animate_mode
from modalprep.report.pictures.render import PICTURE, drawing_problem, mesh_scene, mode_scene
from modalprep.report.pictures.system_animation import animate_system
from modalprep.report.responses import chosen_panels, draw_response, largest_panels
from modalprep.report.rotor import draw_campbell
from modalprep.report.run_page.channels import channel_unit
from modalprep.report.scene.record import Scene, scene_of
from modalprep.report.scene.style import FilmStyle
from modalprep.report.scene.system import SystemScene
from modalprep.report.strength import draw_power, draw_shock, split_shock
from modalprep.report.view.page import view_body, view_run, view_still
from modalprep.response.power import PowerSpectrum
from modalprep.response.result import Response
from modalprep.response.shock import ShockSpectrum
from modalprep.suggest import refuse_unknown
from modalprep.vectors import VectorLike

if TYPE_CHECKING:
    import pyvista
    from matplotlib.axes import Axes

WINDOW = (1000, 750)
FILMS = ("webp", "gif")
DIAGRAMS = ("bode", "nyquist", "root_locus")


@singledispatch
def plot(shown: Plotted, *args: Any, **options: Any) -> Any:
    """Show a record; by default a mesh, or a model with its interfaces."""
    drawn = _mesh_scene(shown, *args, **options)
    return _show(lambda off: mesh_scene(drawn, WINDOW, off_screen=off))


def _mesh_scene(shown: Any) -> Scene:
    """Return the scene of a mesh or a model."""
    source = shown.source if isinstance(shown.source, str) else shown.source.get("mesh", "")
    frames = getattr(shown, "interfaces", ())
    return Scene(
        name=Path(source).stem or "mesh",
        points=shown.points,
        cells=shown.cells,
        interface_name=tuple(frame.name for frame in frames),
        interface_position=np.array([frame.position for frame in frames]).reshape(-1, 3),
    )


@plot.register(FlexibleBody)
def _plot_body(body: FlexibleBody, *, mode: int | None = None, colour: str = "displacement") -> Any:
    scene = scene_of(body)
    if mode is None:
        return _show(lambda off: mesh_scene(scene, WINDOW, off_screen=off))
    return _show(lambda off: mode_scene(scene, mode, colour, WINDOW, off_screen=off))


@plot.register(System)
def _plot_system(system: System, run: Result | None = None, *, time: float | None = None) -> Any:
    state = start_channels(system) if run is None else run
    scene = SystemScene(system, _one_time(state, time), 1, FilmStyle())

    def stage(off_screen: bool) -> pyvista.Plotter:
        from modalprep.report.pictures.system_picture import SystemPicture

        picture = SystemPicture(scene, WINDOW, off_screen=off_screen)
        picture.place(0)
        return picture.plotter

    return _show(stage)


@plot.register(Result)
def _plot_histories(run: Result, *channels: str, axes: Axes | None = None, title: str = "", ylabel: str = "") -> Axes:
    axes = axes or _axes((9.0, 5.0))
    draw_histories(axes, {"run": run}, channels, title=title, ylabel=ylabel or _with_units(run, channels))
    show_verbatim(axes)
    return axes


def _with_units(run: Result, channels: Sequence[str]) -> str:
    """Return the names of channels with their units, one unit for all that have the same."""
    units = [channel_unit(run, name) for name in channels]
    if len(set(units)) == 1 and units[0]:
        return f"{', '.join(channels)} ({units[0]})"
    return ", ".join(f"{name} ({unit})" if unit else name for name, unit in zip(channels, units, strict=True))


@plot.register(Ensemble)
def _plot_bands(
    ensemble: Ensemble,
    channel: str,
    *,
    levels: Sequence[float] = PERCENTILES,
    nominal: Result | None = None,
    axes: Axes | None = None,
    title: str = "",
) -> Axes:
    axes = axes or _axes((9.0, 5.0))
    draw_bands(axes, ensemble, channel, levels=levels, nominal=nominal, title=title)
    show_verbatim(axes)
    return axes


@plot.register(Response)
def _plot_response(response: Response, *channels: str) -> list[Axes]:
    panels = chosen_panels(response, channels) if channels else largest_panels(response)
    if not panels:
        raise InputError("nothing to plot: the response has no curve that is more than round-off")
    all_axes = _panels((9.0, 0.8 + 3.2 * len(panels)), [1.0] * len(panels))
    draw_response(all_axes, response, panels)
    _verbatim(all_axes)
    return all_axes


@plot.register(ShockSpectrum)
def _plot_shock(spectrum: ShockSpectrum, *, label: str = "", unit: str = "", axes: Axes | None = None) -> Axes:
    axes = axes or _axes((9.0, 4.4))
    spectra = split_shock(spectrum, label)
    draw_shock(axes, spectra, dict.fromkeys(spectra, unit))
    show_verbatim(axes)
    return axes


@plot.register(PowerSpectrum)
def _plot_power(spectrum: PowerSpectrum, *, label: str = "", unit: str = "", axes: Axes | None = None) -> Axes:
    axes = axes or _axes((9.0, 4.4))
    draw_power(axes, spectrum, label, unit)
    show_verbatim(axes)
    return axes


@plot.register(LinearSystem)
def _plot_linear(
    linear: LinearSystem,
    kind: str = "bode",
    *,
    input: str | None = None,
    output: str | None = None,
    frequency: VectorLike | None = None,
    gain: VectorLike | None = None,
) -> list[Axes]:
    refuse_unknown(kind, DIAGRAMS, "plot: kind")
    loop = chosen_loop(linear, input, output)
    at = telling_frequencies(loop) if frequency is None else np.asarray(frequency, dtype=float)
    if kind == "bode":
        response = frequency_response(loop, at)
        all_axes = _panels((9.0, 6.2), [2.0, 1.0])
        draw_bode(all_axes[0], all_axes[1], loop, at, response)
    elif kind == "nyquist":
        all_axes = _panels((7.0, 7.0), [1.0])
        draw_nyquist(all_axes[0], loop, at)
    else:
        gains = telling_gains(loop) if gain is None else np.asarray(gain, dtype=float)
        branches = root_locus(loop, gains)
        all_axes = _panels((9.0, 6.2), [1.0])
        draw_root_locus(all_axes[0], loop, gains, branches)
    _verbatim(all_axes)
    return all_axes


@plot.register(ModeTable)
def _plot_effective_mass(table: ModeTable, *, axes: Axes | None = None) -> Axes:
    axes = axes or _axes((9.0, 4.4))
    draw_effective_mass(axes, table)
    return axes


@plot.register(CyclicModes)
def _plot_nodal_diameters(modes: CyclicModes, *, axes: Axes | None = None) -> Axes:
    axes = axes or _axes((9.0, 5.0))
    draw_cyclic(axes, modes)
    return axes


@plot.register(Campbell)
def _plot_campbell(found: Campbell, *, axes: Axes | None = None) -> Axes:
    axes = axes or _axes((9.0, 5.5))
    draw_campbell(axes, found)
    return axes


def _axes(size: tuple[float, float]) -> Axes:
    """Return the axes of a new figure of pyplot, which notebooks show by themselves."""
    from matplotlib import pyplot

    return pyplot.figure(figsize=size, layout="constrained").add_subplot()


def _panels(size: tuple[float, float], heights: Sequence[float]) -> list[Axes]:
    """Return axes below each other, of these shares of the height, of a new figure of pyplot."""
    from matplotlib import pyplot

    figure = pyplot.figure(figsize=size, layout="constrained")
    return list(figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0])


def _verbatim(all_axes: Sequence[Axes]) -> None:
    for axes in all_axes:
        show_verbatim(axes)


@singledispatch
def view(shown: Viewed, *args: Any, **options: Any) -> Page:
    """Return the page of a record; by default of a mesh, or of a model with its interfaces."""
    drawn = _mesh_scene(shown, *args, **options)
    return _page(lambda path: view_still(drawn, path))


@view.register(FlexibleBody)
def _view_body(body: FlexibleBody) -> Page:
    return _page(lambda path: view_body(body, path))


@view.register(System)
def _view_system(system: System, run: Result | None = None) -> Page:
    state = start_channels(system) if run is None else run
    return _page(lambda path: view_run(system, state, path, name="system"))


@singledispatch
def animate(shown: Animated, *args: Any, **options: Any) -> Film:
    """Return the film of a record."""
    raise TypeError(f"{type(shown).__name__} does not move")


@animate.register(FlexibleBody)
def _animate_mode(body: FlexibleBody, mode: int, *, kind: str = "webp", **options: Any) -> Film:
    return _film(lambda path: animate_mode(body, mode, path, **options), kind)


@animate.register(System)
def _animate_system(
    system: System,
    run: Result,
    *,
    kind: str = "webp",
    seconds: float = 5.0,
    frames: int = 60,
    size: tuple[int, int] = (720, 540),
    **style: Any,
) -> Film:
    drawn = FilmStyle(**style)
    options: Any = {"style": drawn, "seconds": seconds, "frames": frames, "size": size}
    return _film(lambda path: animate_system(system, run, path, **options), kind)


def _page(write: Callable[[Path], Path]) -> Page:
    with tempfile.TemporaryDirectory() as folder:
        return Page(write(Path(folder) / "page.html").read_text(encoding="utf-8"))


def _film(write: Callable[[Path], Path], kind: str) -> Film:
    refuse_unknown(kind, FILMS, "animate: kind")
    with tempfile.TemporaryDirectory() as folder:
        return Film(write(Path(folder) / f"film.{kind}").read_bytes(), kind)


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
