"""Environment in pipeline files: gravity, orbit, conductors in its magnetic field, water, control laws."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from modalprep.applies import Rule
from modalprep.multibody.model.environment import EARTH_MU, EARTH_RADIUS, EARTH_SPIN
from modalprep.pipeline.schema.base import FileName, Table, Vector
from modalprep.pipeline.schema.quantities import (
    Acceleration,
    Angle,
    AngularVelocity,
    Density,
    Duration,
    Length,
    MagneticField,
    PlanetConstant,
    Three,
    Velocity,
    or_expression,
)
from modalprep.pipeline.schema.time import form

Laws = Annotated[list[str | float], Field(min_length=3, max_length=3)]


class ControlTable(Table):
    """A control law: expressions of t and of channels."""

    applies: ClassVar[tuple[Rule, ...]] = (Rule(("axes",), needs=("force", "torque")),)

    at: str = Field(description="'body.interface', or a joint")
    force: Annotated[Laws | None, or_expression("N")] = Field(
        None, description="on the interface, N; expressions: '-2*arm.tip.velocity.x'"
    )
    torque: Annotated[Laws | None, or_expression("N m")] = Field(None, description="on the interface, N m")
    values: list[str | float] | None = Field(
        None, description="of a joint instead, N or N m, one for each of its speeds: '-3*hinge.angle - hinge.rate'"
    )
    axes: Literal["inertial", "body"] = Field("inertial", description="of force and torque")

    @model_validator(mode="after")
    def _one_kind(self) -> ControlTable:
        if (self.values is None) == (self.force is None and self.torque is None):
            raise ValueError("a control needs 'force' or 'torque' of an interface, or 'values' of a joint")
        return self


class FmuTable(Table):
    """A functional mock-up unit of another program beside the system: a controller, an actuator, a force."""

    applies: ClassVar[tuple[Rule, ...]] = (Rule(("axes",), needs=("force", "torque")),)

    file: FileName = Field(description="for co-simulation, of FMI 2.0 or 3.0")
    at: str = Field(description="'body.interface', or a joint")
    inputs: dict[str, str | float] = Field(
        {}, description="its inputs: expressions of t and of channels, as in [controls]"
    )
    force: Laws | None = Field(
        None, description="on the interface, N: its outputs by their names, '-fx' the other way, or 0"
    )
    torque: Laws | None = Field(None, description="on the interface, N m, likewise")
    values: list[str | float] | None = Field(None, description="of a joint instead, an output for each of its speeds")
    axes: Literal["inertial", "body"] = Field("inertial", description="of force and torque")
    step: Duration | None = Field(None, gt=0, description="between two exchanges, s; that which the FMU asks for")
    start: dict[str, float] = Field({}, description="its parameters and start values")

    @model_validator(mode="after")
    def _one_kind(self) -> FmuTable:
        if (self.values is None) == (self.force is None and self.torque is None):
            raise ValueError("an FMU needs 'force' or 'torque' on an interface, or 'values' of a joint")
        return self

    @property
    def outputs(self) -> list[str | float]:
        """The outputs, those of force and torque in turn."""
        if self.values is not None:
            return self.values
        zero: list[str | float] = [0.0, 0.0, 0.0]
        return [*(self.force or zero), *(self.torque or zero)]


class CentralTable(Table):
    """Gravity of a planet, with its gradient over each body."""

    mu: PlanetConstant = Field(gt=0, description="m^3/s^2; 3.986004418e14 for the Earth")
    centre: Three[Length] = Field([0.0, 0.0, 0.0], description="m")


class WaterTable(Table):
    """Water with a steady current; immersed bodies are listed in [immersed]."""

    density: Density = Field(1025.0, gt=0, description="kg/m^3")
    current: Three[Velocity] | list[Three[Velocity]] = Field(
        [0.0, 0.0, 0.0], description="m/s; or one for each of `depths`"
    )
    depths: Annotated[list[Length], Field(min_length=1)] = Field([0.0], description="m below the surface, increasing")
    up: Vector = Field([0.0, 0.0, 1.0], description="direction")
    surface: Length = Field(0.0, description="where the depth is zero, m along `up`")


class DipoleTable(Table):
    """Magnetic field of a planet, rotating with it."""

    strength: MagneticField = Field(
        gt=0, description="on the magnetic equator at `radius`, T; about 3.12e-5 for the Earth"
    )
    radius: Length = Field(EARTH_RADIUS, gt=0, description="m")
    tilt: Angle = Field(0.0, description="between the axes of dipole and planet")
    longitude: Angle = Field(0.0, description="of the dipole's axis at the start, from the ascending node")


class OrbitTable(Table):
    """Circular orbit of the ground: x up, y along the flight, z normal to the orbit."""

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("mu",), beside=("rate",), advice="give the rate, or mu with the altitude or the radius"),
    )

    altitude: Length | None = Field(None, description="above the equator of the Earth, m")
    radius: Length | None = Field(None, gt=0, description="instead, m")
    rate: AngularVelocity | None = Field(
        None, gt=0, description="instead, rad/s: gravity to first order in distances (Hill)"
    )
    mu: PlanetConstant = Field(EARTH_MU, gt=0, description="of the planet, m^3/s^2")
    inclination: Angle = Field(0.0, description="to the planet's equator")
    argument_of_latitude: Angle = Field(0.0, description="from the ascending node to the origin at the start")
    planet_spin: AngularVelocity = Field(EARTH_SPIN, description="rad/s")
    dipole: DipoleTable | None = None

    @model_validator(mode="after")
    def _one_size(self) -> OrbitTable:
        if sum(size is not None for size in (self.altitude, self.radius, self.rate)) != 1:
            raise ValueError("an orbit needs one of 'altitude', 'radius' and 'rate'")
        return self


class EnvironmentTable(Table):
    """Loads on every body."""

    gravity: Annotated[
        Annotated[Three[Acceleration], Tag("list")] | Annotated[CentralTable, Tag("table")], Discriminator(form)
    ] = Field(default=[0.0, 0.0, 0.0], description="m/s^2, or { mu, centre } of a planet")
    orbit: OrbitTable | None = Field(default=None, description="the ground is the local frame of a circular orbit")
    water: WaterTable | None = Field(default=None, description="that surrounds the bodies of [immersed]")
