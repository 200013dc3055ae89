"""Coordinate systems of a deck: rectangular, cylindrical, spherical."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(slots=True)
class System:
    """A coordinate system: kind R, C or S, origin and rows e1, e2, e3 in basic coordinates (deck units)."""

    kind: str
    origin: np.ndarray
    axes: np.ndarray

    def to_basic(self, x: np.ndarray) -> np.ndarray:
        """Return basic coordinates of ``x (n, 3)``; angles of C and S are degrees.

        Examples
        --------
        >>> System("C", np.zeros(3), np.eye(3)).to_basic(np.array([[2.0, 90.0, 5.0]])).round(12)
        array([[0., 2., 5.]])
        """
        if self.kind == "C":
            angle = np.radians(x[:, 1])
            x = np.stack([x[:, 0] * np.cos(angle), x[:, 0] * np.sin(angle), x[:, 2]], axis=1)
        elif self.kind == "S":
            r = x[:, 0]
            polar = np.radians(x[:, 1])
            around = np.radians(x[:, 2])
            across = r * np.sin(polar)
            x = np.stack([across * np.cos(around), across * np.sin(around), r * np.cos(polar)], axis=1)
        return self.origin + x @ self.axes

    def axes_at(self, point: np.ndarray) -> np.ndarray:
        """Return the rows e1, e2, e3 that hold at a basic ``point (3,)``: those of r, theta, z in a cylinder."""
        if self.kind == "R":
            return self.axes
        x, y, z = self.axes @ (point - self.origin)
        around = math.atan2(y, x)
        across = math.hypot(x, y)
        radial = np.array([math.cos(around), math.sin(around), 0.0])
        tangent = np.array([-radial[1], radial[0], 0.0])
        if self.kind == "C":
            return np.array([radial, tangent, [0.0, 0.0, 1.0]]) @ self.axes
        polar = math.atan2(across, z)
        up = np.array([0.0, 0.0, 1.0])
        outward = math.sin(polar) * radial + math.cos(polar) * up
        return np.array([outward, math.cos(polar) * radial - math.sin(polar) * up, tangent]) @ self.axes


BASIC = System("R", np.zeros(3), np.eye(3))
