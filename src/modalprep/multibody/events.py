"""Events: zero crossings of channels, of expressions of channels and time, or of Python functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody import kernel
from modalprep.multibody.evaluate import Model
from modalprep.multibody.expressions import channel_expression
from modalprep.multibody.layout import Packed
from modalprep.multibody.loading import Loading
from modalprep.multibody.state import Frame, State
from modalprep.multibody.system import System
from modalprep.records import Record


@dataclass(frozen=True, eq=False, kw_only=True)
class Event(Record):
    """A zero crossing to be located; `Result.events` has its times.

    Attributes
    ----------
    name : str
    when : str or callable
        A channel, ``"hinge.angle"``, or an expression of channels and ``t``, ``"arm.tip.position.y + 0.5"``; or a
        function ``(t, state) -> float`` with `state` as callbacks see it. Channels: `expressions.channel_expression`.
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
    value = channel_expression(system, event.when, f"event {event.name!r}")
    return lambda t: value(t, state(t))
