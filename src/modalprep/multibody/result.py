"""The outcome of a simulation: named time histories and how the run went."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from modalprep.errors import InputError
from modalprep.records import Record


@dataclass(frozen=True, eq=False, kw_only=True)
class Result(Record):
    """Time histories by name.

    Attributes
    ----------
    time : (nt,) float
        s.
    channels : dict of (nt,) or (nt, k) float
        ``<joint>.angle`` (rad), ``<joint>.rate``, ``<joint>.torque``, ``<body>.modal`` (nt, n),
        ``<body>.<interface>.position`` (nt, 3, inertial, m), ``.velocity``, ``.deflection`` (in the
        body frame, m), and the audit ``energy.kinetic``, ``energy.strain``, ``energy.gravity``,
        ``energy.work``, ``energy.error`` (J), ``momentum.linear``, ``momentum.angular`` (nt, 3).
    status : str
        ``done``, or ``diverged`` when a deflection grew beyond the validity of the modal body.
    message : str
        One sentence for the user.
    stats : dict of float
        Evaluations, steps and the energy error relative to the largest energy.

    Examples
    --------
    >>> r = Result(time=np.array([0.0, 1.0]), channels={"a.position": np.array([[0., 1, 2], [3, 4, 5]])},
    ...            status="done", message="", stats={})
    >>> r["a.position.y"]
    array([1., 4.])
    """

    time: np.ndarray
    channels: dict[str, np.ndarray]
    status: str
    message: str
    stats: dict[str, float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a channel, or one component of it by a trailing ``.x``, ``.y``, ``.z`` or ``.<number>``."""
        if name in self.channels:
            return self.channels[name]
        parent, _, component = name.rpartition(".")
        columns = self.columns().get(parent, ())
        if component in columns:
            return self.channels[parent][:, columns.index(component)]
        known = ", ".join(sorted(self.channels))
        raise InputError(f"the result has no channel {name!r}; it has {known}")

    def columns(self) -> dict[str, list[str]]:
        """Return the component names of every channel with more than one column."""
        vectors = {name: a.shape[1] for name, a in self.channels.items() if a.ndim == 2}
        return {name: list("xyz") if k == 3 and not name.endswith(".modal") else [str(i + 1) for i in range(k)]
                for name, k in vectors.items()}  # fmt: skip
