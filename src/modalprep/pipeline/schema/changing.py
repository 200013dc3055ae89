"""Systems that change in pipeline files: bodies that deplete, their jets, what deploys from a body, and events."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from modalprep.applies import Rule
from modalprep.multibody.model.events import Event
from modalprep.pipeline.schema.base import FileName, Table, Vector
from modalprep.pipeline.schema.quantities import (
    BendingStiffness,
    Damping,
    Duration,
    Force,
    InertiaPerLength,
    Length,
    Mass,
    MassFlow,
    MassPerLength,
    Three,
    Velocity,
    or_expression,
)
from modalprep.pipeline.schema.system import Inertia
from modalprep.pipeline.schema.time import TIME, PieceTable, Time

DIRECTIONS = {"both": 0, "rising": 1, "falling": -1}  # of a zero crossing
Rate = Annotated[MassFlow, Field(ge=0)] | list[PieceTable]


class LevelTable(Table):
    """A body at another fill level: a rigid body, scaled densities, or a modal file with the same modes."""

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("centre", "inertia"), needs=("mass",), advice="it is that of a rigid body"),
    )

    mass: Mass | None = Field(None, gt=0, description="of a rigid body, kg")
    centre: Three[Length] = Field([0.0, 0.0, 0.0], description="of mass of a rigid body, m")
    inertia: Inertia = Field([0.0, 0.0, 0.0], description="of a rigid body about its centre of mass, as in [bodies]")
    density_factor: float | None = Field(None, gt=0, description="factor on all densities of the body")
    file: FileName | None = Field(None, description="modal file with the modes of the body")

    @model_validator(mode="after")
    def _one_source(self) -> LevelTable:
        if sum(source is not None for source in (self.mass, self.density_factor, self.file)) != 1:
            raise ValueError("a fill level needs either 'mass', 'density_factor' or 'file'")
        return self


class DepletionTable(Table):
    """A body whose mass decreases."""

    body: str = Field(description="as it is in [bodies], full")
    empty: LevelTable = Field(description="the empty body")
    intermediate: list[LevelTable] = Field(
        [], description="fill levels between full and empty, where the density does not change uniformly"
    )
    rate: Rate | None = Field(
        None,
        description="mass flow rate, kg/s, until the body is empty; pieces [{ value, until }, ...] if throttled",
    )
    mass: Annotated[Time | None, or_expression("kg")] = Field(
        None, description="of the body (kg), instead of a rate: " + TIME
    )

    @model_validator(mode="after")
    def _one_law(self) -> DepletionTable:
        if (self.rate is None) == (self.mass is None):
            raise ValueError("a depletion needs either 'rate' or 'mass'")
        if isinstance(self.rate, list) and not all(isinstance(piece.value, float) for piece in self.rate):
            raise ValueError("the pieces of a rate are numbers; give the mass as a function of time instead")
        return self


class JetTable(Table):
    """Gas that leaves through an exit."""

    at: str = Field(description="'body.interface', the exit")
    depletion: str = Field(description="the depletion that supplies the gas")
    speed: Velocity = Field(ge=0, description="exhaust velocity, m/s")
    axis: Vector = Field(description="direction of the exhaust, in the axes of the exit, opposite to the thrust")
    mass_fraction: float = Field(1.0, ge=0, le=1, description="of the mass lost that leaves through this exit")
    pressure: Force = Field(0.0, ge=0, description="N, exit pressure times exit area, while gas flows")
    flow_path: list[str] = Field(
        [],
        description="'body.interface' along which the gas flows to the exit; its Coriolis force damps rotation",
    )


class DeploymentTable(Table):
    """A beam, cable or tether that deploys through an exit, as rigid rods whose number changes: see `Deployment`."""

    parent: str = Field("ground", description="the exit: 'ground' or an interface of a rigid body, 'body.interface'")
    axis: Vector = Field([1.0, 0.0, 0.0], description="direction of deployment, in the parent's frame")
    normal: Vector = Field([0.0, 0.0, 1.0], description="of the bending plane, in the parent's frame")
    position: Three[Length] = Field([0.0, 0.0, 0.0], description="of an exit in the ground, m")
    length: Length = Field(gt=0, description="total length, m")
    segments: int = Field(ge=1, le=100_000, description="number of rods of equal length")
    mass_per_length: MassPerLength = Field(gt=0, description="kg/m")
    EI: BendingStiffness = Field(0.0, ge=0, description="bending stiffness, N m^2; 0 for a cable or tether")
    damping: Duration = Field(0.0, ge=0, description="damping over stiffness of the material, s")
    deployed_length: Annotated[Time | None, or_expression("m")] = Field(
        None, description="prescribed (m), its rate may jump: " + TIME
    )
    tension: Annotated[Time | None, or_expression("N")] = Field(
        None, description="of a free reel, N, instead of deployed_length: " + TIME
    )
    brake: Damping = Field(0.0, ge=0, description="viscous brake of a free reel, N s/m")
    initial_length: Length = Field(0.0, ge=0, description="deployed length of a free reel at the start, m")
    initial_speed: Velocity = Field(0.0, description="its rate at the start, m/s")
    stop_time: Duration | None = Field(None, ge=0, description="s, from which the deployed length is constant")
    spatial: bool = Field(False, description="true: a cable moves in space; false: in the plane of the normal")
    rotary_inertia: InertiaPerLength = Field(
        0.0, ge=0, description="of the cross-section about the axis, per length, kg m"
    )
    deflection: Length = Field(
        0.0, description="initial deflection of a beam's tip, in the shape due to a static tip force, m"
    )


class EventTable(Table):
    """A zero crossing to be located; there closures may become active or inactive, or act as an impact."""

    when: str = Field(description="what crosses zero: channels and t, 'port.gap', 'arm.angle - pi/2'")
    direction: Literal["both", "rising", "falling"] = "both"
    terminal: bool = Field(False, description="whether the run ends there")
    activates: list[str] = Field([], description="closures that become active, with the impulse that this takes")
    deactivates: list[str] = Field([], description="closures that are released")
    impacts: list[str] = Field([], description="closures that act as an impulse at that time only")
    restitution: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0, description="coefficient of restitution of the impacts"
    )
    once: bool = Field(False, description="whether it changes closures at its first occurrence only")


def read_events(tables: dict[str, EventTable]) -> tuple[Event, ...]:
    """Return the events that a pipeline file describes.

    Examples
    --------
    >>> read_events({"dock": EventTable(when="port.gap", direction="falling", activates=["port"])})[0].direction
    -1
    """
    return tuple(
        Event(name=name, direction=DIRECTIONS[table.direction], **table.model_dump(exclude={"direction"}))
        for name, table in tables.items()
    )
