"""The search for events in the steps of a run: where event functions are asked, and what is found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.evaluation.event_functions import EventFunction
from modalprep.multibody.evaluation.state import State
from modalprep.multibody.integration.events.crossings import NODES, POLE, WRAP, crossings, node_times, plain_crossings
from modalprep.multibody.model.events import Event

TURN = 2.5  # rad of all phases in a panel: four tenths of a period
WIDEST_GAP = max(b - a for a, b in pairwise(NODES))
SURVEY, SHORTEST = 1e-3, 1e-6  # of the run: time between two looks, longest (where nothing bounds a function), shortest
AT_ONCE = 1e-14  # events no further apart, relative to the time, come at the same time
NEAR = 1e-12  # so near to an event, relative to the time, an event that is not looked for comes at the same time
JUST_AFTER = 1e-300  # event function just after its event, on the side to which the motion goes


class Node(NamedTuple):
    """A time at which all event functions are asked."""

    t: float
    values: list[float]  # of each event; 1 of those that are not looked for
    phases: list[float]  # of all events, rad
    spin: float  # rad/s, of the fastest body


class EventSearch:
    """Looks for zero crossings in each step of a run.

    A step is divided into panels of five nodes, so short that no phase of an event function, nor any body, turns far in
    one. Within a panel `crossings` looks for changes of sign and for extrema that come through zero.

    Parameters
    ----------
    functions : sequence of EventFunction
    state_at : callable
        ``t -> state`` within the last step.
    spin : callable
        Returns the largest angular velocity of a body, rad/s, at the last state.
    armed : callable
        ``number -> bool``: whether an event is looked for.
    span : float
        Length of the run, s.
    shortest_event : float or None
        Longest time between two looks at a function that nothing bounds, s; a thousandth of the run by default.

    Attributes
    ----------
    found : list of (int, float)
        Events and their times.
    stop : float
        s, where the last step has to end; infinite when it does not.
    is_limited : bool
        Whether functions turned so quickly that panels were not made short enough.
    """

    def __init__(
        self,
        functions: Sequence[EventFunction],
        state_at: Callable[[float], State],
        spin: Callable[[], float],
        armed: Callable[[int], bool],
        span: float,
        shortest_event: float | None = None,
    ) -> None:
        self.functions = functions
        self.state_at = state_at
        self.spin = spin
        self.armed = armed
        self.span = span
        self.turns = any(f.turns for f in functions)
        self.unbounded = [repr(f.event.name) for f in functions if f.is_unbounded]
        self.is_stated = shortest_event is not None
        self.width = shortest_event or SURVEY * span
        self.survey = self.width / WIDEST_GAP if self.unbounded else np.inf
        self.found: list[tuple[int, float]] = []
        self.stop, self.is_limited = np.inf, False
        self.before = Node(0.0, [], [], 0.0)
        self.left: set[int] = set()  # events whose value before is a side only
        self.signs: dict[int, float] = {}  # after the events at `stop`

    def look(self, t: float) -> Node:
        """Return the event functions at a time."""
        state = self.state_at(t)
        values = []
        phases = []
        for e, function in enumerate(self.functions):
            value, *turned = function(t, state) if self.armed(e) else [1.0]
            values.append(value)
            phases += turned
        return Node(t, values, phases, self.spin() if self.turns else 0.0)

    def begin(self, t: float) -> None:
        """Take the values at a time as those before the next step, which begins there."""
        self.before = self.look(t)
        self.left = set()
        for function, value in zip(self.functions, self.before.values, strict=True):
            if not np.isfinite(value):
                _refuse_infinite(function, t)

    def start(self, t: float) -> None:
        """Do as `begin` at the start of a run; refuse what gives two values at the same time and state."""
        self.begin(t)
        for function, *found in zip(self.functions, self.before.values, self.look(t).values, strict=True):
            if found[0] != found[1]:
                raise InputError(
                    f"event {function.event.name!r}: its function returned {found[0]:g} and then {found[1]:g} at the "
                    f"same time, t = {t:g} s, and state; give one that depends on these only"
                )

    def go_on(self, t: float, values: Sequence[float]) -> None:
        """Do as `begin` after the events at `stop`, before which the functions had `values (events,)`.

        Functions of places are then zero but for round-off, and count as on a side: the other one, or after an impact
        the one that they came from.
        """
        self.begin(t)
        for e, sign in self.signs.items():
            if self.armed(e) and self.before.values[e] == values[e]:
                returns = self.functions[e].event.impacts and not self.functions[e].is_of_time(t)
                self.before.values[e] = (-sign if returns else sign) * JUST_AFTER
                self.left.add(e)

    def at_once(self) -> list[Event]:
        """Return the events at `stop`, with those that are not looked for but cross zero there as well."""
        waiting = (e for e in range(len(self.functions)) if not self.armed(e) and self._crosses(e))
        return [self.functions[e].event for e in (*self.signs, *waiting)]

    def _crosses(self, e: int) -> bool:
        gap = NEAR * abs(self.stop)
        function = self.functions[e]
        before, after = (function(t, self.state_at(t))[0] for t in (self.stop - gap, self.stop + gap))
        return before * after < 0.0 and function.event.direction in (0, np.sign(after))

    def notes(self) -> list[str]:
        """Return what may be missed, in sentences."""
        names = self.unbounded
        found = []
        if names and not self.is_stated:
            found.append(f"event{'s' * (len(names) > 1)} {', '.join(names)}: {_missed(self.width)}")
        if self.is_limited:
            found.append(f"events change very quickly: {_missed(SHORTEST * self.span)}")
        return found

    def step(self, end: float) -> None:
        """Look for events in the last step, which begins where the one before ended; `stop` is the first to end it."""
        self.stop = np.inf
        self._panel(end)

    def _panel(self, end: float) -> None:
        first = self.before
        nodes = [first, *map(self.look, node_times(first.t, end)[1:])]
        parts = self._parts(nodes)
        if parts == 1:
            self._find(nodes)
            return
        length = (end - first.t) / parts
        for k in range(1, parts + 1):
            self._panel(end if k == parts else first.t + k * length)
            if self.stop < np.inf:
                return

    def _parts(self, nodes: Sequence[Node]) -> int:
        """Return into how many panels one has to be divided."""
        length = nodes[-1].t - nodes[0].t
        phases = [node.phases for node in nodes if len(node.phases) == len(nodes[-1].phases)]
        turned = float(np.abs(np.diff(phases, axis=0)).sum()) + max(node.spin for node in nodes) * length
        wanted = max(turned / TURN, length / self.survey * (1.0 - 1e-9))
        most = max(1.0, length / (SHORTEST * self.span))
        self.is_limited |= not wanted <= most
        return int(np.ceil(max(1.0, min(wanted, most))))

    def _find(self, nodes: Sequence[Node]) -> None:
        """Write down the events of a panel up to the first that ends the step."""
        found = sorted((c.t, e, c.sign) for e in range(len(self.functions)) for c in self._crossings(e, nodes))
        for t, e, sign in found:
            if t > self.stop + AT_ONCE * abs(self.stop):
                break
            event = self.functions[e].event
            if (event.terminal or event.changes) and self.stop == np.inf:
                self.stop = t
                self.signs = {}
            if self.stop < np.inf:
                t, self.signs[e] = self.stop, sign
            self.found.append((e, t))
        self.before = nodes[-1]
        self.left = set()

    def _crossings(self, e: int, nodes: Sequence[Node]) -> list:
        function = self.functions[e]
        times = [node.t for node in nodes]
        values = [node.values[e] for node in nodes]
        if all(np.isinf(values)):
            _refuse_infinite(function, times[0])

        def value(t: float) -> float:
            return function(t, self.state_at(t))[0]

        most = WRAP if function.wraps else POLE
        if function.is_condition:
            found = plain_crossings(value, times, values, most)
        elif self.armed(e):
            found = crossings(value, times, values, e in self.left, most)
        else:
            found = iter(())
        sense = function.event.direction or (1 if function.is_condition else 0)
        return [c for c in found if sense in (0, c.sign)]


def _missed(time: float) -> str:
    return f"crossings that come back within {time:.3g} s may be missed"


def _refuse_infinite(function: EventFunction, t: float) -> None:
    raise InputError(
        f"event {function.event.name!r}: its function is infinite at t = {t:g} s; give one that has a value there"
    )
