"""Base of all TOML tables of a pipeline file: unknown keys are refused, vectors and angles are read."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from modalprep.errors import InputError
from modalprep.suggest import suggestion

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]


def _radians(value: Any) -> Any:
    """Read ``1.5``, ``"1.5 rad"`` or ``"90 deg"``."""
    if isinstance(value, str):
        match = re.fullmatch(r"\s*([-+.\deE]+)\s*(deg|rad)\s*", value)
        if not match:
            raise ValueError(f"{value!r} is not an angle; write for example '90 deg' or 1.57")
        return float(match[1]) * (math.pi / 180 if match[2] == "deg" else 1.0)
    return value


def _in_units(units: dict[str, float], example: str) -> BeforeValidator:
    """Read a number in SI, or text of a number and one of the units, each with its factor to SI."""

    def read(value: Any) -> Any:
        if not isinstance(value, str):
            return value
        number, unit = (re.match(r"\s*([-+.\deE]*)(.*)$", value, re.DOTALL) or [value] * 3).groups()
        try:
            return float(number) * units[unit.strip().replace("^", "")]
        except (ValueError, KeyError):
            known = ", ".join(units)
            raise ValueError(f"{value!r} is not understood; write {example}, or a unit of {known}") from None

    return BeforeValidator(read)


STRESS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm2": 1e6}
DENSITY = {"kg/m3": 1.0, "g/cm3": 1e3, "kg/dm3": 1e3, "t/m3": 1e3, "t/mm3": 1e12}
Stress = Annotated[float, _in_units(STRESS, "2.1e11 or '210 GPa'")]
Density = Annotated[float, _in_units(DENSITY, "7850 or '7.85 g/cm3'")]
Angle = Annotated[float, BeforeValidator(_radians)]


def first_message(error: ValidationError) -> str:
    """Return the message of the first validation error.

    Examples
    --------
    >>> try:
    ...     ReferenceTable(label="a", t=[0.0], y=[])
    ... except ValidationError as error:
    ...     print(first_message(error))
    t has 1 values and y 0; give as many of each
    """
    first = error.errors()[0]
    value = first.get("input")
    if first["type"] in ("float_type", "int_type") and isinstance(value, str):
        return f"{value!r} is text; write the number without quotes and in SI units"
    if first["type"] == "union_tag_invalid" and first["ctx"]["discriminator"] == "form()":
        expected = first["ctx"]["expected_tags"].replace("'", "").replace(", ", " or ")
        return f"{value!r} is a {first['ctx']['tag']}, but this key needs a {expected}"
    return first["msg"].removeprefix("Value error, ")


class Table(BaseModel):
    """A TOML table that refuses keys it does not know."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, strict=True)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: Any) -> Any:
        for key in data if isinstance(data, dict) else ():
            if key not in cls.model_fields:
                raise ValueError(f"unknown key {key!r}; {suggestion(key, cls.model_fields, 'known are')}")
        return data


class ReferenceTable(Table):
    """Reference points drawn in a plot."""

    label: str
    t: list[float]
    y: list[float]

    @model_validator(mode="after")
    def _pairs(self) -> ReferenceTable:
        if len(self.t) != len(self.y):
            raise ValueError(f"t has {len(self.t)} values and y {len(self.y)}; give as many of each")
        return self


@contextmanager
def naming(file: Path | str) -> Iterator[None]:
    """Put the name of the file (or table) before an input error that does not say it.

    Examples
    --------
    >>> with naming("job.toml"):
    ...     raise InputError("no group 'a'")
    Traceback (most recent call last):
    modalprep.errors.InputError: job.toml: no group 'a'
    """
    try:
        yield
    except InputError as error:
        if str(file) in str(error):
            raise
        raise type(error)(f"{file}: {error}") from None
