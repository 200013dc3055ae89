"""What a pipeline file may say of control laws."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from modalprep.pipeline.tables import Table


class ControlTable(Table):
    """Forces that are expressions of what the system does."""

    on: str = Field(description="joint, or 'body.interface'")
    law: Annotated[list[str], Field(min_length=1)] = Field(
        description="force (N) or torque (N m) in each speed of the joint; force, or force and torque on the "
        "interface, inertial axes; expressions of t and of channels: 'hinge.angle', 'hinge.rate', 'joint.angle.2', "
        "'body.interface.position.x', '.velocity.x', '.rotation.x' (a rotation vector), '.spin.x', 'body.modal.1'"
    )
