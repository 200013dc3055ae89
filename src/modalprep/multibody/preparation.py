"""A system made ready: an integration that has not begun, and every channel of a run at one state."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.evaluation.system_state import SystemState
from modalprep.multibody.integration.run import Integration
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.constraints import closed_accelerations
from modalprep.multibody.reference.loads import loaded_accelerations
from modalprep.multibody.results.channels import Channels
from modalprep.multibody.results.record import Recorder, histories
from modalprep.multibody.results.recovered_state import RecoveredState
from modalprep.multibody.results.result import Result

Kind = TypeVar("Kind", bound=Integration)


def channel_names(system: System, t_end: float) -> Result:
    """Return every channel of a run to `t_end` (s) without samples; nothing is evaluated.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> "hinge.angle" in channel_names(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)), t_end=1.0)
    True
    """
    packed = pack(system)
    channels = Channels(system, packed, Loading(system, packed, t_end).loops)
    found = histories(system, channels.index, np.empty((0, channels.width)), np.empty(0))
    audit = ["energy.error", *["momentum.error"] * len(channels.columns.sums)]
    return Result(time=np.empty(0), channels=found | dict.fromkeys(audit, np.empty(0)), status="start", message="")


def channels_at(system: System, y: np.ndarray, t: float = 0.0) -> Result:
    """Return every channel of a run at one state ``y (nx + nu,)`` and time t (s), no work done."""
    integration = prepare(system, np.array([0.0, t + 1.0]), method="explicit", rtol=1.0, atol=1.0)
    loading = integration.loading
    loading.enter(*next(stretch for stretch in loading.stretches if t < stretch[1]))
    recorder = Recorder(integration, 1)
    integration.sample(t, y)
    recorder.add(np.array([t]), np.append(y, 0.0)[None])
    loading.sampling.close()
    integration.raise_callback()
    return recorder.result("state", "", {})


def start_channels(system: System) -> Result:
    """Return every channel of a run at the start values of the joints, modes at rest.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", angle=0.5)
    >>> start_channels(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)))["hinge.angle"]
    array([0.5])
    """
    return channels_at(system, start_state(pack(system)))


def prepare(
    system: System,
    times: np.ndarray,
    *,
    start: SystemState | None = None,
    reference: bool = False,
    shortest_event: float | None = None,
    kind: type[Kind] = Integration,
    **options,
) -> Kind:
    """Return an integration that has not begun, no work done; options as `Integration`, of which `kind` is.

    It begins at a state, or at the start values of the joints with modes at rest.
    """
    packed = pack(system)
    loading = Loading(system, packed, float(times[-1]), shortest_event)
    begin = float(times[0])
    anew = start is None or bool(loading.sampling.loads) or _are_apart(start.steps, begin, loading, options)
    steps = {} if start is None or anew else start.steps
    loading.clip(begin, float(times[-1]))
    y = np.append(start_state(packed) if start is None else start.vector(system), 0.0)
    if start is not None and loading.loops:
        loading.loops.restore(start.closures, start.active)
    accelerations = _reference_accelerations(system, loading) if reference else None
    size = deflections(system, packed)
    seen = RecoveredState(system, packed, loading.loops)
    given = {"reference": accelerations, "observer": seen, "is_deflected": start is not None, "steps": steps}
    return kind(system, packed, loading, y, times, size, **given, **options)


def _are_apart(steps: Mapping[str, np.ndarray], begin: float, loading: Loading, options: Mapping[str, Any]) -> bool:
    """Whether something lies between the last step that was not cut and the time where the run before ended."""
    breaks = [end for _, end in loading.stretches]
    return bool(steps) and float(steps["time"]) < begin and (begin in breaks or bool(options.get("events")))


def deflections(system: System, packed: Packed) -> np.ndarray:
    """Return the largest deflection per modal coordinate, in sizes of its body (nx,)."""
    found = np.zeros(packed.nx)
    of_body = {}
    for name, body in system.bodies.items():
        if body.n and id(body) not in of_body:
            extent = max(np.ptp(body.points, axis=0).max(initial=0.0), 1e-12)
            of_body[id(body)] = np.abs(body.shape).max(axis=(0, 1), initial=0.0) / extent
        if body.n:
            found[packed.modes_of(name)] = of_body[id(body)]
    return found


def _reference_accelerations(system: System, loading: Loading) -> Callable:
    """Return the accelerations by the reference implementation, ``(y, motion, t) -> (nu,)``."""
    loops = loading.loops
    if loops is None:
        return lambda y, motion, t: loaded_accelerations(system, y, motion, t)
    return lambda y, motion, t: closed_accelerations(system, loops, y, motion, t)[0]
