"""Notches of an input, shock spectra and fatigue in pipeline files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from modalprep.applies import Rule
from modalprep.pipeline.schema.base import OneOf, Table
from modalprep.pipeline.schema.quantities import Allowable, Duration, Frequency, Mass
from modalprep.pipeline.schema.time import Curve, Level
from modalprep.response.fatigue import METHODS
from modalprep.response.limits import MAX_DEPTH
from modalprep.response.shock import KINDS, STARTS
from modalprep.response.sn_curve import SNCurve
from modalprep.suggest import suggestion

Positive = Annotated[float, Field(gt=0)]
FORCES = ("base.force.x", "base.force.y", "base.force.z")
OF_HISTORIES = "a random response: its damage is that of the duration, without a mean"
OF_RANDOM = "histories: their cycles are counted, and 'repeats' says how often they happen"
WAYS = {"limit": "limit", "factor": "factor and break_frequency", "design_acceleration": "design_acceleration"}


class NotchTable(Table):
    """A limit of channels of a response, to which its inputs are lowered."""

    applies: ClassVar[tuple[Rule, ...]] = (Rule(("rolloff",), needs=("factor",)), Rule(("mass",), beside=("limit",)))

    channel: str = Field(description='name, its beginning, or a pattern: "base.force.z", "struts.*.N"')
    limit: Curve | None = Field(None, description="in the unit of the channel; of random responses a density")
    factor: Positive | None = Field(
        None, description="C of the semi-empirical limit of a force of the base, C times mass times input"
    )
    break_frequency: Frequency | None = Field(
        None, gt=0, description="Hz, beyond which the semi-empirical limit falls, with the first significant mode"
    )
    rolloff: Annotated[float, Field(ge=0)] = Field(
        1.0, description="n of (break_frequency / f)^n by which the semi-empirical amplitude falls; densities with 2 n"
    )
    design_acceleration: Level | None = Field(
        None, description="m/s^2; the force of the base stays within mass times it, of random ones three sigma"
    )
    mass: Annotated[Mass, Field(gt=0)] | None = Field(None, description="kg; default that of the body")
    max_depth: Annotated[float, Field(gt=0)] = Field(
        MAX_DEPTH, description="dB, of its notches; where they would be deeper, the limit is exceeded, with a warning"
    )

    @model_validator(mode="after")
    def _one_way(self) -> NotchTable:
        given = [key for key in WAYS if getattr(self, key) is not None]
        if len(given) != 1 or (self.factor is None) != (self.break_frequency is None):
            raise ValueError(f"a notch needs one of {'; '.join(WAYS.values())}")
        if self.limit is None and self.channel not in FORCES:
            raise ValueError(f"mass times acceleration limits {', '.join(FORCES)}, not {self.channel!r}; give 'limit'")
        return self


class OfChannels(Table):
    """What is computed from channels of a response or of the run."""

    response: str | None = Field(None, description="name of a [response]; without it the channels are of the run")
    channels: Annotated[list[str], Field(min_length=1)] = Field(
        description='names, their beginnings, or patterns such as "struts.*.N"'
    )
    kinds: ClassVar[tuple[str, ...]] = ("transient",)

    def unmet(self, kinds: Mapping[str, str], run: object) -> str:
        """Return why the channels cannot be there, by the kinds of the responses and the run; empty if they can."""
        if self.response is None:
            return "" if run is not None else "needs the channels of a run or of a response; name one by 'response'"
        if self.response not in kinds:
            return f"names the response {self.response!r}; {suggestion(self.response, kinds, 'there are')}"
        if kinds[self.response] not in self.kinds:
            return f"cannot use a {kinds[self.response]} response; it needs a {' or a '.join(self.kinds)} one"
        return ""


class ShockTable(OfChannels):
    """Shock response spectra."""

    lowest: Frequency = Field(gt=0, description="of the oscillators, Hz")
    highest: Frequency = Field(gt=0, description="of the oscillators, Hz")
    points: Annotated[int, Field(ge=2, le=10_000)] = 100
    Q: Annotated[float, Field(gt=0.5)] = Field(10.0, description="amplification, 1 / (2 damping ratio)")
    kind: Annotated[str, OneOf(KINDS)] = Field("absolute_acceleration", description="of the oscillators")
    start: Annotated[str, OneOf(STARTS)] = Field("rest", description="steady: the first value has acted for ever")

    @model_validator(mode="after")
    def _ascends(self) -> ShockTable:
        if not self.lowest < self.highest:
            raise ValueError(f"lowest = {self.lowest:g} Hz must be below highest = {self.highest:g} Hz")
        return self

    @property
    def axis(self) -> np.ndarray:
        """Frequencies, Hz."""
        return np.geomspace(self.lowest, self.highest, self.points)


class FatigueTable(OfChannels):
    """Damage by rainflow counts of histories, or of random responses; the S-N curve is one of amplitudes."""

    kinds = ("transient", "random")
    applies: ClassVar[tuple[Rule, ...]] = (Rule(("knee",), needs=("second_slope",)),)
    scale: Positive = Field(
        1.0, description="by which channels are multiplied: stress concentration, or stress per force, 1/m^2"
    )
    stress: Annotated[Allowable, Field(gt=0)] = Field(description="amplitude of a point of the S-N curve, Pa")
    cycles: Positive = Field(description="that are borne at this amplitude")
    slope: Positive = Field(description="k of the curve, N = cycles (stress / S)^k")
    second_slope: Positive | None = Field(None, description="beyond the knee; default the same")
    knee: Positive | None = Field(None, description="cycles where the second slope starts; default those of the point")
    limit: Annotated[Allowable, Field(ge=0)] = Field(0.0, description="endurance limit, an amplitude, Pa")
    ultimate: Annotated[Allowable, Field(gt=0)] | None = Field(
        None, description="tensile strength, Pa, for the mean stress by Goodman's rule; default: the mean is ignored"
    )
    repeats: Positive = Field(1.0, description="how often the history happens")
    duration: Annotated[Duration, Field(gt=0)] | None = Field(None, description="s, of a random response")
    method: Annotated[str, OneOf(METHODS)] = Field("dirlik", description="of a random response")

    def unmet(self, kinds: Mapping[str, str], run: object) -> str:
        """Return why the channels cannot be there, or what a random response lacks."""
        random = kinds.get(self.response or "") == "random"
        if problem := super().unmet(kinds, run):
            return problem
        if random and self.duration is None:
            return "needs the duration of its random response"
        for key in ("repeats", "ultimate") if random else ("duration", "method"):
            if getattr(self, key) != type(self).model_fields[key].default:
                return f"has {key!r}, which has no effect on {OF_HISTORIES if random else OF_RANDOM}; leave it out"
        return ""

    @property
    def curve(self) -> SNCurve:
        """The S-N curve."""
        names = ("stress", "cycles", "slope", "second_slope", "knee", "limit", "ultimate")
        return SNCurve(**{name: getattr(self, name) for name in names})
