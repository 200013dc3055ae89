"""The mode-selection table: one row per candidate vector, with the reason it was kept or dropped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar

import numpy as np

from modalprep.drawing import Plotted
from modalprep.extras import need
from modalprep.notebook import html_table
from modalprep.records import Record

if TYPE_CHECKING:
    import pandas

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
FIXED, CONSTRAINT, TRUNCATION = "fixed-interface", "constraint", "truncation"
OF_INTERFACE = " of interface "  # in the reason of a constraint mode
DERIVATIVES = "derivatives"  # of the softest shapes, among the loads of truncation vectors
DERIVATIVE_VECTORS = 6  # of these, the most important combinations
BODY = "body"  # of a target error: frequencies, static responses and compliance
FREE, ATTACHMENT, PROJECTED = "free-interface", "attachment", "projected"


@dataclass(frozen=True, eq=False, kw_only=True)
class ModeTable(Record, Plotted):
    """Candidate vectors of a reduction and their selection.

    Attributes
    ----------
    kind : tuple of str, length n
        ``fixed-interface`` or ``free-interface`` mode, ``constraint`` or residual ``attachment`` mode of an interface
        DOF, or modal ``truncation`` vector.
    frequency : (n,) float
        Hz, of fixed-interface modes with every fixed interface held; NaN for constraint modes, which have none.
    effective_mass : (n, 6) float
        Modal effective mass in x, y, z (kg) and about x, y, z (kg m^2) through the root interface;
        NaN where the kind has none. Theory 3.
    total : (6,) float
        Rigid-body mass (kg) and moments of inertia (kg m^2) of the whole body about the root interface.
    kept : (n,) bool
    reason : tuple of str, length n
        Reason for keeping or dropping the row.
    held_mass : (6,) float or None
        Mass (kg) and moments of inertia (kg m^2) about the root interface that stay on the held root, which no mode
        moves (`reduction.basis.held_mass`); None where it was not computed.

    Examples
    --------
    >>> table = ModeTable(kind=("fixed-interface",), frequency=np.array([2.5]),
    ...                   effective_mass=np.array([[0, 0.6, 0, 0, 0, 0.9]]), total=np.ones(6),
    ...                   kept=np.array([True]), reason=("asked for",))
    >>> float(table.fraction[0].max())
    0.9
    >>> table.with_rows("constraint", ["unit displacement x of interface tip"]).kept
    array([ True,  True])
    """

    kind: tuple[str, ...]
    frequency: np.ndarray
    effective_mass: np.ndarray
    total: np.ndarray
    kept: np.ndarray
    reason: tuple[str, ...]
    held_mass: np.ndarray | None = None

    def __repr__(self) -> str:
        """Kept and all candidates, and the range of the kept frequencies."""
        known = self.frequency[self.kept & np.isfinite(self.frequency)]
        band = f", {known.min():.4g}..{known.max():.4g} Hz" if len(known) else ""
        return f"ModeTable({np.count_nonzero(self.kept)} of {len(self.kind)} candidates kept{band})"

    def _repr_html_(self) -> str:
        """Return the rows, effective masses in percent of the body's, as an HTML table."""
        share = [[f"{value:.2f}" if np.isfinite(value) else "" for value in row] for row in 100 * self.fraction]
        hertz = [f"{value:.5g}" if np.isfinite(value) else "" for value in self.frequency]
        header = ["candidate", "kind", "Hz", *(f"{direction}, %" for direction in DIRECTIONS), "kept", "reason"]
        rows = [
            [k + 1, kind, hertz[k], *share[k], "yes" if self.kept[k] else "no", self.reason[k]]
            for k, kind in enumerate(self.kind)
        ]
        return html_table(repr(self), header, rows)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the rows of the table.

        Returns
        -------
        pandas.DataFrame
            A row for each candidate, counted from 1: kind, frequency (Hz), effective mass in each direction (kg,
            kg m^2) and as a fraction of the body's, kept, reason.

        Raises
        ------
        InputError
            When pandas is not installed.
        """
        need("pandas", "a data frame")
        import pandas

        columns = {"kind": self.kind, "frequency": self.frequency}
        columns |= {f"mass.{name}": self.effective_mass[:, i] for i, name in enumerate(DIRECTIONS)}
        columns |= {f"fraction.{name}": self.fraction[:, i] for i, name in enumerate(DIRECTIONS)}
        columns |= {"kept": self.kept, "reason": self.reason}
        return pandas.DataFrame(columns, index=pandas.RangeIndex(1, len(self.kind) + 1, name="candidate"))

    @classmethod
    def empty(cls, total: np.ndarray) -> ModeTable:
        """Return a table without rows.

        Returns
        -------
        ModeTable
            With n = 0.
        """
        none = np.zeros(0)
        return cls(
            kind=(), frequency=none, effective_mass=none.reshape(0, 6), total=total, kept=none.astype(bool), reason=()
        )

    def with_rows(
        self,
        kind: str,
        reason: Sequence[str],
        frequency: np.ndarray | float = np.nan,
        effective_mass: np.ndarray | float = np.nan,
    ) -> ModeTable:
        """Return the table with further rows of one kind, a row for each reason, all kept.

        Returns
        -------
        ModeTable
            The rows of this table, then the further ones.
        """
        n = len(reason)
        return self.with_(
            kind=self.kind + (kind,) * n,
            frequency=np.append(self.frequency, np.broadcast_to(frequency, n)),
            effective_mass=np.concatenate([self.effective_mass, np.broadcast_to(effective_mass, (n, 6))]),
            kept=np.append(self.kept, np.ones(n, dtype=bool)),
            reason=(*self.reason, *reason),
        )

    @property
    def held_interfaces(self) -> tuple[str, ...]:
        """The interfaces besides the root that were held when the modes were computed: those of constraint modes."""
        rows = (reason for kind, reason in zip(self.kind, self.reason, strict=True) if kind == CONSTRAINT)
        return tuple(dict.fromkeys(reason.rpartition(OF_INTERFACE)[2] for reason in rows))

    @property
    def complete_below(self) -> float:
        """Frequency (Hz) below which no mode of the structure with its fixed interfaces held was dropped.

        It is that of the lowest dropped candidate, or of the highest candidate; infinite without candidates.
        """
        normal = np.array([kind in (FIXED, FREE) for kind in self.kind], dtype=bool)
        dropped, kept = (self.frequency[normal & x] for x in (~self.kept, self.kept))
        return float(dropped.min() if len(dropped) else kept.max(initial=0.0) or np.inf)

    @property
    def fraction(self) -> np.ndarray:
        """(n, 6) effective mass over the body's total, 0 where the total is 0."""
        total = np.where(self.total > 0, self.total, np.inf)
        return self.effective_mass / total


class ModalBody(Protocol):
    """Interface of a body for synthesis, such as `body.FlexibleBody` (theory 4)."""

    name: str
    m: float
    s0: np.ndarray
    E0: np.ndarray
    S: np.ndarray
    H: np.ndarray
    K: np.ndarray
    D: np.ndarray
    modes: ModeTable
    modal_mass: np.ndarray
    T: np.ndarray | None
    phi: np.ndarray
    psi: np.ndarray
    interface_name: tuple[str, ...]
    interface_position: np.ndarray
    points: np.ndarray
    cells: dict[str, np.ndarray]
    shape: np.ndarray
    stress: dict[str, Any]
    recovery: dict[str, Any]
    stations: Any
    coupled_damping: np.ndarray | None

    @property
    def n(self) -> int:
        """Number of modal coordinates."""
        ...

    def with_(self, **changes: Any) -> Self:
        """Return a copy with the named fields changed.

        Returns
        -------
        ModalBody
            The copy.
        """
        ...


AnyBody = TypeVar("AnyBody", bound=ModalBody)
