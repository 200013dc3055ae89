"""Analyses and ensembles in pipeline files: equilibrium, modes, linear equations, responses, forces; many cases."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from modalprep.applies import Rule
from modalprep.formats.statespace import WRITERS
from modalprep.pipeline.schema.base import OneOf, ReferenceTable, Table
from modalprep.pipeline.schema.quantities import TEXT_TOO, AngularVelocity, Duration, Frequency, Three, in_si
from modalprep.pipeline.schema.system import EACH, THEORY, Theory
from modalprep.pipeline.schema.time import TIME, Time, form

UNITS_OF = {  # of the parameters of ensembles, by a part of their names
    **dict.fromkeys(("angle", "rotation"), ("rad",)),
    **dict.fromkeys(("free_position", "lower", "upper"), ("rad", "m")),
    **dict.fromkeys(("rate", "angular_velocity"), ("rad/s",)),
    **dict.fromkeys(("displacement", "free_length"), ("m",)),
    **dict.fromkeys(("speed", "velocity"), ("m/s",)),
    "stiffness": ("N/m", "N m/rad"),
    "damping": ("N s/m", "N m s/rad"),
    "gravity": ("m/s^2",),
}
Numbers = list[Annotated[float, TEXT_TOO]]


class ResponseTable(Table):
    """Frequencies of a response to harmonic inputs, on a logarithmic grid."""

    lowest: Frequency = Field(gt=0, description="Hz")
    highest: Frequency = Field(gt=0, description="Hz")
    points: Annotated[int, Field(ge=2, le=100_000)] = 400

    @model_validator(mode="after")
    def _ascending(self) -> ResponseTable:
        if not self.lowest < self.highest:
            raise ValueError(f"lowest = {self.lowest:g} Hz must be below highest = {self.highest:g} Hz")
        return self


class SweepTable(Table):
    """Modes at many times: loads and masses change with time, the reference state does not move."""

    until: Duration = Field(gt=0, description="s, end of the sweep, which begins at `time`")
    points: Annotated[int, Field(ge=2, le=10_000)] = 100
    modes: Annotated[int, Field(ge=1)] = Field(6, description="lowest that vibrate")
    label: str = Field("time (s)", description="label of the axis, for loads that are ramps of another parameter")
    reference: list[ReferenceTable] = Field([], description="reference frequencies (y, Hz) over time (t) for the plot")


class SensitivitiesTable(Table):
    """Derivatives of the frequencies of the finite-element model by its properties."""

    modes: Annotated[int, Field(ge=1, le=1000)] = Field(10, description="lowest modes")
    by: list[Literal["thickness", "modulus", "density", "A", "Iy", "Iz", "J", "stiffness", "mass"]] = Field(
        [], description="kinds of parameters: of shells, materials, beams and trusses, springs, masses; empty: all"
    )
    boundary: Literal["clamped", "free"] = Field("clamped", description="held at the root interface alone, or floating")


class InverseTable(Table):
    """Inverse dynamics: hinge forces of a prescribed motion."""

    motion: Annotated[dict[str, Time | list[Time]], Field(min_length=1)] = Field(
        description="by joint, m or rad: " + TIME + EACH
    )
    t_end: Duration = Field(gt=0, description="s")
    output_step: Duration = Field(0.01, gt=0, description="s")
    modes: Literal["dynamic", "quasi_static"] = Field(
        "dynamic", description="quasi_static: modes in quasi-static equilibrium at each time"
    )
    rtol: float = Field(1e-9, ge=1e-13, le=1e-2, description="relative tolerance of modes and joints without a history")


class RotorTable(Table):
    """Campbell diagram and critical speeds of a system in which a joint turns steadily."""

    joint: str = Field(description="about which the rotor turns: revolute, cylindrical, spherical or free")
    axis: Three[float] | None = Field(
        None, description="of a spherical or free joint, in the parent's frame; default: its angular velocity"
    )
    lowest: AngularVelocity = Field(0.0, ge=0, description="speed, rad/s")
    highest: AngularVelocity = Field(gt=0, description="speed, rad/s")
    points: Annotated[int, Field(ge=2, le=10_000)] = 21
    modes: Annotated[int, Field(ge=1, le=1000)] = Field(8, description="the slowest, which are followed")
    orders: Annotated[list[Annotated[float, Field(gt=0)]], Field(min_length=1)] = Field(
        [1.0], description="multiples of the speed that excite: 1 unbalance, 2 misalignment, the number of blades"
    )

    unbalance: dict[str, Three[float]] = Field(
        {}, description="by body.interface, mass times distance from the axis in the body's axes, kg m; its response"
    )

    @model_validator(mode="after")
    def _ascending(self) -> RotorTable:
        if not self.lowest < self.highest:
            raise ValueError(f"lowest = {self.lowest:g} rad/s must be below highest = {self.highest:g} rad/s")
        return self


class AnalysisTable(Table):
    """Equilibrium, modes, linear equations, frequency response and hinge forces of the system."""

    about: Literal["equilibrium", "steady", "start"] = Field(
        "equilibrium", description="reference state; steady: equilibrium while prescribed joints move"
    )
    time: Duration = Field(0.0, ge=0, description="s, at which functions of time are taken")
    theory: Theory = Field("consistent", description=THEORY)
    modes: Annotated[int, Field(ge=0)] = Field(20, description="modes of the system to list")
    inputs: list[str] = Field([], description="'joint', 'joint.2', 'body.interface.force.x', '... .torque.x'")
    outputs: list[str] = Field(
        [],
        description="'joint.angle', 'body.modal.1', 'body.interface.position.x', also velocity, acceleration, ...; "
        "'body.recovery.name.place.component'",
    )
    state_space: list[Annotated[str, OneOf(WRITERS)]] = Field([], description="files to write A, B, C, D to")
    response: ResponseTable | None = Field(None, description="of the outputs to harmonic inputs")
    sweep: SweepTable | None = Field(None, description="modes over time")
    inverse: InverseTable | None = None
    rotor: dict[str, RotorTable] = Field({}, description="Campbell diagrams, of the system without weight")

    @model_validator(mode="after")
    def _response_of_what(self) -> AnalysisTable:
        if self.response is not None and not (self.inputs and self.outputs):
            raise ValueError("a response needs both 'inputs' and 'outputs'")
        return self


class DistributionTable(Table):
    """A distribution; exactly one of its keys."""

    normal: Numbers | None = Field(None, description="[mean, standard deviation]")
    uniform: Numbers | None = Field(None, description="[lower, upper]")
    lognormal: Numbers | None = Field(None, description="[median, standard deviation of the logarithm]")
    triangular: Numbers | None = Field(None, description="[lower, mode, upper]")

    @model_validator(mode="after")
    def _one(self) -> DistributionTable:
        if len(self.given) != 1:
            raise ValueError(f"a distribution needs exactly one of {', '.join(type(self).model_fields)}")
        return self

    @property
    def given(self) -> dict[str, Numbers]:
        """The distribution by its name."""
        return {name: numbers for name, numbers in self if numbers is not None}


Values = Annotated[Annotated[Numbers, Tag("list")] | Annotated[DistributionTable, Tag("table")], Discriminator(form)]


def _without_units(name: str, given: Any) -> Any:
    """Return the values of a parameter in SI where they are text with a unit that the parameter has."""
    if isinstance(given, dict):
        return {key: _without_units(name, numbers) for key, numbers in given.items()}
    if not isinstance(given, list):
        return given
    units = next((UNITS_OF[part] for part in name.split(".") if part in UNITS_OF), ())
    return [_number(name, value, units) if isinstance(value, str) else value for value in given]


def _number(name: str, text: str, units: tuple[str, ...]) -> float:
    try:
        number = in_si(text, units) if units else None
    except ValueError as error:
        raise ValueError(f"{name!r}: {error}") from None
    if number is None:
        expected = f"a number with a unit of {' or '.join(units)}" if units else "a number without a unit"
        raise ValueError(f"{name!r}: {text!r} is not {expected}; write the number in SI units")
    return number


class CollectTable(Table):
    """Channels of the run that join the quantities of a job: smallest and largest are those of the output times."""

    channels: Annotated[list[str], Field(min_length=1)] = Field(description="a vector gives its components")
    statistics: Annotated[list[Literal["min", "max", "rms", "final"]], Field(min_length=1)] = Field(
        ["min", "max", "rms", "final"], description="of each component"
    )


class EnsembleTable(Table):
    """Many runs of the [simulation] that differ in start values, parameters of joints and loads, or gravity."""

    applies: ClassVar[tuple[Rule, ...]] = (Rule(("pool", "workers"), beside=("scheduler",)),)

    parameters: Annotated[dict[str, Values], Field(min_length=1)] = Field(
        description='by name in quotes, such as "hinge.angle", "stay.stiffness", "push.amplitude", "gravity.y": a '
        "distribution such as { normal = [0.0, 0.1] }, or a list with a value for each case"
    )
    cases: Annotated[int, Field(ge=1, le=1_000_000)] | None = Field(
        None, description="number of cases; not needed where a parameter has a list"
    )
    seed: Annotated[int, Field(ge=0)] = Field(0, description="equal seeds draw equal cases")
    sampling: Literal["random", "latin_hypercube", "sobol"] = Field(
        "random", description="sobol: best with a power of two cases"
    )
    channels: Annotated[list[str], Field(min_length=1)] = Field(description="that are kept, plotted and tabulated")
    percentiles: Annotated[list[Annotated[float, Field(ge=0, le=100)]], Field(min_length=1)] = Field(
        [5.0, 50.0, 95.0], description="of the bands and tables, %"
    )
    pool: Literal["threads", "processes"] = Field(
        "threads",
        description="processes take seconds to start, and run the set-up of small systems at the same time; a job of a "
        "batch has threads",
    )
    workers: Annotated[int, Field(ge=1)] | None = Field(
        None, description="threads or processes; default one for each processor"
    )
    scheduler: str | None = Field(
        None, description="address of a Dask scheduler whose workers run the cases instead, such as tcp://host:8786"
    )

    @model_validator(mode="before")
    @classmethod
    def _texts_are_numbers(cls, data: Any) -> Any:
        parameters = data.get("parameters") if isinstance(data, dict) else None
        if not isinstance(parameters, dict):
            return data
        return data | {"parameters": {name: _without_units(name, given) for name, given in parameters.items()}}

    @field_validator("scheduler")
    @classmethod
    def _address(cls, scheduler: str | None) -> str | None:
        if scheduler is not None and ":" not in scheduler:
            raise ValueError(f"{scheduler!r} is no address; write for example 'tcp://host:8786'")
        return scheduler

    @model_validator(mode="after")
    def _counted(self) -> EnsembleTable:
        lengths = {name: len(values) for name, values in self.parameters.items() if isinstance(values, list)}
        if self.cases is None and not lengths:
            raise ValueError("an ensemble of distributions needs the number of 'cases'")
        if len(lengths) == len(self.parameters) and (self.seed or self.sampling != "random"):
            raise ValueError("'seed' and 'sampling' have no effect without a distribution; leave them out")
        for name, length in lengths.items():
            if length != self.count:
                raise ValueError(f"{name!r} has {length} values, but there are {self.count} cases; give one for each")
        return self

    @property
    def count(self) -> int:
        """Number of cases."""
        if self.cases is not None:
            return self.cases
        return next(len(values) for values in self.parameters.values() if isinstance(values, list))
