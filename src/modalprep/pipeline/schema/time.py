"""Functions of time and of frequency in pipeline files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, overload

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from modalprep.multibody.model.time_function import FOREVER, TimeFunction
from modalprep.pipeline.schema.base import FileName, Table, naming
from modalprep.pipeline.schema.columns import points_of_file
from modalprep.pipeline.schema.quantities import TEXT_TOO, Angle, Duration, Frequency, level
from modalprep.response.inputs import DECIBEL, Spectrum

Level = Annotated[float, Field(strict=True)] | Annotated[str, TEXT_TOO]


class PieceTable(Table):
    """A piece of a function of time."""

    value: str | float = Field(description="number, or expression of t (s)")
    until: Duration | None = Field(None, description="s; the last piece has none")


class PointsOrFile(Table):
    """Two columns of numbers, or a CSV file with them."""

    what: ClassVar[str]
    units: ClassVar[tuple[tuple[str, ...], tuple[str, ...]]]  # of both columns
    file: FileName | None = None

    @model_validator(mode="after")
    def _points_or_file(self) -> Self:
        names = self._columns()
        given = [name for name in names if getattr(self, name) is not None]
        if given != ([] if self.file else names):
            raise ValueError(f"{self.what} needs both {' and '.join(map(repr, names))}, or 'file'")
        return self

    def columns(self, folder: Path) -> tuple[Any, Any]:
        """Return both columns; a file is relative to `folder`."""
        if self.file is not None:
            return points_of_file(folder / self.file, self.units)
        first, second = (getattr(self, name) for name in self._columns())
        return first, second

    @classmethod
    def _columns(cls) -> list[str]:
        """Return the names of both columns."""
        return [name for name in cls.model_fields if name not in ("file", "smooth", "spline")]


class PointsTable(PointsOrFile):
    """A function of time as straight lines between points; a time named twice is a jump."""

    what = "a table of time"
    units = (("s",), ())
    t: list[Duration] | None = Field(None, description="s")
    values: list[float] | None = None
    file: FileName | None = Field(None, description="CSV file with a row 't, value' for each point, instead")
    smooth: bool = Field(False, description="a monotone curve instead, that stays between the points")
    spline: bool = Field(False, description="a cubic spline instead, that may go beyond the points")


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


class CurveTable(Table):
    """An input over frequency: straight lines in logarithmic axes, zero outside."""

    frequency: list[Frequency] | None = Field(None, description="Hz, ascending; one that is named twice is a jump")
    values: list[Level] | None = Field(
        None, description='of each, in SI or text such as "0.5 g"; of densities also slopes such as "3 dB/oct"'
    )
    phase: list[Angle] | None = Field(None, description="of each amplitude, rad")
    file: FileName | None = Field(None, description="CSV file with a row 'frequency, value' for each, instead")
    unit: str | None = Field(None, description='of values that are plain numbers, such as "g" or "g^2/Hz"; default SI')

    @model_validator(mode="after")
    def _one_way(self) -> CurveTable:
        if (self.file is None) == (self.frequency is None) or (self.frequency is None) != (self.values is None):
            raise ValueError("an input over frequency needs both 'frequency' and 'values', or 'file'")
        for name in ("values", "phase"):
            given = getattr(self, name)
            if given is not None and (self.frequency is None or len(given) != len(self.frequency)):
                raise ValueError(f"{name!r} needs as many numbers as there are frequencies, which a file has not")
        return self

    def spectrum(self, units: str, folder: Path) -> Spectrum:
        """Return the spectrum in SI; a file is relative to `folder`."""
        if self.file is not None:
            frequency, values = points_of_file(folder / self.file, (("Hz",), None if self.unit else (units,)))
        else:
            frequency, values = self.frequency or [], self.values or []
        levels = [x if _is_slope(x) else level(x, units, self.unit) for x in values]
        if any(isinstance(x, str) for x in levels):
            return Spectrum.with_slopes(list(frequency), levels)
        return Spectrum(frequency=np.array(frequency), value=np.array(levels), phase=self.phase)


def _is_slope(value: Any) -> bool:
    return isinstance(value, str) and value.endswith(DECIBEL)


Curve = Annotated[
    Annotated[str, Tag("text")] | Annotated[float, Tag("number")] | Annotated[CurveTable, Tag("table")],
    Discriminator(form),
]


TIME = "number, expression of t (s), pieces [{ value, until }, ...], or points { t, values } or { file }"


@overload
def time_function(key: str, value: Time, folder: Path) -> TimeFunction: ...
@overload
def time_function(key: str, value: None, folder: Path) -> None: ...
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
            return TimeFunction.table(*value.columns(folder), smooth=value.smooth, spline=value.spline)
        if isinstance(value, list):
            return TimeFunction(pieces(value))
        return TimeFunction(value)


def spectrum_of(value: Curve, unit: str, folder: Path) -> Spectrum:
    """Return the spectrum in an SI unit that a key of a pipeline file has; its files are relative to `folder`.

    Raises
    ------
    ValueError
        When a number has another dimension.

    Examples
    --------
    >>> spectrum_of("2 g", "m/s^2", Path()).value
    array([19.6133])
    """
    if isinstance(value, CurveTable):
        return value.spectrum(unit, folder)
    return Spectrum(value=np.array([level(value, unit, None)]))


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
