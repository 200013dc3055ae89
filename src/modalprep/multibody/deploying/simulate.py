"""Simulate deployments: integrate stage by stage, add and take rods between, with the momentum of the same particles.

A stage ends where the innermost rod is all out (the next one follows), all in (it goes), or long enough to turn by
itself. No particle moves at such an event, and none changes its velocity, with two exceptions: a rod that becomes too
short to turn by itself is locked to the next one, and a law of the length may kink. Both are impulses inside the
system, ``u+ = u- + M^-1 G' p``, so that its linear and angular momentum stay; what energy they take is booked.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.multibody.deploying.histories import Histories
from modalprep.multibody.deploying.phase import Phase, RunSettings
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.evaluation.stresses import stress_channels
from modalprep.multibody.model.deployment import FIRST_BEND, IN, OUT, STIFF, Change, Deployment, Stage, start_angles
from modalprep.multibody.model.deployment_law import aligning, first_stage, leaving, samples, stretches
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.results.channels import Channels
from modalprep.multibody.results.result import Result, output_times
from modalprep.multibody.simulate import check_span

ALIGNED = 0.1  # of a rod: way in which the guide aligns a rod of a beam that comes in
KINK, JAM = "kink", "jam"


def simulate_deployment(
    system: DeployingSystem,
    *,
    t_end: float,
    output_step: float = 0.01,
    rtol: float = 1e-7,
    atol: float = 1e-10,
    method: str = "auto",
    progress: Callable[[float], None] | None = None,
) -> Result:
    """Integrate a system with deployments; parameters and channels are those of `simulate`, and in addition a few.

    ``<deployment>.length``, ``.speed`` (m, m/s), ``.tension`` (N, in the beam just outside the exit), ``.rods`` (how
    many are out, wholly or in part), and ``energy.events`` (J), what events have given so far; it is also part of
    ``energy.work``, so that ``energy.error`` stays a check. Channels of rods that are stowed, and of hinges that are
    stowed or locked, are NaN. The root of the innermost rod is where the material would be, straight behind the exit.
    `Result.events` has the times of ``<deployment>.insert``, ``.remove``, ``.unlock``, ``.lock``, ``.kink`` and
    ``.stop``.

    Returns
    -------
    Result
        As of `simulate`, with the channels above.

    Raises
    ------
    InputError
        When a law leaves the length that there is, or a time or tolerance is not positive.
    SimulationError
        When the run cannot go on.

    References
    ----------
    Theory 9.3.

    Examples
    --------
    >>> boom = Deployment(name="boom", parent="ground", length=2.0, segments=4, mass_per_length=1.0, EI=100.0,
    ...                   law="0.6 + t")
    >>> run = simulate_deployment(DeployingSystem(bodies={}, joints=(), deployments=(boom,)), t_end=1.0)
    >>> run["boom.length"][-1].round(9), run["boom.rods"][[0, -1]]
    (np.float64(1.6), array([2., 4.]))
    """
    check_span(t_end, output_step, rtol, atol, method)
    times = output_times(t_end, output_step)
    run = Run(system, times, {"rtol": rtol, "atol": atol}, method)
    return run.through(progress)


def deployment_channels(system: DeployingSystem) -> Result:
    """Return every channel of a run by name, without numbers."""
    full = system.full()
    histories = Histories(system, np.zeros(0))
    histories.add(Channels(full, pack(full), None).places, np.zeros((0, 0)))
    return _with_stress(system, histories.result("start", "", {}, {}))


def _with_stress(system: DeployingSystem, run: Result) -> Result:
    return run.with_(channels=run.channels | stress_channels(system.bodies, run.channels))


class Run:
    """A run: the stages of the deployments, the phase that is integrated, what was recorded."""

    def __init__(self, system: DeployingSystem, times: np.ndarray, tolerances: dict, method: str) -> None:
        self.system, self.times = system, times
        self.laws = [None if d.law is None else stretches(d) for d in system.deployments]
        self.samples = [None if d.law is None else samples(d, times[-1]) for d in system.deployments]
        self.histories = Histories(system, times)
        self.settings = RunSettings(system, times, self.histories, tolerances, method)
        self.stats: dict[str, float] = {}
        self.events: dict[str, list[float]] = {}
        stages = [first_stage(d) for d in system.deployments]
        places = [_places(d, stage) for d, stage in zip(system.deployments, stages, strict=True)]
        self.phase = Phase(
            self.settings, stages, 0.0, {name: place for found in places for name, place in found.items()}
        )

    def through(self, progress: Callable[[float], None] | None) -> Result:
        """Integrate to the end."""
        status, message = "done", ""
        while self.phase.t < self.times[-1] and status == "done":
            planned = self._planned()
            status, message, change = self.phase.run(planned, progress)
            self.settings = self.settings._replace(method=self.phase.method)
            if change and status == "done":
                self._take(change)
        self._count()
        events = {name: np.array(found) for name, found in self.events.items()}
        return _with_stress(self.system, self.histories.result(status, message, self.stats, events))

    def _planned(self) -> Change:
        """Return the next change that is known beforehand, or the end of the run."""
        found = [Change(float(self.times[-1]), -1, "")]
        for k, (d, stage) in enumerate(zip(self.system.deployments, self.phase.stages, strict=True)):
            if stage.held:
                continue
            found.append(Change(max(d.jam, self.phase.t), k, JAM))
            if d.law is not None:
                found.append(Change(self.laws[k][0][0], k, KINK))
                found.append(leaving(d, k, stage.range(d), self.phase.t, self.samples[k]))
        return min(found, key=lambda change: change.t)

    def _take(self, change: Change) -> None:
        """Change the stage of a deployment."""
        old, k = self.phase, change.k
        before = old.energy()
        stage, places = self._next(change)
        stages = [*old.stages[:k], stage, *old.stages[k + 1 :]]
        self._count()
        self.phase = Phase(self.settings, stages, old.t, {}, old, places)
        gained = self.phase.energy() - before
        self.phase.steps.y[-1] += gained
        self.histories.gained.append((old.t, gained))

    def _next(self, change: Change) -> tuple[Stage, dict]:
        """Return the next stage of a deployment, and places and rates of hinges in it."""
        d, stage = self.system.deployments[change.k], self.phase.stages[change.k]
        if change.what in (OUT, IN):
            low, high = stage.range(d)
            if not np.isfinite(high if change.what == OUT else low):
                return self._stopped(change, "stop", None)
            name, function = _change(change.what, d, stage)
            self._log(d, name)
            return function(self.phase, d, stage)
        if change.what == KINK:
            self.laws[change.k].pop(0)
            return self._stopped(change, "kink", self.laws[change.k][0][1])
        return self._stopped(change, "stop", None)

    def _stopped(self, change: Change, name: str, law: TimeFunction | None) -> tuple[Stage, dict]:
        """Give the reel another law, or none; its speed changes by an impulse."""
        d, stage = self.system.deployments[change.k], self.phase.stages[change.k]
        self._log(d, name)
        phase, t = self.phase, self.phase.t
        length, speed = phase.travel(d)
        wanted = law(t)[1] if law else 0.0
        if stage.law is not None:
            stages = list(phase.stages)
            stages[change.k] = stage.with_(law=None)
            freed = Phase(self.settings, stages, t, {}, phase, {d.name: (np.array([length]), np.array([speed]))})
            freed.stop(d.name, np.array([wanted]))
            phase.take_speeds(freed)
        else:
            phase.stop(d.name, np.array([wanted]))
        return stage.with_(law=law or TimeFunction(float(length)), held=law is None), {}

    def _log(self, d: Deployment, name: str) -> None:
        self.events.setdefault(f"{d.name}.{name}", []).append(self.phase.t)

    def _count(self) -> None:
        for name, value in self.phase.counts.items():
            known = self.stats.get(name, 0.0)
            self.stats[name] = max(known, value) if name in ("stiffness_ratio", "method") else known + value


def _insert(phase: Phase, d: Deployment, stage: Stage) -> tuple[Stage, dict]:
    """The next rod follows, straight behind the last: nothing changes its place or velocity."""
    n = stage.rods
    if not d.guided:
        return stage.with_(rods=n + 1, locked=True, turn=np.eye(3)), {f"{d.name}{n + 1}": phase.hinge(f"{d.name}{n}")}
    bent = phase.hinge(f"{d.name}{n - 1}")[0][0] if n > 1 else 0.0
    return stage.with_(rods=n + 1, fading=-STIFF / FIRST_BEND * bent), {f"{d.name}{n}": (np.zeros(1), np.zeros(1))}


def _remove(phase: Phase, d: Deployment, stage: Stage) -> tuple[Stage, dict]:
    """The innermost rod is in; a cable's next one hangs on the exit, a beam's is aligned while it follows."""
    n = stage.rods
    turn, spin, speed = phase.turned_in(d, stage)
    places = {} if stage.law is not None else {d.name: (np.array([phase.travel(d)[0]]), np.array([speed]))}
    if not d.guided:
        places[f"{d.name}{n - 1}"] = _place(d, turn), spin if d.spatial else spin[2:]
        return stage.with_(rods=n - 1, locked=False, turn=np.eye(3)), places
    within = min(ALIGNED * d.rod / abs(speed), float(phase.settings.times[-1]))
    tilt = aligning(phase.t, float(np.arctan2(turn[1, 0], turn[0, 0])), float(spin[2]), within)
    return stage.with_(rods=n - 1, tilt=tilt, fading=0.0), places


def _unlock(phase: Phase, d: Deployment, stage: Stage) -> tuple[Stage, dict]:
    """The innermost rod turns by itself."""
    still = (_place(d, stage.turn), np.zeros(3 if d.spatial else 1))
    return stage.with_(locked=False, turn=np.eye(3)), {f"{d.name}{max(1, stage.rods - 1)}": still}


def _lock(phase: Phase, d: Deployment, stage: Stage) -> tuple[Stage, dict]:
    """The innermost rod is too short to turn by itself: an impulse stops it against the next one."""
    hinge = f"{d.name}{max(1, stage.rods - 1)}"
    phase.stop(hinge, np.zeros(3 if d.spatial else 1))
    return stage.with_(locked=True, turn=phase.relative(hinge)[0]), {}


def _place(d: Deployment, turn: np.ndarray) -> np.ndarray:
    """Coordinates of a hinge at a rotation."""
    if d.spatial:
        return Rotation.from_matrix(turn).as_quat(scalar_first=True)
    return np.array([np.arctan2(turn[1, 0], turn[0, 0])])


def _change(what: str, d: Deployment, stage: Stage) -> tuple[str, Callable]:
    """Return name and function of what happens at an end of a stage."""
    if d.guided:
        return ("insert", _insert) if what == OUT else ("remove", _remove)
    return {
        (OUT, False): ("insert", _insert),
        (OUT, True): ("unlock", _unlock),
        (IN, False): ("lock", _lock),
        (IN, True): ("remove", _remove),
    }[what, stage.locked]


def _places(d: Deployment, stage: Stage) -> dict[str, dict]:
    """Start values of a beam's hinges."""
    if not d.guided:
        return {}
    angles, rates = start_angles(d, stage)
    return {f"{d.name}{k}": {"angle": float(angles[k - 1]), "rate": float(rates[k - 1])} for k in range(1, stage.rods)}
