"""Targets of joint positions and speeds in pipeline files."""

from __future__ import annotations

from typing import Annotated

from pydantic import Discriminator, Field, Tag

from modalprep.pipeline.schema.base import Table
from modalprep.pipeline.schema.quantities import AngularVelocity, Length, Three, Velocity
from modalprep.pipeline.schema.reduction import RotationTable
from modalprep.pipeline.schema.time import form

PARTS = "three numbers, or those that count, such as { x = 1.2, y = 0 }: "


class PlaceTable(Table):
    """Coordinates that a place should have; others are free."""

    x: Length | None = None
    y: Length | None = None
    z: Length | None = None


class VelocityTable(Table):
    """Velocities that a place should have; others are free."""

    x: Velocity | None = None
    y: Velocity | None = None
    z: Velocity | None = None


class SpinTable(Table):
    """Angular velocities that an interface should have; others are free."""

    x: AngularVelocity | None = None
    y: AngularVelocity | None = None
    z: AngularVelocity | None = None


Place = Annotated[Annotated[Three[Length], Tag("list")] | Annotated[PlaceTable, Tag("table")], Discriminator(form)]
Speed = Annotated[Annotated[Three[Velocity], Tag("list")] | Annotated[VelocityTable, Tag("table")], Discriminator(form)]
Spin = Annotated[
    Annotated[Three[AngularVelocity], Tag("list")] | Annotated[SpinTable, Tag("table")], Discriminator(form)
]


class TargetTable(Table):
    """Where an interface should be, and how it should move, in the axes of the ground."""

    position: Place | None = Field(None, description=PARTS + "m")
    rotation: RotationTable | None = None
    velocity: Speed | None = Field(None, description=PARTS + "m/s")
    angular_velocity: Spin | None = Field(None, description=PARTS + "rad/s")
    weight: float = Field(1.0, gt=0, description="of its errors, where not all targets can be met")


class InverseKinematicsTable(Table):
    """Start values of the joints for which loops are closed, and interfaces are and move as they should."""

    targets: dict[str, TargetTable] = Field({}, description="by 'body.interface'; none: only the loops are closed")
    given: list[str] = Field([], description="joints, or 'joint.2', that keep their start values and rates")
    free: list[str] | None = Field(None, description="instead: joints that may move; default all others")
    weights: dict[str, Annotated[float, Field(gt=0)]] = Field(
        {}, description="how much a joint stays at its start, beside the others with 1"
    )
    nearest: bool = Field(False, description="true: targets that cannot all be met are met as nearly as they can")
