"""Pictures, plots and films of a pipeline file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from modalprep.errors import RenderError
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import Loaded

if TYPE_CHECKING:
    from modalprep.pipeline.systems.systems import Simulated


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """The pictures of a stage.

    Attributes
    ----------
    mass_plot : Path or None
        The chart of effective masses.
    mesh : Path or None
    modes : {mode: Path}
        Counted from 1.
    plots : sequence of (title, Path)
    film : Path or None
    notes : tuple of str
        Why pictures are missing, and what files for other programs lack.
    """

    mass_plot: Path | None = None
    mesh: Path | None = None
    modes: Mapping[int, Path] = field(default_factory=dict)
    plots: Sequence[tuple[str, Path]] = ()
    film: Path | None = None
    notes: tuple[str, ...] = ()


def not_drawn(error: RenderError, reporter: Reporter) -> Drawn:
    """Report in one line why there is no picture."""
    note = f"pictures not drawn: {error}"
    reporter.say(f"  {note}")
    return Drawn(notes=(note,))


def draw_runs(source: Loaded, simulated: Simulated, folder: Path, reporter: Reporter) -> Drawn:
    """Draw the [[plots]] and the film that a pipeline file asks for."""
    plots = plot_runs(source, simulated, folder, reporter)
    return replace(film_run(source, simulated, folder, reporter), plots=plots)


def plot_runs(source: Loaded, simulated: Simulated, folder: Path, reporter: Reporter) -> list[tuple[str, Path]]:
    """Draw the [[plots]] of a pipeline file; return (title, file) of each."""
    plots = source.pipeline.plots
    if not plots:
        return []
    from modalprep.report.charts.plots import history_plot

    drawn = []
    for number, plot in enumerate(plots, start=1):
        suffix = "" if len(plots) == 1 else f"-{number}"
        target = folder / f"{source.path.stem}-history{suffix}.png"
        reference = [point.model_dump() for point in plot.reference]
        runs = simulated.runs
        if plot.relative_to is not None:
            runs = {label: run.relative_to(plot.relative_to) for label, run in runs.items()}
        history_plot(runs, plot.channels, target, title=plot.title, ylabel=plot.ylabel, reference=reference)
        drawn.append((plot.title or ", ".join(plot.channels), reporter.wrote(target)))
    return drawn


def film_run(source: Loaded, simulated: Simulated, folder: Path, reporter: Reporter) -> Drawn:
    """Draw the film that a pipeline file asks for, or report in one line why not."""
    kind = source.pipeline.output.film
    if kind == "none":
        return Drawn()
    from modalprep.pipeline.film import draw_film

    target = folder / f"{source.path.stem}.{kind}"
    try:
        return Drawn(film=reporter.wrote(draw_film(source.pipeline.film, simulated.system, simulated.main, target)))
    except RenderError as error:
        return not_drawn(error, reporter)
