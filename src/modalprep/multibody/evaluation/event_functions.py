"""The functions of time whose zeros are the events of a run, and how quickly they may change."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from modalprep.compiler.jit import bound
from modalprep.errors import InputError
from modalprep.multibody.evaluation.evaluate import Equations, evaluate
from modalprep.multibody.evaluation.expressions import CHANNEL, compile_expressions, read_channels
from modalprep.multibody.evaluation.loading import Loading, frames
from modalprep.multibody.evaluation.state import State
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed

TURNING = {"position", "rotation", "velocity", "angular_velocity", "gap", "multiplier", "recovery"}  # parts of channels
MOST_POWER = 4  # of polynomials, which the nodes of a panel show


class Observer(Protocol):
    """What reads channels from the accelerations of a state, such as `results.recovered_state.RecoveredState`."""

    @property
    def wanted(self) -> Mapping:
        """What it has been asked for; empty where nothing is to be observed."""
        ...

    def reader(self, name: str, what: str) -> Callable[[State], float] | None:
        """Return ``state -> value`` of a channel that it knows."""

    def observe(self, eq: Equations, t: float, y: np.ndarray, ydot: np.ndarray) -> None:
        """Take the values of a state after `evaluate`."""


class EventFunction:
    """``(t, state) -> [value, phases ...]`` of an event.

    Phases are the arguments of the sines and cosines in it: how far it turns from one time to another.

    Attributes
    ----------
    is_condition : bool
        Whether it returned true or false, which count as 1 and -1.
    turns : bool
        Whether it depends on places and velocities of bodies, which turn with them.
    is_unbounded : bool
        Whether nothing tells how quickly it changes: it is a Python function, or has other functions than sine, cosine
        and small powers.
    """

    def __init__(self, event: Event, made: Callable[[str], tuple]) -> None:
        self.event, self.is_condition, self.wraps = event, False, False
        self.turns, self.is_unbounded, self._of_time = True, True, False
        when = event.when
        if callable(when):
            self._values = lambda t, state: [when(t, state)]
        else:
            value, known, numbers = made(when)
            compiled = compile_expressions(known, [value, *_phases(value)])
            self._values = lambda t, state: compiled(numbers(t, state)).tolist()
            names = CHANNEL.findall(when)
            self._of_time = not names
            self.is_unbounded = not _is_gentle(value)
            self.turns = any(TURNING & set(name.split(".")) for name in names)
            self.wraps = any(".rotation." in name for name in names)

    def __call__(self, t: float, state: State) -> list[float]:
        """Return the value and the phases; an infinite value where a Python function divides by zero."""
        try:
            value, *phases = self._values(t, state)
        except ZeroDivisionError:
            return [np.inf]
        if isinstance(value, bool | np.bool_):
            self.is_condition = True
            value = 1.0 if value else -1.0
        return [_number(self.event, t, value), *phases]

    def is_of_time(self, t: float) -> bool:
        """Whether it depends on time only: an expression without channels, or a Python function that needs no state."""
        if not callable(self.event.when):
            return self._of_time
        try:
            self.event.when(t, None)
        except Exception:
            return False
        return True


def event_functions(
    system: System, packed: Packed, loading: Loading, events: Sequence[Event], observer: Observer | None = None
) -> list[EventFunction]:
    """Return the function of each event.

    Raises
    ------
    InputError
        When the expression cannot be read or names no channel.
    """
    others = observer.reader if observer else None

    def made(event: Event) -> Callable[[str], tuple]:
        return lambda text: read_channels(system, packed, text, f"event {event.name!r}", loading.loops, others)

    return [EventFunction(event, made(event)) for event in events]


def state_reader(
    system: System,
    packed: Packed,
    loading: Loading,
    eq: Equations,
    events: Sequence[Event],
    observer: Observer | None = None,
) -> Callable[[float], State]:
    """Return ``t -> state``: what is in `eq.state`, with what the events ask for."""
    texts = [event.when for event in events if not callable(event.when)]
    forces = any(name.endswith(".multiplier") for text in texts for name in CHANNEL.findall(text))
    ydot = np.zeros(packed.nx + packed.nu + 1)
    frame = frames(packed, eq.data)
    watched = observer if observer is not None and observer.wanted else None
    outward = bound(kernel.outward_in_world, eq.model, eq.data, eq.state, loading.motion)

    def state(t: float) -> State:
        motion = loading.prescribe(t, eq.data)
        if forces or watched:
            y = np.append(eq.state, 0.0)
            evaluate(eq, t, y, ydot)
            if watched:
                watched.observe(eq, t, y, ydot)
            return State(system, packed, eq.state, motion, frame)
        outward()
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


def _parts(value: Any) -> Iterator[Any]:
    """Yield an expression and all within it."""
    yield value
    for part in value.args:
        yield from _parts(part)


def _phases(value: Any) -> list[Any]:
    """Return the different arguments of sines, cosines and tangents that are no numbers."""
    import symengine

    turning = symengine.sin, symengine.cos, symengine.tan
    found = [part.args[0] for part in _parts(value) if isinstance(part, turning) and part.free_symbols]
    return list(dict.fromkeys(found))


def _is_gentle(value: Any) -> bool:
    """Whether an expression has sines, cosines, products and small powers only."""
    import symengine

    if not value.free_symbols or isinstance(value, symengine.Symbol):
        return True
    if value.is_Pow:
        power = value.args[1]
        small = power.is_Integer and 0 < int(power) <= MOST_POWER
        return small and _is_gentle(value.args[0])
    known = symengine.Add, symengine.Mul, symengine.sin, symengine.cos
    return isinstance(value, known) and all(map(_is_gentle, value.args))
