"""What events do to a run: closures that begin or end, impacts, the jumps of speed that go with them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.energy import energy
from modalprep.multibody.evaluation.evaluate import Equations, load
from modalprep.multibody.evaluation.impact import Impact, strike
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.model.events import Event, check_changes
from modalprep.multibody.model.system import System

MOST_IMPACTS = 1000  # in one run


class Changes:
    """The changes that the events of one run make.

    Attributes
    ----------
    impacts : dict of str to list of Impact
        By event.
    """

    def __init__(self, system: System, events: Sequence[Event], loading: Loading, eq: Equations) -> None:
        if events:
            check_changes(system, events)
        self.loading, self.equations = loading, eq
        self.number = {closure.name: k for k, closure in enumerate(system.closures)}
        self.impacts: dict[str, list[Impact]] = {event.name: [] for event in events if event.changes}
        self.past: set[str] = set()

    def armed(self, event: Event) -> bool:
        """Return whether an event that is there to begin or to end closures still can."""
        if self._spent(event):
            return False
        if not event.changes or event.impacts:
            return True
        active = self.loading.closed_loops.active
        waiting = any(not active(self.number[name]) for name in event.activates)
        return waiting or any(active(self.number[name]) for name in event.deactivates)

    def _spent(self, event: Event) -> bool:
        return event.once and event.name in self.past

    def refuse_contradiction(self, events: Sequence[Event], t: float) -> None:
        """Refuse events at one time of which one activates what another deactivates."""
        for one, other in permutations([event for event in events if not self._spent(event)], 2):
            for name in set(one.activates) & set(other.deactivates):
                raise SimulationError(
                    f"events {one.name!r} and {other.name!r} come at the same time, t = {t:.6g} s; one activates "
                    f"closure {name!r}, the other deactivates it; let them come one after the other"
                )

    def apply(self, event: Event, t: float, y: np.ndarray) -> None:
        """Let the closures of an event act on a state ``y (nx + nu + 1,)``; the change of energy counts as work.

        Raises
        ------
        SimulationError
            When impacts accumulate, or no impulses satisfy the law of friction.
        """
        self.past.add(event.name)
        begins, ends, hits = (
            [self.number[n] for n in names] for names in (event.activates, event.deactivates, event.impacts)
        )
        for k in ends:
            self.loading.closed_loops.activate(k, False)
        if begins or hits:
            loops = self.loading.closed_loops
            load(self.equations, t, y)
            loops.residual(self.equations.data, y, self.equations.motion, t)
            for k in begins:
                loops.begin(k)
            impact = strike(loops, self.equations.data, y[:-1], t, hits, event.restitution)
            self._count(event, impact)
            before = energy(self.equations, t, y)
            y[:-1] = impact.y
            y[-1] += energy(self.equations, t, y) - before  # impulses of prescribed hinges change it too

    def _count(self, event: Event, impact: Impact) -> None:
        self.impacts[event.name].append(impact)
        if len(self.impacts[event.name]) > MOST_IMPACTS:
            raise SimulationError(
                f"event {event.name!r} comes again and again, for the {MOST_IMPACTS}th time at "
                f"t = {impact.t:.6g} s; let a closure begin there, or end the run"
            )

    def notes(self) -> list[str]:
        """Return a sentence for each impact, the first ten."""
        impacts = [(name, impact) for name, impacts in self.impacts.items() for impact in impacts]
        found = [
            f"event {name!r} at t = {b.t:.6g} s took {b.energy_loss:.6g} J"
            for name, b in sorted(impacts, key=_time)[:10]
        ]
        return [*found, f"and {len(impacts) - 10} more"] if len(impacts) > 10 else found


def _time(pair: tuple[str, Impact]) -> float:
    return pair[1].t
