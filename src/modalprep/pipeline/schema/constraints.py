"""Closures and couplers in pipeline files."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from modalprep.multibody.model.constraints import ClosureType
from modalprep.pipeline.schema.base import Table, Vector
from modalprep.pipeline.schema.quantities import AnyVelocity, Length, three
from modalprep.pipeline.schema.reduction import RotationTable
from modalprep.pipeline.schema.time import TIME, Time

END = "'body.interface' or 'ground'"


class ClosureTable(Table):
    """A joint or a condition that closes a loop of the tree, or connects a body to the ground."""

    type: ClosureType = Field(description="a joint, or point_on_line, point_on_plane, distance, position")
    a: str = Field(description=END)
    b: str = Field("ground", description=END)
    axis: Vector = Field([0.0, 0.0, 1.0], description="of the joint, line or plane, in a's axes")
    second_axis: Vector | None = Field(None, description="of a universal joint, fixed in b, in a's axes at zero")
    position: three(Length) = Field([0.0, 0.0, 0.0], description="of the end on the ground, m")
    rotation: RotationTable | None = Field(None, description="b's axes to a's axes at zero angle")
    length: Time | None = Field(None, description="of a distance, m; default as at the start: " + TIME)
    path: Annotated[list[Time], Field(min_length=3, max_length=3)] | None = Field(
        None, description='of a position: b relative to a, m, each component "free" or ' + TIME
    )
    friction_coefficient: Annotated[float, Field(ge=0)] = Field(0.0, description="of a point on a line or plane")
    transition_velocity: Annotated[AnyVelocity, Field(gt=0)] = Field(
        1e-3, description="of friction, from sticking to sliding, m/s"
    )
    active: bool = Field(True, description="false: inactive until an event activates it")


class CouplerTable(Table):
    """A linear relation of joint coordinates: gears, rack and pinion, screw, a driven joint."""

    factors: dict[str, float] = Field(
        description="by joint, or joint.k for its coordinate k, translations before rotations"
    )
    value: Time | None = Field(None, description="of the sum, m or rad; default as at the start: " + TIME)
    active: bool = Field(True, description="false: inactive until an event activates it")
