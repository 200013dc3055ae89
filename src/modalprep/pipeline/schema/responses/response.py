"""Linear responses of the body in pipeline files: what drives it, over frequency or time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, cast

import numpy as np
from pydantic import Field, model_validator

from modalprep.applies import Rule
from modalprep.errors import InputError
from modalprep.pipeline.schema.base import FileName, Table, naming
from modalprep.pipeline.schema.columns import points_of_file
from modalprep.pipeline.schema.quantities import Angle, Duration, Frequency, level
from modalprep.pipeline.schema.reduction import DAMPING, Damping
from modalprep.pipeline.schema.responses.strength import NotchTable
from modalprep.pipeline.schema.time import Curve, Level, spectrum_of
from modalprep.reduction.table import DIRECTIONS
from modalprep.response.inputs import PER_CYCLE, History, Rate, Spectrum, Sweep

AMPLITUDE = (("m/s^2", "rad/s^2"), ("N", "N m"))  # of the base and of interfaces, along and about an axis
DENSITY = (("m^2/s^4/Hz", "rad^2/s^4/Hz"), ("N^2/Hz", "N^2 m^2/Hz"))


class DriveTable(Table):
    """Inputs over frequency along and about three axes: numbers in SI, text such as "5 g", or curves."""

    x: Curve | None = None
    y: Curve | None = None
    z: Curve | None = None
    rx: Curve | None = None
    ry: Curve | None = None
    rz: Curve | None = None


class Driven(Table):
    """What every kind of response has."""

    units: ClassVar[tuple[tuple[str, str], tuple[str, str]]] = AMPLITUDE
    damping: Damping | None = Field(None, description="instead of that of the body; " + DAMPING)
    channels: list[str] = Field(
        [], description='names, or their beginnings, of those with curves, such as "base.force", "tip"; default all'
    )

    @model_validator(mode="after")
    def _driven(self) -> Driven:
        if not any(self._given()):
            raise ValueError("nothing drives the body; give an input, such as base.x or forces.tip.x")
        return self

    def _given(self) -> list[tuple[str, str, Any]]:
        """Return name, unit and value of each input."""
        own = vars(self)  # inputs over frequency, or over time
        tables = {"base": own["base"]} | own["forces"]
        return [
            (f"{place}.{d}", self.units[number > 0][k > 2], getattr(table, d))
            for number, (place, table) in enumerate(tables.items())
            for k, d in enumerate(DIRECTIONS)
            if getattr(table, d) is not None
        ]


class OverFrequency(Driven):
    """Inputs over frequency."""

    base: DriveTable = Field(DriveTable(), description="acceleration of the root: m/s^2, rad/s^2")
    forces: dict[str, DriveTable] = Field({}, description="by interface, force and moment: N, N m")

    def inputs(self, folder: Path) -> dict[str, Spectrum]:
        """Return the inputs by name, in SI."""
        return {name: _named(name, spectrum_of, value, unit, folder) for name, unit, value in self._given()}


def _named(name: str, read: Callable[..., Any], *given: Any) -> Any:
    with naming(name):
        try:
            return read(*given)
        except ValueError as error:
            raise InputError(str(error)) from None


class Limited(OverFrequency):
    """Inputs over frequency that limits may lower."""

    notch: list[NotchTable] = Field([], description="limits of channels, to which all inputs are lowered together")

    @model_validator(mode="after")
    def _driven_where_limited(self) -> Limited:
        given = [name for name, _, _ in self._given()]
        for row in self.notch:
            if row.factor is not None and row.channel.replace("force.", "") not in given:
                raise ValueError(f"a semi-empirical limit of {row.channel} needs an input along it; give 'limit'")
        return self


class HarmonicTable(Limited):
    """Response to harmonic inputs, which act together."""

    applies: ClassVar[tuple[Rule, ...]] = (Rule(("points", "spacing"), beside=("frequency",)),)

    kind: Literal["harmonic"]
    lowest: Frequency | None = Field(None, gt=0, description="Hz")
    highest: Frequency | None = Field(None, gt=0, description="Hz")
    points: Annotated[int, Field(ge=2, le=100_000)] = 400
    spacing: Literal["logarithmic", "linear"] = "logarithmic"
    frequency: list[Frequency] = Field([], description="Hz, ascending, instead of lowest and highest")
    refine: bool = Field(True, description="add the resonances with points around them")

    @model_validator(mode="after")
    def _has_axis(self) -> HarmonicTable:
        _refuse_range(self.lowest, self.highest, bool(self.frequency))
        return self

    @property
    def axis(self) -> np.ndarray:
        """Frequencies, Hz."""
        if self.frequency:
            return np.array(self.frequency)
        assert self.lowest is not None  # by the check of the table
        assert self.highest is not None
        space = np.linspace if self.spacing == "linear" else np.geomspace
        return space(self.lowest, self.highest, self.points)


def _refuse_range(lowest: float | None, highest: float | None, otherwise: bool) -> None:
    if (lowest is None) != (highest is None) or (lowest is None) != otherwise:
        raise ValueError("a harmonic response needs 'lowest' and 'highest', or 'frequency'")
    if lowest is not None and highest is not None and not lowest < highest:
        raise ValueError(f"lowest = {lowest:g} Hz must be below highest = {highest:g} Hz")


class CoherenceTable(Table):
    """Cross spectrum of two inputs, ``sqrt(coherence S_a S_b) exp(i phase)``."""

    between: Annotated[list[str], Field(min_length=2, max_length=2)] = Field(
        description='two inputs, such as "base.x" and "tip.z"'
    )
    coherence: Annotated[float, Field(ge=0, le=1)]
    phase: Angle = Field(0.0, description="rad, by which the first is ahead of the second")


class RandomTable(Limited):
    """Response to stationary random inputs: one-sided power spectral densities."""

    units: ClassVar[tuple[tuple[str, str], tuple[str, str]]] = DENSITY
    kind: Literal["random"]
    correlation: Literal["none", "full"] = Field("none", description="of the inputs: independent, or one signal in all")
    coherence: list[CoherenceTable] = Field([], description="of pairs of inputs that are neither")
    lowest: Frequency | None = Field(None, gt=0, description="Hz; default that of the tables")
    highest: Frequency | None = Field(None, gt=0, description="Hz; default that of the tables")

    @model_validator(mode="after")
    def _one_correlation(self) -> RandomTable:
        if self.coherence and self.correlation == "full":
            raise ValueError("correlation 'full' and a coherence contradict each other; give one of them")
        if self.correlation == "full" and len(self._given()) == 1:
            raise ValueError("'correlation' has no effect on one input; leave it out")
        if (self.lowest is None) != (self.highest is None):
            raise ValueError("a band needs both 'lowest' and 'highest'")
        return self

    @property
    def band(self) -> tuple[float, float] | None:
        """Lowest and highest frequency, Hz."""
        return None if self.lowest is None or self.highest is None else (self.lowest, self.highest)

    def correlated(self) -> Literal["none", "full"] | np.ndarray:
        """Return the correlation of the inputs as `random_response` takes it."""
        if not self.coherence:
            return self.correlation
        names = [name for name, _, _ in self._given()]
        R = np.eye(len(names), dtype=complex)
        for pair in self.coherence:
            for name in pair.between:
                if name not in names:
                    raise InputError(f"coherence: there is no input {name!r}; there are {', '.join(names)}")
            a, b = (names.index(name) for name in pair.between)
            R[a, b] = np.sqrt(pair.coherence) * np.exp(1j * pair.phase)
            R[b, a] = R[a, b].conj()
        return R


class SweepTable(OverFrequency):
    """Response to a sine sweep at a rate, from rest."""

    kind: Literal["sweep"]
    lowest: Frequency = Field(gt=0, description="Hz")
    highest: Frequency = Field(gt=0, description="Hz")
    rate: str = Field(description='of the frequency, such as "2 oct/min" or "0.5 Hz/s"')
    direction: Literal["up", "down"] = "up"
    samples: Annotated[int, Field(ge=20, le=10_000)] = Field(
        PER_CYCLE, description="in a cycle; the input is straight between them"
    )

    @model_validator(mode="after")
    def _sweeps(self) -> SweepTable:
        Sweep(self.lowest, self.highest, self.speed, self.direction).refuse_long(self.samples)
        return self

    @property
    def speed(self) -> Rate:
        """The rate as `sweep_response` takes it."""
        number, _, unit = self.rate.partition(" ")
        try:
            return float(number), cast(Literal["oct/min", "Hz/s"], unit.strip())  # `Sweep` refuses others
        except ValueError:
            raise ValueError(f"rate = {self.rate!r} is none; write for example '2 oct/min' or '0.5 Hz/s'") from None


class HistoryTable(Table):
    """An input over time: straight lines between points, zero before and after."""

    t: list[Duration] | None = Field(None, description="s")
    values: list[Level] | None = Field(None, description='in SI or text such as "0.5 g"')
    file: FileName | None = Field(None, description="CSV file with a row 't, value' for each point, instead")
    unit: str | None = Field(None, description='of values that are plain numbers, such as "g"; default SI')

    @model_validator(mode="after")
    def _one_way(self) -> HistoryTable:
        if (self.file is None) == (self.t is None) or (self.t is None) != (self.values is None):
            raise ValueError("an input over time needs both 't' and 'values', or 'file'")
        if self.t is not None and self.values is not None and len(self.t) != len(self.values):
            raise ValueError(f"t has {len(self.t)} values and values {len(self.values)}; give as many of each")
        return self

    def history(self, unit: str, folder: Path) -> History:
        """Return the history in SI; a file is relative to `folder`."""
        units = (("s",), None if self.unit else (unit,))
        t, values = (
            (self.t or [], self.values or []) if self.file is None else points_of_file(folder / self.file, units)
        )
        return History(time=np.array(t), value=np.array([level(x, unit, self.unit) for x in values]))


class HistoriesTable(Table):
    """Inputs over time along and about three axes."""

    x: HistoryTable | None = None
    y: HistoryTable | None = None
    z: HistoryTable | None = None
    rx: HistoryTable | None = None
    ry: HistoryTable | None = None
    rz: HistoryTable | None = None


class TransientTable(Driven):
    """Response to histories, from rest."""

    kind: Literal["transient"]
    base: HistoriesTable = Field(HistoriesTable(), description="acceleration of the root: m/s^2, rad/s^2")
    forces: dict[str, HistoriesTable] = Field({}, description="by interface, force and moment: N, N m")
    step: Duration | None = Field(None, gt=0, description="s; default by the tables and the shortest period")
    duration: Duration | None = Field(None, gt=0, description="s; default to the end of the longest table")

    def inputs(self, folder: Path) -> dict[str, History]:
        """Return the inputs by name, in SI."""
        return {name: _named(name, value.history, unit, folder) for name, unit, value in self._given()}


Response = Annotated[HarmonicTable | SweepTable | RandomTable | TransientTable, Field(discriminator="kind")]
