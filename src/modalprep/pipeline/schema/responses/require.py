"""Requirements on a body in pipeline files: mass, frequencies, effective mass, margins, error."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import Field, model_validator

from modalprep.pipeline.schema.base import Table
from modalprep.pipeline.schema.quantities import Frequency, Length, Mass, Share


class _Bounds(Table):
    """What a value must be above, below, or between."""

    above: Any = None
    below: Any = None

    @model_validator(mode="after")
    def _some_bound(self) -> _Bounds:
        if self.above is None and self.below is None:
            raise ValueError("give a bound: above, below, or both")
        if None not in (self.above, self.below) and not self.above < self.below:
            raise ValueError(f"above = {self.above:g} must be less than below = {self.below:g}")
        return self


class MassBounds(_Bounds):
    """Bounds of a mass."""

    above: Mass | None = Field(None, description="least value, kg")
    below: Mass | None = Field(None, description="largest value, kg")


class LengthBounds(_Bounds):
    """Bounds of a coordinate."""

    above: Length | None = Field(None, description="least value, m")
    below: Length | None = Field(None, description="largest value, m")


class FrequencyBounds(_Bounds):
    """Bounds of a frequency."""

    above: Frequency | None = Field(None, description="least value, Hz")
    below: Frequency | None = Field(None, description="largest value, Hz")


class CentreTable(Table):
    """Bounds of the centre of mass, in the frame of the body."""

    x: LengthBounds | None = None
    y: LengthBounds | None = None
    z: LengthBounds | None = None


class FrequencyTable(Table):
    """Bounds of the first elastic mode, and of the lowest with 10 % of the effective mass in a direction."""

    first: FrequencyBounds | None = Field(default=None, description="of all elastic modes, with the root clamped")
    x: FrequencyBounds | None = None
    y: FrequencyBounds | None = None
    z: FrequencyBounds | None = None
    rx: FrequencyBounds | None = None
    ry: FrequencyBounds | None = None
    rz: FrequencyBounds | None = None


class RequireTable(Table):
    """Requirements; each is a row of the report with its value, its limit and the verdict."""

    mass: MassBounds | None = Field(default=None, description="of the body")
    centre_of_mass: CentreTable = Field(default=CentreTable(), description="in the frame of the body")
    frequency: FrequencyTable = Field(
        default=FrequencyTable(), description="first, or by direction: x, y, z, rx, ry, rz"
    )
    effective_mass: Share | None = Field(
        default=None,
        gt=0,
        le=1,
        description="least share of the mass that the modes of the body have in x, in y and in z",
    )
    margin: float | None = Field(default=None, description="least margin of all allowables, 0 by default")
    error: Share | None = Field(
        default=None, gt=0, description="largest error against the full model, which reduction.up_to measures"
    )


def bounds(table: Table) -> Iterator[tuple[str, _Bounds]]:
    """Yield the bounds that a table of them gives, by their keys.

    Examples
    --------
    >>> list(bounds(CentreTable(x=LengthBounds(below=1.0))))
    [('x', LengthBounds(above=None, below=1.0))]
    """
    yield from ((key, getattr(table, key)) for key in type(table).model_fields if getattr(table, key) is not None)
