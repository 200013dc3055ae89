"""Plots and film of the runs of a pipeline file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from modalprep.errors import RenderError
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.loaded import Loaded

if TYPE_CHECKING:
    from modalprep.pipeline.systems.systems import Simulated


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


def film_run(source: Loaded, simulated: Simulated, folder: Path, reporter: Reporter, notes: list[str]) -> Path | None:
    """Draw the film that a pipeline file asks for, and return it; or report in one line why not."""
    pipeline = source.pipeline
    if pipeline.output.film == "none":
        return None
    from modalprep.pipeline.film import draw_film
    from modalprep.pipeline.pictures import not_drawn

    try:
        target = folder / f"{source.path.stem}.{pipeline.output.film}"
        return reporter.wrote(draw_film(pipeline.film, simulated.system, next(iter(simulated.runs.values())), target))
    except RenderError as error:
        not_drawn(error, notes, reporter)
        return None
