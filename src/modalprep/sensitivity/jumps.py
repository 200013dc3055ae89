"""Impacts as maps of changes: saltation.

A change of the state moves an event in time, ``dt = -(g_y dy + g_p dp) / g'`` with the rate g' of its function along
the motion before. The state after it is that of the impact, R, on the motion that lasted dt longer, and goes on dt
shorter: ``dy+ = R_y dy + R_p dp + (R' - f+) dt`` with the rate R' of the state after an impact on the motion before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.evaluate import load
from modalprep.multibody.evaluation.event_functions import event_functions, state_reader
from modalprep.multibody.evaluation.impact import strike
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.system import System
from modalprep.multibody.preparation import prepare
from modalprep.sensitivity.differences import CENTRAL, RELATIVE
from modalprep.sensitivity.local import Local, Model, Moment
from modalprep.sensitivity.tangent_maps import StepMap

GRAZING = 1e-6  # share of its terms that is left of the rate of an event: it touches, and derivatives do not exist


class Jump(NamedTuple):
    """A change of the speeds by an event.

    Attributes
    ----------
    t : float
        s.
    stretch : (float, float)
        Between breaks of functions of time, s.
    event : Event
    y, end : (nx + nu,)
        States before and after.
    """

    t: float
    stretch: tuple[float, float]
    event: Event
    y: np.ndarray
    end: np.ndarray

    @property
    def begin(self) -> Moment:
        """When it is."""
        return Moment(self.t, self.stretch)

    def at(self, c: float) -> Moment:
        """Return when it is."""
        return self.begin


class EventReader:
    """The functions of events and what impacts do, as functions of time and state of one system."""

    def __init__(self, system: System, events: Sequence[Event], until: float) -> None:
        self.integration = prepare(system, np.array([0.0, until]), method="explicit", rtol=1.0, atol=1.0)
        self.loading = self.integration.loading
        self.numbers = {closure.name: k for k, closure in enumerate(system.closures)}
        self.equations = self.integration.equations
        given = system, self.integration.packed, self.loading
        self.functions = event_functions(*given, events)
        self.names = [event.name for event in events]
        self.read = state_reader(*given, self.equations, events)

    def value(self, event: Event, moment: Moment, y: np.ndarray) -> float:
        """Return the function of an event."""
        self.loading.enter(*moment.stretch)
        self.equations.state[:] = y
        return self.functions[self.names.index(event.name)](moment.t, self.read(moment.t))[0]

    def after(self, event: Event, moment: Moment, y: np.ndarray) -> np.ndarray:
        """Return the state after the impacts of an event."""
        self.loading.enter(*moment.stretch)
        load(self.equations, moment.t, np.append(y, 0.0))
        loops = self.loading.closed_loops
        loops.residual(self.equations.data, y, self.equations.motion, moment.t)
        hits = [self.numbers[name] for name in event.impacts]
        return strike(loops, self.equations.data, y, moment.t, hits, event.restitution).y

    def both(self, event: Event, moment: Moment, y: np.ndarray) -> np.ndarray:
        """Return the state after an event, and last its function (ny + 1,)."""
        return np.append(self.after(event, moment, y), self.value(event, moment, y))


class Readers(NamedTuple):
    """Those of a system, and of the systems beside it by each parameter that changes forces."""

    own: EventReader
    beside: list[list[EventReader]]

    @classmethod
    def of(cls, model: Model, events: Sequence[Event], until: float) -> Readers:
        """Return those of a model."""
        beside = [[EventReader(s, events, until) for s in along.found.systems] for along in model.beside]
        return cls(EventReader(model.system, events, until), beside)


class JumpMap(StepMap):
    """An impact as a map of changes, from differences of the impact and of the event's function at its state."""

    def __init__(self, model: Model, jump: Jump, readers: Readers) -> None:
        self.jump, self.ny = jump, len(jump.y)
        both = partial(readers.own.both, jump.event)
        by_state = self._by_state(model, both)
        by_parameter = np.zeros((self.ny + 1, len(model.parameters)))
        for along, others in zip(model.beside, readers.beside, strict=True):
            found = [each.both(jump.event, jump.begin, jump.y) for each in others]
            by_parameter[:, along.number] = along.found.derivative(found)
        before = Local(model, jump.y, jump.begin).ydot
        rate = self._along(both, before)
        self._refuse_grazing(rate[-1], by_state[-1] * before)
        shift = rate[:-1] - Local(model, jump.end, jump.begin).ydot
        self.by_state = by_state[:-1] - np.outer(shift, by_state[-1]) / rate[-1]
        self.by_parameter = by_parameter[:-1] - np.outer(shift, by_parameter[-1]) / rate[-1]

    def _by_state(self, model: Model, both: Callable[[Moment, np.ndarray], np.ndarray]) -> np.ndarray:
        """Return the derivatives (ny + 1, ny) of the state after the event and of its function by that before."""
        nx, nu, y = model.nx, model.nu, self.jump.y
        directions = np.vstack([model.layout.directions(y).T @ np.eye(nx, self.ny), np.eye(nu, self.ny, nx)])
        scale = np.concatenate([model.evaluator.scale, np.maximum(model.evaluator.scale, np.abs(y[nx:]))])
        slopes = np.zeros((self.ny + 1, 2 * nu))
        for k, size in enumerate(RELATIVE * scale):
            parts = [w * both(self.jump.begin, y + s * size * directions[k]) for s, w in zip(*CENTRAL, strict=True)]
            slopes[:, k] = sum(parts) / size
        increments = model.layout.kinematics(y).increments
        return np.hstack([slopes[:, :nu] @ increments, slopes[:, nu:]])

    def _along(self, both: Callable[[Moment, np.ndarray], np.ndarray], ydot: np.ndarray) -> np.ndarray:
        """Return the rates (ny + 1,) of both along the motion before."""
        jump = self.jump
        size = RELATIVE / max(1.0, np.abs(ydot).max())
        found = [
            w * both(jump.begin._replace(t=jump.t + s * size), jump.y + s * size * ydot)
            for s, w in zip(*CENTRAL, strict=True)
        ]
        return np.sum(found, axis=0) / size

    def _refuse_grazing(self, rate: float, terms: np.ndarray) -> None:
        if not abs(rate) > GRAZING * np.abs(terms).sum():
            raise SimulationError(
                f"derivatives of the run do not exist: event {self.jump.event.name!r} only touches zero at "
                f"t = {self.jump.t:.6g} s"
            )

    def forward(self, dz: np.ndarray, dp: np.ndarray) -> np.ndarray:
        """Return the changes (nz, k) after the impact."""
        found = np.zeros_like(dz)
        found[: self.ny] = self.by_state @ dz[: self.ny] + self.by_parameter @ dp
        return found
