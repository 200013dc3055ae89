"""Named time histories of a run."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.multibody import kernel
from modalprep.multibody.dense import BodyState, body_states, energy_and_momentum, node_motion
from modalprep.multibody.layout import PRESCRIBED, PRESCRIBED_REVOLUTE, PRISMATIC, REVOLUTE, SPHERICAL, U, X
from modalprep.multibody.reactions import interface_accelerations, joint_wrenches
from modalprep.multibody.result import Result
from modalprep.multibody.system import System

ENERGIES = ("kinetic", "strain", "gravity", "stored")


class Recorder:
    """Collects the channels of a `Result` at the output times."""

    def __init__(self, system: System, run) -> None:
        self.system, self.run = system, run
        self.rows: dict[str, list] = defaultdict(list)

    def add(self, t: float, y: np.ndarray) -> None:
        """Record every channel at time t from the state with the work appended."""
        y = y.copy()  # the step loop writes its next samples there
        rates = self.run.derivative(t, y)  # leaves forces and energies
        motion = self.run.loading.motion
        states = body_states(self.system, self.run.packed, y[:-1], motion)
        self._joints(y, motion)
        self._forces(dict(zip(self.system.order, states, strict=True)))
        for name, value in self.run.loading.loops.channels().items() if self.run.loading.loops else ():
            self.rows[name].append(value)
        for name, state in zip(self.system.order, states, strict=True):
            self._body(name, state)
        balance = energy_and_momentum(self.system.gravity, states)
        balance["gravity"] += self.run.energies.gravity
        balance["stored"] = self.run.energies.stored
        for kind in ENERGIES:
            self.rows[f"energy.{kind}"].append(balance[kind])
        self.rows["energy.work"].append(y[-1])
        self.rows["power.in"].append(rates[-1])
        self.rows["momentum.linear"].append(balance["linear"])
        self.rows["momentum.angular"].append(balance["angular"])

    def _joints(self, y: np.ndarray, motion: np.ndarray) -> None:
        found: dict[str, list[float]] = defaultdict(list)
        drives = dict(zip(self.run.prescribed.tolist(), self.run.drive.tolist(), strict=True))
        for i, link in enumerate(self.run.packed.links):
            row, kind, name = self.run.packed.tree.ints[i], self.run.packed.types[i], link.joint.name
            x, u = row[X], self.run.nx + row[U]
            turns = kind in (REVOLUTE, PRESCRIBED_REVOLUTE)
            place, speed = ("angle", "rate") if turns else ("displacement", "speed")
            if kind in (REVOLUTE, PRISMATIC):
                found[f"{name}.{place}"].append(y[x])
                found[f"{name}.{speed}"].append(y[u])
                if link.joint.elements:
                    found[f"{name}.drive"].append(self.run.loading.tau[row[U]])
            elif kind in PRESCRIBED:
                found[f"{name}.{place}"].append(motion[i, 0])
                found[f"{name}.{speed}"].append(motion[i, 1])
                found[f"{name}.drive"].append(drives[i])
            elif kind == SPHERICAL:
                found[f"{name}.quaternion"] = [*y[x : x + 4]]
                found[f"{name}.spin"] = [*y[u : u + 3]]
        for channel, values in found.items():
            self.rows[channel].append(values[0] if len(values) == 1 else np.array(values))

    def _forces(self, states: dict[str, BodyState]) -> None:
        run = self.run
        kernel.world(run.packed.tree, run.W)
        channels = joint_wrenches(self.system, run.packed, run.reactions, states)
        for name, value in (channels | interface_accelerations(self.system, run.packed, run.W, run.F)).items():
            self.rows[name].append(value)

    def _body(self, name: str, s: BodyState) -> None:
        self.rows[f"{name}.modal"].append(s.q)
        self.rows[f"{name}.origin"].append(s.p)
        self.rows[f"{name}.orientation"].append(Rotation.from_matrix(s.R).as_quat(scalar_first=True))
        for k, interface in enumerate(s.body.interface_name):
            r, _, _, vel, _ = node_motion(s.body, k, s.V[3:], s.q, s.qd)
            channel = f"{name}.{interface}"
            self.rows[f"{channel}.position"].append(s.p + s.R @ r)
            self.rows[f"{channel}.velocity"].append(s.R @ (s.V[:3] + np.cross(s.V[3:], r) + vel[:3]))
            self.rows[f"{channel}.deflection"].append(r - s.body.interface_position[k])

    def result(self, time: np.ndarray, status: str, message: str, stats: dict[str, float]) -> Result:
        """Close the energy balance and return the result."""
        channels = {name: np.array(rows) for name, rows in self.rows.items() if np.size(rows[0])}
        parts = [channels[f"energy.{kind}"] for kind in ENERGIES]
        total = np.sum(parts, axis=0)
        error = total - total[0] - channels["energy.work"]
        channels["energy.error"] = error
        scale = np.abs([p - p[0] for p in parts] + [channels["energy.work"], channels["energy.kinetic"]]).max()
        return Result(
            time=time,
            channels=channels,
            status=status,
            message=message,
            stats={**stats, "energy_error": float(np.abs(error).max() / max(scale, np.finfo(float).tiny))},
        )
