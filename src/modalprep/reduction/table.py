"""The mode-selection table: one row per candidate vector, with the reason it was kept or dropped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.records import Record

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
FIXED, CONSTRAINT, TRUNCATION = "fixed-interface", "constraint", "truncation"
FREE, ATTACHMENT, PROJECTED = "free-interface", "attachment", "projected"


@dataclass(frozen=True, eq=False, kw_only=True)
class ModeTable(Record):
    """Candidates of a reduction and what became of them.

    Attributes
    ----------
    kind : tuple of str, length n
        ``fixed-interface`` or ``free-interface`` mode, ``constraint`` or residual ``attachment`` mode of an interface
        DOF, or modal ``truncation`` vector.
    frequency : (n,) float
        Hz; NaN for constraint modes, which have none.
    effective_mass : (n, 6) float
        Modal effective mass in x, y, z (kg) and about x, y, z (kg m^2) through the root interface;
        NaN where the kind has none. Theory 3.
    total : (6,) float
        Rigid-body mass (kg) and moments of inertia (kg m^2) of the whole body about the root interface.
    kept : (n,) bool
    reason : tuple of str, length n
        Why the row was kept or dropped.

    Examples
    --------
    >>> table = ModeTable(kind=("fixed-interface",), frequency=np.array([2.5]),
    ...                   effective_mass=np.array([[0, 0.6, 0, 0, 0, 0.9]]), total=np.ones(6),
    ...                   kept=np.array([True]), reason=("asked for",))
    >>> float(table.fraction[0].max())
    0.9
    """

    kind: tuple[str, ...]
    frequency: np.ndarray
    effective_mass: np.ndarray
    total: np.ndarray
    kept: np.ndarray
    reason: tuple[str, ...]

    @property
    def fraction(self) -> np.ndarray:
        """(n, 6) effective mass over the body's total, 0 where the total is 0."""
        total = np.where(self.total > 0, self.total, np.inf)
        return self.effective_mass / total
