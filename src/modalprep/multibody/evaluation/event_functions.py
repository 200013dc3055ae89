"""The functions of time whose zeros are the events of a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.evaluation.evaluate import Equations, evaluate
from modalprep.multibody.evaluation.expressions import CHANNEL, channel_expression
from modalprep.multibody.evaluation.loading import Loading, frames
from modalprep.multibody.evaluation.state import State
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.kernels.interfaces import world
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed


class Observer(Protocol):
    """What reads channels from the accelerations of a state, such as `results.recovered_state.RecoveredState`."""

    wanted: Mapping

    def reader(self, name: str, what: str) -> Callable[[State], float] | None:
        """Return ``state -> value`` of a channel that it knows."""

    def observe(self, eq: Equations, t: float, y: np.ndarray, ydot: np.ndarray) -> None:
        """Take the values of a state after `evaluate`."""


def event_functions(
    system: System, packed: Packed, loading: Loading, events: Sequence[Event], observer: Observer | None = None
) -> list[Callable[[float, State], float]]:
    """Return ``(t, state) -> value`` of each event.

    Raises
    ------
    InputError
        When the expression cannot be read or names no channel.
    """
    others = observer.reader if observer else None

    def function(event: Event) -> Callable[[float, State], float]:
        value = event.when
        if not callable(value):
            value = channel_expression(system, packed, value, f"event {event.name!r}", loading.loops, others)
        return lambda t, state: _number(event, t, value(t, state))

    return [function(event) for event in events]


def state_reader(
    system: System, packed: Packed, loading: Loading, eq: Equations, events: Sequence[Event],
    observer: Observer | None = None,
) -> Callable[[float], State]:  # fmt: skip
    """Return ``t -> state``: what the compiled loop left in `eq.state`, with what the events ask for."""
    texts = [event.when for event in events if not callable(event.when)]
    forces = any(name.endswith(".multiplier") for text in texts for name in CHANNEL.findall(text))
    ydot, frame = np.zeros(packed.nx + packed.nu + 1), frames(packed, eq.data)
    watched = observer is not None and bool(observer.wanted)

    def state(t: float) -> State:
        motion = loading.prescribe(t, eq.data)
        if forces or watched:
            y = np.append(eq.state, 0.0)
            evaluate(eq, t, y, ydot)
            if watched:
                observer.observe(eq, t, y, ydot)
            return State(system, packed, eq.state, motion, frame)
        kernel.outward(eq.model, eq.data, eq.state, motion)
        world(eq.model, eq.data)
        if loading.loops:
            loading.loops.residual(eq.data, eq.state, motion, t)
        return State(system, packed, eq.state, motion, frame)

    return state


def _number(event: Event, t: float, value: Any) -> float:
    """Return the value of an event function; refuse what is no number, of which no sign tells a crossing."""
    try:
        found = float(np.asarray(value, dtype=float))
    except (TypeError, ValueError):
        raise InputError(
            f"event {event.name!r}: its function returned {value!r} at t = {t:g} s; return a number"
        ) from None
    if np.isnan(found):
        raise InputError(
            f"event {event.name!r}: its function is not a number at t = {t:g} s; give one that is defined there"
        )
    return found
