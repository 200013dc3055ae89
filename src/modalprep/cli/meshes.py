"""Commands on meshes, and the schema of pipeline files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from modalprep.cli.common import Json, app, print_json
from modalprep.report import summary

if TYPE_CHECKING:
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.schema.load import Loaded


@app.command()
def mesh(
    name: Annotated[
        str | None, typer.Argument(help="Name of the shape, such as plate; --list shows all of them.")
    ] = None,
    param: Annotated[
        list[str] | None, typer.Option("--param", "-p", help="NAME=VALUE in SI units; may be repeated.")
    ] = None,
    target: Annotated[
        Path | None, typer.Option("-o", help="Mesh file to write (.msh); the default is NAME.msh.")
    ] = None,
    shapes: Annotated[bool, typer.Option("--list", help="Print all shapes with their parameters and groups.")] = False,
    as_json: Json = False,
) -> None:
    """Make the mesh of a parametric shape, with named groups."""
    from modalprep.errors import InputError
    from modalprep.fe.generation.generate import make_mesh
    from modalprep.pipeline.console import Reporter

    reporter = Reporter(quiet=as_json)
    if shapes:
        from modalprep.fe.generation.generate import GENERATORS
        from modalprep.report.tables import shapes_table

        shapes_table(GENERATORS.values(), reporter.console)
        if as_json:
            print_json(summary.shapes(GENERATORS.values()))
        return
    if name is None:
        raise InputError("no shape given; write modalprep mesh NAME with a name from modalprep mesh --list")
    target = target or Path(f"{name.replace('_', '-')}.msh")
    made = make_mesh(name, target, **_parameters(param or []))
    reporter.wrote(target)
    groups = {group: {kind: len(rows) for kind, rows in kinds.items()} for group, kinds in made.groups.items()}
    cells = {kind: len(rows) for kind, rows in made.cells.items()}
    if as_json:
        print_json({"file": str(target), "points": len(made.points), "cells": cells, "groups": groups})
    for label, counts in {f"{len(made.points)} points": cells, **groups}.items():
        reporter.say(f"  {label}: {', '.join(f'{count} {kind}' for kind, count in counts.items())}")


@app.command()
def quality(
    file: Annotated[Path, typer.Argument(help="Mesh file, or pipeline file (TOML) that names one.")],
    picture: Annotated[
        Path | None, typer.Option("--picture", help="Also write a picture (.png) in which the flaws are marked.")
    ] = None,
    length_unit: Annotated[
        str, typer.Option("--length-unit", help="Length unit of a mesh file: m, mm, cm, in or ft.")
    ] = "m",
    as_json: Json = False,
) -> None:
    """Print the quality of a mesh; exit code 1 when it has an error.

    The output has the statistics of each type of cell, and a line for each flaw.
    """
    from modalprep.pipeline.console import Reporter
    from modalprep.report.check_tables import quality_table

    reporter = Reporter(quiet=as_json)
    source = None
    if file.suffix == ".toml":
        from modalprep.pipeline.schema.load import load

        source = load(file)
    if picture:
        from modalprep.pipeline.building.sources import needed_files, refuse_overwriting

        refuse_overwriting([picture], needed_files(source) if source else [file])
    mesh, found = _mesh_quality(source or file, length_unit)
    quality_table(found, reporter.console)
    for note in mesh.notes:
        reporter.say(f"note: {note}")
    if picture:
        from modalprep.report.pictures.mesh_picture import render_findings

        reporter.wrote(render_findings(mesh.points, mesh.cells, found.findings, picture, name=mesh.source))
    if as_json:
        print_json(summary.quality(mesh, found) | {"files": [str(f) for f in reporter.files]})
    if found.errors:
        raise typer.Exit(1)


@app.command()
def init(
    file: Annotated[Path, typer.Argument(help="Mesh, deck or CAD file of a part.")],
    target: Annotated[
        Path | None, typer.Option("-o", help="Pipeline file to write; the default is the file's name with .toml here.")
    ] = None,
    material: Annotated[
        str | None,
        typer.Option("--material", help="Name, such as aluminium, or E,nu,rho in SI units, where the file has none."),
    ] = None,
    size: Annotated[
        float | None, typer.Option("--size", help="Edge of an element of a CAD part, in its unit of length.")
    ] = None,
    length_unit: Annotated[
        str | None, typer.Option("--length-unit", help="Length unit: m, mm, cm, in or ft; guessed without.")
    ] = None,
    mass_unit: Annotated[
        str | None, typer.Option("--mass-unit", help="Mass unit of the materials of a deck, such as t with mm.")
    ] = None,
    dialect: Annotated[
        str | None, typer.Option("--dialect", help="Of an .inp deck that does not tell itself: abaqus or calculix.")
    ] = None,
    subcase: Annotated[
        int | None,
        typer.Option("--subcase", help="Subcase or step of a deck whose supports, loads, modes and damping are taken."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there already.")] = False,
    as_json: Json = False,
) -> None:
    """Write a first pipeline file for a part.

    The part is a mesh, a deck or a CAD file, whose groups, sets, openings and plane faces are listed, or a body that
    another program has reduced. A second file is a system in which the part swings as a pendulum.
    """
    from modalprep.fe.readers.abaqus.dialect import dialect_of
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.init.reduced import is_reduced
    from modalprep.pipeline.init.write import init_pipeline, rows
    from modalprep.pipeline.init.write import summary as found_in
    from modalprep.report.check_tables import survey_table

    reporter = Reporter(quiet=as_json)
    units = {"length_unit": length_unit, "mass_unit": mass_unit}
    if is_reduced(file):
        given = {"--material": material, "--size": size, "--dialect": dialect, "--subcase": subcase}
        _refuse_mesh_options(file, given)
        _init_reduced(file, target, units, force, reporter, as_json)
        return
    found, written = init_pipeline(
        file,
        target,
        material=material,
        size=size,
        dialect=dialect_of(dialect),
        subcase=subcase,
        force=force,
        **units,
    )
    survey_table(*rows(found), reporter.console)
    reporter.notes(found.notes)
    for path in written:
        reporter.wrote(path)
    if as_json:
        print_json(found_in(found) | {"files": [str(f) for f in reporter.files]})
    _say_next(written, reporter)


def _init_reduced(
    file: Path, target: Path | None, units: dict[str, str | None], force: bool, reporter: Reporter, as_json: bool
) -> None:
    from modalprep.pipeline.init.reduced import init_reduced
    from modalprep.report.tables import body_summary

    body, notes, written = init_reduced(file, target, force=force, **units)
    body_summary(body, reporter.console)
    for note in notes:
        reporter.say(f"  the file does not hold {note}")
    for path in written:
        reporter.wrote(path)
    if not written[1:]:
        reporter.say(f"  note: a hinge needs an interface at rest in the body's frame; choose a root in {written[0]}")
    if as_json:
        print_json({"interfaces": body.interface_name, "notes": notes, "files": [str(f) for f in reporter.files]})
    _say_next(written, reporter)


def _refuse_mesh_options(file: Path, given: dict[str, object]) -> None:
    from modalprep.errors import InputError

    for option, value in given.items():
        if value is not None:
            raise InputError(f"{option} is of meshes, and {file} holds a reduced body; leave it out")


def _say_next(written: Sequence[Path], reporter: Reporter) -> None:
    reporter.say(
        f"next: modalprep run {written[0]}, modalprep simulate {written[1]}" if written[1:] else "next: correct it"
    )


@app.command()
def schema(
    table: Annotated[
        str | None, typer.Argument(help="Table or key, such as reduction or joints.revolute; the default is a list.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the JSON schema instead of text.")] = False,
) -> None:
    """Describe the tables and keys of pipeline files.

    An editor that knows the JSON schema completes and checks pipeline files.
    """
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.schema.pipeline import Pipeline
    from modalprep.report.schema_tables import find_part, schema_list, schema_page

    whole = Pipeline.model_json_schema()
    if as_json:
        print_json(find_part(whole, table) if table else whole)
    elif table:
        schema_page(whole, table, Reporter().console)
    else:
        schema_list(whole, Reporter().console)


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


def _mesh_quality(file: Path | Loaded, length_unit: str) -> tuple[Any, Any]:
    """Read and check a mesh; a pipeline file also says its units, its structural groups and its interfaces."""
    if not isinstance(file, Path):
        from modalprep.pipeline.building.model import pipeline_quality

        return pipeline_quality(file)
    from modalprep.fe.quality.quality import check_mesh
    from modalprep.fe.readers.read import read_cells

    mesh = read_cells(file, length_unit)
    return mesh, check_mesh(mesh, mesh.properties or None)
