"""What an FMU cannot carry."""

from __future__ import annotations

from collections.abc import Sequence

from modalprep.errors import InputError
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.loads import Callback
from modalprep.multibody.model.system import System


def refuse_python(system: System) -> None:
    """Refuse a system whose loads are functions of Python."""
    for load in system.loads:
        if isinstance(load, Callback):
            raise InputError(
                f"an FMU holds no Python, and load {load.name!r} is a Python function or a control law; leave it out, "
                "give the joint or the force that it drives a number, which becomes an input, and put the controller "
                "into the importing program"
            )


def refuse_far_deflections(system: System) -> None:
    """Refuse a system with a body of stations."""
    for name, body in system.bodies.items():
        if body.stations is not None:
            raise InputError(
                f"an FMU cannot carry body {name!r}, which has stations; build it with large_deflection = false"
            )


def refuse_changes(events: Sequence[Event]) -> None:
    """Refuse events that change the system."""
    for event in events:
        if event.changes:
            raise InputError(f"an FMU cannot carry event {event.name!r}, which changes closures; leave it out")
