"""Events: zero crossings of channels, of expressions of channels and time, or of Python functions."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody import kernel
from modalprep.multibody.evaluate import Model
from modalprep.multibody.layout import PRESCRIBED_REVOLUTE, REVOLUTE, XQ, Packed
from modalprep.multibody.loading import Loading
from modalprep.multibody.loads import locate
from modalprep.multibody.state import Frame, State
from modalprep.multibody.system import System
from modalprep.records import Record
from modalprep.suggest import suggestion

CHANNEL = re.compile(r"[^\W\d]\w*(?:\.\w+)+")
AXES = {"x": 0, "y": 1, "z": 2}
PARTS = ("position", "velocity", "spin")
PLACES, RATES = ("angle", "displacement"), ("rate", "speed")


@dataclass(frozen=True, eq=False, kw_only=True)
class Event(Record):
    """A zero crossing to be located; `Result.events` has its times.

    Attributes
    ----------
    name : str
    when : str or callable
        A channel, ``"hinge.angle"``, or an expression of channels and ``t``, ``"arm.tip.position.y + 0.5"``; or a
        function ``(t, state) -> float`` with `state` as callbacks see it. Channels: ``<joint>.angle``, ``.rate``,
        ``.displacement``, ``.speed``; ``<body>.<interface>.position.x``, ``.velocity.x``, ``.spin.x``;
        ``<body>.modal.<number>``.
    direction : {0, 1, -1}
        Rising crossings only (1), falling only (-1), or both.
    terminal : bool
        Whether the run ends there.

    Examples
    --------
    >>> Event(name="upright", when="hinge.angle - pi/2", direction=1).terminal
    False
    """

    name: str
    when: str | Callable[[float, Any], float]
    direction: int = 0
    terminal: bool = False

    def __post_init__(self) -> None:
        """Check the direction."""
        if self.direction not in (-1, 0, 1):
            raise InputError(f"event {self.name!r}: direction {self.direction} is none of -1, 0, 1")
        super().__post_init__()


def event_function(
    system: System, packed: Packed, loading: Loading, model: Model, event: Event
) -> Callable[[float], float]:
    """Return ``t -> value`` of an event at the state that the compiled loop left in `model.state`.

    Raises
    ------
    InputError
        When the expression cannot be read or names no channel.
    """

    def frame(body: str, k: int) -> Frame:
        found = kernel.node_state(model.tree, model.flex, model.W, model.F, packed.link_of(body), k)
        return Frame(*(np.reshape(part, (3, 3) if len(part) == 9 else 3) for part in found))

    def state(t: float) -> State:
        motion = loading.prescribe(t)
        kernel.outward(model.tree, model.flex, model.W, model.F, model.state, motion)
        kernel.world(model.tree, model.W)
        return State(system, packed, model.state, motion, frame)

    if callable(event.when):
        return lambda t: float(event.when(t, state(t)))
    value, readers = _expression(system, packed, event)
    return lambda t: float(value(np.array([t, *(read(at) for at in [state(t)] for read in readers)]))[0])


def _expression(system: System, packed: Packed, event: Event) -> tuple[Callable, list[Callable[[State], float]]]:
    import symengine

    names = list(dict.fromkeys(CHANNEL.findall(event.when)))
    readers = [_reader(system, packed, name, event) for name in names]
    symbols = {name: f"channel_{k}" for k, name in enumerate(names)}
    text = CHANNEL.sub(lambda match: symbols[match[0]], event.when)
    try:
        value = symengine.sympify(text)
        unknown = [str(s) for s in value.free_symbols if str(s) not in ("t", *symbols.values())]
    except (RuntimeError, TypeError, ValueError, SyntaxError, AttributeError) as error:
        raise InputError(f"event {event.name!r}: {event.when!r} is not an expression: {error}") from None
    if unknown:
        raise InputError(f"event {event.name!r}: unknown name {unknown[0]!r} in {event.when!r}; use t and channels")
    return symengine.Lambdify([symengine.Symbol(s) for s in ("t", *symbols.values())], [value]), readers


def _reader(system: System, packed: Packed, name: str, event: Event) -> Callable[[State], float]:
    """Return ``state -> value`` of a channel."""
    owner, _, part = name.partition(".")
    joint = next((j for j in system.joints if j.name == owner), None)
    if joint is not None and part in PLACES + RATES:
        turns = [packed.types[i] in (REVOLUTE, PRESCRIBED_REVOLUTE) for i in packed.links_of(owner)]
        fits = [k for k, turn in enumerate(turns) if turn == (part in ("angle", "rate"))]
        if len(fits) == 1 and joint.type not in ("spherical", "free"):
            which = "position" if part in PLACES else "rate"
            return lambda state: float(getattr(state.joint(owner), which)[fits[0]])
    if owner in system.bodies:
        found = _body_reader(system, packed, owner, part)
        if found:
            return found
    known = suggestion(owner, [*(j.name for j in system.joints), *system.bodies], "known are")
    raise InputError(
        f"event {event.name!r}: no channel {name!r}; give <joint>.angle, .rate, .displacement or .speed, "
        f"<body>.<interface>.position.x, .velocity.x or .spin.x, <body>.modal.<number>; {known}"
    )


def _body_reader(system: System, packed: Packed, body: str, part: str) -> Callable[[State], float] | None:
    words = part.split(".")
    if len(words) == 2 and words[0] == "modal" and words[1].isdigit() and 0 < int(words[1]) <= system.bodies[body].n:
        x = packed.tree.ints[packed.link_of(body), XQ] + int(words[1]) - 1
        return lambda state: float(state.coordinates[x])
    if len(words) == 3 and words[1] in PARTS and words[2] in AXES:
        locate(system.bodies, f"{body}.{words[0]}", "event")
        return lambda state: float(getattr(state[f"{body}.{words[0]}"], words[1])[AXES[words[2]]])
    return None
