"""Local coordinate systems of Ansys: kind, origin and three angles."""

from __future__ import annotations

import math

import numpy as np

from modalprep.fe.readers.ansys.commands import Command
from modalprep.fe.readers.systems import System

KINDS = {0: "R", 1: "C", 2: "S"}


class Spherical(System):
    """Axes along the radius, the meridian's angle and the height over the equator, as Ansys orders them."""

    def axes_at(self, point: np.ndarray) -> np.ndarray:
        """Return the rows e1, e2, e3 that hold at a basic ``point (3,)``."""
        radial, polar, around = super().axes_at(point)
        return np.array([radial, around, -polar])


PREDEFINED: dict[int, System] = {
    1: System("C", np.zeros(3), np.eye(3)),
    2: Spherical("S", np.zeros(3), np.eye(3)),
    5: System("C", np.zeros(3), np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])),
    6: System("C", np.zeros(3), np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])),
}


def axes_of(angles: np.ndarray) -> np.ndarray:
    """Return the rows e1, e2, e3 after rotations about z, the new x and the new y, ``angles (3,)`` in degrees.

    Examples
    --------
    >>> axes_of(np.array([90.0, 0.0, 0.0])).round(12)[0]
    array([0., 1., 0.])
    """
    turned = np.eye(3)
    for axis, angle in zip((2, 0, 1), np.radians(angles), strict=True):
        c = math.cos(angle)
        s = math.sin(angle)
        own = np.eye(3)
        j, k = (axis + 1) % 3, (axis + 2) % 3
        own[j, j], own[j, k], own[k, j], own[k, k] = c, s, -s, c
        turned = own @ turned
    return turned


def local_system(command: Command, kind: int, origin: np.ndarray, angles: np.ndarray) -> System:
    """Return a system; toroidal ones are refused."""
    if kind not in KINDS:
        raise command.error(
            f"a coordinate system of kind {kind} is not read; use a Cartesian, cylindrical or spherical one"
        )
    return (Spherical if KINDS[kind] == "S" else System)(KINDS[kind], origin, axes_of(angles))
