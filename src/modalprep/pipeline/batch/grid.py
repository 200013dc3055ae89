"""The jobs of a batch: pipeline files, and one for every combination of a file's [grid]."""

from __future__ import annotations

import copy
import glob
import itertools
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w
from pydantic import ValidationError

from modalprep.atomic import write_text
from modalprep.errors import InputError
from modalprep.pipeline.batch.job import Cell, Job
from modalprep.pipeline.building.sources import mark_source, refuse_shared, relative, source_files
from modalprep.pipeline.schema.base import first_message, named_files
from modalprep.pipeline.schema.load import Loaded, read_toml
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.robot import with_robot

LONGEST = 40  # characters of a value in a folder name
MOST = 100_000  # combinations


class Needs(NamedTuple):
    """What is known of a job before it runs.

    Attributes
    ----------
    modes : int
        That it asks for; 0 where its file is not valid.
    pipelines, files : tuple of Path
        Complete paths of the pipelines of its bodies, and of the other files that it names.
    """

    modes: int = 0
    pipelines: tuple[Path, ...] = ()
    files: tuple[Path, ...] = ()


Planned = list[tuple[Job, Needs]]


def find_jobs(patterns: Sequence[str], output: Path | None) -> list[Job]:
    """Return the jobs of pipeline files and patterns such as ``pipelines/*.toml``; write the files of grids.

    Raises
    ------
    InputError
        When nothing fits a pattern, a grid cannot be read, or two jobs would share a folder.
    """
    return [job for job, _ in plan_jobs(patterns, output)]


def plan_jobs(patterns: Sequence[str], output: Path | None) -> Planned:
    """Return the jobs as `find_jobs` does, and what each of them needs.

    Raises
    ------
    InputError
        When nothing fits a pattern, a grid cannot be read, or two jobs would share a folder.
    """
    files = dict.fromkeys(path for pattern in patterns for path in _matches(pattern))
    found = [row for file in files for row in _jobs(file, output)]
    homes: dict[Path, Job] = {}
    for job, _ in found:
        other = homes.setdefault(job.folder.resolve(), job)
        if other is not job:
            raise InputError(f"{other.file} and {job.file} would both write into {job.folder}; rename one")
        if job.cell is None:
            refuse_shared(job.folder, job.file)
    return found


def _matches(pattern: str) -> list[Path]:
    if Path(pattern).is_dir():
        raise InputError(f"{pattern} is a folder; name the pipeline files in it, such as '{Path(pattern) / '*.toml'}'")
    if Path(pattern).is_file():
        return [Path(pattern)]
    found = [path for path in sorted(map(Path, glob.glob(pattern, recursive=True))) if path.is_file()]
    if not found:
        raise InputError(f"no pipeline file matches {pattern!r}")
    return found


def _jobs(file: Path, output: Path | None) -> Planned:
    """Return the job of a file, or those of its grid; a file that cannot be read becomes a job that fails."""
    try:
        data = read_toml(file)[1]
    except InputError:
        return [(Job(file, output), Needs())]
    if "grid" not in data:
        return [(Job(file, output), _needs(file, validated(data, file.parent)[0]))]
    return grid_jobs(file, data, output or file.parent / "output")


def _needs(file: Path, pipeline: Pipeline | None) -> Needs:
    """Return what a job with the tables of a file needs."""
    if pipeline is None:
        return Needs()
    source = Loaded(file, pipeline)
    named = source.body_files, source_files(source)
    return Needs(pipeline.reduction.modes, *(tuple(path.resolve() for path in paths) for paths in named))


def grid_jobs(file: Path, data: dict[str, Any], output: Path) -> Planned:
    """Write a pipeline file for every combination of a grid into its output folder; return the jobs.

    Raises
    ------
    InputError
        When the grid is no table of lists, or none of its combinations is a valid pipeline file.
    """
    base = {key: value for key, value in data.items() if key != "grid"}
    grid = _checked(file, data["grid"])
    # equal needs are kept once
    jobs = list(_cells(file, grid, output))
    known = dict[Needs, Needs]()

    def tables(job: Job) -> dict[str, Any]:
        return combined(file, base, dict(zip(grid, job.cell.values if job.cell else (), strict=True)), "[grid]")

    problems = (validated(tables(job), file.parent)[1] for job in jobs)  # up to the first valid combination
    if (problem := next(problems)) and all(problems):
        raise InputError(f"{file}: no combination of its [grid] is a pipeline file: {problem}")
    for job in jobs:
        refuse_shared(job.folder, file)
    head = f"# A combination of the grid of {file.name}."
    found = (_needs(file, write_copy(file, job, tables(job), head)) for job in jobs)
    return [(job, known.setdefault(needs, needs)) for job, needs in zip(jobs, found, strict=True)]


def _cells(file: Path, grid: dict[str, list], output: Path) -> Iterator[Job]:
    """Yield the job of each combination."""
    short = tuple(_short(key, grid) for key in grid)
    labels = [_labels(values) for values in grid.values()]
    for values, texts in zip(itertools.product(*grid.values()), itertools.product(*labels), strict=True):
        name = "-".join([file.stem, *(f"{key}={text}" for key, text in zip(short, texts, strict=True))])
        shown = dict(zip(grid, texts, strict=True))
        yield Job(output / name / f"{name}.toml", output, shown, Cell(file, short, values))


def _checked(file: Path, grid: Any) -> dict[str, list]:
    """Refuse anything but a table of lists; keys contain dots and need quotes in TOML."""
    if not isinstance(grid, dict) or not grid:
        raise InputError(f'{file}: [grid] is empty; write for example "reduction.modes" = [10, 20]')
    for key, values in grid.items():
        if isinstance(values, dict):
            raise InputError(f'{file}: [grid]: write the key {key}... in quotes, such as "reduction.modes" = [10, 20]')
        if not isinstance(values, list) or not values:
            raise InputError(f"{file}: [grid]: {key!r} needs a list of values, such as [10, 20]")
        if len({repr(value) for value in values}) < len(values):
            raise InputError(f"{file}: [grid]: {key!r} lists a value twice; keep one")
    count = math.prod(map(len, grid.values()))
    if count > MOST:
        raise InputError(f"{file}: [grid] has {count} combinations, more than {MOST}; give fewer values")
    return grid


def combined(file: Path, base: dict[str, Any], chosen: dict[str, Any], source: str) -> dict[str, Any]:
    """Put chosen values into a copy of the base; a body keeps the name of the base.

    Raises
    ------
    InputError
        When a key passes through what is no table; the message names the `source` of the values.
    """
    data = copy.deepcopy(base)
    if "mesh" in data or "matrices" in data:
        data.setdefault("name", file.stem)
    for key, value in chosen.items():
        *tables, last = key.split(".")
        inner = data
        for table in tables:
            inner = inner.setdefault(table, {})
            if not isinstance(inner, dict):
                raise InputError(f"{file}: {source}: {key!r} passes through {table!r}, which is not a table")
        inner[last] = copy.deepcopy(value)
    return data


def validated(data: dict[str, Any], folder: Path) -> tuple[Pipeline | None, str]:
    """Return what the tables of a file in a folder describe, or None and why they are no pipeline file."""
    try:
        return Pipeline.model_validate(with_robot(data, folder)), ""
    except ValidationError as error:
        where = ".".join(str(part) for part in error.errors()[0]["loc"])
        return None, f"{where}: {first_message(error)}".removeprefix(": ")
    except InputError as error:  # in a robot file
        return None, str(error)


def _labels(values: Iterable[Any]) -> list[str]:
    """Return a short, unique text of each value for a folder name."""
    texts = [re.sub(r"[^\w.+-]+", "_", str(value)).strip("_.")[:LONGEST] or "_" for value in values]
    if len({text.lower() for text in texts}) < len(texts):
        texts = [f"{text}_{number}" for number, text in enumerate(texts, start=1)]
    return texts


def _short(key: str, grid: Iterable[str]) -> str:
    """Return the last part of a key where it is unique in the grid."""
    last = key.rpartition(".")[2]
    unique = sum(other.rpartition(".")[2] == last for other in grid) == 1
    return re.sub(r"[^\w.+-]+", "_", last if unique else key)


def _moved(data: dict[str, Any], pipeline: Pipeline | None, old: Path, new: Path) -> dict[str, Any]:
    """Name the files that tables name relative to a folder from a new one; those of no valid pipeline are left."""
    for keys, name in named_files(pipeline or {}):
        inner: Any = data
        for key in keys[:-1]:
            inner = inner[key]
        inner[keys[-1]] = str(name) if Path(name).is_absolute() else relative(old / name, new)
    return data


def write_copy(file: Path, job: Job, data: dict[str, Any], head: str) -> Pipeline | None:
    """Write tables, made of those of a file, as the file of a job unless it is there; return what they describe."""
    pipeline, _ = validated(data, file.parent)
    mark_source(job.folder, file)
    text = f"{head}\n{tomli_w.dumps(_moved(data, pipeline, file.parent, job.folder))}"
    if not job.file.is_file() or job.file.read_text(encoding="utf-8") != text:
        write_text(text, job.file)
    return pipeline
