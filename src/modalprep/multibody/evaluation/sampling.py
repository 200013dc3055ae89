"""Sampled loads in a run: when they are called, and the energy that they exchange with the system."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.evaluation.state import State
from modalprep.multibody.model.loads import Held, Load, SampledLoad

MOST_SAMPLES = 1e7
ALLOWED = 0.01  # of the energy that is exchanged: beyond it a run says what is not balanced


class Motion(NamedTuple):
    """Coordinates on which a load does work (NaN: there are none, as of rotations in space), and their rates."""

    place: np.ndarray
    rate: np.ndarray

    def since(self, before: Motion, duration: float) -> np.ndarray:
        """Return how far it has moved; without a coordinate by the mean of the rates."""
        moved = self.place - before.place
        return np.where(np.isnan(moved), 0.5 * duration * (before.rate + self.rate), moved)


class Balance:
    """The energy that a load exchanges with the system, and how far it is known.

    Between two samples a load is held. Had it gone on in a straight line to its next value, it would have done
    other work: the difference is the error of the exchange, of first order in the period.

    Attributes
    ----------
    work, error, exchanged : float
        J: work done by the held load, error of the exchange, sum of the amounts of work.

    Examples
    --------
    >>> balance = Balance()
    >>> for t, force in ((0.0, 0.0), (0.1, 2.0), (0.2, 4.0)):
    ...     balance.add(t, {"hinge": np.array([force])}, {"hinge": Motion(np.array([t]), np.array([1.0]))})
    >>> round(balance.work, 12), round(balance.error, 12)
    (0.2, 0.2)
    """

    def __init__(self) -> None:
        self.work = self.error = self.exchanged = 0.0
        self._before: tuple[float, Mapping[str, np.ndarray], Mapping[str, Motion]] | None = None

    def add(self, t: float, loads: Mapping[str, np.ndarray], motions: Mapping[str, Motion]) -> None:
        """Take loads from time t (s) on, and the motion of what they act on at that time, both by place."""
        begin, held, before = self._before or (t, {}, {})
        for place in held.keys() & loads.keys():
            moved = motions[place].since(before[place], t - begin)
            self.work += float(held[place] @ moved)
            self.exchanged += float(np.abs(held[place] @ moved))
            self.error += 0.5 * float((loads[place] - held[place]) @ moved)
        self._before = t, loads, motions


class Sampling:
    """The sampled loads of one run up to `t_end` (s).

    Attributes
    ----------
    breaks : list of float
        Times at which they are called, but for the begin of the run, s.
    """

    def __init__(self, loads: Sequence[Load], t_end: float) -> None:
        self.loads = [load for load in loads if isinstance(load, SampledLoad)]
        self._times = {load.name: _multiples(load, t_end) for load in self.loads}
        self.breaks = sorted(set().union(*self._times.values()))
        self.balances: dict[str, Balance] = {}

    def sample(self, t: float, state: State) -> None:
        """Call the loads that are due at time t, and those that are not held."""
        for load in self.loads:
            if load.name not in self.balances:
                load.begin(t)
                self.balances[load.name] = Balance()
            if _held(load).loads is None or t in self._times[load.name]:
                _held(load).loads = found = _arrays(load, t, state)
                motions = {place: _motion(state, place, len(values)) for place, values in found.items()}
                self.balances[load.name].add(t, found, motions)

    def end(self, t: float, state: State) -> None:
        """Add the work since the last calls, at the end of a run."""
        for load in self.loads:
            held = _held(load).loads or {}
            motions = {place: _motion(state, place, len(values)) for place, values in held.items()}
            self.balances[load.name].add(t, held, motions)

    def close(self) -> None:
        """Hold the loads no longer: a run has ended, or not begun."""
        for load in self.loads:
            _held(load).loads = None

    def stats(self) -> dict[str, float]:
        """Return the energies of loads that stand for continuous ones, J."""
        return {
            f"exchange.{load.name}.{part}": float(getattr(self.balances[load.name], part))
            for load in self.loads
            if load.balanced and load.name in self.balances
            for part in ("work", "error")
        }

    def notes(self) -> Iterator[str]:
        """Yield a sentence for each exchange whose error is more than `ALLOWED` of its energy."""
        for load in self.loads:
            own = self.balances.get(load.name)
            if own and load.balanced and abs(own.error) > ALLOWED * own.exchanged:
                off = f"{abs(own.error):.2g} of {own.exchanged:.2g} J that were exchanged"
                held = f"load {load.name!r} is held for {load.period:g} s at a time"
                yield f"{held}: {off} are out of balance; shorten its period"


def _held(load: SampledLoad) -> Held:
    found: Any = load.function
    return found


def _multiples(load: SampledLoad, t_end: float) -> frozenset[float]:
    count = t_end / load.period
    if count > MOST_SAMPLES:
        raise InputError(
            f"load {load.name!r}: {count:.1e} samples of {load.period:g} s are too many; give a longer one"
        )
    return frozenset((load.period * np.arange(1, int(np.ceil(count)))).tolist())


def _arrays(load: SampledLoad, t: float, state: State) -> dict[str, np.ndarray]:
    found = load.sample(t, state)
    if not isinstance(found, Mapping):
        raise InputError(
            f"sampled load {load.name!r} returned {type(found).__name__}; return a dictionary of loads by "
            "'body.interface' or joint"
        )
    return {place: np.atleast_1d(np.asarray(value, dtype=float)) for place, value in found.items()}


def _motion(state: State, place: str, count: int) -> Motion:
    """Return the motion on which a load of so many numbers does work."""
    if state.packed.links_of(place):
        position, rate = (np.asarray(values, dtype=float) for values in state.joint(place))
        return Motion(position if len(position) == len(rate) else np.full(len(rate), np.nan), rate)
    frame = state[place]
    rate = np.concatenate([frame.velocity, frame.angular_velocity])
    return Motion(np.concatenate([frame.position, np.full(3, np.nan)])[:count], rate[:count])
