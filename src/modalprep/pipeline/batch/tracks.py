"""Modes of the bodies of a grid, followed from case to case."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal, cast

from modalprep.atomic import write_table
from modalprep.correlation import body_modes, track_modes
from modalprep.correlation.mode_set import BOUNDARIES, ModeSet
from modalprep.correlation.study import Study
from modalprep.correlation.tracking import Indices
from modalprep.errors import InputError
from modalprep.formats.modalfile import read_body
from modalprep.pipeline.batch.batch import Batch
from modalprep.pipeline.batch.job import Cell, Job
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.suggest import refuse_unknown

POINTS = 3000  # points of the mesh at which shapes are compared, evenly chosen


def grids(batch: Batch, boundary: str) -> list[list[Job]]:
    """Return the jobs of each grid of a batch that makes bodies.

    Raises
    ------
    InputError
        When no file has a grid of bodies, or the boundary is unknown.
    """
    refuse_unknown(boundary, BOUNDARIES, "--track")
    found: dict[Path, list[Job]] = {}
    for job in batch.jobs:
        if job.cell is not None:
            found.setdefault(job.cell.file, []).append(job)
    if not found:
        raise InputError("--track follows modes over a [grid], and none of the files has one; leave it out")
    for file, jobs in found.items():
        if not _makes_body(jobs):
            raise InputError(f"--track follows modes of bodies, and {file} makes none; leave it out")
    return list(found.values())


def _makes_body(jobs: Sequence[Job]) -> bool:
    for job in jobs:
        with suppress(InputError):
            return load(job.file).pipeline.has_body
    return False


def write_tracks(jobs: Sequence[Job], boundary: str, reporter: Reporter) -> dict[str, Any]:
    """Track the modes of a grid; print a table, and write it as a CSV file and a chart beside the jobs.

    Raises
    ------
    InputError
        When no body of the grid can be read, or the grid changes the mesh.
    """
    from modalprep.report.correlation.tracks import track_plot, track_table

    grid = _cell(jobs[0])
    name = grid.file.stem
    folder = jobs[0].folder.parent
    study, missing = _study(name, jobs, boundary)
    reporter.notes(missing)
    track_table(study, reporter.console)
    rows = study.rows()
    table = [[_written(value) for value in row.values()] for row in rows]
    files = [
        reporter.wrote(write_table(rows[0], table, folder / f"{name}-modes.csv")),
        reporter.wrote(track_plot(study, folder / f"{name}-modes.png")),
    ]
    return {
        "grid": str(grid.file),
        "boundary": boundary,
        "modes": study.summary(),
        "notes": [*missing, *study.uncertainties()],
        "files": [str(file) for file in files],
    }


def _written(value: Any) -> float | str:
    return value if isinstance(value, int | float) and not isinstance(value, bool) else str(value)


def _cell(job: Job) -> Cell:
    """Return the combination of the grid that a job is."""
    if job.cell is None:
        raise InputError(f"--track: {job.name} is not of a grid")
    return job.cell


def _study(name: str, jobs: Sequence[Job], boundary: str) -> tuple[Study, list[str]]:
    keys = _cell(jobs[0]).keys
    order = [_order([_cell(job).values[k] for job in jobs]) for k in range(len(keys))]
    modes: dict[Indices, ModeSet] = {}
    missing = []
    for job in jobs:
        place = tuple(levels.index(value) for levels, value in zip(order, _cell(job).values, strict=True))
        try:
            modes[place] = _modes(job, boundary)
        except InputError as error:
            missing.append(f"{job.name} is left out: {error}")
    if not modes:
        raise InputError(f"--track: no case of {name} has a body; {missing[0]}")
    tracks = track_modes(modes)
    return Study(name=name, parameters=keys, levels=tuple(map(tuple, order)), modes=modes, tracks=tracks), missing


def _order(values: Sequence[Any]) -> list[Any]:
    """Return the different values: numbers by size, so that neighbours are neighbours, others as in the file."""
    found = [value for k, value in enumerate(values) if value not in values[:k]]
    numbers = all(isinstance(value, int | float) for value in found)
    return sorted(found) if numbers else found


def _modes(job: Job, boundary: str) -> ModeSet:
    found = body_modes(
        read_body(job.folder / f"{job.name}.h5"), cast(Literal["clamped", "free"], boundary)
    )  # no others
    some = slice(None, None, -(-len(found.points) // POINTS))
    return found.with_(name=job.name, points=found.points[some], shape=found.shape[some], labels=found.labels[some])
