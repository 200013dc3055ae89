"""Simulation results on disk: HDF5 with every channel, CSV for a spreadsheet."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import h5py
import numpy as np

from modalprep.atomic import text_of_csv, write_columns, write_table
from modalprep.errors import InputError
from modalprep.formats.hdf5 import reading, writing
from modalprep.formats.statefile import GROUP, put_state, state_in
from modalprep.multibody.results.envelopes import Envelope
from modalprep.multibody.results.result import STATS, Result
from modalprep.suggest import refuse_other
from modalprep.verdicts.notes import told

RESULT = "modalprep result"
EVENTS = "events"  # group of the times of events, s


def write_result(
    result: Result, path: str | Path, runs: dict[str, Result] | None = None, *, identity: str = ""
) -> Path:
    """Write the channels to HDF5: dataset ``time`` and one per channel; further `runs` in groups of their name.

    `identity` is a fingerprint of what the run is of, which `stated_identity` returns.

    Returns
    -------
    Path
        The file.

    Examples
    --------
    >>> import tempfile
    >>> run = Result(time=np.arange(2.0), channels={"a.angle": np.ones(2)}, status="done", message="")
    >>> file = write_result(run, Path(tempfile.mkdtemp()) / "run.h5")
    >>> read_result(file)["a.angle"]
    array([1., 1.])
    """
    refuse_other("write_result: the result", Result, result)
    path = Path(path)
    with writing(path) as file:
        file.attrs.update(format=RESULT, format_version=1, units="SI", identity=identity)
        for group, run in {"": result, **(runs or {})}.items():
            target = file.require_group(group) if group else file
            target.attrs.update(status=run.status, message=run.message, notes="\n".join(run.notes), **run.stats)
            target["time"] = run.time
            for name, values in run.channels.items():
                target[f"channels/{name}"] = values
            for name, times in run.events.items():
                target[f"{EVENTS}/{name}"] = times
            if run.state is not None:
                put_state(target.require_group(GROUP), run.state)
    return path


@told
def read_result(path: str | Path) -> Result:
    """Read the first run of a result file.

    Returns
    -------
    Result
        With the channels, statistics, times of events and last state that were written.

    Raises
    ------
    InputError
        When the file is missing, damaged or not a result file.
    """
    with reading(Path(path), "result file", "simulate again") as file:
        count = len(file["time"])
        return Result(
            time=_histories(file["time"], count),
            channels={name: _histories(data, count) for name, data in file["channels"].items()},
            status=str(file.attrs["status"]),
            message=str(file.attrs["message"]),
            notes=tuple(str(file.attrs.get("notes", "")).splitlines()),
            stats=_stats(file.attrs),
            events=_events(file),
            state=state_in(file[GROUP]) if GROUP in file else None,
        )


def stated_identity(path: str | Path) -> str:
    """Return the fingerprint that `write_result` was given; empty where there was none.

    Raises
    ------
    InputError
        When the file is missing, damaged or not a result file.
    """
    with reading(Path(path), "result file", "simulate again") as file:
        return str(file.attrs.get("identity", ""))


def _events(file: h5py.File) -> dict[str, np.ndarray]:
    if EVENTS not in file:
        return {}
    return {name: _histories(data, data.size) for name, data in file[EVENTS].items()}


def _stats(attributes: h5py.AttributeManager) -> dict[str, str | int | float]:
    """Return the entries of `STATS`; the method of older files, a number, is left out."""
    known = {name: attributes[name] for name in STATS if name in attributes}
    texts = {name for name, value in known.items() if isinstance(value, str)}
    return {name: STATS[name](value) for name, value in known.items() if (STATS[name] is str) == (name in texts)}


def _histories(data: h5py.Dataset, count: int) -> np.ndarray:
    if data.dtype.kind not in "fiu" or data.ndim not in (1, 2) or len(data) != count:
        raise InputError(f"{data.name} does not hold numbers at {count} times")
    return data[()]


def write_csv(result: Result, path: str | Path, channels: Sequence[str] = ()) -> Path:
    """Write time and the named channels (all when none is named) as columns; a vector takes one per component.

    Returns
    -------
    Path
        The file.
    """
    refuse_other("write_csv: the result", Result, result)
    columns = {"time": result.time} | result.table(channels)
    return write_columns(columns, path)


def write_envelopes(envelopes: Sequence[Envelope], path: str | Path) -> Path:
    """Write a row for each place and component of envelopes: extremes with their times, and the margin.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OutputError
        When the folder cannot be written.
    """
    rows = [row for envelope in envelopes for row in envelope.rows()]
    return write_table(rows[0] if rows else (), (tuple(row.values()) for row in rows), path)


def read_csv(path: str | Path) -> Result:
    """Read a file of `write_csv`, with ten digits; columns ``name.x``, ``name.y``, ... become one channel.

    Returns
    -------
    Result
        With the channels of the file.

    Raises
    ------
    InputError
        When the file is missing, or not a table of numbers with a column ``time``.

    Examples
    --------
    >>> import tempfile
    >>> moved = {"a.tip.position": np.arange(6.0).reshape(2, 3)}
    >>> run = Result(time=np.arange(2.0), channels=moved, status="", message="")
    >>> read_csv(write_csv(run, Path(tempfile.mkdtemp()) / "run.csv"))["a.tip.position"].tolist()
    [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]
    """
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            header, *rows = csv.reader(file)
        header = [text_of_csv(name) for name in header]
        values = np.array(rows, dtype=float).reshape(len(rows), len(header))
        time = values[:, header.index("time")]
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"{path} is not a table of a result ({error}); write it again") from None
    found: dict[str, list[np.ndarray]] = {}
    for name, column in zip(header, values.T, strict=True):
        stem, _, component = name.rpartition(".")
        part = component.isdigit() or component in tuple("xyz")
        found.setdefault(stem if part else name, []).append(column if not part else column[:, None])
    channels = {name: np.hstack(parts) for name, parts in found.items() if name != "time"}
    return Result(time=time, channels=channels, status="read", message=f"read from {path}")
