"""Events in pipeline files: when they occur, and which closures they activate, deactivate or let act as impacts."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from modalprep.multibody.model.events import Event
from modalprep.pipeline.schema.base import Table

DIRECTIONS = {"both": 0, "rising": 1, "falling": -1}


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
        Event(name=name, **table.model_dump() | {"direction": DIRECTIONS[table.direction]})
        for name, table in tables.items()
    )
