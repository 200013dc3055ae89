"""Channels of a run with a changing number of rods."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.model.deployment import EXACT
from modalprep.multibody.results.record import audited
from modalprep.multibody.results.result import Result


class Histories:
    """Collects the channels of all phases of a run; those of stowed rods are NaN."""

    def __init__(self, system: DeployingSystem, times: np.ndarray) -> None:
        self.system, self.times, self.count = system, times, 0
        self.channels: dict[str, np.ndarray] = {}
        self.event_energy: list[tuple[float, float]] = []
        self.hidden = tuple(f"{d.exit_body}." for d in system.deployments)
        self.names = {f"{d.name}.displacement": f"{d.name}.length" for d in system.deployments}
        self.names |= {f"{d.name}.drive": f"{d.name}.tension" for d in system.deployments}

    def add(self, columns: Mapping[str, int | slice], rows: np.ndarray) -> None:
        """Add the rows of a phase."""
        here = slice(self.count, self.count + len(rows))
        for name, own in columns.items():
            if name.startswith(self.hidden):
                continue
            name = self.names.get(name, name)
            shape = (len(self.times),) + ((own.stop - own.start,) if isinstance(own, slice) else ())
            if name not in self.channels:
                self.channels[name] = np.full(shape, np.nan)
            if len(rows):
                self.channels[name][here] = rows[:, own]
        self.count = here.stop

    def result(self, status: str, message: str, stats: dict, events: dict) -> Result:
        """Return the result with the additional channels of the deployments."""
        time = self.times[: self.count]
        channels = {name: values[: self.count] for name, values in self.channels.items()}
        for d in self.system.deployments:
            channels[f"{d.name}.tension"] = -channels[f"{d.name}.tension"]
            channels[f"{d.name}.rods"] = np.ceil(np.maximum(channels[f"{d.name}.length"] / d.rod_length - EXACT, 0.0))
        changes = np.array(self.event_energy).reshape(-1, 2)
        channels["energy.events"] = np.append(0.0, np.cumsum(changes[:, 1]))[
            np.searchsorted(changes[:, 0], time, side="left")
        ]
        if not len(time):
            return Result(time=time, channels=channels, status=status, message=message)
        return audited(time, channels, status, message, stats).with_(events=events)
