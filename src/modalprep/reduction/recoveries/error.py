"""Error of recovered quantities of a reduced body against the full model under harmonic loads (theory 3.6)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from modalprep.fe.assembly.model import FEModel
from modalprep.fe.recovery.fields import Fields, Quantity
from modalprep.fe.recovery.recover import ModelRecovery
from modalprep.reduction.basis import Reduction, unit_loads
from modalprep.reduction.dropped import DroppedModes, dropped_modes
from modalprep.reduction.participation import model_size
from modalprep.reduction.recoveries.unit_loads import ACCELERATION, NEGLIGIBLE, unit_columns

DRIVES = 12


@dataclass(frozen=True, eq=False)
class RecoveryReference:
    """Recovered quantities of the full model with its root clamped, at some frequencies.

    Attributes
    ----------
    recovery : ModelRecovery
    loads : (12 + 6 n_if, m)
        Accelerations of the root and loads on the other interfaces, each of about 1 N, per column of
        `Reduction.loads`; none without recoveries.
    force : (n_dof, m)
    omega : list of float, length k
        1/s.
    values : list of {name: (p, c, m)}, length k
    """

    recovery: ModelRecovery
    loads: np.ndarray
    force: np.ndarray
    omega: list[float]
    values: list[dict[str, np.ndarray]]

    @classmethod
    def of(cls, model: FEModel, recovery: ModelRecovery | None) -> RecoveryReference:
        """Return a reference without frequencies."""
        if recovery is None or not recovery.quantities:
            return cls(ModelRecovery({}, {}), np.zeros((0, 0)), np.zeros((0, 0)), [], [])
        loads = unit_columns(model.rigid.m, model_size(model), len(model.interfaces))
        units = np.hstack([model.inertia_loads, unit_loads(model, [f.dofs for f in model.interfaces])])
        return cls(recovery, loads, units @ loads, [], [])

    def add(self, omega: float, solve: Callable[[np.ndarray], np.ndarray]) -> None:
        """Take the values at a frequency (1/s); ``solve(f (n_dof, m)) -> u (n_dof, m)`` is that of the full model."""
        if not self.loads.size:
            return
        u = solve(self.force)
        fields = Fields(u, -(omega**2) * u, self.loads[:DRIVES])
        self.omega.append(omega)
        self.values.append({name: quantity.values(fields) for name, quantity in self.recovery.quantities.items()})

    def errors(self, reduction: Reduction) -> np.ndarray:
        """Return the error ``(recoveries, k)`` of a reduction: largest difference over the largest value.

        Of components with the same unit, and the worst of all loads; not of those under which the recovery stays below
        `NEGLIGIBLE` of its largest value.
        """
        found = np.zeros((len(self.recovery.quantities), len(self.omega)))
        if not found.size:
            return found
        dropped = dropped_modes(reduction)
        for k, (omega, full) in enumerate(zip(self.omega, self.values, strict=True)):
            own, bare = _reduced_fields(reduction, dropped, self.loads, omega)
            for i, (name, quantity) in enumerate(self.recovery.quantities.items()):
                corrected = self.recovery.wanted[name].method == "acceleration" or quantity.kind == ACCELERATION
                found[i, k] = _difference(quantity, quantity.values(own if corrected else bare), full[name])
        return found


def _reduced_fields(
    reduction: Reduction, dropped: DroppedModes, loads: np.ndarray, omega: float
) -> tuple[Fields, Fields]:
    """Return the fields of a reduced body by mode acceleration, and those by mode displacement."""
    w2 = (2 * np.pi * reduction.frequency) ** 2
    gap = w2 - omega**2
    force = reduction.basis.T @ (reduction.loads @ loads)
    q = np.divide(force, gap[:, None], out=np.zeros_like(force), where=gap[:, None] != 0)
    qdd = -(omega**2) * q
    strained = reduction.basis @ np.where(w2[:, None] > 0, q, 0.0)
    u = strained + dropped.to_loads @ loads - dropped.to_inertia @ qdd
    return Fields(u, reduction.basis @ qdd, loads[:DRIVES]), Fields.static(strained)


def _difference(quantity: Quantity, found: np.ndarray, full: np.ndarray) -> float:
    worst = 0.0
    for unit in dict.fromkeys(quantity.units):
        own = np.array(quantity.units) == unit
        size, off = (np.abs(x[:, own]).max(axis=(0, 1), initial=0.0) for x in (full, found - full))
        real = size > NEGLIGIBLE * size.max(initial=0.0)
        worst = max(worst, float(np.max(off[real] / size[real], initial=0.0)))
    return worst
