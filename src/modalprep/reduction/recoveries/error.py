"""Error of recovered quantities of a reduced body against the full model under harmonic loads (theory 3.6)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from modalprep.fe.assembly.model import FEModel
from modalprep.fe.recovery.fields import Fields
from modalprep.fe.recovery.recover import ModelRecovery
from modalprep.reduction.basis import Reduction
from modalprep.reduction.clamped import unit_loads
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
    loss : list of float, length k
        Of ``K (1 + i loss)``, in both models.
    values : list of {name: (p, c, m)}, length k
    """

    recovery: ModelRecovery
    loads: np.ndarray
    force: np.ndarray
    omega: list[float]
    loss: list[float]
    values: list[dict[str, np.ndarray]]

    @classmethod
    def of(cls, model: FEModel, recovery: ModelRecovery | None) -> RecoveryReference:
        """Return a reference without frequencies."""
        if recovery is None or not recovery.quantities:
            return cls(ModelRecovery({}, {}), np.zeros((0, 0)), np.zeros((0, 0)), [], [], [])
        loads = unit_columns(model.rigid.m, model_size(model), len(model.interfaces))
        units = np.hstack([model.inertia_loads, unit_loads(model, [f.dofs for f in model.interfaces])])
        return cls(recovery, loads, units @ loads, [], [], [])

    def add(self, omega: float, solve: Callable[[np.ndarray], np.ndarray], loss: float = 0.0) -> None:
        """Take the values at a frequency (1/s); ``solve(f (n_dof, m)) -> u (n_dof, m)`` is that of the full model."""
        if not self.loads.size:
            return
        u = solve(self.force)
        fields = Fields(u, -(omega**2) * u, self.loads[:DRIVES])
        self.omega.append(omega)
        self.loss.append(loss)
        self.values.append({name: _values(quantity, fields) for name, quantity in self.recovery.quantities.items()})

    def errors(self, reduction: Reduction) -> np.ndarray:
        """Return the error ``(recoveries, k)`` of a reduction: largest difference over the largest value.

        Of components with the same unit, and the worst of all loads; not of those under which the recovery stays below
        `NEGLIGIBLE` of its largest value.
        """
        found = np.zeros((len(self.recovery.quantities), len(self.omega)))
        if not found.size:
            return found
        dropped = dropped_modes(reduction)
        for k, (omega, loss, full) in enumerate(zip(self.omega, self.loss, self.values, strict=True)):
            own, bare = _reduced_fields(reduction, dropped, self.loads, omega, loss)
            for i, (name, quantity) in enumerate(self.recovery.quantities.items()):
                corrected = self.recovery.wanted[name].method == "acceleration" or quantity.kind == ACCELERATION
                values = _values(quantity, own if corrected else bare)
                found[i, k] = largest_difference(quantity.units, values, full[name])
        return found


def _values(quantity: Any, fields: Fields) -> np.ndarray:
    """Return the values (p, c, m) of fields that may be complex."""
    if not np.iscomplexobj(fields[0]):
        return quantity.values(fields)
    real, imaginary = (Fields(part(fields[0]), part(fields[1]), part(fields[2])) for part in (np.real, np.imag))
    return quantity.values(real) + 1j * quantity.values(imaginary)


def _reduced_fields(
    reduction: Reduction, dropped: DroppedModes, loads: np.ndarray, omega: float, loss: float
) -> tuple[Fields, Fields]:
    """Return the fields of a reduced body by mode acceleration, and those by mode displacement."""
    w2 = (2 * np.pi * reduction.frequency) ** 2
    z = 1 + 1j * loss if loss else 1.0
    gap = w2 * z - omega**2
    force = reduction.basis.T @ (reduction.loads @ loads)
    q = np.divide(force, gap[:, None], out=np.zeros(force.shape, dtype=gap.dtype), where=gap[:, None] != 0)
    qdd = -(omega**2) * q
    strained = reduction.basis @ np.where(w2[:, None] > 0, q, 0.0)
    u = strained + (dropped.to_loads @ loads - dropped.to_inertia @ qdd) / z
    return Fields(u, reduction.basis @ qdd, loads[:DRIVES]), Fields.static(strained)


def largest_difference(units: tuple[str, ...], values: np.ndarray, full: np.ndarray) -> float:
    """Return the largest difference of values (p, c, m) over the largest with the same unit, the worst of m loads.

    Loads under which the values stay below `NEGLIGIBLE` of their largest do not count; ``units`` are c or p c.

    Examples
    --------
    >>> full = np.array([[[2.0, 1e-9], [40.0, 1.0]]])
    >>> largest_difference(("N", "N m"), full + 0.5, full)
    0.5
    """
    own = np.broadcast_to(np.reshape(units, (-1, full.shape[1])), full.shape[:2])
    worst = 0.0
    for unit in set(units):
        size, off = (np.abs(x[own == unit]).max(axis=0, initial=0.0) for x in (full, values - full))
        real = size > NEGLIGIBLE * size.max(initial=0.0)
        worst = max(worst, float(np.max(off[real] / size[real], initial=0.0)))
    return worst


def between_resonances(frequency: np.ndarray, points: int) -> np.ndarray:
    """Return frequencies halfway between neighbouring resonances, at most `points`, evenly chosen.

    Examples
    --------
    >>> between_resonances(np.array([1.0, 2.0, 2.001, 4.0]), 6)
    array([1.5   , 3.0005])
    """
    gaps = np.flatnonzero(np.diff(frequency) > 1e-2 * frequency[1:]) if len(frequency) > 1 else np.zeros(0, dtype=int)
    chosen = gaps[np.unique(np.linspace(0, len(gaps) - 1, min(points, len(gaps))).astype(int))] if len(gaps) else gaps
    return (frequency[chosen] + frequency[chosen + 1]) / 2
