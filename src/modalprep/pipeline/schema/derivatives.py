"""Derivatives of the run of a pipeline file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from modalprep.pipeline.schema.base import Table


class ObjectiveTable(Table):
    """A number that the run makes, of which the derivatives are taken: one of these."""

    last: str | None = Field(None, description="a channel, at the end of the run")
    integral: str | None = Field(None, description="a channel, over the time")
    integral_of_square: str | None = Field(None, description="the square of a channel, over the time")

    @model_validator(mode="after")
    def _is_one(self) -> ObjectiveTable:
        if len(self.named) != 1:
            raise ValueError("an objective is one of 'last', 'integral' and 'integral_of_square'; give one of them")
        return self

    @property
    def named(self) -> dict[str, str]:
        """The channel by what is made of it."""
        return self.model_dump(exclude_none=True)


class RunSensitivitiesTable(Table):
    """Derivatives of the [simulation] by parameters: of histories of channels, and of one number."""

    parameters: Annotated[list[str], Field(min_length=1)] = Field(
        description='names such as "hinge.stiffness", "hinge.angle" (at the start), "push.amplitude", "gravity.y", '
        '"disc.mass", "arm.mode_stiffness.2"'
    )
    channels: list[str] = Field(
        [], description='single numbers whose histories are differentiated, such as "arm.tip.position.x"'
    )
    objective: ObjectiveTable | None = Field(None, description='such as { last = "hinge.angle" }')
    rtol: float = Field(1e-8, gt=0, description="relative tolerance of this run; steps end at its output times")

    @model_validator(mode="after")
    def _has_channels(self) -> RunSensitivitiesTable:
        if not self.channels and self.objective is None:
            raise ValueError("name 'channels', or an 'objective', or both")
        return self
