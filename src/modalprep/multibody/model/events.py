"""Events: zero crossings of channels, of expressions of channels and time, or of Python functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from modalprep.errors import InputError
from modalprep.multibody.model.system import System
from modalprep.records import Record
from modalprep.suggest import refuse_unknown


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
    begins, ends : tuple of str
        Closures that hold from there on, with the sudden impulse that this takes (see `impact`), and that are let go. A
        closure that begins holds the ends as they are then, friction included. The event is looked for while there is
        something to begin or to end.
    hits : tuple of str
        Closures that act for this moment only: a blow that comes back by `restitution`.
    restitution : float
        Newton's coefficient of the hits, 0 to 1.
    once : bool
        Whether it begins, ends or hits something the first time only.

    Examples
    --------
    >>> Event(name="upright", when="hinge.angle - pi/2", direction=1).terminal
    False
    """

    name: str
    when: str | Callable[[float, Any], float]
    direction: int = 0
    terminal: bool = False
    begins: tuple[str, ...] = ()
    ends: tuple[str, ...] = ()
    hits: tuple[str, ...] = ()
    restitution: float = 0.0
    once: bool = False

    def __post_init__(self) -> None:
        """Check the direction and the restitution."""
        if self.direction not in (-1, 0, 1):
            raise InputError(f"event {self.name!r}: direction {self.direction} is none of -1, 0, 1")
        if not 0 <= self.restitution <= 1:
            raise InputError(f"event {self.name!r}: restitution = {self.restitution:g} must be between 0 and 1")
        for key in ("begins", "ends", "hits"):
            object.__setattr__(self, key, tuple(getattr(self, key)))
        super().__post_init__()

    @property
    def changes(self) -> bool:
        """Whether the motion goes on with other speeds or closures."""
        return bool(self.begins or self.ends or self.hits)


def check_changes(system: System, events: Sequence[Event]) -> None:
    """Refuse events that begin, end or hit closures that are not there."""
    names = [closure.name for closure in system.closures]
    for event in events:
        for name in (*event.begins, *event.ends, *event.hits):
            refuse_unknown(name, names, f"event {event.name!r}: closure")
