"""Stations that a body has for large deflections only: left out where the modes alone do (theory 4.10).

A body of ``large_deflection = "auto"`` runs as if it had none, and once more with them where it deflected too far.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.stations.error import gap_of_modes, size_of
from modalprep.errors import SimulationError
from modalprep.multibody.model.system import System

P = ParamSpec("P")
R = TypeVar("R")
LOOKED_AT = 50  # times of the largest bounds


class Decorator(Protocol):
    """What decorates an analysis of a system."""

    def __call__(self, run: Callable[Concatenate[System, P], R]) -> Callable[Concatenate[System, P], R]:
        """Return the analysis of a system, decorated."""
        ...


def stations_where_needed(modal: Callable[[Any, str], np.ndarray]) -> Decorator:
    """Decorate an analysis of a system to leave idle stations out, and to begin again with those of what goes too far.

    Parameters
    ----------
    modal : callable
        The modal coordinates ``(nt, n)`` of a body, by its name, in what the analysis returns.
    """

    def decorate(run: Callable[Concatenate[System, P], R]) -> Callable[Concatenate[System, P], R]:
        @wraps(run)
        def running(system: System, *given: P.args, **options: P.kwargs) -> R:
            used = system
            while isinstance(used, System) and (light := without_idle(used)) is not used:
                found = _tried(run, light, *given, **options)
                idle = {name: body for name, body in used.bodies.items() if _idle(body)}
                far = [name for name in idle if found is None or too_far(idle[name], modal(found, name))]
                if found is not None and not far:
                    return found
                used = used.with_(bodies={**used.bodies, **{name: _awake(idle[name]) for name in far}})
            return run(used, *given, **options)

        return running

    return decorate


def _tried(run: Callable[Concatenate[System, P], R], system: System, *given: P.args, **options: P.kwargs) -> R | None:
    """Return what a run finds, None where it cannot go on."""
    try:
        return run(system, *given, **options)
    except SimulationError:
        return None


def without_idle(system: System) -> System:
    """Return the system without stations that may be left out; the same where there are none.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> from modalprep.multibody.model.joint import Joint
    >>> beam = large_cantilever(modes=2, stations=4)
    >>> beam = beam.with_(stations=beam.stations.with_(idle_below=1e-4))
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="beam")
    >>> without_idle(System(bodies={"beam": beam}, joints=(hinge,))).bodies["beam"].stations is None
    True
    """
    idle = {name: body.with_(stations=None) for name, body in system.bodies.items() if _idle(body)}
    return system.with_(bodies={**system.bodies, **idle}) if idle else system


def _idle(body: FlexibleBody) -> bool:
    return body.stations is not None and body.stations.idle_below > 0


def _awake(body: FlexibleBody) -> FlexibleBody:
    assert body.stations is not None
    return body.with_(stations=body.stations.with_(idle_below=0.0))


def too_far(body: FlexibleBody, q: np.ndarray) -> bool:
    """Whether the modes alone leave more than a body allows at modal coordinates ``q (nt, n)``.

    Where no node can move by half the cube root of what is allowed, nothing is looked at: the difference is of third
    order, a fifth of the cube of the deflection of a cantilever.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> beam = large_cantilever(modes=2, stations=8)
    >>> beam = beam.with_(stations=beam.stations.with_(idle_below=1e-4))
    >>> tip = np.abs(beam.phi[1]).max(axis=0)[0]
    >>> [too_far(beam, np.array([[w / tip] + [0.0] * (beam.n - 1)])) for w in (0.5, 3.0)]
    [False, True]
    """
    assert body.stations is not None
    allowed, size = body.stations.idle_below, size_of(body)
    if not np.all(np.isfinite(q)):
        return True
    bound = np.abs(q) @ np.sqrt((body.shape**2).sum(axis=1)).max(axis=0, initial=0.0)
    rows = np.argsort(bound)[::-1][:LOOKED_AT]
    rows = rows[bound[rows] > 0.5 * np.cbrt(allowed) * size]
    return len(rows) > 0 and bool(gap_of_modes(body, q[rows]).max() > allowed * size)
