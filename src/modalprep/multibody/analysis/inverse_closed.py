"""Inverse dynamics with closed loops: each prescribed history is a coupler whose multiplier is the drive force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.evaluation.evaluate import evaluate
from modalprep.multibody.evaluation.evaluator import AHEAD
from modalprep.multibody.integration.run import Integration
from modalprep.multibody.model.constraints import Coupler
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.preparation import prepare


def drive_loops(
    system: System, laws: Mapping[str, Sequence[TimeFunction]], times: np.ndarray, rtol: float
) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Return states (nt, nx + nu), accelerations (nt, nu) and forces {joint: (nt, k)} of driven joints in loops.

    Modes, and joints without a prescribed history, follow from their equations of motion and start values.

    Parameters
    ----------
    laws : {joint: a function of time for each of its coordinates}
    times : (nt,)
        s, from 0.

    Raises
    ------
    InputError
        When the first time is not 0, or there are more histories than degrees of freedom.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.constraints import Closure
    >>> from modalprep.multibody.model.joint import Joint
    >>> rod = rigid_body("rod", mass=1.0, centre=np.zeros(3), inertia=np.eye(3),
    ...                  interfaces={"root": np.zeros(3), "end": np.array([1.0, 0, 0])})
    >>> joints = (Joint(name="crank", type="revolute", parent="ground", child="a", angle=1.0, keep_start=True),
    ...           Joint(name="knee", type="revolute", parent="a.end", child="b", angle=-2.0))
    >>> slot = Closure(name="slot", type="point_on_plane", a="ground", b="b.end", axis=np.array([0, 1.0, 0]))
    >>> system = System(bodies={"a": rod, "b": rod}, joints=joints, closures=(slot,))
    >>> y, udot, force = drive_loops(system, {"crank": [TimeFunction("1 + t**2")]}, np.array([0.0, 0.1]), 1e-9)
    >>> force["crank"][0].round(9).tolist()  # a and b turn oppositely: both inertias, and b's mass that the knee moves
    [6.0]
    """
    if times[0] != 0.0:
        raise InputError(f"inverse dynamics: with closed loops the times must begin at 0, not at {times[0]:g} s")
    drives = [
        Coupler(name=f"drive of {joint}.{k}", factors={f"{joint}.{k}": 1.0}, value=law)
        for joint, several in laws.items()
        for k, law in enumerate(several, start=1)
    ]
    driven = system.with_(closures=(*system.closures, *drives))
    options = {"method": "explicit", "rtol": rtol, "atol": 1e-3 * rtol}
    span = times if len(times) > 1 else np.array([0.0, AHEAD])
    run = prepare(driven, span, **options)
    _refuse_dependent(prepare(system, span, **options), run, drives)
    states = _states(run, times)
    udot, multipliers = zip(*(_evaluated(run, t, y) for t, y in zip(times, states, strict=True)), strict=True)
    force = np.array(multipliers)[:, len(system.closures) :]
    ends = np.cumsum([len(several) for several in laws.values()])
    columns = np.split(force, ends[:-1], axis=1)
    return states[:, :-1], np.array(udot), dict(zip(laws, columns, strict=True))


def _refuse_dependent(free: Integration, driven: Integration, drives: Sequence[Coupler]) -> None:
    added = int(driven.loading.closed_loops.work.rank[0]) - int(free.loading.closed_loops.work.rank[0])
    if added < len(drives):
        raise InputError(
            f"inverse dynamics: only {added} of the {len(drives)} coordinates with a history are independent, so the "
            "forces are not determined; leave histories out"
        )


def _states(run: Integration, times: np.ndarray) -> np.ndarray:
    """Return the states (nt, nx + nu + 1) at the times."""
    blocks: list[np.ndarray] = []
    if len(times) == 1:
        return run.steps.y[None].copy()
    run.run(lambda _, states: blocks.append(states.copy()), None)
    return np.vstack(blocks)


def _evaluated(run: Integration, t: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the accelerations (nu,) and the multipliers, summed over each closure, of a state."""
    run.loading.enter(*next(s for s in run.loading.stretches if t <= s[1]))
    ydot = np.zeros(len(y))
    loops = run.loading.closed_loops
    evaluate(run.equations, t, y, ydot)
    run.raise_callback()
    rows = [loops.closing.of(k) for k in range(len(run.system.closures))]
    return ydot[run.packed.nx : -1], np.array([loops.work.multiplier[r].sum() for r in rows])
