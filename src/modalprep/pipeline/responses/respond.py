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
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.responses.response import HarmonicTable, Limited, RandomTable, SweepTable, TransientTable
from modalprep.pipeline.schema.responses.response import Response as ResponseTable
from modalprep.pipeline.schema.responses.strength import NotchTable
from modalprep.report.responses import peak_table, response_plot
from modalprep.report.strength import notch_plot, notch_table
from modalprep.response.harmonic import harmonic_response
from modalprep.response.inputs import History, Spectrum
from modalprep.response.limits import NotchedInput
from modalprep.response.modal import BASE, Damping, input_names
from modalprep.response.random import correlation_factor, find_band, random_response
from modalprep.response.result import Response
from modalprep.response.sweep import sweep_response
from modalprep.response.transient import transient_response
from modalprep.suggest import suggestion

ROWS = 10_000  # of a CSV file


@dataclass(frozen=True)
class Responded:
    """A response of a pipeline file, with its name, its plot, its notched input and the plot of that."""

    name: str
    response: Response
    plot: Path
    cut: NotchedInput | None = None
    notch_plot: Path | None = None

    @property
    def notes(self) -> list[str]:
        """Notes on the validity of the response."""
        return [f"response {self.name}: {note}" for note in self.response.notes]


def refuse_responses(source: Loaded) -> None:
    """Refuse inputs and channels that the body cannot have, before it is built.

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
            if pipeline.body is None:  # a supplied body may have recoveries of its own
                _refuse_channels(_named_channels(name, table, pipeline), [BASE, *interfaces, *pipeline.recovery])
            if isinstance(table, RandomTable):
                correlation_factor(table.correlated(), len(inputs))
                find_band(table.inputs(source.folder), table.band)


def _named_channels(name: str, table: ResponseTable, pipeline: Pipeline) -> list[str]:
    """Return the channels of a response that its table, its limits, and [srs] and [fatigue] name."""
    users = [user for user in (*pipeline.srs.values(), *pipeline.fatigue.values()) if user.response == name]
    used = [channel for user in users for channel in user.channels]
    return [*table.channels, *used, *(row.channel for row in _notches(table))]


def _refuse_channels(channels: list[str], heads: list[str]) -> None:
    for channel in channels:
        if channel.split(".")[0] not in heads:
            raise InputError(f"there is no channel {channel!r}; {suggestion(channel, heads, 'they begin with')}")


def _notches(table: ResponseTable) -> list[NotchTable]:
    return table.notch if isinstance(table, Limited) else []


def respond(source: Loaded, body: FlexibleBody, folder: Path, reporter: Reporter) -> list[Responded]:
    """Compute the responses of a pipeline file, write their curves, peaks and plots, and print their peaks.

    Raises
    ------
    InputError
        When one of them cannot be computed; the files of those before remain.
    """
    path = source.path
    responses = []
    for name, table in source.pipeline.response.items():
        stem = folder / f"{path.stem}-{name}"
        ends = ("response.h5", "response.csv", "peaks.csv", "response.png")
        file, curves, peaks, plot = (Path(f"{stem}-{end}") for end in ends)
        others = [Path(f"{stem}-notched.{end}") for end in ("csv", "png")] if _notches(table) else []
        refuse_overwriting([file, curves, peaks, plot, *others], source_files(source))
        with naming(path), naming(f"[response.{name}]"):
            response, notched = computed(table, body, source.folder)
        reporter.wrote(write_response(response, file))
        reporter.wrote(write_curves(response, curves))
        if sampling(response) > 1:
            reporter.say(f"  (with one of {sampling(response)} samples; all {len(response.axis)} are in {file.name})")
        reporter.wrote(write_peaks(response, peaks))
        reporter.wrote(response_plot(response, plot))
        peak_table(name, response, reporter.console)
        notch_picture = report_notches(name, notched, stem, _unit(response.inputs[0]), reporter) if notched else None
        responses.append(Responded(name, response, plot, notched, notch_picture))
    return responses


def report_notches(name: str, notched: NotchedInput, stem: Path, unit: str, reporter: Reporter) -> Path:
    """Write the notched input as a CSV file and its plot, and print the notches; return the plot."""
    columns = {
        "frequency (Hz)": notched.frequency,
        "given": notched.given,
        "notched": notched.notched,
        "depth (dB)": notched.depth,
    }
    reporter.wrote(write_columns(columns, Path(f"{stem}-notched.csv")))
    notch_table(name, notched, reporter.console)
    return reporter.wrote(notch_plot(notched, Path(f"{stem}-notched.png"), unit))


def _unit(name: str) -> str:
    place, _, direction = name.rpartition(".")
    return (("m/s²", "rad/s²") if place == BASE else ("N", "N m"))[direction.startswith("r")]


def computed(table: ResponseTable, body: FlexibleBody, folder: Path) -> tuple[Response, NotchedInput | None]:
    """Return the response of a body to the inputs of a table, and its notched input; files are relative to `folder`."""
    response, notched = _computed(table, body, folder)
    damping = _damping(table)
    notes = () if damping is None else implausible_ratios(damping)
    return response.with_(notes=(*response.notes, *notes)), notched


def _computed(table: ResponseTable, body: FlexibleBody, folder: Path) -> tuple[Response, NotchedInput | None]:
    if isinstance(table, TransientTable):
        return _transient(table, table.inputs(folder), body), None
    if isinstance(table, SweepTable):
        return _sweep(table, table.inputs(folder), body), None
    inputs = table.inputs(folder)
    response = _steady_state(table, inputs, body)
    if not table.notch:
        return response, None
    notched = notched_input(table, response, body, folder)
    response = _steady_state(table, lowered(inputs, notched), body, notched.frequency)
    notes = (*too_shallow(notched), *response.notes, *excess(table, response, body, folder, inputs, notched))
    return response.with_(notes=notes), notched


def _transient(table: TransientTable, inputs: dict[str, History], body: FlexibleBody) -> Response:
    return transient_response(
        body, inputs, step=table.step, duration=table.duration, damping=_damping(table), channels=table.channels
    )


def _sweep(table: SweepTable, inputs: dict[str, Spectrum], body: FlexibleBody) -> Response:
    return sweep_response(
        body,
        inputs,
        table.lowest,
        table.highest,
        table.speed,
        direction=table.direction,
        samples=table.samples,
        damping=_damping(table),
        channels=table.channels,
    )


def _steady_state(
    table: HarmonicTable | RandomTable,
    inputs: dict[str, Spectrum],
    body: FlexibleBody,
    frequency: np.ndarray | None = None,
) -> Response:
    """Return the response; a harmonic one at these frequencies alone (Hz), by default at those of the table."""
    damping = _damping(table)
    channels = with_limited(table.channels, table.notch)
    if isinstance(table, RandomTable):
        correlation = table.correlated()
        return random_response(
            body, inputs, correlation=correlation, band=table.band, damping=damping, channels=channels
        )
    axis = table.axis if frequency is None else frequency
    refine = table.refine and frequency is None
    return harmonic_response(body, inputs, axis, refine=refine, damping=damping, channels=channels)


def _damping(table: ResponseTable) -> Damping:
    return None if table.damping is None else target_damping(table.damping)


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
