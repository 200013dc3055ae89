"""Deployments in pipeline files: beams, cables and tethers that deploy from a body."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from modalprep.pipeline.schema.base import Table, Vector
from modalprep.pipeline.schema.system import Constant
from modalprep.pipeline.schema.time import TIME, Time

Positive = Annotated[float, Field(gt=0)]


class DeploymentTable(Table):
    """A beam, cable or tether that deploys through an exit, as rigid rods whose number changes: see `Deployment`."""

    parent: str = Field("ground", description="the exit: 'ground' or an interface of a rigid body, 'body.interface'")
    axis: Vector = Field([1.0, 0.0, 0.0], description="direction of deployment, in the parent's frame")
    normal: Vector = Field([0.0, 0.0, 1.0], description="of the bending plane, in the parent's frame")
    position: Vector = Field([0.0, 0.0, 0.0], description="of an exit in the ground, m")
    length: Positive = Field(description="total length, m")
    segments: int = Field(ge=1, le=100_000, description="number of rods of equal length")
    mass_per_length: Positive = Field(description="kg/m")
    EI: Constant = Field(0.0, description="bending stiffness, N m^2; 0 for a cable or tether")
    damping: Constant = Field(0.0, description="damping over stiffness of the material, s")
    deployed_length: Time | None = Field(None, description="prescribed (m), its rate may jump: " + TIME)
    tension: Time | None = Field(None, description="of a free reel, N, instead of deployed_length: " + TIME)
    brake: Constant = Field(0.0, description="viscous brake of a free reel, N s/m")
    initial_length: float = Field(0.0, ge=0, description="deployed length of a free reel at the start, m")
    initial_speed: float = Field(0.0, description="its rate at the start, m/s")
    stop_time: float | None = Field(None, ge=0, description="s, from which the deployed length is constant")
    spatial: bool = Field(False, description="true: a cable moves in space; false: in the plane of the normal")
    rotary_inertia: Constant = Field(0.0, description="of the cross-section about the axis, per length, kg m")
    deflection: float = Field(
        0.0, description="initial deflection of a beam's tip, in the shape due to a static tip force, m"
    )
