"""Simulate deployments: integrate stage by stage, add and take rods between, with the momentum of the same particles.

A stage ends where the innermost rod is all out (the next one follows), all in (it goes), or long enough to turn by
itself. No particle moves at such an event, and none changes its velocity, with two exceptions: a rod that becomes too
short to turn by itself is locked to the next one, and a law of the length may kink. Both are impulses inside the
system, ``u+ = u- + M^-1 G' p``, so that its linear and angular momentum stay; what energy they take is booked.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from modalprep.errors import InputError
from modalprep.multibody import kernel
from modalprep.multibody.channels import WORK, Channels
from modalprep.multibody.deployment import (
    EXACT,
    FIRST_BEND,
    STIFF,
    DeployingSystem,
    Deployment,
    Stage,
    aligning,
    first_stage,
    start_angles,
    stretches,
)
from modalprep.multibody.driver import ALPHA, EXPLICIT, ROSENBROCK
from modalprep.multibody.evaluate import Model, build_model, load
from modalprep.multibody.events import Event
from modalprep.multibody.integrators import Integration
from modalprep.multibody.layout import (
    COORDINATES,
    MASS,
    MODES,
    PRESCRIBED,
    PRISMATIC,
    SPEEDS,
    SPHERICAL,
    UQ,
    WELD,
    XQ,
    Packed,
    U,
    X,
    pack,
)
from modalprep.multibody.loading import Loading
from modalprep.multibody.observation import record
from modalprep.multibody.packed_reels import pack_reels
from modalprep.multibody.plant import start_state
from modalprep.multibody.record import Recorder, audited
from modalprep.multibody.result import Result, output_times
from modalprep.multibody.simulate import check_span, deflections
from modalprep.multibody.stepping import SIZES
from modalprep.multibody.timefunction import FOREVER, TimeFunction

SAMPLES = 20_000  # of a law, between which it is taken to pass a length once
ALIGNED = 0.1  # of a rod: way in which the guide aligns a rod of a beam that comes in
OUT, IN, KINK, JAM = "out", "in", "kink", "jam"


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

    Raises
    ------
    InputError
        When a law leaves the length that there is, or a time or tolerance is not positive.
    SimulationError
        When the run cannot go on.

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
    histories = _Histories(system, np.zeros(0))
    histories.add(Channels(full, pack(full), None).places, np.zeros((0, 0)))
    return histories.result("start", "", {}, {})


class _Change(NamedTuple):
    """What ends a stage of deployment k at time t."""

    t: float
    k: int
    what: str


class Run:
    """A run: the stages of the deployments, the phase that is integrated, what was recorded."""

    def __init__(self, system: DeployingSystem, times: np.ndarray, tolerances: dict, method: str) -> None:
        self.system, self.times, self.tolerances, self.method = system, times, tolerances, method
        self.laws = [None if d.law is None else stretches(d) for d in system.deployments]
        self.samples = [None if d.law is None else _samples(d, times[-1]) for d in system.deployments]
        self.histories = _Histories(system, times)
        self.stats: dict[str, float] = {}
        self.events: dict[str, list[float]] = {}
        stages = [first_stage(d) for d in system.deployments]
        places = [_places(d, stage) for d, stage in zip(system.deployments, stages, strict=True)]
        self.phase = Phase(self, stages, 0.0, {name: place for found in places for name, place in found.items()})

    def through(self, progress: Callable[[float], None] | None) -> Result:
        """Integrate to the end."""
        status, message = "done", ""
        while self.phase.t < self.times[-1] and status == "done":
            planned = self._planned()
            status, message, change = self.phase.run(planned, progress)
            if change and status == "done":
                self._take(change)
        self._count()
        events = {name: np.array(found) for name, found in self.events.items()}
        return self.histories.result(status, message, self.stats, events)

    def _planned(self) -> _Change:
        """Return the next change that is known beforehand, or the end of the run."""
        found = [_Change(float(self.times[-1]), -1, "")]
        for k, (d, stage) in enumerate(zip(self.system.deployments, self.phase.stages, strict=True)):
            if stage.held:
                continue
            found.append(_Change(max(d.jam, self.phase.t), k, JAM))
            if d.law is not None:
                found.append(_Change(self.laws[k][0][0], k, KINK))
                found.append(_leaving(d, k, stage.range(d), self.phase.t, self.samples[k]))
        return min(found, key=lambda change: change.t)

    def _take(self, change: _Change) -> None:
        """Change the stage of a deployment."""
        old, k = self.phase, change.k
        before = old.energy()
        stage, places = self._next(change)
        stages = [*old.stages[:k], stage, *old.stages[k + 1 :]]
        self._count()
        self.phase = Phase(self, stages, old.t, {}, old, places)
        gained = self.phase.energy() - before
        self.phase.steps.y[-1] += gained
        self.histories.gained.append((old.t, gained))

    def _next(self, change: _Change) -> tuple[Stage, dict]:
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

    def _stopped(self, change: _Change, name: str, law: TimeFunction | None) -> tuple[Stage, dict]:
        """Give the reel another law, or none; its speed changes by an impulse."""
        d, stage = self.system.deployments[change.k], self.phase.stages[change.k]
        self._log(d, name)
        phase, t = self.phase, self.phase.t
        length, speed = phase.travel(d)
        wanted = law(t)[1] if law else 0.0
        if stage.law is not None:
            stages = list(phase.stages)
            stages[change.k] = stage.with_(law=None)
            freed = Phase(self, stages, t, {}, phase, {d.name: (np.array([length]), np.array([speed]))})
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


class Phase:
    """The system between two changes of its stages."""

    def __init__(
        self, run: Run, stages: list[Stage], t: float, start: dict, before: Phase | None = None,
        places: dict | None = None,
    ) -> None:  # fmt: skip
        self.owner, self.stages, self.t = run, stages, t
        self.system = run.system.at(stages, start)
        self.packed = pack(self.system)
        self.loading = Loading(self.system, self.packed, float(run.times[-1]))
        self.loading.clip(t, float(run.times[-1]))
        self.loading.reels = pack_reels(run.system.deployments, stages, self.system, self.packed, self.loading.arrays)
        self.loading.active = True
        y = np.append(start_state(self.packed), 0.0)
        if before:
            _carry(before.packed, before.steps.y, self.packed, y)
        for name, (place, rate) in (places or {}).items():
            x, u = self.rows(name)
            y[x], y[u] = place, rate
        later = run.times[run.times > t * (1 + 1e-14)] if before else run.times
        self.integration = Integration(
            self.system, self.packed, self.loading, y, later, deflections(self.system, self.packed),
            method=run.method, step=None, rho=0.9, events=self._events(), twin=None, **run.tolerances,
        )  # fmt: skip
        self.steps, self.counts = self.integration.steps, {}
        self.loading.enter(*self.loading.stretches[0])
        if before:
            self.steps.size[:SIZES] = before.steps.size[:SIZES]
        self.channels = Channels(self.system, self.packed, None)

    def _events(self) -> list[Event]:
        """Return the ends of the stages of reels that move by themselves."""
        found = []
        for k, (d, stage) in enumerate(zip(self.owner.system.deployments, self.stages, strict=True)):
            if stage.law is None and d.law is None:
                low, high = np.clip(stage.range(d), 0.0, d.length)
                found.append(_reaches(d.name, f"{k}.{OUT}", high, 1))
                found.append(_reaches(d.name, f"{k}.{IN}", low, -1))
        return found

    def run(self, planned: _Change, progress: Callable | None) -> tuple[str, str, _Change | None]:
        """Integrate to a planned change, or to one that comes before; returns status, message and the change."""
        if planned.t <= self.t:
            return "done", "", planned
        self.loading.clip(self.t, planned.t)
        due = int(np.sum(self.integration.watch.times <= planned.t * (1 + 1e-14)))
        recorder = Recorder(self.integration, due + 1)
        outcome = self.integration.run(recorder.add, progress)
        self.t, self.counts = outcome.t, outcome.stats
        count = min(recorder.count, int(np.sum(self.integration.watch.times <= self.t * (1 + 1e-14))))
        self.owner.histories.add(recorder.channels.places, recorder.rows[:count])
        self.owner.method = self._method()
        for name, times in outcome.events.items():
            if len(times) and times[-1] == outcome.t and outcome.t < planned.t:
                k, what = name.split(".")
                return outcome.status, outcome.message, _Change(outcome.t, int(k), what)
        return outcome.status, outcome.message, planned if planned.k >= 0 else None

    def _method(self) -> str:
        """Return the name of the method that was chosen, for the next phase."""
        return {EXPLICIT: "explicit", ROSENBROCK: "rosenbrock", ALPHA: "generalized_alpha"}[
            self.integration.choice.method
        ]

    def rows(self, name: str) -> tuple[list[int], list[int]]:
        """Return the places in y of coordinates and speeds of a joint of one hinge."""
        i = self.packed.links_of(name)[0]
        kind, row = self.packed.types[i], self.packed.tree.ints[i]
        first = self.packed.nx + row[U]
        return list(range(row[X], row[X] + COORDINATES[kind])), list(range(first, first + SPEEDS[kind]))

    def hinge(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return coordinates and speeds of a joint of one hinge."""
        x, u = self.rows(name)
        return self.steps.y[x], self.steps.y[u]

    def travel(self, d: Deployment) -> tuple[float, float]:
        """Return length and speed of a deployment."""
        i = self.packed.links_of(d.name)[0]
        if self.packed.types[i] in PRESCRIBED:
            place, rate, _ = self.loading.prescribe(self.t)[i]
            return float(place), float(rate)
        place, rate = self.hinge(d.name)
        return float(place[0]), float(rate[0])

    def number(self, hinge: str) -> int:
        """Return the number of the deployment that a hinge belongs to."""
        names = [d.name for d in self.owner.system.deployments]
        return names.index(hinge.rstrip("0123456789"))

    def relative(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return rotation (3, 3) and angular velocity (3,), in the child's axes, in a hinge of rods or of the exit."""
        i = self.packed.links_of(name)[0]
        kind = self.packed.types[i]
        if kind == SPHERICAL:
            place, rate = self.hinge(name)
            return Rotation.from_quat(place, scalar_first=True).as_matrix(), rate
        if kind == WELD:
            return self.stages[self.number(name)].turn, np.zeros(3)
        place, rate = self.loading.prescribe(self.t)[i, :2] if kind in PRESCRIBED else np.ravel(self.hinge(name))
        return Rotation.from_euler("z", place).as_matrix(), np.array([0.0, 0.0, rate])

    def turned_in(self, d: Deployment, stage: Stage) -> tuple[np.ndarray, np.ndarray, float]:
        """Return rotation and spin (in its axes) of the next rod, the innermost one gone, and the reel's speed.

        What is out slid along the innermost rod, now along the next: an impulse at the exit turns its velocity. Before
        it, the next rod moves freely.
        """
        (first, spin), (turn, rate) = (self.relative(f"{d.name}{k}") for k in (stage.rods, stage.rods - 1))
        speed, spin, place = self.travel(d)[1], turn.T @ spin + rate, first @ turn
        system = self.owner.system.without_exit(self.stages, d, place, speed * turn[0], spin)
        packed = pack(system)
        loading = Loading(system, packed, self.loading.t_end)
        loading.active = True
        y = np.append(start_state(packed), 0.0)
        _carry(self.packed, self.steps.y, packed, y)
        for name in self.owner.system.bodies:  # with the mass that is stowed
            packed.tree.fixed[packed.link_of(name), MASS:] = self.packed.tree.fixed[self.packed.link_of(name), MASS:]
        root = int(packed.tree.ints[packed.link_of(f"{d.name}{stage.rods - 1}"), U])
        wanted = {0: speed, 1: 0.0, 2: 0.0} if d.spatial else {0: speed, 1: 0.0, 2: 0.0, 3: 0.0, 4: 0.0}
        if self.packed.types[self.packed.links_of(d.name)[0]] == PRISMATIC:
            wanted.pop(0)
        rows = root + np.array(list(wanted))
        push(build_model(system, packed, loading), packed, self.t, y, rows, np.array(list(wanted.values())))
        _carry(packed, y, self.packed, self.steps.y)
        free = y[packed.nx + root : packed.nx + root + 6]
        return place, free[3:], float(free[0])

    def stop(self, name: str, wanted: np.ndarray) -> None:
        """Give a joint other speeds by an impulse in it."""
        rows = np.array(self.rows(name)[1]) - self.packed.nx
        push(self.integration.model, self.packed, self.t, self.steps.y, rows, wanted)

    def take_speeds(self, other: Phase) -> None:
        """Take the speeds of the same joints in another phase."""
        _carry(other.packed, other.steps.y, self.packed, self.steps.y)

    def energy(self) -> float:
        """Return the energy of the system and its springs, J."""
        row = np.zeros((1, self.channels.width))
        record(self.integration.model, self.channels.columns, np.array([self.t]), self.steps.y[None], 0.0, row)
        return float(row[0, :WORK].sum())


def push(m: Model, packed: Packed, t: float, y: np.ndarray, rows: np.ndarray, wanted: np.ndarray) -> None:
    """Give speeds other values by impulses in them; all others follow: ``u+ = u- + M^-1 G' p``.

    The inertia of these speeds does not matter; a unit more makes a thin rod's spin about itself determinate.
    """
    nx, more = packed.nx, np.zeros(packed.nu)
    more[rows] = 1.0
    load(m, t, y)
    kernel.inward(m.tree, m.flex, m.W, m.F, m.tau, more, 0.0, 0.0)
    response = np.zeros((len(rows), packed.nu))
    for row, out in zip(rows, response, strict=True):
        kernel.clear_wrenches(m.tree, m.flex, m.W, m.F)
        unit = np.zeros(packed.nu)
        unit[row] = 1.0
        kernel.inward_bias(m.tree, m.flex, m.W, m.F, unit)
        kernel.forward_bias(m.tree, m.flex, m.W, m.F, unit, out)
    impulse = np.linalg.solve(response[:, rows].T, wanted - y[nx + rows])
    y[nx : nx + packed.nu] += impulse @ response


def _reaches(joint: str, name: str, length: float, direction: int) -> Event:
    return Event(
        name=name, when=lambda t, state: state.joint(joint).position[0] - length, direction=direction, terminal=True
    )


def _carry(old: Packed, before: np.ndarray, new: Packed, y: np.ndarray) -> None:
    """Copy coordinates and speeds of the joints that are the same, and the work."""
    known = {(link.joint.name, link.hinge): i for i, link in enumerate(old.links)}
    for row, kind, link in zip(new.tree.ints, new.types, new.links, strict=True):
        i = known.get((link.joint.name, link.hinge), -1)
        if i >= 0 and old.types[i] == kind:
            a = old.tree.ints[i]
            y[row[X] : row[XQ] + row[MODES]] = before[a[X] : a[XQ] + a[MODES]]
            u, v = new.nx + row[U], old.nx + a[U]
            count = row[UQ] + row[MODES] - row[U]
            y[u : u + count] = before[v : v + count]
    y[-1] = before[-1]


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
    within = min(ALIGNED * d.rod / abs(speed), float(phase.owner.times[-1]))
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


def _samples(d: Deployment, t_end: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and lengths of a law.

    Raises
    ------
    InputError
        When it leaves what there is.
    """
    t, begin = np.linspace(0.0, t_end, SAMPLES + 1), 0.0
    length = np.zeros_like(t)
    for piece in d.law.pieces:
        here = t >= begin
        length[here], begin = piece.evaluate(t[here])[0], piece.until
    length[t >= d.jam] = d.law(min(d.jam, t_end))[0]
    wrong = ~((length >= -EXACT * d.rod) & (length <= d.length + EXACT * d.rod))
    if np.any(wrong):
        first = np.flatnonzero(wrong)[0]
        raise InputError(
            f"deployment {d.name!r}: the law asks for {length[first]:g} m at t = {t[first]:g} s; there are "
            f"{d.length:g} m, from none to all of it may be out"
        )
    return t, length


def _leaving(d: Deployment, k: int, bounds: tuple[float, float], t: float, samples: tuple) -> _Change:
    """Return when the law first leaves a range of lengths."""
    times, length = samples
    slack = EXACT * d.rod
    after = np.flatnonzero((times > t) & ((length > bounds[1] + slack) | (length < bounds[0] - slack)))
    if not len(after):
        return _Change(FOREVER, k, "")
    i = after[0]
    what, bound = (OUT, bounds[1]) if length[i] > bounds[1] else (IN, bounds[0])
    a, b = max(t, times[i - 1]), times[i]
    sides = [d.law(s)[0] - bound for s in (a, b)]
    if sides[0] * sides[1] >= 0:
        return _Change(a, k, what)
    return _Change(float(brentq(lambda s: d.law(s)[0] - bound, a, b, xtol=1e-15 * times[-1])), k, what)


class _Histories:
    """Channels of a run whose rods change."""

    def __init__(self, system: DeployingSystem, times: np.ndarray) -> None:
        self.system, self.times, self.count = system, times, 0
        self.channels: dict[str, np.ndarray] = {}
        self.gained: list[tuple[float, float]] = []
        self.hidden = tuple(f"{d.leads}." for d in system.deployments)
        self.names = {f"{d.name}.displacement": f"{d.name}.length" for d in system.deployments}
        self.names |= {f"{d.name}.drive": f"{d.name}.tension" for d in system.deployments}

    def add(self, places: dict, rows: np.ndarray) -> None:
        """Add the rows of a phase."""
        place = slice(self.count, self.count + len(rows))
        for name, columns in places.items():
            if name.startswith(self.hidden):
                continue
            name = self.names.get(name, name)
            shape = (len(self.times),) + ((columns.stop - columns.start,) if isinstance(columns, slice) else ())
            if name not in self.channels:
                self.channels[name] = np.full(shape, np.nan)
            if len(rows):
                self.channels[name][place] = rows[:, columns]
        self.count = place.stop

    def result(self, status: str, message: str, stats: dict, events: dict) -> Result:
        """Return the result, with what the deployments add."""
        time = self.times[: self.count]
        channels = {name: values[: self.count] for name, values in self.channels.items()}
        for d in self.system.deployments:
            channels[f"{d.name}.tension"] = -channels[f"{d.name}.tension"]
            channels[f"{d.name}.rods"] = np.ceil(np.maximum(channels[f"{d.name}.length"] / d.rod - EXACT, 0.0))
        gained = np.array(self.gained).reshape(-1, 2)
        channels["energy.events"] = np.append(0.0, np.cumsum(gained[:, 1]))[
            np.searchsorted(gained[:, 0], time, side="left")
        ]
        if not len(time):
            return Result(time=time, channels=channels, status=status, message=message)
        return audited(time, channels, status, message, stats).with_(events=events)
