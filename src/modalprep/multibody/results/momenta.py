"""The audit of momenta: how well they stay in the parts of a system that nothing holds or loads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from modalprep.multibody.packing.free_parts import FreePart
from modalprep.multibody.results.result import Result


class Momenta(NamedTuple):
    """What a run has of one part.

    Attributes
    ----------
    mass : float
        kg.
    rows : (nt, 8)
        Linear momentum, angular momentum about the mass centre, and how large both can be: see `results.observation`.
    restored : (6,)
        Linear and angular momentum that was given back after steps, in all.
    """

    mass: float
    rows: np.ndarray
    restored: np.ndarray


def with_momenta(run: Result, parts: Sequence[Momenta], gravity: np.ndarray) -> Result:
    """Return a run with the channel ``momentum.error`` and its audit, where there are parts whose momenta stay.

    Examples
    --------
    >>> run = Result(time=np.arange(2.0), channels={}, status="done", message="")
    >>> rows = np.array([[0, 0, 0, 0, 0, 0, 9.0, 5.0], [0, -18.0, 0, 0, 0, 1.0, 18.0, 5.0]])
    >>> found = with_momenta(run, [Momenta(2.0, rows, np.zeros(6))], np.array([0, -9.0, 0]))
    >>> found["momentum.error"], found.stats
    (array([0. , 0.2]), {'momentum_error': 0.2, 'momentum_restored': 0.0})
    """
    if not parts or not len(run.time):
        return run
    error, restored = (np.max(both, axis=0) for both in zip(*_relative(run, parts, gravity), strict=True))
    stats = {"momentum_error": float(error.max()), "momentum_restored": float(restored)}
    return run.with_(channels=run.channels | {"momentum.error": error}, stats=run.stats | stats)


def _relative(run: Result, parts: Sequence[Momenta], gravity: np.ndarray) -> Iterator[tuple[np.ndarray, float]]:
    """Yield the error (nt,) of each part and what was restored, in shares of the largest that momenta can be."""
    for part in parts:
        pull = np.append(part.mass * gravity, np.zeros(3))
        changed = part.rows[:, :6] - part.rows[0, :6] - np.outer(run.time - run.time[0], pull)
        largest = part.rows[:, 6:].max(axis=0)
        yield _size(changed, largest), float(_size(part.restored[None], largest)[0])


def _size(momenta: np.ndarray, largest: np.ndarray) -> np.ndarray:
    """Return the larger share (n,) of the linear and of the angular part of momenta (n, 6)."""
    return (np.linalg.norm(momenta.reshape(-1, 2, 3), axis=2) / largest).max(axis=1)


def unaudited(parts: Sequence[FreePart]) -> tuple[str, ...]:
    """Return a sentence for each part that nothing holds but that is loaded, so that its momenta are not audited.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.loads import PointForce
    >>> from modalprep.multibody.model.system import System
    >>> from modalprep.multibody.packing.free_parts import free_parts
    >>> flight = Joint(name="flight", type="free", parent="ground", child="arm")
    >>> push = PointForce(name="push", at="arm.tip", force=(1, 0, 0))
    >>> unaudited(free_parts(System(bodies={"arm": uniform_beam(modes=1)}, joints=(flight,), loads=(push,))))
    ("the momentum of 'arm' is not audited, as load 'push' acts on it",)
    """
    return tuple(
        f"the momentum of {part.bodies[0]!r}{' and what moves with it' * (len(part.bodies) > 1)} is not audited, as "
        f"{part.loaded}"
        for part in parts
        if part.loaded
    )
