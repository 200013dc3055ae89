"""One phase of a deployment: the system between two changes of its rods, and impulses between phases."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
import scipy

from modalprep.multibody.deploying.histories import Histories
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.evaluation.energy import energy
from modalprep.multibody.evaluation.evaluate import Equations, build_equations, load
from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.integration.run import Integration
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.kernels.data import Data
from modalprep.multibody.model.deployment import IN, OUT, Change, Deployment, Stage
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.joint_types import PRESCRIBED, SLIDING, SPHERICAL, WELD
from modalprep.multibody.packing.deployment import pack_reels
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.preparation import deflections
from modalprep.multibody.results.record import Recorder


class RunSettings(NamedTuple):
    """Settings shared by all phases of a run."""

    system: DeployingSystem
    times: np.ndarray  # (nt,) s, output times
    histories: Histories
    tolerances: dict
    method: str
    shortest_event: float | None


class Phase:
    """The system between two changes of its stages."""

    def __init__(
        self,
        run: RunSettings,
        stages: list[Stage],
        t: float,
        start: dict,
        before: Phase | None = None,
        hinges: dict | None = None,
    ) -> None:
        self.settings, self.method, self.stages, self.t = run, run.method, stages, t
        self.system = run.system.in_stages(stages, start)
        self.packed = pack(self.system)
        self.loading = Loading(self.system, self.packed, float(run.times[-1]), run.shortest_event)
        self.loading.clip(t, float(run.times[-1]))
        self.loading.reels = pack_reels(run.system.deployments, stages, self.system, self.packed)
        self.loading.active = True
        y = np.append(start_state(self.packed), 0.0)
        if before:
            _carry(before.packed, before.steps.y, self.packed, y)
        for name, (position, rate) in (hinges or {}).items():
            x, u = self.rows(name)
            y[x], y[u] = position, rate
        later = run.times[run.times > t * (1 + 1e-14)] if before else run.times
        self.integration = Integration(
            self.system,
            self.packed,
            self.loading,
            y,
            later,
            deflections(self.system, self.packed),
            method=run.method,
            events=self._events(),
            **run.tolerances,
        )
        self.steps = self.integration.steps
        self.counts = {}
        self.loading.enter(*self.loading.stretches[0])
        if before:
            self.steps.size[0] = before.steps.size[0]

    def _events(self) -> list[Event]:
        """Return the events that end the stages of free reels."""
        found = []
        for k, (d, stage) in enumerate(zip(self.settings.system.deployments, self.stages, strict=True)):
            if stage.length is None and d.deployed_length is None:
                low, high = np.clip(stage.range(d), 0.0, d.length)
                found.append(_length_event(d.name, f"{k}.{OUT}", high, 1))
                found.append(_length_event(d.name, f"{k}.{IN}", low, -1))
        return found

    def run(self, planned: Change, progress: Callable | None) -> tuple[str, str, Change | None]:
        """Integrate to a planned change or to an earlier event; returns status, message and the change."""
        if planned.t <= self.t:
            return "done", "", planned
        self.loading.clip(self.t, planned.t)
        due = int(np.sum(self.integration.watch.times <= planned.t * (1 + 1e-14)))
        recorder = Recorder(self.integration, due + 1)
        outcome = self.integration.run(recorder.add, progress)
        self.t, self.counts = outcome.t, outcome.stats
        count = min(recorder.count, int(np.sum(self.integration.watch.times <= self.t * (1 + 1e-14))))
        self.settings.histories.add(recorder.index, recorder.rows[:count])
        self.method = str(outcome.stats["method"])  # for the next phase
        for name, times in outcome.events.items():
            if len(times) and times[-1] == outcome.t and outcome.t < planned.t:
                k, kind = name.split(".")
                return outcome.status, outcome.message, Change(outcome.t, int(k), kind)
        return outcome.status, outcome.message, planned if planned.k >= 0 else None

    def rows(self, name: str) -> tuple[list[int], list[int]]:
        """Return the indices in y of coordinates and speeds of a joint."""
        return self.packed.coordinates_of(name), [self.packed.nx + u for u in self.packed.speeds_of(name)]

    def hinge(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return coordinates and speeds of a joint of one hinge."""
        x, u = self.rows(name)
        return self.steps.y[x], self.steps.y[u]

    def length_and_speed(self, d: Deployment) -> tuple[float, float]:
        """Return length and speed of a deployment."""
        i = self.packed.links_of(d.name)[0]
        if self.packed.types[i] == PRESCRIBED:
            position, rate, _ = self.loading.prescribe(self.t)[i]
            return float(position), float(rate)
        position, rate = self.hinge(d.name)
        return float(position[0]), float(rate[0])

    def number(self, hinge: str) -> int:
        """Return the number of the deployment that a hinge belongs to."""
        names = [d.name for d in self.settings.system.deployments]
        return names.index(hinge.rstrip("0123456789"))

    def relative(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return rotation (3, 3) and angular velocity (3,), in the child's axes, in a hinge of rods or of the exit."""
        i = self.packed.links_of(name)[0]
        kind = self.packed.types[i]
        if kind == SPHERICAL:
            position, rate = self.hinge(name)
            return scipy.spatial.transform.Rotation.from_quat(position, scalar_first=True).as_matrix(), rate
        if kind == WELD:
            return self.stages[self.number(name)].rotation, np.zeros(3)
        angle, rate = self.loading.prescribe(self.t)[i, :2] if kind == PRESCRIBED else np.ravel(self.hinge(name))
        return scipy.spatial.transform.Rotation.from_euler("z", angle).as_matrix(), np.array([0.0, 0.0, rate])

    def release_innermost(self, d: Deployment, stage: Stage) -> tuple[np.ndarray, np.ndarray, float]:
        """Return rotation, angular velocity (own axes) and sliding speed of the next rod, the innermost one removed.

        The deployed part slid along the innermost rod and slides along the next one from now on: an impulse at the exit
        changes the direction of its velocity. Before the impulse the next rod moves freely.
        """
        (first, spin), (turn, rate) = (self.relative(f"{d.name}{k}") for k in (stage.rods, stage.rods - 1))
        speed = self.length_and_speed(d)[1]
        spin = turn.T @ spin + rate
        rotation = first @ turn
        system = self.settings.system.without_exit(self.stages, d, rotation, speed * turn[0], spin)
        packed = pack(system)
        _take_masses(self.packed, self.integration.equations.data, packed, self.settings.system.bodies)
        loading = Loading(system, packed, self.loading.t_end)
        loading.active = True
        y = np.append(start_state(packed), 0.0)
        _carry(self.packed, self.steps.y, packed, y)
        root = int(packed.model.links["u"][packed.link_of(f"{d.name}{stage.rods - 1}")])
        target = {0: speed, 1: 0.0, 2: 0.0} if d.spatial else {0: speed, 1: 0.0, 2: 0.0, 3: 0.0, 4: 0.0}
        if self.packed.types[self.packed.links_of(d.name)[0]] == SLIDING:
            target.pop(0)
        rows = root + np.array(list(target))
        apply_impulse(build_equations(packed, loading), packed, self.t, y, rows, np.array(list(target.values())))
        _carry(packed, y, self.packed, self.steps.y)
        free = y[packed.nx + root : packed.nx + root + 6]
        return rotation, free[3:], float(free[0])

    def change_speed(self, name: str, target: np.ndarray) -> None:
        """Change the speeds of a joint to target values by an impulse in it."""
        rows = np.array(self.rows(name)[1]) - self.packed.nx
        apply_impulse(self.integration.equations, self.packed, self.t, self.steps.y, rows, target)

    def copy_speeds(self, other: Phase) -> None:
        """Copy the speeds of the same joints from another phase."""
        _carry(other.packed, other.steps.y, self.packed, self.steps.y)

    def energy(self) -> float:
        """Return the energy of the system and its springs, J."""
        return energy(self.integration.equations, self.t, self.steps.y)


def apply_impulse(m: Equations, packed: Packed, t: float, y: np.ndarray, rows: np.ndarray, target: np.ndarray) -> None:
    """Change some speeds to target values by impulses in them; the others follow: ``u+ = u- + M^-1 G' p``.

    The inertia of these speeds does not affect the result; a unit inertia is added to them, so that the rotation of a
    thin rod about its own axis is determinate.
    """
    nx = packed.nx
    more = np.zeros(packed.nu)
    more[rows] = 1.0
    load(m, t, y)
    kernel.inward(m.model, m.data, m.tau, more, 0.0, 0.0)
    response = np.zeros((len(rows), packed.nu))
    for row, out in zip(rows, response, strict=True):
        kernel.clear_wrenches(m.model, m.data)
        unit = np.zeros(packed.nu)
        unit[row] = 1.0
        kernel.inward_bias(m.model, m.data, unit)
        kernel.forward_bias(m.model, m.data, unit, out)
    impulse = np.linalg.solve(response[:, rows].T, target - y[nx + rows])
    y[nx : nx + packed.nu] += impulse @ response


def _length_event(joint: str, name: str, length: float, direction: int) -> Event:
    return Event(
        name=name, when=lambda t, state: state.joint(joint).position[0] - length, direction=direction, terminal=True
    )


def _carry(old: Packed, before: np.ndarray, new: Packed, y: np.ndarray) -> None:
    """Copy coordinates and speeds of the joints common to both, and the work."""
    known = {(link.joint.name, link.hinge): i for i, link in enumerate(old.links)}
    for row, kind, link in zip(new.model.links, new.types, new.links, strict=True):
        i = known.get((link.joint.name, link.hinge), -1)
        if i >= 0 and old.types[i] == kind:
            a = old.model.links[i]
            y[row["x"] : row["xq"] + row["modes"]] = before[a["x"] : a["xq"] + a["modes"]]
            u, v = new.nx + row["u"], old.nx + a["u"]
            count = row["uq"] + row["modes"] - row["u"]
            y[u : u + count] = before[v : v + count]
    y[-1] = before[-1]


def _take_masses(old: Packed, data: Data, new: Packed, bodies: Iterable[str]) -> None:
    """Let bodies of a new model have the masses that they have now, with what is stowed on them."""
    for body in bodies:
        now = data.links[old.link_of(body)]
        link = new.model.links[new.link_of(body)]
        for name in ("mass", "first_moment", "inertia"):
            link[name] = now[name]
