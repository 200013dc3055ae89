"""Command line: every command imports what it needs when it runs, so that ``--help`` is instant."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from modalprep.formats.export import EXPORTS
from modalprep.report import summary

INTERRUPTED = 130  # exit code of a program ended by SIGINT

app = typer.Typer(
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Finite-element meshes to flexible bodies for multibody dynamics, and their simulation.",
)

Output = Annotated[Path | None, typer.Option("--output", help="Folder for outputs; default 'output' beside the file.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")]
PipelineFile = Annotated[Path, typer.Argument(help="Pipeline file (TOML).")]
ModalFile = Annotated[Path, typer.Argument(help="Modal file (HDF5).")]


def _version(wanted: bool) -> None:
    if wanted:
        from modalprep import __version__

        print(f"modalprep {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print it.")] = False,
) -> None: ...


@app.command()
def run(file: PipelineFile, output: Output = None, as_json: Json = False) -> None:
    """Mesh to modal file, report and pictures; then analysis and simulation, if the file has them."""
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.run import run_pipeline

    reporter = Reporter(quiet=as_json)
    outcome = run_pipeline(file, output, reporter)
    if as_json:
        _print_json(summary.outcome(outcome, reporter))
    else:
        reporter.say(f"outputs are in {outcome.folder}")


@app.command()
def batch(
    files: Annotated[list[str], typer.Argument(help="Pipeline files or patterns, such as 'pipelines/*.toml'.")],
    jobs: Annotated[int | None, typer.Option("-j", "--jobs", help="Processes of this machine; default 1.")] = None,
    output: Output = None,
    cache: Annotated[Path | None, typer.Option("--cache", help="Its folder; default .cache in the outputs.")] = None,
    cache_size: Annotated[float, typer.Option("--cache-size", help="What it may hold, GiB.")] = 5.0,
    no_cache: Annotated[bool, typer.Option("--no-cache", help="Compute everything.")] = False,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", help="Dask scheduler to use instead, such as tcp://host:8786.")
    ] = None,
    listing: Annotated[bool, typer.Option("--list", help="Print the jobs and run none.")] = False,
    as_json: Json = False,
) -> None:
    """Many pipeline files, or every combination of a file's [grid]; finished jobs are not run again.

    One job that fails is reported and the rest go on; the exit code is then 1.
    """
    from modalprep.errors import InputError
    from modalprep.pipeline.batch import list_batch, plan_batch, run_batch
    from modalprep.pipeline.console import Reporter

    if jobs is not None and (jobs < 1 or scheduler):
        raise InputError(f"-j {jobs}: give the number of processes, at least 1, and leave it out with --scheduler")
    if not cache_size > 0:
        raise InputError(f"--cache-size {cache_size:g} must be positive; --no-cache does without")
    if no_cache and cache:
        raise InputError("--no-cache and --cache contradict each other; give one of them")
    reporter, planned = Reporter(quiet=as_json), plan_batch(files, output)
    if listing:
        done = list_batch(planned, reporter)
    else:
        folder = None if no_cache else cache or planned.folder / ".cache"
        limit = cache_size * 2**30
        done = run_batch(planned, reporter, jobs=jobs or 1, scheduler=scheduler, cache=folder, limit=limit)
    if as_json:
        _print_json(done)
    if not listing and done["failed"]:
        raise typer.Exit(1)


@app.command()
def modes(
    file: Annotated[Path, typer.Argument(help="Pipeline file (TOML) or modal file (HDF5).")],
    output: Output = None,
    as_json: Json = False,
) -> None:
    """Mode-selection report: a table here, and an HTML page beside the modal file."""
    from modalprep.pipeline.build import build_body, output_folder
    from modalprep.pipeline.console import Reporter
    from modalprep.report.page import write_page
    from modalprep.report.tables import body_summary, mode_table

    reporter = Reporter(quiet=as_json)
    if file.suffix == ".toml":
        built = build_body(file, output_folder(file, output), reporter)
        body, checks, notes, page = (
            built.body,
            built.checks,
            list(built.notes),
            built.file.with_suffix(".html"),
        )
    else:
        from modalprep.body.checks import check_body
        from modalprep.formats.modalfile import read_body

        body, notes = read_body(file), []
        checks, page = check_body(body), (output or file.parent) / f"{file.stem}.html"
    body_summary(body, reporter.console)
    mode_table(body.modes, reporter.console)
    for note in notes:
        reporter.say(f"  note: {note}")
    write_page(body, page, checks=checks, notes=notes)
    reporter.wrote(page)
    if as_json:
        _print_json({"modes": summary.mode_rows(body.modes), "frequency": body.frequency.tolist(), "page": str(page)})


@app.command()
def render(
    file: ModalFile,
    mode: Annotated[int, typer.Option("--mode", help="Mode, counted from 1; 0 draws the mesh.")] = 1,
    target: Annotated[Path | None, typer.Option("-o", help="Picture (.png), or .gif, .mp4 with --animate.")] = None,
    animate: Annotated[bool, typer.Option("--animate", help="Draw an animation (.gif, .mp4).")] = False,
    sheet: Annotated[bool, typer.Option("--sheet", help="Draw all modes in one picture.")] = False,
    colour: Annotated[
        str, typer.Option("--colour", help="By displacement, or by strain energy: energy.")
    ] = "displacement",
) -> None:
    """Off-screen picture or animation of a mode shape, coloured by displacement or strain energy."""
    from modalprep.errors import InputError
    from modalprep.formats.modalfile import read_body
    from modalprep.pipeline.console import Reporter
    from modalprep.report.animation import animate_mode
    from modalprep.report.render import render_mesh, render_mode
    from modalprep.report.sheet import contact_sheet

    if sheet and animate:
        raise InputError("--sheet and --animate ask for two files; give one of them")
    body = read_body(file)
    default = f"{file.stem}-modes.png" if sheet else f"{file.stem}-mode-{mode:02d}{'.gif' if animate else '.png'}"
    target = target or Path(default)
    if sheet:
        contact_sheet(body, target, colour=colour)
    elif animate:
        animate_mode(body, mode, target, colour=colour)
    elif mode == 0:
        render_mesh(body, target)
    else:
        render_mode(body, mode, target, colour=colour)
    Reporter().wrote(target)


@app.command()
def simulate(
    file: PipelineFile,
    target: Annotated[Path | None, typer.Option("-o", help="Result file (.h5); the CSV file goes beside it.")] = None,
    output: Output = None,
    geometric_stiffness: Annotated[bool, typer.Option(help="Use the bodies' geometric stiffness.")] = True,
    dense: Annotated[bool, typer.Option("--dense", help="Use the dense twin of the order-n solver (slow).")] = False,
    animate: Annotated[
        Path | None, typer.Option("--animate", help="Film of the moving system to write (.gif, .mp4).")
    ] = None,
    as_json: Json = False,
) -> None:
    """Simulate the system of a pipeline file with the order-n solver."""
    from modalprep.pipeline.build import output_folder
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.load import load_pipeline
    from modalprep.pipeline.run import plot_runs
    from modalprep.pipeline.systems import simulate_pipeline

    if animate:
        from modalprep.report.animation import check_target

        check_target(animate)
    reporter = Reporter(quiet=as_json)
    done = simulate_pipeline(
        file, output, reporter, target=target, geometric_stiffness=geometric_stiffness, dense=dense
    )
    folder = target.parent if target else output_folder(file, output)
    plot_runs(file, load_pipeline(file), done, folder, reporter)
    if animate:
        from modalprep.report.system_animation import animate_system

        reporter.wrote(animate_system(done.system, next(iter(done.runs.values())), animate))
    if as_json:
        _print_json({"runs": summary.runs(done), "files": [str(f) for f in reporter.files]})
    else:
        reporter.say(f"outputs are in {folder}")


@app.command()
def analyse(file: PipelineFile, output: Output = None, as_json: Json = False) -> None:
    """Rest, modes, linear equations, frequency response and hinge forces: the [analysis] of a pipeline file."""
    from modalprep.pipeline.analysis import analyse_pipeline
    from modalprep.pipeline.console import Reporter

    reporter = Reporter(quiet=as_json)
    found = analyse_pipeline(file, output, reporter)
    if as_json:
        _print_json(found.summary() | {"files": [str(f) for f in reporter.files]})


@app.command()
def check(
    file: Annotated[Path, typer.Argument(help="Modal file (HDF5), or pipeline file (TOML): against its mesh as well.")],
    as_json: Json = False,
) -> None:
    """Physics checks of a modal file or of a pipeline's body; exit code 1 when one fails."""
    from modalprep.pipeline.check import check_file
    from modalprep.pipeline.console import Reporter
    from modalprep.report.tables import check_table

    reporter = Reporter(quiet=as_json)
    report = check_file(file, reporter)
    check_table(report, reporter.console)
    if as_json:
        _print_json(report.summary())
    if not report.passed:
        raise typer.Exit(1)


@app.command()
def export(
    file: ModalFile,
    to: Annotated[str, typer.Option("--to", help=f"Format: {', '.join(EXPORTS)}.")],
    target: Annotated[Path | None, typer.Option("-o", help="File to write; default beside the modal file.")] = None,
    dialect: Annotated[str | None, typer.Option("--dialect", help="Of sid: fembs (default), pysid, fembeam.")] = None,
    version: Annotated[str | None, typer.Option("--version", help="Of mbdyn: full (default), classic.")] = None,
    as_json: Json = False,
) -> None:
    """Modal file to a format of another program."""
    from modalprep.formats.export import export_body, known_export
    from modalprep.formats.modalfile import read_body
    from modalprep.pipeline.console import Reporter

    reporter = Reporter(quiet=as_json)
    target = target or file.with_suffix(known_export(to).suffix)
    reporter.wrote(export_body(read_body(file), to, target, dialect=dialect, version=version))
    if as_json:
        _print_json({"files": [str(f) for f in reporter.files]})


@app.command()
def mesh(
    name: Annotated[str | None, typer.Argument(help="Shape, such as plate; --list shows all.")] = None,
    param: Annotated[
        list[str] | None, typer.Option("--param", "-p", help="NAME=VALUE in SI units; repeat for more.")
    ] = None,
    target: Annotated[Path | None, typer.Option("-o", help="Mesh file (.msh); default NAME.msh.")] = None,
    shapes: Annotated[bool, typer.Option("--list", help="Print the shapes, their parameters and groups.")] = False,
    as_json: Json = False,
) -> None:
    """Mesh of a parametric shape, with named groups."""
    from modalprep.errors import InputError
    from modalprep.fe.generate import make_mesh
    from modalprep.pipeline.console import Reporter

    reporter = Reporter(quiet=as_json)
    if shapes:
        from modalprep.fe.generate import GENERATORS
        from modalprep.report.tables import shapes_table

        shapes_table(GENERATORS.values(), reporter.console)
        if as_json:
            _print_json(summary.shapes(GENERATORS.values()))
        return
    if name is None:
        raise InputError("no shape given; write modalprep mesh NAME, with a name that modalprep mesh --list shows")
    target = target or Path(f"{name.replace('_', '-')}.msh")
    made = make_mesh(name, target, **_parameters(param or []))
    reporter.wrote(target)
    groups = {group: {kind: len(rows) for kind, rows in kinds.items()} for group, kinds in made.groups.items()}
    cells = {kind: len(rows) for kind, rows in made.cells.items()}
    if as_json:
        _print_json({"file": str(target), "points": len(made.points), "cells": cells, "groups": groups})
    for label, counts in {f"{len(made.points)} points": cells, **groups}.items():
        reporter.say(f"  {label}: {', '.join(f'{count} {kind}' for kind, count in counts.items())}")


@app.command()
def quality(
    file: Annotated[Path, typer.Argument(help="Mesh file, or pipeline file (TOML) that names one.")],
    picture: Annotated[Path | None, typer.Option("--picture", help="Picture (.png) with the flaws marked.")] = None,
    length_unit: Annotated[str, typer.Option("--length-unit", help="Of a mesh file: m, mm, cm, in, ft.")] = "m",
    as_json: Json = False,
) -> None:
    """Mesh quality: statistics and flaws; exit code 1 when one is an error."""
    from modalprep.pipeline.console import Reporter
    from modalprep.report.tables import quality_table

    reporter = Reporter(quiet=as_json)
    mesh, found = _mesh_quality(file, length_unit)
    quality_table(found, reporter.console)
    if picture:
        from modalprep.report.mesh_picture import render_findings

        reporter.wrote(render_findings(mesh.points, mesh.cells, found.findings, picture, name=mesh.source))
    if as_json:
        _print_json(summary.quality(mesh, found) | {"files": [str(f) for f in reporter.files]})
    if found.errors:
        raise typer.Exit(1)


@app.command()
def warmup() -> None:
    """Compile the solver for all kinds of systems, once after an installation: a few minutes."""
    from modalprep.examples import small_systems
    from modalprep.jit import when_compiling
    from modalprep.multibody.simulate import simulate as integrate
    from modalprep.pipeline.console import Reporter

    reporter = Reporter()
    for name, system in small_systems().items():
        with when_compiling(lambda name=name: reporter.say(f"compiling for {name} ..."), "modalprep.multibody"):
            integrate(system, t_end=1e-3)
    reporter.say("the solver is compiled")


@app.command()
def schema() -> None:
    """Print the JSON schema of pipeline files: every key with its meaning."""
    from modalprep.pipeline.schema import Pipeline

    _print_json(Pipeline.model_json_schema())


def _parameters(given: Sequence[str]) -> dict[str, str]:
    """Split the NAME=VALUE of --param."""
    from modalprep.errors import InputError

    found: dict[str, str] = {}
    for text in given:
        name, equals, value = (part.strip() for part in text.partition("="))
        name = name.replace("-", "_")
        if not (name and equals and value):
            raise InputError(f"--param {text!r} is not NAME=VALUE, such as length=2")
        if name in found:
            raise InputError(f"--param {name} is given twice, as {found[name]} and {value}; keep one")
        found[name] = value
    return found


def _mesh_quality(file: Path, length_unit: str) -> tuple[Any, Any]:
    """Read and check a mesh; a pipeline file also says its units, its structural groups and its interfaces."""
    if file.suffix == ".toml":
        from modalprep.pipeline.model import pipeline_quality

        return pipeline_quality(file)
    from modalprep.fe.quality import check_mesh
    from modalprep.fe.read import read_mesh

    mesh = read_mesh(file, length_unit, "kg")
    return mesh, check_mesh(mesh, mesh.properties or None)


def _print_json(data: dict[str, Any]) -> None:
    print(json.dumps(data, indent=1))


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit code: 0 done, 1 the work failed, 2 bad input."""
    from modalprep.errors import ModalprepError

    try:
        code = app(args=list(sys.argv[1:] if argv is None else argv), prog_name="modalprep", standalone_mode=False)
        if code == INTERRUPTED:  # click's own way of saying it
            raise KeyboardInterrupt
        return int(code or 0)
    except ModalprepError as error:
        print(f"modalprep: {' '.join(str(error).split())}", file=sys.stderr)
        return error.exit_code
    except typer.Exit as error:
        return error.exit_code
    except (typer.Abort, KeyboardInterrupt):
        print("modalprep: interrupted", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        if hasattr(error, "format_message"):  # a wrong option or argument
            print(f"modalprep: {error.format_message()}; see modalprep --help", file=sys.stderr)
            return 2
        raise


def entry() -> None:
    """Console script."""
    sys.exit(main())
