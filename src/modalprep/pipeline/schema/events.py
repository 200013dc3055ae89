"""What a pipeline file may say of events: when they come, and what begins, ends or is hit then."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from modalprep.multibody.model.events import Event
from modalprep.pipeline.schema.base import Table

DIRECTIONS = {"both": 0, "rising": 1, "falling": -1}


class EventTable(Table):
    """A zero crossing that is located; closures may begin, end or be hit there."""

    when: str = Field(description="what crosses zero: channels and t, 'port.gap', 'arm.angle - pi/2'")
    direction: Literal["both", "rising", "falling"] = "both"
    terminal: bool = Field(False, description="whether the run ends there")
    begins: list[str] = Field([], description="closures that hold from there on, as a sudden constraint")
    ends: list[str] = Field([], description="closures that are let go")
    hits: list[str] = Field([], description="closures that act as a blow only")
    restitution: Annotated[float, Field(ge=0, le=1)] = Field(0.0, description="of the hits")
    once: bool = Field(False, description="whether it does so the first time only")


def read_events(tables: dict[str, EventTable]) -> tuple[Event, ...]:
    """Return the events that a pipeline file describes.

    Examples
    --------
    >>> read_events({"dock": EventTable(when="port.gap", direction="falling", begins=["port"])})[0].direction
    -1
    """
    return tuple(
        Event(name=name, **table.model_dump() | {"direction": DIRECTIONS[table.direction]})
        for name, table in tables.items()
    )
