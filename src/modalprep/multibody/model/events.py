"""Events: zero crossings of channels, of expressions of channels and time, or of Python functions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from modalprep.applies import Rule, refuse_idle
from modalprep.errors import InputError
from modalprep.multibody.model.system import System
from modalprep.records import Record, given, names
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
        A function may return true or false as well: then the event is where it becomes true. Functions that turn as
        the bodies do, sines and cosines are found however quickly they change, and so are extrema that come through
        zero for a moment. A Python function, or another function in an expression, is looked at a thousand times in a
        run at least, or once in each `shortest_event`: crossings that come back sooner may be missed, which
        `Result.notes` says.
    direction : {0, 1, -1}
        Rising crossings only (1), falling only (-1), or both; a condition that becomes false (-1).
    terminal : bool
        Whether the run ends there.
    activates, deactivates : tuple of str
        Closures that become active, with the impulse that this takes (see `impact`), and closures that are released.
        An activated closure keeps the relative position of its ends at that time, friction included. The event is
        monitored while at least one of these closures can still change its state.
    impacts : tuple of str
        Closures that act as an impulse at that time only, with the coefficient `restitution`.
    restitution : float
        Newton's coefficient of restitution of the impacts, 0 to 1.
    once : bool
        Whether the event changes closures at its first occurrence only.

    Examples
    --------
    >>> Event(name="upright", when="hinge.angle - pi/2", direction=1).terminal
    False
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("activates", "deactivates", "impacts"), beside=("terminal",), advice="the run ends there; leave one out"),
        Rule(("restitution",), needs=("impacts",)),
        Rule(("once",), needs=("activates", "deactivates", "impacts")),
    )
    name: str
    when: str | Callable[[float, Any], float]
    direction: int = 0
    terminal: bool = False
    activates: tuple[str, ...] = given(converter=names, default=())
    deactivates: tuple[str, ...] = given(converter=names, default=())
    impacts: tuple[str, ...] = given(converter=names, default=())
    restitution: float = 0.0
    once: bool = False

    def __post_init__(self) -> None:
        """Check the direction and the restitution."""
        if self.direction not in (-1, 0, 1):
            raise InputError(f"event {self.name!r}: direction {self.direction} is none of -1, 0, 1")
        if not 0 <= self.restitution <= 1:
            raise InputError(f"event {self.name!r}: restitution = {self.restitution:g} must be between 0 and 1")
        self._convert(f"event {self.name!r}: ")
        for name in set(self.activates) & set(self.deactivates):
            raise InputError(f"event {self.name!r} activates and deactivates closure {name!r}; choose one of both")
        refuse_idle(self, f"event {self.name!r}: ")
        super().__post_init__()

    @property
    def changes(self) -> bool:
        """Whether the event changes speeds or closures."""
        return bool(self.activates or self.deactivates or self.impacts)


def check_changes(system: System, events: Sequence[Event]) -> None:
    """Refuse events of one name, and those that name unknown closures."""
    for name, count in Counter(event.name for event in events).items():
        if count > 1:
            raise InputError(f"{count} events have the name {name!r}; give each its own")
    names = [closure.name for closure in system.closures]
    for event in events:
        for name in (*event.activates, *event.deactivates, *event.impacts):
            refuse_unknown(name, names, f"event {event.name!r}: closure")


def idle_closures(system: System, events: Sequence[Event]) -> tuple[str, ...]:
    """Return a sentence for each closure that is never active.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.constraints import Closure
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> stop = Closure(name="stop", type="point_on_plane", a="ground", b="arm.tip", active=False)
    >>> arm = System(bodies={"arm": uniform_beam(modes=0)}, joints=(hinge,), closures=(stop,))
    >>> idle_closures(arm, [Event(name="end", when="hinge.angle - 1")])
    ("'stop' has no effect: it is inactive, and no event activates it",)
    >>> idle_closures(arm, [Event(name="hit", when="hinge.angle - 1", impacts=("stop",))])
    ()
    """
    used = {name for event in events for name in (*event.activates, *event.impacts)}
    return tuple(
        f"{closure.name!r} has no effect: it is inactive, and no event activates it"
        for closure in system.closures
        if not closure.active and closure.name not in used
    )
