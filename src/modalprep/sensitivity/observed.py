"""Channels of a run as functions of its states, and their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.evaluation.system_state import SystemState
from modalprep.multibody.model.system import System
from modalprep.multibody.preparation import prepare
from modalprep.multibody.results.channels import STATE
from modalprep.multibody.results.observation import record
from modalprep.multibody.results.record import Recorder, histories
from modalprep.multibody.results.result import NUMBERED
from modalprep.sensitivity.differences import CENTRAL, RELATIVE
from modalprep.sensitivity.local import Model, Moment
from modalprep.sensitivity.projection import Projection
from modalprep.suggest import suggestion

OF_HISTORY = ("energy.work", "energy.error", "momentum.error")  # they depend on more than the state


class Channel(NamedTuple):
    """A number among the channels: a name of `Result`, and a component, -1 of a single number."""

    name: str
    component: int


class Observer:
    """Reads channels of a system off its states.

    Parameters
    ----------
    names : sequence of str
        As ``hinge.angle``, ``arm.tip.position.x`` and ``arm.modal.2``.
    until : float
        Functions of time are known to this time, s.
    start : SystemState or None
        Where the run starts: what closed loops keep is known from there.

    Raises
    ------
    InputError
        When a channel is unknown, or has several numbers of which none is named.
    """

    def __init__(self, system: System, names: Sequence[str], until: float, start: SystemState | None = None) -> None:
        self.system = system
        self.integration = prepare(system, np.array([0.0, until]), start=start, method="explicit", rtol=1.0, atol=1.0)
        self.recorder = Recorder(self.integration, 1)
        empty = self._histories(np.empty((0, self.width)), np.empty(0))
        self.channels = [find_channel(empty, name) for name in names]

    @property
    def width(self) -> int:
        """Numbers in a row."""
        return self.recorder.rows.shape[1]

    def _histories(self, rows: np.ndarray, time: np.ndarray) -> dict[str, np.ndarray]:
        return histories(self.system, self.recorder.index, rows, time)

    def values(self, moments: Sequence[Moment], states: np.ndarray) -> np.ndarray:
        """Return the channels (k, nc) of states (k, nx + nu) at their moments."""
        rows = np.empty((len(states), self.width))
        for stretch in dict.fromkeys(moment.stretch for moment in moments):
            own = [k for k, moment in enumerate(moments) if moment.stretch == stretch]
            rows[own] = self._rows(stretch, np.array([moments[k].t for k in own]), states[own])
        found = self._histories(rows, np.array([moment.t for moment in moments]))
        columns = [found[c.name] if c.component < 0 else found[c.name][:, c.component] for c in self.channels]
        return np.array(columns).reshape(len(self.channels), len(states)).T

    def _rows(self, stretch: tuple[float, float], times: np.ndarray, states: np.ndarray) -> np.ndarray:
        r = self.recorder
        self.integration.loading.enter(*stretch)
        whole = np.hstack([states, np.zeros((len(states), 1))])
        found = np.empty((len(states), self.width))
        record(r.equations, r.steps, r.columns, times, whole, r.soft, found)
        self.integration.raise_callback()
        return found

    def places(self) -> list[int]:
        """Return the index of each channel in the state, -1 for those that are not in it."""
        packed, index = self.integration.packed, self.recorder.index
        of_column = {int(c): int(i) for source, i, _, c in self.recorder.columns.joints if source == STATE}
        for name, body in self.system.bodies.items():
            if body.n:
                modes = packed.modes_of(name)
                of_column |= {self._column(index[f"{name}.modal"], k): modes.start + k for k in range(body.n)}
        return [of_column.get(self._column(index.get(c.name), c.component), -1) for c in self.channels]

    @staticmethod
    def _column(where: int | slice | None, component: int) -> int:
        if isinstance(where, slice):
            return where.start + component
        return -1 if where is None else where


def find_channel(known: Mapping[str, np.ndarray], name: str) -> Channel:
    """Return the number that a name denotes among histories (nt,) and (nt, k).

    Raises
    ------
    InputError
        When there is none.

    Examples
    --------
    >>> known = {"hinge.angle": np.zeros(3), "arm.tip.position": np.zeros((3, 3)), "arm.modal": np.zeros((3, 5))}
    >>> find_channel(known, "arm.tip.position.z"), find_channel(known, "arm.modal.2")
    (Channel(name='arm.tip.position', component=2), Channel(name='arm.modal', component=1))
    """
    if name in OF_HISTORY:
        raise InputError(f"channel {name!r} depends on the whole run before; name one that depends on the state")
    if name in known and known[name].ndim == 1:
        return Channel(name, -1)
    whole, _, part = name.rpartition(".")
    if whole in known and known[whole].ndim == 2:
        count = known[whole].shape[1]
        letters = "xyz" if count == 3 and not whole.endswith(NUMBERED) else ""
        names = {**{letter: k for k, letter in enumerate(letters)}, **{str(k + 1): k for k in range(count)}}
        if part in names:
            return Channel(whole, names[part])
        raise InputError(f"channel {name!r}: {whole!r} has {count} components; end it with one of {', '.join(names)}")
    if name in known:
        count = known[name].shape[1]
        raise InputError(f"channel {name!r} has {count} numbers; name one, such as {name}.{'x' if count == 3 else 1}")
    raise InputError(f"channel {name!r}: {suggestion(name, known, 'there are')}")


class ChannelSlopes:
    """Derivatives of channels by state and parameters: exact of the state's own numbers, else by differences.

    The differences are of the channels at states beside a given one: algebraic functions, to the fourth order.
    """

    def __init__(self, model: Model, names: Sequence[str], until: float, start: SystemState | None) -> None:
        self.model, self.names = model, list(names)
        self.observer = Observer(model.system, names, until, start)
        self.place = np.array(self.observer.places(), dtype=int)
        self.others = np.flatnonzero(self.place < 0)
        self.beside = []
        if len(self.others):
            own = [names[k] for k in self.others.tolist()]
            self.observer_of_others = Observer(model.system, own, until, start)
            for along in model.beside:
                observers = [Observer(other, own, until, start) for other in along.found.systems]
                self.beside.append((along, observers))

    @property
    def differenced(self) -> list[str]:
        """Names of the channels whose derivatives are differences."""
        return [self.names[k] for k in self.others.tolist()]

    def forward(self, moments: Sequence[Moment], states: np.ndarray, changes: np.ndarray) -> np.ndarray:
        """Return the changes (np, nt, nc) of the channels with those of the states (nt, ny, np)."""
        count = changes.shape[2]
        found = np.zeros((count, len(states), len(self.names)))
        exact = np.flatnonzero(self.place >= 0)
        found[:, :, exact] = changes[:, self.place[exact], :].transpose(2, 0, 1)
        if len(self.others):
            for k in range(count):
                found[k][:, self.others] = self._along(moments, states, changes[:, :, k])
            for along, observers in self.beside:
                values = [observer.values(moments, states) for observer in observers]
                found[along.number][:, self.others] += along.found.derivative(values)
        return found

    def _along(self, moments: Sequence[Moment], states: np.ndarray, changes: np.ndarray) -> np.ndarray:
        """Return the changes (k, others) of channels along changes (k, ny) of states."""
        step = np.array([self._step(y, dy) for y, dy in zip(states, changes, strict=True)])[:, None]
        total = np.zeros((len(states), len(self.others)))
        for place, weight in zip(*CENTRAL, strict=True):
            total += weight * self.observer_of_others.values(moments, states + place * step * changes)
        return total / step

    def _step(self, y: np.ndarray, dy: np.ndarray) -> float:
        """Return how far to go along a change: a small share of the size of a body, and of the speeds."""
        nx, scale = self.model.nx, self.model.evaluator.scale
        moved = np.abs(self.model.layout.kinematics(y).increments @ dy[:nx]) / scale
        speed = np.abs(dy[nx:]) / np.maximum(scale, np.abs(y[nx:]))
        size = max(moved.max(initial=0.0), speed.max(initial=0.0))
        return RELATIVE / size if size > 0 else 1.0

    def reverse(
        self,
        moments: Sequence[Moment],
        states: np.ndarray,
        weights: np.ndarray,
        projection: Callable[[int], Projection],
        bar_p: np.ndarray,
    ) -> np.ndarray:
        """Return the gradients (nt, ny) by the states of a sum of channels with weights (nt, nc).

        The gradient by the parameters is added to `bar_p`; `projection` has those of the outputs.
        """
        found = np.zeros_like(states)
        for k in np.flatnonzero(self.place >= 0).tolist():
            found[:, self.place[k]] += weights[:, k]
        used = np.flatnonzero(np.any(weights[:, self.others] != 0, axis=1)).tolist() if len(self.others) else []
        for k in used:
            found[k] += self._gradient(moments[k], states[k], weights[k, self.others], projection(k), bar_p)
        if len(used):
            for along, observers in self.beside:
                own = [moments[k] for k in used]
                values = [observer.values(own, states[used]) for observer in observers]
                bar_p[along.number] += np.sum(weights[used][:, self.others] * along.found.derivative(values))
        return found

    def _gradient(
        self, moment: Moment, y: np.ndarray, weights: np.ndarray, projection: Projection, bar_p: np.ndarray
    ) -> np.ndarray:
        """Return the gradient (ny,) of a sum of channels by the state, by differences in all directions.

        They are those that keep loops closed, and those in which the parameters move the closed state.
        """
        nx, nu = self.model.nx, self.model.nu
        directions = np.zeros((nx + nu, 2 * nu))
        directions[:nx, :nu] = self.model.layout.directions(y)
        directions[nx:, nu:] = np.eye(nu)
        if self.model.loops is not None:
            count, more = directions.shape[1], len(self.model.parameters)
            still, here = np.zeros((more, count)), np.zeros((nx + nu, more))
            moves = projection.forward(directions, still), projection.forward(here, np.eye(more))
            directions = np.hstack(moves)
        count = directions.shape[1]
        slopes = self._along([moment] * count, np.tile(y, (count, 1)), directions.T) @ weights
        if count > 2 * nu:
            bar_p += slopes[2 * nu :]
        increments = self.model.layout.kinematics(y).increments
        return np.concatenate([increments.T @ slopes[:nu], slopes[nu : 2 * nu]])
