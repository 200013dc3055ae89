"""Values of a pipeline file that the command line changes: ``--set reduction.modes=20``."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from modalprep.errors import InputError
from modalprep.pipeline.batch.grid import combined, write_copy
from modalprep.pipeline.batch.job import Job
from modalprep.pipeline.building.sources import refuse_shared
from modalprep.pipeline.schema.load import Loaded, load, read_toml


def with_settings(file: Path, settings: Sequence[str], output: Path | None) -> tuple[Loaded, Path | None]:
    """Read a pipeline file, or write and read it with other values; return it and the folder of the outputs.

    Parameters
    ----------
    file : Path
    settings : sequence of str
        ``KEY=VALUE`` with the dots of tables in the key, and a value as TOML writes it; text may go without quotes.
        With some, the file goes into its output folder.
    output : Path or None
        Folder of the outputs, by default ``output`` beside the file.

    Raises
    ------
    InputError
        When a setting is not ``KEY=VALUE``, a key is given twice, or it passes through what is no table.
    """
    if not settings:
        return load(file), output
    output = output or file.parent / "output"
    job = Job(output / file.stem / f"{file.stem}.toml", output)
    if job.file.resolve() == file.resolve():
        raise InputError(f"{file} lies where its changed copy would be written; name another folder with --output")
    data = combined(file, read_toml(file)[1], _parsed(settings), "--set")
    refuse_shared(job.folder, file)
    said = [f"# --set {setting}" for setting in settings]
    write_copy(file, job, data, "\n".join([f"# {file.name} with other values:", *said]))
    return load(job.file), output


def _parsed(settings: Sequence[str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for setting in settings:
        key, equals, text = (part.strip() for part in setting.partition("="))
        if not (key and equals and text) or "" in key.split("."):
            raise InputError(f"--set {setting!r} is not KEY=VALUE, such as reduction.modes=20")
        if key in found:
            raise InputError(f"--set {key} is given twice; keep one")
        found[key] = _value(text)
    return found


def _value(text: str) -> Any:
    """Return a value of TOML, or the text itself where it is none."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
