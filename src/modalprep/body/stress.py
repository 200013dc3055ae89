"""Stress of a modal body at its points: linear in the modal coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from modalprep.records import Record

NORMAL = ("xx", "yy", "zz")
COMPONENTS = (*NORMAL, "xy", "yz", "xz", "torsion")
VON_MISES = "von_mises"


@dataclass(frozen=True, eq=False, kw_only=True)
class StressModes(Record):
    """Stress at a point per modal coordinate (theory 7.6).

    Attributes
    ----------
    position : (3,)
        Position of its node in the body's frame B, m.
    axes : (3, 3)
        Rows: the axes x, y, z of the components, in B.
    components : tuple of str
        Of ``xx, yy, zz, xy, yz, xz``; ``torsion`` is the shear of a beam's torque. Missing ones are zero, or in a
        beam unknown.
    modes : (c, n)
        Pa per modal coordinate.

    Examples
    --------
    >>> bar = StressModes(position=np.zeros(3), axes=np.eye(3), components=("xx", "torsion"), modes=np.eye(2))
    >>> bar.histories(np.array([[1.0, 0.0], [3.0, 4.0]]))["von_mises"].round(3)
    array([1.   , 7.55])
    """

    position: np.ndarray
    axes: np.ndarray
    components: tuple[str, ...]
    modes: np.ndarray

    def histories(self, q: np.ndarray) -> dict[str, np.ndarray]:
        """Return components and ``von_mises`` (Pa) at modal coordinates ``q (..., n)``, m sqrt(kg), as ``(...)``.

        Returns
        -------
        dict of (...) float
            Pa, by the component's name.

        References
        ----------
        Theory 7.6.
        """
        found = dict(zip(self.components, np.moveaxis(q @ self.modes.T, -1, 0), strict=True))
        return found | {VON_MISES: von_mises(found)}

    def in_frame(self, c: np.ndarray, Q: np.ndarray) -> StressModes:
        """Return the stress in a frame with its origin at c (m) and the columns of Q as axes, in the present ones.

        Returns
        -------
        StressModes
            Of the same components and coordinates.
        """
        return self.with_(position=(self.position - c) @ Q, axes=self.axes @ Q)

    def in_basis(self, Y: np.ndarray) -> StressModes:
        """Return the stress in the coordinates p of ``q = Y p``, ``Y (n, r)``.

        Returns
        -------
        StressModes
            Of r coordinates.
        """
        return self.with_(modes=self.modes @ Y)


def von_mises(stress: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the equivalent stress of components by name; missing ones are zero.

    Examples
    --------
    >>> float(von_mises({"xx": np.array(3.0), "yy": np.array(3.0), "xy": np.array(4.0)}).round(9))
    7.549834435
    """
    x, y, z = (stress.get(name, 0.0) for name in NORMAL)
    shear = sum(values**2 for name, values in stress.items() if name not in NORMAL)
    return np.sqrt(((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) / 2 + 3 * shear)
