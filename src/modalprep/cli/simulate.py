"""The command that simulates a system."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from modalprep.cli.common import Json, Output, PipelineFile, Quiet, Report, Settings, app, end_with, print_json
from modalprep.report import summary

if TYPE_CHECKING:
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.drawn import Drawn
    from modalprep.pipeline.responses.strength import Strength
    from modalprep.pipeline.schema.load import Loaded
    from modalprep.pipeline.systems.systems import Simulated

Target = Annotated[Path | None, typer.Option("-o", help="Result file (.h5); the CSV file is written beside it.")]
Animate = Annotated[
    Path | None, typer.Option("--animate", help="Also write an animation of the moving system (.gif, .webp or .mp4).")
]
Colour = Annotated[
    str | None, typer.Option("--colour", help="Of the animation: displacement, or a recovery such as skin.von_mises.")
]
Vtu = Annotated[
    Path | None, typer.Option("--vtu", help="Also write each flexible body as a time series for ParaView (.pvd).")
]
Reference = Annotated[
    bool, typer.Option("--reference", help="Use the reference implementation with a full mass matrix (slow).")
]


@app.command()
def simulate(
    file: PipelineFile,
    target: Target = None,
    output: Output = None,
    settings: Settings = None,
    geometric_stiffness: Annotated[bool, typer.Option(help="Use the bodies' geometric stiffness.")] = True,
    reference: Reference = False,
    animate: Animate = None,
    colour: Colour = None,
    vtu: Vtu = None,
    report: Report = True,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Simulate the system of a pipeline file with the order-n solver.

    The last line is the verdict: PASS, PASS WITH WARNINGS, or FAIL with exit code 1, where an audit of the run fails, a
    margin is negative or a damage is 1 or more.
    """
    from modalprep.pipeline.batch.settings import with_settings
    from modalprep.pipeline.building.sources import needed_files, output_folder, refuse_overwriting
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.drawn import plot_runs
    from modalprep.pipeline.outcome import Outcome
    from modalprep.pipeline.pages import page_of_run
    from modalprep.pipeline.systems.systems import simulate_pipeline

    _refuse_options(animate, colour, vtu)
    source, output = with_settings(file, settings or [], output)
    reporter = Reporter(quiet=as_json or quiet)
    if animate:
        refuse_overwriting([animate], [*needed_files(source), *([target] if target else [])])
    how = {"geometric_stiffness": geometric_stiffness, "reference": reference}
    done = simulate_pipeline(source, output, reporter, target=target, **how)
    folder = target.parent if target else output_folder(source.path, output)
    plots = plot_runs(source, done, folder, reporter)
    strength = _strength(source, done, folder, reporter)
    drawn = replace(_film(source, done, folder, (animate, colour), reporter), plots=plots)
    if vtu:
        _series(done, vtu, reporter)
    outcome = Outcome(folder, source.pipeline, simulated=done, run_drawn=drawn, strength=strength)
    if report:
        page_of_run(source, outcome, reporter)
    if as_json:
        print_json(summary.simulation(outcome, reporter))
    else:
        reporter.say(f"outputs are in {outcome.folder}")
    end_with(outcome.verdict, reporter, source.path)


def _refuse_options(animate: Path | None, colour: str | None, vtu: Path | None) -> None:
    """Refuse a film or a series that cannot be written, before the run."""
    from modalprep.errors import InputError

    if colour is not None and not animate:
        raise InputError(f"--colour {colour} is that of an animation; add --animate with a file")
    if vtu:
        from modalprep.formats.vtu import check_series

        check_series(vtu)
    if animate:
        from modalprep.report.pictures.animation import check_target

        check_target(animate)


def _film(
    source: Loaded, done: Simulated, folder: Path, wanted: tuple[Path | None, str | None], reporter: Reporter
) -> Drawn:
    """Draw the film that the options or the file ask for."""
    from modalprep.pipeline.drawn import Drawn, film_run
    from modalprep.pipeline.film import draw_film

    animate, colour = wanted
    if not animate:
        return film_run(source, done, folder, reporter)
    table = source.pipeline.film if colour is None else source.pipeline.film.model_copy(update={"colour": colour})
    return Drawn(film=reporter.wrote(draw_film(table, done.system, done.main, animate)))


def _strength(source: Loaded, done: Simulated, folder: Path, reporter: Reporter) -> Strength | None:
    """Compute shock spectra and damage of the run; those of responses are left to the command run."""
    from modalprep.pipeline.run import strength_of

    tables = {**source.pipeline.srs, **source.pipeline.fatigue}
    left = [name for name, table in tables.items() if table.response is not None]
    if left:
        reporter.say(f"  note: {', '.join(left)}: of a response, which modalprep run computes")
    return strength_of(source, (), done, folder, reporter)


def _series(done: Simulated, target: Path, reporter: Reporter) -> None:
    """Write the flexible bodies of a run as time series, each in a file of its name if there are several."""
    from modalprep.formats.vtu import write_vtu_series

    run = done.main
    bodies = {name: body for name, body in done.system.bodies.items() if body.n and body.cells}
    for name, body in bodies.items():
        file = target if len(bodies) == 1 else target.with_name(f"{target.stem}-{name}{target.suffix}")
        reporter.wrote(write_vtu_series(body, run, file, name=name))
