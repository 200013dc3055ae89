"""Read a pipeline file; every error is reported in one message with file, line and key."""

from __future__ import annotations

import math
import re
import sys
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from modalprep.errors import InputError
from modalprep.pipeline.schema.base import first_message, naming
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.suggest import refuse_missing

SMALLEST, LARGEST = 1e-60, 1e60  # of a number


def load_pipeline(path: str | Path) -> Pipeline:
    """Read and validate a TOML file.

    Raises
    ------
    InputError
        When the file is missing, is not TOML, or has an unknown key.

    Examples
    --------
    >>> load_pipeline("no.toml")
    Traceback (most recent call last):
    modalprep.errors.InputError: pipeline file no.toml does not exist
    """
    return read_pipeline(Path(path))[0]


def read_pipeline(path: Path) -> tuple[Pipeline, str]:
    """Read and validate a TOML file; return what it says, and its text.

    Raises
    ------
    InputError
        As `load_pipeline`.
    """
    text, data = read_toml(path)
    _refuse_odd_values(path, text, data, [])
    try:
        pipeline = Pipeline.model_validate(data)
    except ValidationError as error:
        raise InputError(_message(path, text, error)) from None
    if pipeline.grid:
        raise InputError(f"{path} has a [grid] of several jobs: write modalprep batch {path}")
    with naming(path):
        return pipeline.with_chains(), text


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text of a TOML file and what it says.

    Raises
    ------
    InputError
        When the file is missing or is not TOML.
    """
    refuse_missing(path, "pipeline file")
    try:
        text = path.read_text(encoding="utf-8-sig")
        return text, tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{path} has too deeply nested lists or tables; correct it") from None
    except ValueError as error:  # also of bytes that are no text, and numbers of thousands of digits
        raise InputError(f"{path} is not valid TOML: {error}") from None


def _refuse_odd_values(path: Path, text: str, value: Any, keys: list[str]) -> None:
    """Refuse numbers whose powers overflow, as no quantity in SI units does, and texts that no file can hold."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        _refuse_odd_values(path, text, inner, [*keys, str(key)])
    odd = ""
    if isinstance(value, (int, float)) and 0 < abs(value) < math.inf and not SMALLEST <= abs(value) <= LARGEST:
        shown = f"{value:g}" if abs(value) < sys.float_info.max else f"a number of {len(str(abs(value)))} digits"
        odd = f"{shown} is no quantity in SI units"
    if isinstance(value, str) and "\0" in value:
        odd = f"{value!r} has a character NUL, which is no text"
    if odd:
        raise InputError(f"{path}, line {_line(text, keys)}: [{'.'.join(keys)}]: {odd}; correct it")


def _message(path: Path, text: str, error: ValidationError) -> str:
    first = error.errors()[0]
    keys = _keys(first, tomllib.loads(text))
    message = first_message(error)
    named = re.match(r"(?:unknown key )?'(.+?)'(?: has no effect|;)", message)
    line = _line(text, [*keys, *named[1].split(".")] if named else keys)
    where = f"{path}, line {line}" if line else str(path)
    table = f"[{'.'.join(keys)}]: " if keys else ""
    more = f" ({error.error_count() - 1} more)" if error.error_count() > 1 else ""
    return f"{where}: {table}{message[:1].lower() + message[1:]}{more}"


def _keys(error: Any, data: Any) -> list[str]:
    """Return the keys of the TOML file that lead to an error, without pydantic's tags of unions."""
    keys = []
    for part in error["loc"]:
        inside = part in data if isinstance(data, dict) else isinstance(part, int) and isinstance(data, list)
        if inside:
            keys.append(str(part))
            data = data[part]
    return [*keys, str(error["loc"][-1])] if error["type"] == "missing" else keys


def _line(text: str, keys: list[str]) -> int | None:
    """Return the line of a key: the last of its path found, table header first."""
    found, start, lines = None, 0, text.splitlines()
    header = None
    for depth in range(len(keys), 0, -1):
        name = re.escape(".".join(keys[:depth]))
        header = next((k for k, s in enumerate(lines) if re.match(rf"\s*\[+\s*{name}\s*\]+", s)), None)
        if header is not None:
            found, start = header + 1, header + 1
            keys = keys[depth:]
            break
    for key in keys:
        row = next(
            (k for k in range(start, len(lines)) if re.match(rf"\s*\"?{re.escape(key)}\"?\s*=", lines[k])),
            None,
        )
        found = row + 1 if row is not None else found
    return found
