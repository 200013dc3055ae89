"""Named time histories of a run."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from modalprep.multibody.dense import BodyState, body_states, energy_and_momentum, node_motion
from modalprep.multibody.layout import PRESCRIBED, REVOLUTE
from modalprep.multibody.result import Result
from modalprep.multibody.system import System


class Recorder:
    """Collects the channels of a `Result` at the output times."""

    def __init__(self, system: System, run) -> None:
        self.system, self.run = system, run
        self.rows: dict[str, list] = defaultdict(list)

    def add(self, t: float, y: np.ndarray) -> None:
        """Record every channel at time t from the state with the work appended."""
        motion = self.run.motion(t)
        states = body_states(self.system, self.run.tree, y[:-1], motion)
        self._joints(t, y, motion)
        for name, state in zip(self.system.order, states, strict=True):
            self._body(name, state)
        balance = energy_and_momentum(self.system.gravity, states)
        for kind in ("kinetic", "strain", "gravity"):
            self.rows[f"energy.{kind}"].append(balance[kind])
        self.rows["energy.work"].append(y[-1])
        self.rows["momentum.linear"].append(balance["linear"])
        self.rows["momentum.angular"].append(balance["angular"])

    def _joints(self, t: float, y: np.ndarray, motion: np.ndarray) -> None:
        if np.any(self.run.tree.joint == PRESCRIBED):
            self.run.derivative(t, y)  # leaves the torques
        for i, joint in enumerate(self.run.joints):
            kind, x, u = self.run.tree.joint[i], self.run.tree.x[i], self.run.nx + self.run.tree.u[i]
            if kind == REVOLUTE:
                self.rows[f"{joint.name}.angle"].append(y[x])
                self.rows[f"{joint.name}.rate"].append(y[u])
            elif kind == PRESCRIBED:
                self.rows[f"{joint.name}.angle"].append(motion[i, 0])
                self.rows[f"{joint.name}.rate"].append(motion[i, 1])
                self.rows[f"{joint.name}.torque"].append(self.run.torque[i])

    def _body(self, name: str, s: BodyState) -> None:
        self.rows[f"{name}.modal"].append(s.q)
        for k, interface in enumerate(s.body.interface_name):
            r, _, _, vel, _ = node_motion(s.body, k, s.V[3:], s.q, s.qd)
            channel = f"{name}.{interface}"
            self.rows[f"{channel}.position"].append(s.p + s.R @ r)
            self.rows[f"{channel}.velocity"].append(s.R @ (s.V[:3] + np.cross(s.V[3:], r) + vel[:3]))
            self.rows[f"{channel}.deflection"].append(r - s.body.interface_position[k])

    def result(self, time: np.ndarray, status: str, message: str, stats: dict[str, float]) -> Result:
        """Close the energy balance and return the result."""
        channels = {name: np.array(rows) for name, rows in self.rows.items() if np.size(rows[0])}
        parts = [channels[f"energy.{kind}"] for kind in ("kinetic", "strain", "gravity")]
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
