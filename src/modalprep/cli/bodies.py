"""Commands on modal bodies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from modalprep.cli.common import Json, ModalFile, Output, Pdf, Settings, app, end_with, print_json
from modalprep.formats.export import EXPORTS
from modalprep.report import summary
from modalprep.suggest import refuse_missing

if TYPE_CHECKING:
    from modalprep.body.checks import CheckReport
    from modalprep.body.flexible_body import FlexibleBody
    from modalprep.pipeline.console import Reporter
    from modalprep.report.page import BodyPage

MODES = "-modes.html"  # ends the names of the pages of `modes`, so that the full report of `run` stays as it is
OF_SYSTEMS = "fmu, urdf, mjcf, exudyn, mbdyn"


@app.command()
def modes(
    file: Annotated[Path, typer.Argument(help="Pipeline file (TOML) or modal file (HDF5).")],
    output: Output = None,
    settings: Settings = None,
    pdf: Pdf = False,
    as_json: Json = False,
) -> None:
    """Print the mode-selection table of a body, and write its report.

    The report is the HTML page NAME-modes.html beside the modal file; the page of modalprep run stays as it is.
    """
    from modalprep.errors import InputError
    from modalprep.pipeline.building.sources import claiming
    from modalprep.pipeline.console import Reporter
    from modalprep.report.body_page.printing import find_browser, print_page
    from modalprep.report.page import write_page
    from modalprep.report.tables import body_summary, mode_table

    reporter = Reporter(quiet=as_json)
    browser = find_browser() if pdf else None
    if file.suffix == ".toml":
        shown, page, file = _built(file, settings or [], output, reporter)
        claimed = {}
    else:
        if settings:
            raise InputError(f"--set changes a pipeline file, and {file} is none; leave it out")
        page = (output or file.parent) / f"{file.stem}{MODES}"
        shown = _read(file, [page, *([page.with_suffix(".pdf")] if pdf else [])])
        claimed = {page: file} if output else {}
    body = shown.body
    body_summary(body, reporter.console)
    mode_table(body.modes, reporter.console)
    reporter.notes(body.notes)
    with claiming(claimed):
        write_page(shown, page)
    reporter.wrote(page)
    if browser:
        reporter.wrote(print_page(page, browser))
    if as_json:
        found = {"modes": summary.mode_rows(body.modes), "frequency_Hz": body.frequency.tolist()}
        found |= {"mode_names": list(body.mode_names), "page": str(page), "verdict": shown.judgement.summary()}
        print_json(found)
    end_with(shown.judgement, reporter, file)


def _built(file: Path, settings: list[str], output: Path | None, reporter: Reporter) -> tuple[BodyPage, Path, Path]:
    """Build the body of a pipeline file; return its page, where that is written, and the pipeline file."""
    from modalprep.pipeline.batch.settings import with_settings
    from modalprep.pipeline.building.build import build_body
    from modalprep.pipeline.building.described import body_inputs
    from modalprep.pipeline.building.sources import output_folder, refuse_shared_folders
    from modalprep.report.page import BodyPage

    source, output = with_settings(file, settings, output)
    refuse_shared_folders(source, output)
    built = build_body(source, output_folder(source.path, output), reporter)
    body, inputs = built.body, body_inputs(source, built)
    shown = BodyPage(body, checks=built.checks, notes=body.notes, errors=built.error_curves, inputs=inputs)
    return shown, built.file.with_name(f"{built.file.stem}{MODES}"), source.path


def _read(file: Path, written: list[Path]) -> BodyPage:
    """Return the page of a modal file, which none of the files to write may replace."""
    from modalprep.body.checks import check_body
    from modalprep.formats.modalfile import read_body
    from modalprep.pipeline.building.sources import refuse_overwriting
    from modalprep.report.page import BodyPage

    refuse_overwriting(written, [file])
    body = read_body(file)
    return BodyPage(body, checks=check_body(body), notes=body.notes)


@app.command()
def render(
    file: ModalFile,
    mode: Annotated[
        int, typer.Option("--mode", help="Number of the mode, counted from 1; 0 draws the undeformed mesh.")
    ] = 1,
    target: Annotated[
        Path | None, typer.Option("-o", help="File to write: a .png, or with --animate a .gif or .mp4.")
    ] = None,
    animate: Annotated[bool, typer.Option("--animate", help="Draw an animation (.gif, .mp4).")] = False,
    sheet: Annotated[bool, typer.Option("--sheet", help="Draw all modes in one picture.")] = False,
    colour: Annotated[
        str, typer.Option("--colour", help="Colour by displacement or by energy (density of strain energy).")
    ] = "displacement",
    edges: Annotated[bool, typer.Option("--edges", help="Draw the elements in a picture of a mode too.")] = False,
) -> None:
    """Draw or animate a mode shape; no display is needed.

    The colour shows the displacement or the density of strain energy.
    """
    from modalprep.errors import InputError
    from modalprep.formats.modalfile import read_body
    from modalprep.pipeline.building.sources import claiming, refuse_overwriting
    from modalprep.pipeline.console import Reporter
    from modalprep.report.pictures.animation import animate_mode
    from modalprep.report.pictures.render import render_mesh, render_mode
    from modalprep.report.pictures.sheet import contact_sheet

    if sheet and animate:
        raise InputError("--sheet and --animate exclude each other; give one of them")
    if edges and (sheet or animate):
        raise InputError("--edges is for a picture of one mode; leave it out with --sheet and --animate")
    default = f"{file.stem}-modes.png" if sheet else f"{file.stem}-mode-{mode:02d}{'.gif' if animate else '.png'}"
    own = {} if target else {Path(default): file}
    target = target or Path(default)
    refuse_overwriting([target], [file])
    body = read_body(file)
    with claiming(own):
        if sheet:
            contact_sheet(body, target, colour=colour)
        elif animate:
            animate_mode(body, mode, target, colour=colour)
        elif mode == 0:
            render_mesh(body, target)
        else:
            render_mode(body, mode, target, colour=colour, edges=edges)
    Reporter().wrote(target)


@app.command()
def check(
    file: Annotated[
        Path,
        typer.Argument(help="Modal file (HDF5), or pipeline file (TOML), whose body is compared with its mesh too."),
    ],
    energy: Annotated[
        bool,
        typer.Option(
            "--energy", help="Also compare the geometric stiffness with finite differences of the nonlinear energy."
        ),
    ] = False,
    speed: Annotated[
        float | None,
        typer.Option(
            "--speed", help="Speed of rotation (rad/s) at which the error by rebuilt terms is estimated.", min=0.0
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Check a modal body; exit code 1 when a check fails.

    The body is that of a modal file or of a pipeline file.
    """
    from modalprep.pipeline.building.check import check_file
    from modalprep.pipeline.console import Reporter

    reporter = Reporter(quiet=as_json)
    _show(check_file(file, reporter, energy, speed), reporter, as_json)


@app.command()
def export(
    file: Annotated[Path, typer.Argument(help="Modal file (HDF5), or the pipeline file (TOML) of a system.")],
    to: Annotated[str, typer.Option("--to", help=f"Format: {', '.join(EXPORTS)}; of systems: {OF_SYSTEMS}.")],
    target: Annotated[
        Path | None, typer.Option("-o", help="File to write; the default is beside the modal file.")
    ] = None,
    dialect: Annotated[
        str | None, typer.Option("--dialect", help="Dialect of sid: fembs (default), pysid, embs or fembeam.")
    ] = None,
    version: Annotated[
        str | None, typer.Option("--version", help="Version of mbdyn: full (default) or classic.")
    ] = None,
    point: Annotated[
        str | None,
        typer.Option(
            "--point", help="Of coupling: the reference point x,y,z in m, in the body's frame; default the root."
        ),
    ] = None,
    sensors: Annotated[
        int | None,
        typer.Option(
            "--sensors", help="With uff: a synthetic test by this many sensors, chosen by effective independence."
        ),
    ] = None,
    noise: Annotated[
        float, typer.Option("--noise", help="Of the synthetic test: standard deviation over the largest displacement.")
    ] = 0.0,
    fmi: Annotated[str | None, typer.Option("--fmi", help="Version of FMI of fmu: 2 (default) or 3.")] = None,
    kind: Annotated[
        str | None,
        typer.Option("--kind", help="Kind of fmu: me (model exchange), cs (co-simulation) or both (default)."),
    ] = None,
    platform: Annotated[
        list[str] | None,
        typer.Option(
            "--platform",
            help="With fmu: linux-x86_64, linux-aarch64, windows-x86_64 or macos-arm64; repeat. Default: this machine.",
        ),
    ] = None,
    step: Annotated[
        float | None, typer.Option("--step", help="With fmu: a fixed step of co-simulation in s, for real time.")
    ] = None,
    output: Output = None,
    as_json: Json = False,
) -> None:
    """Write a body or a system for another program, or as an FMU."""
    from modalprep.pipeline.exporting import SYSTEM_EXPORTS

    of_bodies = {"dialect": dialect, "version": version, "point": point, "sensors": sensors, "noise": noise or None}
    if to == "fmu":
        _refuse_given(to, **of_bodies)
        options = {"fmi": fmi or "2", "kind": kind or "both", "platforms": platform or (), "step": step}
        _export_fmu(file, target, options, output, as_json)
        return
    _refuse_given(to, fmi=fmi, kind=kind, platform=platform, step=step)
    if to in ("urdf", "mjcf") or (file.suffix == ".toml" and to in SYSTEM_EXPORTS):
        _refuse_given(to, **of_bodies)
        _export_system(file, to, target, output, as_json)
        return
    _refuse_given(to, output=output)
    _export_body(file, to, target, of_bodies, as_json)


def _export_body(file: Path, to: str, target: Path | None, options: dict[str, Any], as_json: bool) -> None:
    """Write the body of a modal file for another program, or a synthetic test of it."""
    from modalprep.formats.export import export_body, known_export, lost_in
    from modalprep.formats.modalfile import read_body
    from modalprep.pipeline.building.sources import claiming, refuse_overwriting
    from modalprep.pipeline.console import Reporter

    reporter = Reporter(quiet=as_json)
    refuse_missing(file, "modal file")
    beside = file.with_suffix(known_export(to).suffix)
    own = {} if target else {beside: file}
    target = target or beside
    refuse_overwriting([target], [file])
    body = read_body(file)
    sensors, noise = options.pop("sensors"), options.pop("noise")
    with claiming(own):
        if sensors is None and noise is None:
            reporter.wrote(export_body(body, to, target, **options))
            notes = lost_in(body, to)
        else:
            notes = _synthetic(body, to, sensors, noise or 0.0, target, reporter)
    _tell(notes, reporter, as_json)


def _refuse_given(to: str, **options: object) -> None:
    """Refuse options of other formats."""
    from modalprep.errors import InputError

    for name, value in options.items():
        if value is not None:
            raise InputError(f"format {to!r} has no {name}; leave --{name} out")


def _export_fmu(file: Path, target: Path | None, options: dict[str, Any], output: Path | None, as_json: bool) -> None:
    """Write the system of a pipeline file as an FMU."""
    from modalprep.errors import InputError
    from modalprep.pipeline.building.sources import claiming
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.fmu import fmu_of_pipeline

    if file.suffix != ".toml":
        raise InputError(f"an FMU is of a system: give its pipeline file (TOML), not {file}")
    reporter = Reporter(quiet=as_json)
    beside = file.with_suffix(".fmu")
    with claiming({} if target else {beside: file}):
        model = fmu_of_pipeline(file, output, reporter, target=target or beside, **options)
    if as_json:
        said = {"method": model.method, "variables": len(model.variables)}
        print_json({"files": [str(f) for f in reporter.files], "notes": list(model.notes), **said})


def _export_system(file: Path, to: str, target: Path | None, output: Path | None, as_json: bool) -> None:
    """Write the system of a pipeline file for another program."""
    from modalprep.pipeline.building.sources import claiming
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.exporting import SYSTEM_EXPORTS, export_system

    reporter = Reporter(quiet=as_json)
    beside = file.with_suffix(SYSTEM_EXPORTS[to].suffix)
    with claiming({} if target else {beside: file}):
        notes = export_system(file, to, output, reporter, target=target)
    _tell(notes, reporter, as_json)


def _synthetic(
    body: FlexibleBody, to: str, sensors: int | None, noise: float, target: Path, reporter: Reporter
) -> list[str]:
    """Write a synthetic test; return its sensors as notes."""
    from modalprep.correlation import body_modes, choose_sensors, synthetic_test, write_test_modes
    from modalprep.errors import InputError

    if to != "uff" or sensors is None:
        raise InputError("--sensors and --noise make a synthetic test with --to uff; give --sensors with it")
    if not 0 <= noise < float("inf"):
        raise InputError(f"--noise {noise:g} must not be negative")
    modes = body_modes(body)
    test = synthetic_test(modes, choose_sensors(modes, sensors), noise=noise)
    reporter.wrote(write_test_modes(test, target))
    chosen = (
        f"{label} {''.join(axis for axis, on in zip('xyz', own, strict=True) if on)}"
        for label, own in zip(test.labels, test.measured.tolist(), strict=True)
    )
    return [f"sensors (node of the file, numbered from 1, and direction): {', '.join(chosen)}"]


@app.command("import")
def import_file(
    file: Annotated[Path, typer.Argument(help="File of another program, or of modalprep export, with a body.")],
    target: Annotated[
        Path | None, typer.Option("-o", help="Modal file to write; the default is beside the file.")
    ] = None,
    root: Annotated[
        str | None, typer.Option("--root", help="Interface that becomes the root, as reroot moves the frame.")
    ] = None,
    length_unit: Annotated[
        str, typer.Option("--length-unit", help="Unit of the file's lengths: m, mm, cm, in, ft.")
    ] = "m",
    mass_unit: Annotated[
        str | None,
        typer.Option("--mass-unit", help="Unit of the file's masses, with seconds: kg, g, t, lbm, slug, slinch."),
    ] = None,
    interface: Annotated[
        list[str] | None,
        typer.Option("--interface", help="Interface that the file does not name, with its nodes: NAME=1,2,3; repeat."),
    ] = None,
    nodes: Annotated[
        Path | None, typer.Option("--nodes", help="File with the places of the nodes of a substructure: deck, .csv.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Read a body of another program, and write its modal file."""
    from modalprep.formats.bodies.read import import_body
    from modalprep.formats.modalfile import write_body
    from modalprep.pipeline.building.sources import claiming, refuse_overwriting
    from modalprep.pipeline.console import Reporter
    from modalprep.report.tables import body_summary

    reporter = Reporter(quiet=as_json)
    own = {} if target else {file.with_suffix(".h5"): file}
    target = target or file.with_suffix(".h5")
    refuse_overwriting([target], [file, *([] if nodes is None else [nodes])])
    chosen = dict(map(_named_nodes, interface or ()))
    body = import_body(file, root=root, length_unit=length_unit, mass_unit=mass_unit, interfaces=chosen, nodes=nodes)
    with claiming(own):
        reporter.wrote(write_body(body, target))
    body_summary(body, reporter.console)
    _tell(body.notes, reporter, as_json)


def _named_nodes(text: str) -> tuple[str, list[int]]:
    """Return name and nodes of ``NAME=1,2,3``."""
    from modalprep.errors import InputError

    name, _, nodes = text.partition("=")
    try:
        return name, [int(node) for node in nodes.split(",")]
    except ValueError:
        raise InputError(f"--interface {text}: give a name and the numbers of its nodes, as root=1,2,3") from None


@app.command()
def diff(
    first: ModalFile,
    second: ModalFile,
    tolerance: Annotated[
        float, typer.Option("--tolerance", help="Largest relative difference that is accepted.", min=0.0)
    ] = 1e-6,
    as_json: Json = False,
) -> None:
    """Compare two modal files; exit code 1 when they differ.

    They are compared as physical systems: the signs, the order and the basis of the modes do not matter.
    """
    from modalprep.body.checks import CheckReport
    from modalprep.body.difference import compare_bodies
    from modalprep.formats.modalfile import read_body
    from modalprep.pipeline.console import Reporter

    found = compare_bodies(read_body(first), read_body(second), tolerance)
    report = CheckReport(subject=f"{first} against {second}", checks=tuple(found))
    _show(report, Reporter(quiet=as_json), as_json)


def _tell(notes: Sequence[str], reporter: Reporter, as_json: bool) -> None:
    """Print notes, and as JSON the files written with them."""
    reporter.notes(notes)
    if as_json:
        print_json({"files": [str(f) for f in reporter.files], "notes": list(notes)})


def _show(report: CheckReport, reporter: Reporter, as_json: bool) -> None:
    """Print a report of checks; exit code 1 when one failed."""
    from modalprep.report.check_tables import check_table

    check_table(report, reporter.console)
    if as_json:
        print_json(report.summary())
    if not report.passed:
        raise typer.Exit(1)
