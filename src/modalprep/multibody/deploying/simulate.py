"""Simulate deployments: integrate stage by stage, and insert or remove rods between stages at constant momentum.

A stage ends where the innermost rod is fully deployed (the next one is inserted), fully retracted (it is removed), or
long enough to rotate freely. At such an event no particle changes its position or velocity, with two exceptions: a rod
that becomes too short to rotate freely is locked to the next one, and the rate of a prescribed length may jump. Both
are internal impulses, ``u+ = u- + M^-1 G' p``, which conserve linear and angular momentum; the energy that they take is
recorded in ``energy.events``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from modalprep.multibody.deploying.histories import Histories
from modalprep.multibody.deploying.phase import Phase, RunSettings
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.evaluation.stresses import stress_channels
from modalprep.multibody.model.deployment import FIRST_BEND, IN, OUT, STIFF, Change, Deployment, Stage, start_angles
from modalprep.multibody.model.deployment_law import alignment_angle, first_stage, next_exit, samples, smooth_intervals
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.results.channels import Channels
from modalprep.multibody.results.recovered import recovery_channels
from modalprep.multibody.results.result import Result, output_times
from modalprep.multibody.results.time_notes import time_notes
from modalprep.multibody.simulate import check_span, check_steps
from modalprep.verdicts.notes import told

ALIGNED = 0.1  # of a rod: retraction within which the guide aligns the next rod of a beam
RATE_JUMP, STOP = "kink", "stop"


@told
def simulate_deployment(
    system: DeployingSystem,
    *,
    t_end: float,
    output_step: float = 0.01,
    rtol: float = 1e-7,
    atol: float = 1e-10,
    method: str = "auto",
    max_step: float | None = None,
    shortest_event: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Result:
    """Integrate a system with deployments; parameters and channels as in `simulate`, with additional channels.

    These are ``<deployment>.length``, ``.speed`` (m, m/s), ``.tension`` (N, just outside the exit), ``.rods`` (number
    of fully or partly deployed rods) and ``energy.events`` (J), the energy added by events so far. It is included in
    ``energy.work``, so that ``energy.error`` remains a check. Channels of stowed rods and of stowed or locked hinges
    are NaN. The root of the innermost rod lies on the straight continuation of the rod behind the exit. `Result.events`
    has the times of ``<deployment>.insert``, ``.remove``, ``.unlock``, ``.lock``, ``.kink`` and ``.stop``.

    Returns
    -------
    Result
        As of `simulate`, with the channels above.

    Raises
    ------
    InputError
        When a deployed length exceeds the total length, or a time or tolerance is not positive.
    SimulationError
        When the run cannot go on.

    References
    ----------
    Theory 9.3.

    Examples
    --------
    >>> boom = Deployment(name="boom", parent="ground", length=2.0, segments=4, mass_per_length=1.0, EI=100.0,
    ...                   deployed_length="0.6 + t")
    >>> run = simulate_deployment(DeployingSystem(bodies={}, joints=(), deployments=(boom,)), t_end=1.0)
    >>> run["boom.length"][-1].round(9), run["boom.rods"][[0, -1]]
    (np.float64(1.6), array([2., 4.]))
    """
    check_span(t_end, output_step, rtol, atol, method)
    check_steps(t_end, max_step, shortest_event)
    times = output_times(t_end, output_step)
    run = Run(system, times, {"rtol": rtol, "atol": atol, "longest": max_step or np.inf}, method, shortest_event)
    result = run.integrate(progress)
    return result.with_(notes=(*result.notes, *time_notes(system, t_end, shortest_event)))


def deployment_channels(system: DeployingSystem) -> Result:
    """Return every channel of a run by name, without samples."""
    full = system.full()
    histories = Histories(system, np.zeros(0))
    histories.add(Channels(full, pack(full), None).index, np.zeros((0, 0)))
    return _with_recovery(system, histories.result("start", "", {}, {}))


def _with_recovery(system: DeployingSystem, run: Result) -> Result:
    """Add the stress and the recoveries of the bodies; rods have none, and carry no body with modes behind the exit."""
    found = run.channels | stress_channels(system.bodies, run.channels)
    return run.with_(channels=found | recovery_channels(system.full(), run.time, found))


class Run:
    """A run: stages of the deployments, current phase, recorded histories."""

    def __init__(
        self, system: DeployingSystem, times: np.ndarray, tolerances: dict, method: str, shortest_event: float | None
    ) -> None:
        self.system, self.times = system, times
        prescribed = {k: d for k, d in enumerate(system.deployments) if d.deployed_length is not None}
        self.intervals = {k: smooth_intervals(d) for k, d in prescribed.items()}
        self.samples = {k: samples(d, times[-1]) for k, d in prescribed.items()}
        self.histories = Histories(system, times)
        self.settings = RunSettings(system, times, self.histories, tolerances, method, shortest_event)
        self.stats: dict[str, Any] = {}
        self.events: dict[str, list[float]] = {}
        stages = [first_stage(d) for d in system.deployments]
        hinges = [_start_values(d, stage) for d, stage in zip(system.deployments, stages, strict=True)]
        self.phase = Phase(
            self.settings, stages, 0.0, {name: values for found in hinges for name, values in found.items()}
        )

    def integrate(self, progress: Callable[[float], None] | None) -> Result:
        """Integrate to the end."""
        status, message = "done", ""
        while self.phase.t < self.times[-1] and status == "done":
            planned = self._planned()
            status, message, change = self.phase.run(planned, progress)
            self.settings = self.settings._replace(method=self.phase.method)
            if change and status == "done":
                self._apply(change)
        self._add_counts()
        events = {name: np.array(found) for name, found in self.events.items()}
        return _with_recovery(self.system, self.histories.result(status, message, self.stats, events))

    def _planned(self) -> Change:
        """Return the next change known in advance, or the end of the run."""
        found = [Change(float(self.times[-1]), -1, "")]
        for k, (d, stage) in enumerate(zip(self.system.deployments, self.phase.stages, strict=True)):
            if stage.stopped:
                continue
            found.append(Change(max(d.stop_time, self.phase.t), k, STOP))
            if k in self.intervals:
                found.append(Change(self.intervals[k][0][0], k, RATE_JUMP))
                found.append(next_exit(d, k, stage.range(d), self.phase.t, self.samples[k]))
        return min(found, key=lambda change: change.t)

    def _apply(self, change: Change) -> None:
        """Replace the stage of a deployment and start the next phase."""
        old, k = self.phase, change.k
        before = old.energy()
        stage, hinges = self._next(change)
        stages = [*old.stages[:k], stage, *old.stages[k + 1 :]]
        self._add_counts()
        self.phase = Phase(self.settings, stages, old.t, {}, old, hinges)
        added = self.phase.energy() - before
        self.phase.steps.y[-1] += added
        self.histories.event_energy.append((old.t, added))

    def _next(self, change: Change) -> tuple[Stage, dict]:
        """Return the next stage of a deployment, and positions and rates of hinges in it."""
        d, stage = self.system.deployments[change.k], self.phase.stages[change.k]
        if change.kind in (OUT, IN):
            low, high = stage.range(d)
            if not np.isfinite(high if change.kind == OUT else low):
                return self._represcribed(change, "stop", None)
            name, function = _change(change.kind, d, stage)
            self._log(d, name)
            return function(self.phase, d, stage)
        if change.kind == RATE_JUMP:
            self.intervals[change.k].pop(0)
            return self._represcribed(change, "kink", self.intervals[change.k][0][1])
        return self._represcribed(change, "stop", None)

    def _represcribed(self, change: Change, name: str, length: TimeFunction | None) -> tuple[Stage, dict]:
        """Prescribe the deployed length anew, or stop the reel (None); its speed changes by an impulse."""
        d, stage = self.system.deployments[change.k], self.phase.stages[change.k]
        self._log(d, name)
        phase, t = self.phase, self.phase.t
        now, speed = phase.length_and_speed(d)
        target = np.array([length(t)[1] if length else 0.0])
        if stage.length is not None:
            stages = list(phase.stages)
            stages[change.k] = stage.with_(length=None)
            freed = Phase(self.settings, stages, t, {}, phase, {d.name: (np.array([now]), np.array([speed]))})
            freed.change_speed(d.name, target)
            phase.copy_speeds(freed)
        else:
            phase.change_speed(d.name, target)
        return stage.with_(length=length or TimeFunction(float(now)), stopped=length is None), {}

    def _log(self, d: Deployment, name: str) -> None:
        self.events.setdefault(f"{d.name}.{name}", []).append(self.phase.t)

    def _add_counts(self) -> None:
        """Add up the counts of the phases; the method is that of the last, the stiffness ratio the largest."""
        for name, value in self.phase.counts.items():
            known = self.stats.get(name, 0)
            largest = name == "stiffness_ratio"
            self.stats[name] = value if name == "method" else max(known, value) if largest else known + value


def _insert(phase: Phase, d: Deployment, stage: Stage) -> tuple[Stage, dict]:
    """Insert the next rod in line with the last one; positions and velocities do not change."""
    n = stage.rods
    if not d.guided:
        return stage.with_(rods=n + 1, locked=True, rotation=np.eye(3)), {
            f"{d.name}{n + 1}": phase.hinge(f"{d.name}{n}")
        }
    bent = phase.hinge(f"{d.name}{n - 1}")[0][0] if n > 1 else 0.0
    return stage.with_(rods=n + 1, vanishing_angle=-STIFF / FIRST_BEND * bent), {
        f"{d.name}{n}": (np.zeros(1), np.zeros(1))
    }


def _remove(phase: Phase, d: Deployment, stage: Stage) -> tuple[Stage, dict]:
    """Remove the innermost rod; a cable's next rod is hinged to the exit, a beam's is aligned as it retracts."""
    n = stage.rods
    turn, spin, speed = phase.release_innermost(d, stage)
    hinges = {} if stage.length is not None else {d.name: (np.array([phase.length_and_speed(d)[0]]), np.array([speed]))}
    if not d.guided:
        hinges[f"{d.name}{n - 1}"] = _hinge_coordinates(d, turn), spin if d.spatial else spin[2:]
        return stage.with_(rods=n - 1, locked=False, rotation=np.eye(3)), hinges
    within = min(ALIGNED * d.rod_length / abs(speed), float(phase.settings.times[-1]))
    tilt = alignment_angle(phase.t, float(np.arctan2(turn[1, 0], turn[0, 0])), float(spin[2]), within)
    return stage.with_(rods=n - 1, tilt=tilt, vanishing_angle=0.0), hinges


def _unlock(phase: Phase, d: Deployment, stage: Stage) -> tuple[Stage, dict]:
    """Let the innermost rod rotate freely."""
    still = (_hinge_coordinates(d, stage.rotation), np.zeros(3 if d.spatial else 1))
    return stage.with_(locked=False, rotation=np.eye(3)), {f"{d.name}{max(1, stage.rods - 1)}": still}


def _lock(phase: Phase, d: Deployment, stage: Stage) -> tuple[Stage, dict]:
    """Lock the innermost rod, too short to rotate freely, to the next one by an impulse."""
    hinge = f"{d.name}{max(1, stage.rods - 1)}"
    phase.change_speed(hinge, np.zeros(3 if d.spatial else 1))
    return stage.with_(locked=True, rotation=phase.relative(hinge)[0]), {}


def _hinge_coordinates(d: Deployment, turn: np.ndarray) -> np.ndarray:
    """Return the coordinates of a hinge at a relative rotation (3, 3)."""
    if d.spatial:
        return scipy.spatial.transform.Rotation.from_matrix(turn).as_quat(scalar_first=True)
    return np.array([np.arctan2(turn[1, 0], turn[0, 0])])


def _change(kind: str, d: Deployment, stage: Stage) -> tuple[str, Callable]:
    """Return name and function of the change at an end of a stage."""
    if d.guided:
        return ("insert", _insert) if kind == OUT else ("remove", _remove)
    return {
        (OUT, False): ("insert", _insert),
        (OUT, True): ("unlock", _unlock),
        (IN, False): ("lock", _lock),
        (IN, True): ("remove", _remove),
    }[kind, stage.locked]


def _start_values(d: Deployment, stage: Stage) -> dict[str, dict]:
    """Return the initial values of a beam's hinges."""
    if not d.guided:
        return {}
    angles, rates = start_angles(d, stage)
    return {f"{d.name}{k}": {"angle": float(angles[k - 1]), "rate": float(rates[k - 1])} for k in range(1, stage.rods)}
