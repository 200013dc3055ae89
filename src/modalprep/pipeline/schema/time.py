"""Functions of time in pipeline files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from modalprep.errors import InputError
from modalprep.multibody.model.time_function import FOREVER, TimeFunction
from modalprep.pipeline.schema.base import Table, naming
from modalprep.pipeline.schema.quantities import Duration
from modalprep.suggest import refuse_missing


class PieceTable(Table):
    """A piece of a function of time."""

    value: str | float = Field(description="number, or expression of t (s)")
    until: Duration | None = Field(None, description="s; the last piece has none")


class PointsOrFile(Table):
    """Two columns of numbers, or a CSV file with them."""

    what: ClassVar[str]
    file: str | None = None

    @model_validator(mode="after")
    def _points_or_file(self) -> Self:
        names = [name for name in type(self).model_fields if name != "file"]
        given = [name for name in names if getattr(self, name) is not None]
        if given != ([] if self.file else names):
            raise ValueError(f"{self.what} needs both {' and '.join(map(repr, names))}, or 'file'")
        return self

    def columns(self, folder: Path) -> tuple[Any, Any]:
        """Return both columns; a file is relative to `folder`."""
        if self.file is not None:
            return points_of_file(folder / self.file)
        first, second = (getattr(self, name) for name in type(self).model_fields if name != "file")
        return first, second


class PointsTable(PointsOrFile):
    """A function of time as a smooth curve through points; a time named twice is a jump."""

    what = "a table of time"
    t: list[Duration] | None = Field(None, description="s")
    values: list[float] | None = None
    file: str | None = Field(None, description="CSV file with a row 't, value' for each point, instead")


def form(value: Any) -> str:
    """Return the form of a value, so that an error message refers to the intended one."""
    forms = {str: "text", list: "list"}
    return "table" if isinstance(value, (dict, Table)) else forms.get(type(value), "number")


Time = Annotated[
    Annotated[str, Tag("text")]
    | Annotated[float, Tag("number")]
    | Annotated[list[PieceTable], Tag("list")]
    | Annotated[PointsTable, Tag("table")],
    Discriminator(form),
]
TIME = "number, expression of t (s), pieces [{ value, until }, ...], or points { t, values } or { file }"


def time_function(key: str, value: Time | None, folder: Path) -> TimeFunction | None:
    """Return the function of time that a key of a pipeline file has; its files are relative to `folder`.

    Examples
    --------
    >>> time_function("torque", "2*t", Path())(3.0)
    (6.0, 2.0, 0.0)
    """
    with naming(key):
        if value is None:
            return None
        if isinstance(value, PointsTable):
            return TimeFunction.table(*value.columns(folder))
        if isinstance(value, list):
            return TimeFunction(pieces(value))
        return TimeFunction(value)


def pieces(tables: list[PieceTable]) -> list[tuple[float, Any]]:
    """Return pieces of a function of time as ``(until, value)``, the last without end.

    Examples
    --------
    >>> pieces([PieceTable(value=1.0, until=2.0), PieceTable(value="t")])
    [(2.0, 1.0), (inf, 't')]
    """
    return [(FOREVER if piece.until is None else piece.until, piece.value) for piece in tables]


def has_several_values(value: Any) -> bool:
    """Whether a key has a value for each coordinate, not a single one in pieces."""
    return isinstance(value, list) and not (value and isinstance(value[0], PieceTable))


def points_of_file(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the two columns of a CSV file, with or without a header."""
    refuse_missing(path, "table of points")
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    try:
        rows = [[float(word) for word in line.split(",")] for line in lines[_header(lines) :] if line.strip()]
        t, values = np.array(rows, dtype=float).reshape(len(rows), 2).T
    except ValueError:
        raise InputError(f"table of points {path}: needs rows of two numbers") from None
    return t, values


def _header(lines: list[str]) -> int:
    """Return 1 when the first line is a header."""
    first = lines[0].split(",")[0].strip() if lines else ""
    return int(bool(first) and not first.lstrip("+-.")[:1].isdigit())
