"""Read a pipeline file, once; every error is reported in one message with file, line and key."""

from __future__ import annotations

import math
import os
import re
import sys
import tomllib
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from modalprep.errors import InputError
from modalprep.pipeline.schema.base import PipelineName, first_message, named_files, naming
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.robot import with_robot
from modalprep.suggest import refuse_missing

SMALLEST, LARGEST = 1e-60, 1e60  # of a number


@dataclass(frozen=True, eq=False)
class Loaded:
    """A pipeline file and what it says.

    Attributes
    ----------
    path : Path
        Files that it names are relative to its folder.
    pipeline : Pipeline
    text : str

    Examples
    --------
    >>> Loaded(Path("pipelines/arm.toml"), Pipeline.model_validate({"mesh": {"file": "a.msh"}})).body_name
    'arm'
    """

    path: Path
    pipeline: Pipeline
    text: str = ""

    @property
    def folder(self) -> Path:
        """Where the file lies."""
        return self.path.parent

    @property
    def body_name(self) -> str:
        """Name of the body that the file builds."""
        return self.pipeline.name or self.path.stem

    @property
    def body_files(self) -> list[Path]:
        """The pipeline files of the bodies."""
        names = [name for _, name in named_files(self.pipeline) if isinstance(name, PipelineName)]
        return [self.folder / name for name in dict.fromkeys(names)]

    @cached_property
    def files(self) -> tuple[Loaded, ...]:
        """The file itself, and the pipeline files of its bodies and of their bodies; each is read once.

        Raises
        ------
        InputError
            When one of them cannot be read.
        """
        found: list[Loaded] = [self]
        todo = self.body_files
        while todo:
            path = todo.pop()
            if not any(same_file(path, other.path) for other in found):
                found.append(load(path))
                todo += found[-1].body_files
        return tuple(found)

    def of_body(self, name: str) -> Loaded:
        """Return the pipeline file of a body, by the name that a table has for it."""
        path = self.folder / name
        return replace(next(file for file in self.files if same_file(file.path, path)), path=path)


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
    return load(path).pipeline


def load(file: str | Path | Loaded) -> Loaded:
    """Read and validate a pipeline file with its path and text; one that was read already is returned as it is.

    Raises
    ------
    InputError
        As `load_pipeline`.
    """
    if isinstance(file, Loaded):
        return file
    path = Path(file)
    text, data = read_toml(path)
    _refuse_odd_values(path, text, data, [])
    try:
        pipeline = Pipeline.model_validate(with_robot(data, path.parent))
    except ValidationError as error:
        raise InputError(_message(path, text, error)) from None
    if pipeline.grid:
        raise InputError(f"{path} has a [grid] of several jobs: write modalprep batch {path}")
    with naming(path):
        return Loaded(path, pipeline.with_chains(), text)


def same_file(one: Path, other: Path) -> bool:
    """Whether two paths lead to one file, also through links; files that are not there yet count by their names."""
    try:
        return os.path.samefile(one, other)
    except (OSError, ValueError):  # one is not there, or its name cannot be one
        return os.path.abspath(one) == os.path.abspath(other)


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
        what = f"{_no_pipeline(path)} ({error})" if path.suffix != ".toml" else f"is not valid TOML: {error}"
        raise InputError(f"{path} {what}") from None


def _no_pipeline(path: Path) -> str:
    """Say what to do with a file of another kind."""
    if path.suffix == ".h5":
        return "is no pipeline file (TOML); modalprep explain says what it holds, and modalprep view shows it"
    return f"is no pipeline file (TOML); modalprep init {path.name} writes one for a part, a mesh or a deck"


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
    found = None
    start = 0
    lines = text.splitlines()
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
