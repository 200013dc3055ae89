"""Channels of a run whose rods change."""

from __future__ import annotations

import numpy as np

from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.model.deployment import EXACT
from modalprep.multibody.results.record import audited
from modalprep.multibody.results.result import Result


class Histories:
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
