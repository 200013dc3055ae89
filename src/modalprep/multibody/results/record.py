"""Named time histories of a run."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.evaluation.stresses import stress_channels
from modalprep.multibody.integration.run import Integration
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.free_parts import parts_of
from modalprep.multibody.results.channels import ENERGIES, MOMENTA, Channels, Columns, Index
from modalprep.multibody.results.momenta import Momenta, with_momenta
from modalprep.multibody.results.observation import record
from modalprep.multibody.results.recovered import recovery_channels
from modalprep.multibody.results.result import Result


class Recorder:
    """Collects the channels of a `Result`; `most` output times are expected.

    Raises
    ------
    InputError
        When there is not enough memory for them.
    """

    def __init__(self, integration: Integration, most: int) -> None:
        system = integration.system
        packed = integration.packed
        loops = integration.loading.loops
        self.system, self.equations, self.count = system, integration.equations, 0
        self.parts = parts_of(system, packed)
        self.index, columns, width = packed.kept("channels", lambda: layout(Channels(system, packed, loops)))
        self.columns = columns._replace(reactions=np.zeros_like(columns.reactions), sums=np.zeros_like(columns.sums))
        self.steps = integration.steps
        self.soft = packed.softest if loops else 0.0
        try:
            self.time = np.empty(most)
            self.rows = np.empty((most, width))
        except MemoryError:
            raise InputError(
                f"simulation: {most} output times of {width} numbers each do not fit into memory; raise "
                "output_step or lower t_end"
            ) from None

    def add(self, times: np.ndarray, states: np.ndarray) -> None:
        """Record every channel at times (nt,) of states (nt, nx + nu + 1), the work their last number."""
        here = slice(self.count, self.count + len(times))
        if here.stop > len(self.time):
            self.time, self.rows = (np.concatenate([a, np.empty_like(a)]) for a in (self.time, self.rows))
        self.time[here] = times
        record(self.equations, self.steps, self.columns, times, states, self.soft, self.rows[here])
        self.count = here.stop

    def result(self, status: str, message: str, stats: dict[str, str | int | float]) -> Result:
        """Close the energy balance and return the result; its channels are views of the recorded rows."""
        time, rows = self.time[: self.count], self.rows[: self.count]
        rows.flags.writeable = False  # of the channels too, at once
        found = audited(time, histories(self.system, self.index, rows, time), status, message, stats)
        return with_momenta(found, self._momenta(rows), self.system.gravity)

    def _momenta(self, rows: np.ndarray) -> list[Momenta]:
        """Return what is known of the parts whose momenta stay."""
        bodies = self.system.bodies
        found = []
        parts = [part for part in self.parts if not part.loaded]
        for part, kept, c in zip(parts, self.steps.kept, self.columns.momenta[:, 1], strict=True):
            restored = np.append(kept.given_linear, kept.given_angular)
            found.append(Momenta(sum(bodies[name].m for name in part.bodies), rows[:, c : c + MOMENTA], restored))
        return found


def layout(channels: Channels) -> tuple[Index, Columns, int]:
    """Return what does not hold the system, which lives as long as it is used."""
    return channels.index, channels.columns, channels.width


def histories(system: System, index: Index, rows: np.ndarray, time: np.ndarray) -> dict[str, np.ndarray]:
    """Return the channels by name, views of rows (nt, width), with those that follow from them; but ``energy.error``.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.system import System
    >>> from modalprep.multibody.packing.tree import pack
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> histories(arm, Channels(arm, pack(arm), None).index, np.zeros((5, 60)), np.arange(5.0))["arm.origin"].shape
    (5, 3)
    """
    found = {name: rows[:, columns] for name, columns in index.items()}
    found |= _axes(system, found) | stress_channels(system.bodies, found)
    return found | recovery_channels(system, time, found)


def _axes(system: System, channels: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the semi-major axes of the orbits of the bodies' roots, where the orbit's radius is known."""
    if system.orbit is None or system.orbit.radius == np.inf:
        return {}
    root = {name: f"{name}.{body.interface_name[0]}" for name, body in system.bodies.items()}
    found = {}
    for name, at in root.items():
        positions, velocities = channels[f"{at}.position"], channels[f"{at}.velocity"]
        found[f"{name}.semi_major_axis"] = system.orbit.semi_major_axis(positions, velocities)
    return found


def audited(
    time: np.ndarray, channels: dict[str, np.ndarray], status: str, message: str, stats: dict[str, str | int | float]
) -> Result:
    """Return the result with its energy balance: ``energy.error``, and the largest relative error in the stats."""
    parts = np.array([channels[name] for name in (*ENERGIES, "energy.work", "energy.kinetic", "energy.strain")])
    stored = parts[: len(ENERGIES)]
    work = parts[len(ENERGIES)]
    total = stored.sum(axis=0)
    error = total - total[0] - (work - work[0])
    stored -= stored[:, :1].copy()
    scale = np.abs(parts).max()
    relative = float(np.abs(error).max() / max(scale, np.finfo(float).tiny))
    return Result(
        time=time,
        channels=channels | {"energy.error": error},
        status=status,
        message=message,
        stats={**stats, "energy_error": relative},
    )
