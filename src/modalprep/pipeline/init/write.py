"""From a file of a part to its first pipeline file and the file of a pendulum."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path

from modalprep.atomic import refuse_folder, refuse_unwritable, write_text
from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.abaqus.dialect import Dialect
from modalprep.pipeline.building.model import assemble_pipeline, whole_mesh
from modalprep.pipeline.building.sources import refuse_overwriting
from modalprep.pipeline.init.analysis import MOST_MODES
from modalprep.pipeline.init.case import idle_loads, modes_in_band
from modalprep.pipeline.init.interfaces import without
from modalprep.pipeline.init.materials import chosen_material
from modalprep.pipeline.init.pendulum import pendulum_text
from modalprep.pipeline.init.survey import Survey, survey
from modalprep.pipeline.init.text import pipeline_text
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.suggest import refuse_missing


def init_pipeline(
    file: Path,
    target: Path | None = None,
    *,
    material: str | None = None,
    size: float | None = None,
    length_unit: str | None = None,
    mass_unit: str | None = None,
    dialect: Dialect | None = None,
    subcase: int | None = None,
    force: bool = False,
) -> tuple[Survey, list[Path]]:
    """Write a pipeline file for a mesh, a deck or a CAD file, and beside it one of a pendulum.

    Parameters
    ----------
    file : Path
    target : Path, optional
        By default in the working folder, with the name of `file`.
    material : str, optional
        A name or ``E,nu,rho``, for parts whose file says none.
    size : float, optional
        Of the elements of a CAD file, in `length_unit`.
    length_unit, mass_unit : str, optional
        Guessed without.
    dialect : {"abaqus", "calculix"}, optional
        Of an .inp deck, where it does not tell itself.
    subcase : int, optional
        Subcase or step of a deck whose supports, loads, modes and damping are taken; else those of all.
    force : bool
        Whether files may be replaced.

    Returns
    -------
    What was found, and the files.

    Raises
    ------
    InputError
        When the file cannot be read, or one of the files to write is there already.
    """
    refuse_missing(file, "mesh file")
    target = target or Path(f"{file.stem}.toml")
    _refuse_present(_files(target), file, force)
    chosen = chosen_material(material)
    found = survey(file, length_unit, mass_unit, size, dialect, subcase)
    found, text, model = _that_assembles(found, target, chosen, material is not None)
    texts = [text] if model is None else [text, pendulum_text(found, target, model)]
    return found, written_files(file, target, texts, force)


def _that_assembles(
    survey: Survey, target: Path, material: tuple[str, tuple[float, float, float]], given: bool
) -> tuple[Survey, str, FEModel | None]:
    """Return the survey without the interfaces that the model refuses, the text and the model; None if it has none."""
    message = ""
    for _ in range(1 + len(survey.interfaces)):
        text = pipeline_text(survey, target, material, given)
        try:
            pipeline = Pipeline.model_validate(tomllib.loads(text))
            mesh = whole_mesh(pipeline, survey.mesh)
            model = assemble_pipeline(pipeline, mesh)
        except InputError as error:
            message = str(error)
        else:
            survey = _counted(_without_idle_loads(survey, mesh, model), model)
            return survey, pipeline_text(survey, target, material, given), model
        refused = re.match(r"interface '(.+?)': (.+)", message)
        if not refused or refused[1] not in {one.name for one in survey.active}:
            break
        survey = survey.with_(interfaces=without(survey.interfaces, refused[1], refused[2]))
    survey = survey.with_(notes=(*survey.notes, f"{target.name} does not run yet: {message}"))
    return survey, pipeline_text(survey, target, material, given), None


def _without_idle_loads(survey: Survey, mesh: Mesh, model: FEModel) -> Survey:
    """Return the survey without loads that need no truncation vector, and say why."""
    case = survey.case
    idle = idle_loads(model, mesh, case.loads) if case else {}
    if case is None or not idle:
        return survey
    kept = tuple(name for name in case.loads if name not in idle)
    return survey.with_(case=case.with_(loads=kept), notes=(*survey.notes, *idle.values()))


def _counted(survey: Survey, model: FEModel) -> Survey:
    """Return the survey with the number of modes in the band of a deck that gives a band alone."""
    case = survey.case
    if case is None or case.highest is None or 0 < (case.modes or 0) <= MOST_MODES:
        return survey
    return survey.with_(in_band=modes_in_band(model, case.highest))


def written_files(file: Path, target: Path, texts: Sequence[str], force: bool) -> list[Path]:
    """Write the pipeline file of a part and, where there is a second text, that of its pendulum.

    Raises
    ------
    InputError
        When one of them is there already and not to be replaced.
    """
    files = _files(target)[: len(texts)]
    _refuse_present(files, file, force)
    for path, text in zip(files, texts, strict=True):
        write_text(text, path)
    return files


def _files(target: Path) -> list[Path]:
    refuse_folder(target)
    return [target, target.with_name(f"{target.stem}-pendulum.toml")]


def _refuse_present(files: Sequence[Path], source: Path, force: bool) -> None:
    refuse_overwriting(files, [source])
    for path in files:
        refuse_unwritable(path)
        if path.exists() and not force:
            raise InputError(f"{path} is there already; give another name by -o, or --force to replace it")


def summary(survey: Survey) -> dict[str, object]:
    """Return what was found, for JSON."""
    mesh = survey.mesh
    return {
        "mesh": mesh.source,
        "length_unit": survey.read.length_unit,
        "size_m": survey.read.size,
        "cells": {kind: len(rows) for kind, rows in mesh.cells.items()},
        "structure": list(survey.structure) + list(mesh.properties),
        "openings": [
            {
                "hole": one.hole,
                "radius_m": one.cylinder.radius,
                "axis": one.cylinder.axis.tolist(),
                "centre_m": one.centre.tolist(),
                "nodes": len(one.nodes),
            }
            for one in survey.openings
        ],
        "interfaces": [one.name for one in survey.active],
        "further_interfaces": [one.name for one in survey.interfaces if one not in survey.active],
        "loads": list(survey.case.loads) if survey.case else [],
        "notes": list(survey.notes),
    }


def rows(survey: Survey) -> tuple[str, list[tuple[str, str, str, bool]]]:
    """Return the title and the rows of the table of what was found."""
    mesh, used = survey.mesh, survey.active
    cells = ", ".join(f"{len(conn)} {kind}" for kind, conn in mesh.cells.items())
    table = [("group", name, f"{_kind(mesh, name)}; a property of the deck", True) for name in mesh.properties]
    table += [("group", name, f"{_kind(mesh, name)}; needs a property", True) for name in survey.structure]
    if survey.supported:
        table += [
            ("supports", name, f"{len(held.nodes)} nodes that the deck holds", name == survey.supported)
            for name, held in mesh.supports.items()
        ]
    taken = survey.case.loads if survey.case else ()
    table += [("load", name, f"on {len(load.nodes)} nodes", name in taken) for name, load in mesh.loads.items()]
    table += [("interface", one.name, one.what, any(one is other for other in used)) for one in survey.interfaces]
    return f"{mesh.source}: {len(mesh.points)} nodes, {cells}; in {survey.read.length_unit} ({survey.read.why})", table


def _kind(mesh: Mesh, name: str) -> str:
    return ", ".join(f"{len(rows)} {kind}" for kind, rows in mesh.groups.get(name, {}).items())
