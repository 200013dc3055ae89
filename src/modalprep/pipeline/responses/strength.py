"""[srs] and [fatigue] of a pipeline file: of channels of its responses and of its run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from modalprep.atomic import write_columns, write_table
from modalprep.body.stress import VON_MISES
from modalprep.errors import InputError
from modalprep.multibody.results.result import Result
from modalprep.pipeline.building.sources import needed_files, refuse_overwriting
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.schema.responses.strength import FatigueTable, OfChannels, ShockTable
from modalprep.report.strength import fatigue_table, shock_plot
from modalprep.report.summary import SHOCK_UNITS
from modalprep.response.fatigue import Fatigue, rainflow_damage, random_damage
from modalprep.response.result import Response
from modalprep.response.shock import ShockSpectrum, shock_spectrum
from modalprep.suggest import matching, suggestion

SIGNLESS = "von Mises stress has no sign, so that some cycles count as two of half the range; take a component instead"
Histories = dict[str, np.ndarray]


@dataclass(frozen=True)
class Strength:
    """Shock spectra and damage by table and channel, the plots of the spectra, and notes."""

    shocks: dict[str, dict[str, ShockSpectrum]] = field(default_factory=dict)
    plots: dict[str, Path] = field(default_factory=dict)
    fatigue: dict[str, dict[str, Fatigue]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def strength(
    source: Loaded, histories: Mapping[str | None, Response | Result], folder: Path, reporter: Reporter
) -> Strength:
    """Compute the shock spectra and the damage of the [srs] and [fatigue] tables; write CSV files and plots.

    Parameters
    ----------
    histories : {name: Response or Result}
        Of the tables [response], and of None the main run. Tables of histories that are missing are passed over.

    Raises
    ------
    InputError
        Which names the table.
    """
    results = Strength()
    path = source.path
    for kind, tables in (("srs", source.pipeline.srs), ("fatigue", source.pipeline.fatigue)):
        for name, table in tables.items():
            history = histories.get(table.response)
            if history is None:
                continue
            target = folder / f"{path.stem}-{name}-{kind}.csv"
            refuse_overwriting([target, target.with_suffix(".png")], needed_files(source))
            with naming(path), naming(f"[{kind}.{name}]"):
                if isinstance(table, ShockTable):
                    _shocks(results, name, table, history, target, reporter)
                else:
                    _fatigue(results, name, table, history, target, reporter)
    reporter.notes(results.notes)
    return results


def channels_of(table: OfChannels, source: Result | Response) -> tuple[np.ndarray, Histories]:
    """Return the axis (n,) of a run or a response, s or Hz, and the channels (n,) that match the names of a table.

    Raises
    ------
    InputError
        When there is no such channel.
    """
    if isinstance(source, Result):
        axis = source.time
        known = source.table()
    else:
        axis = source.axis
        known = dict(zip(source.names, source.values.T, strict=True))
    channels: Histories = {}
    for pattern in table.channels:
        names = matching(known, pattern)
        if not names:
            raise InputError(f"there is no channel {pattern!r}; {suggestion(pattern, sorted(known)[:60], 'there are')}")
        channels |= {name: known[name] for name in names}
    return axis, channels


def _shocks(
    results: Strength, name: str, table: ShockTable, source: Result | Response, target: Path, reporter: Reporter
) -> None:
    time, channels = channels_of(table, source)
    options = {"Q": table.Q, "kind": table.kind, "start": table.start}
    spectra = {key: shock_spectrum(time, values, table.axis, **options) for key, values in channels.items()}
    columns = {"frequency (Hz)": table.axis}
    for key, spectrum in spectra.items():
        columns |= {f"{key} {side}": getattr(spectrum, side) for side in ("maximax", "positive", "negative")}
    reporter.wrote(write_columns(columns, target))
    units = dict.fromkeys(spectra, SHOCK_UNITS[table.kind])
    results.plots[name] = reporter.wrote(shock_plot(spectra, units, target.with_suffix(".png")))
    results.shocks[name] = spectra
    first_channel = {note: key for key, spectrum in reversed(spectra.items()) for note in spectrum.notes}
    results.notes.extend(f"srs {name}: {key}: {note}" for note, key in first_channel.items())


def _fatigue(
    results: Strength, name: str, table: FatigueTable, source: Result | Response, target: Path, reporter: Reporter
) -> None:
    axis, channels = channels_of(table, source)
    damage = {
        key: _damage(table, source, axis, values).with_(unit=_unit(table, source, key))
        for key, values in channels.items()
    }
    rows = [(key, x.cycles, x.largest, x.damage, x.life, x.method) for key, x in damage.items()]
    heads = ("channel", "cycles", "largest amplitude", "damage", "life (s)", "method")
    reporter.wrote(write_table(heads, rows, target))
    fatigue_table(name, damage, reporter.console)
    results.fatigue[name] = damage
    notes = [note for x in damage.values() for note in x.notes]
    if any(key.endswith(VON_MISES) for key in damage):
        notes.append(SIGNLESS)
    results.notes.extend(f"fatigue {name}: {note}" for note in dict.fromkeys(notes))
    failed = [key for key, x in damage.items() if x.damage >= 1]
    if failed:
        results.notes.append(f"fatigue {name}: damage of 1 or more, which is failure, at {', '.join(failed)}")


def _unit(table: FatigueTable, source: Result | Response, channel: str) -> str:
    """Return the unit of the amplitudes; with a scale, channels of forces and moments become stress."""
    units = dict(zip(source.names, source.units, strict=True)) if isinstance(source, Response) else {}
    unit = units.get(channel, "Pa" if ".stress." in channel else "")
    scaled = "Pa" if unit in ("Pa", "N", "N m") else ""
    return unit if table.scale == 1 else scaled


def _damage(table: FatigueTable, source: Result | Response, axis: np.ndarray, values: np.ndarray) -> Fatigue:
    if isinstance(source, Response) and source.kind == "random":
        psd = table.scale**2 * values
        assert table.duration is not None  # by the check of the table
        return random_damage(axis, psd, table.curve, duration=table.duration, method=table.method)
    single = rainflow_damage(axis, table.scale * values, table.curve)
    n = table.repeats
    return single.with_(
        damage=n * single.damage, duration=n * single.duration, cycles=n * single.cycles, counts=n * single.counts
    )
