"""[response] of a pipeline file: the responses of its body, their files and their plots."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from modalprep.atomic import write_columns, write_table
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.formats.responsefile import write_response
from modalprep.pipeline.building.build import stand_in
from modalprep.pipeline.building.reduce import implausible_ratios, target_damping
from modalprep.pipeline.building.sources import refuse_overwriting, source_files
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.responses.notches import excess, lowered, notched_input, too_shallow, with_limited
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.schema.responses.response import HarmonicTable, Limited, RandomTable, SweepTable, TransientTable
from modalprep.pipeline.schema.responses.response import Response as ResponseTable
from modalprep.report.responses import peak_table, response_plot
from modalprep.report.strength import notch_plot, notch_table
from modalprep.response.harmonic import harmonic_response
from modalprep.response.inputs import Spectrum
from modalprep.response.limits import NotchedInput
from modalprep.response.modal import BASE, input_names
from modalprep.response.random import correlation_factor, find_band, random_response
from modalprep.response.result import Response
from modalprep.response.sweep import sweep_response
from modalprep.response.transient import transient_response
from modalprep.suggest import suggestion

ROWS = 10_000  # of a CSV file


@dataclass(frozen=True)
class Responded:
    """A response of a pipeline file, with its name, its plot, and what notches left of its inputs."""

    name: str
    response: Response
    plot: Path
    cut: NotchedInput | None = None
    notch_plot: Path | None = None

    @property
    def notes(self) -> list[str]:
        """What the user should know of it."""
        return [f"response {self.name}: {note}" for note in self.response.notes]


def refuse_responses(source: Loaded) -> None:
    """Refuse inputs and channels that cannot be there, before the body is built.

    Raises
    ------
    InputError
        Which names the table.
    """
    pipeline = source.pipeline
    interfaces = stand_in(source).interface_name
    for name, table in pipeline.response.items():
        with naming(source.path), naming(f"[response.{name}]"):
            inputs = table.inputs(source.folder)
            known = input_names(interfaces)
            for wrong in (key for key in inputs if key not in known):
                raise InputError(f"there is no input {wrong!r}; {suggestion(wrong, known, 'there are')}")
            heads = [BASE, *interfaces, *pipeline.recovery]
            used = [
                x
                for each in (*pipeline.srs.values(), *pipeline.fatigue.values())
                if each.response == name
                for x in each.channels
            ]
            named = [*table.channels, *used, *(each.channel for each in getattr(table, "notch", []))]
            for wrong in (x for x in named if x.split(".")[0] not in heads and pipeline.body is None):
                raise InputError(f"there is no channel {wrong!r}; {suggestion(wrong, heads, 'they begin with')}")
            if isinstance(table, RandomTable):
                correlation_factor(table.correlated(), len(inputs))
                find_band(inputs, table.band)


def respond(source: Loaded, body: FlexibleBody, folder: Path, reporter: Reporter) -> list[Responded]:
    """Compute the responses of a pipeline file, write their curves, peaks and plots, and print their peaks.

    Raises
    ------
    InputError
        When one of them cannot be computed; the files of those before remain.
    """
    path = source.path
    found = []
    for name, table in source.pipeline.response.items():
        stem = folder / f"{path.stem}-{name}"
        ends = ("response.h5", "response.csv", "peaks.csv", "response.png")
        file, curves, peaks, plot = (Path(f"{stem}-{end}") for end in ends)
        others = [Path(f"{stem}-notched.{end}") for end in ("csv", "png")] if getattr(table, "notch", []) else []
        refuse_overwriting([file, curves, peaks, plot, *others], source_files(source))
        with naming(path), naming(f"[response.{name}]"):
            response, cut = computed(table, body, source.folder)
        reporter.wrote(write_response(response, file))
        reporter.wrote(write_curves(response, curves))
        if sampling(response) > 1:
            reporter.say(f"  (with one of {sampling(response)} samples; all {len(response.axis)} are in {file.name})")
        reporter.wrote(write_peaks(response, peaks))
        reporter.wrote(response_plot(response, plot))
        peak_table(name, response, reporter.console)
        picture = None if cut is None else report_notches(name, cut, stem, _unit(response.inputs[0]), reporter)
        found.append(Responded(name, response, plot, cut, picture))
    return found


def report_notches(name: str, cut: NotchedInput, stem: Path, unit: str, reporter: Reporter) -> Path:
    """Write the notched input as a CSV file and its plot, and print the notches; return the plot."""
    columns = {"frequency (Hz)": cut.frequency, "given": cut.given, "notched": cut.notched, "depth (dB)": cut.depth}
    reporter.wrote(write_columns(columns, Path(f"{stem}-notched.csv")))
    notch_table(name, cut, reporter.console)
    return reporter.wrote(notch_plot(cut, Path(f"{stem}-notched.png"), unit))


def _unit(name: str) -> str:
    place, _, direction = name.rpartition(".")
    return (("m/s²", "rad/s²") if place == BASE else ("N", "N m"))[direction.startswith("r")]


def computed(table: ResponseTable, body: FlexibleBody, folder: Path) -> tuple[Response, NotchedInput | None]:
    """Return the response of a body that a table asks for, and its notches; its files are relative to `folder`."""
    inputs = table.inputs(folder)
    response = _driven_by(inputs, table, body, table.axis if isinstance(table, HarmonicTable) else None)
    said = () if table.damping is None else implausible_ratios(target_damping(table.damping))
    response = response.with_(notes=(*response.notes, *said))
    if not isinstance(table, Limited) or not table.notch:
        return response, None
    cut = notched_input(table, response, body, folder)
    found = _driven_by(lowered(inputs, cut), table.model_copy(update={"refine": False}), body, cut.frequency)
    notes = (*too_shallow(cut), *found.notes, *excess(table, found, body, folder, inputs, cut))
    return found.with_(notes=notes), cut


def _driven_by(
    inputs: dict[str, Spectrum], table: ResponseTable, body: FlexibleBody, axis: np.ndarray | None
) -> Response:
    options = {
        "damping": None if table.damping is None else target_damping(table.damping),
        "channels": with_limited(table.channels, getattr(table, "notch", [])),
    }
    if isinstance(table, HarmonicTable):
        return harmonic_response(body, inputs, axis, refine=table.refine, **options)
    if isinstance(table, SweepTable):
        options |= {"direction": table.direction, "samples": table.samples}
        return sweep_response(body, inputs, table.lowest, table.highest, table.speed, **options)
    if isinstance(table, TransientTable):
        return transient_response(body, inputs, step=table.step, duration=table.duration, **options)
    return random_response(body, inputs, correlation=table.correlated(), band=table.band, **options)


def write_curves(response: Response, path: Path) -> Path:
    """Write the curves as a CSV file: amplitudes and phases of harmonic ones, densities, or values.

    Of a long transient every second, third, ... sample is written, so that there are at most `ROWS`.
    """
    each = sampling(response)
    columns = {name: values[::each] for name, values in response.columns().items()}
    return write_columns(columns, path)


def sampling(response: Response) -> int:
    """Return of how many samples one is written to the CSV file."""
    return -(-len(response.axis) // ROWS) if response.kind == "transient" else 1


def write_peaks(response: Response, path: Path) -> Path:
    """Write the peaks of all channels as a CSV file."""
    rows = [peak.row() for peak in response.peaks]
    return write_table(rows[0], (list(row.values()) for row in rows), path)
