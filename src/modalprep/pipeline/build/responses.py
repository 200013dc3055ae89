"""[response] of a pipeline file: the responses of its body, their files and their plots."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from modalprep.atomic import write_table
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.formats.responsefile import write_response
from modalprep.pipeline.build.build import stand_in
from modalprep.pipeline.build.reduce import target_damping
from modalprep.pipeline.build.sources import refuse_overwriting, source_files
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.response import HarmonicTable, RandomTable, SweepTable, TransientTable
from modalprep.pipeline.schema.response import Response as ResponseTable
from modalprep.report.responses import peak_table, response_plot
from modalprep.response.harmonic import harmonic_response
from modalprep.response.modal import BASE, input_names
from modalprep.response.random import correlation_factor, find_band, random_response
from modalprep.response.result import Response
from modalprep.response.sweep import sweep_response
from modalprep.response.transient import transient_response
from modalprep.suggest import suggestion


@dataclass(frozen=True)
class Responded:
    """A response of a pipeline file, with its name and its plot."""

    name: str
    response: Response
    plot: Path


def refuse_responses(pipeline: Pipeline, path: Path) -> None:
    """Refuse inputs and channels that cannot be there, before the body is built.

    Raises
    ------
    InputError
        Which names the table.
    """
    if not pipeline.response:
        return
    interfaces = stand_in(path).interface_name
    for name, table in pipeline.response.items():
        with naming(path), naming(f"[response.{name}]"):
            inputs, known = table.inputs(path.parent), input_names(interfaces)
            for wrong in (key for key in inputs if key not in known):
                raise InputError(f"there is no input {wrong!r}; {suggestion(wrong, known, 'there are')}")
            heads = [BASE, *interfaces, *pipeline.recovery]
            for wrong in (x for x in table.channels if x.split(".")[0] not in heads and pipeline.body is None):
                raise InputError(f"there is no channel {wrong!r}; {suggestion(wrong, heads, 'they begin with')}")
            if isinstance(table, RandomTable):
                correlation_factor(table.correlated(), len(inputs))
                find_band(inputs, table.band)


def respond(path: Path, pipeline: Pipeline, body: FlexibleBody, folder: Path, reporter: Reporter) -> list[Responded]:
    """Compute the responses of a pipeline file, write their curves, peaks and plots, and print their peaks.

    Raises
    ------
    InputError
        When one of them cannot be computed; the files of those before remain.
    """
    found = []
    for name, table in pipeline.response.items():
        stem = folder / f"{path.stem}-{name}"
        ends = ("response.h5", "response.csv", "peaks.csv", "response.png")
        file, curves, peaks, plot = (Path(f"{stem}-{end}") for end in ends)
        refuse_overwriting([file, curves, peaks, plot], source_files(path, pipeline))
        with naming(path), naming(f"[response.{name}]"):
            response = computed(table, body, path.parent)
        reporter.wrote(write_response(response, file))
        reporter.wrote(write_curves(response, curves))
        reporter.wrote(write_peaks(response, peaks))
        reporter.wrote(response_plot(response, plot))
        peak_table(name, response, reporter.console)
        found.append(Responded(name, response, plot))
    return found


def computed(table: ResponseTable, body: FlexibleBody, folder: Path) -> Response:
    """Return the response of a body that a table asks for; its files are relative to `folder`."""
    inputs = table.inputs(folder)
    options = {
        "damping": None if table.damping is None else target_damping(table.damping),
        "channels": table.channels,
    }
    if isinstance(table, HarmonicTable):
        return harmonic_response(body, inputs, table.axis, refine=table.refine, **options)
    if isinstance(table, SweepTable):
        options |= {"direction": table.direction, "samples": table.samples}
        return sweep_response(body, inputs, table.lowest, table.highest, table.speed, **options)
    if isinstance(table, TransientTable):
        return transient_response(body, inputs, step=table.step, duration=table.duration, **options)
    return random_response(body, inputs, correlation=table.correlated(), band=table.band, **options)


def write_curves(response: Response, path: Path) -> Path:
    """Write the curves as a CSV file: amplitudes and phases of harmonic ones, densities, or values."""
    columns = response.columns()
    return write_table(columns, zip(*columns.values(), strict=True), path)


def write_peaks(response: Response, path: Path) -> Path:
    """Write the peaks of all channels as a CSV file."""
    rows = [peak.row() for peak in response.peaks]
    return write_table(rows[0], (list(row.values()) for row in rows), path)
