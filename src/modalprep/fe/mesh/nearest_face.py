"""The point of a face next to a node, with the shape functions there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.polynomial_shapes import polynomial_shapes

STEPS = 20  # of Newton's method; plane faces need one
SETTLED = 1e-13


class Place(NamedTuple):
    """The point of a face next to a node: distance, weights of the nodes of the face and their slopes, the point."""

    distance: float
    weights: np.ndarray
    slopes: np.ndarray
    point: np.ndarray


class Faces:
    """Faces among which the one next to a point is looked for.

    Parameters
    ----------
    cells : list of (cell type, nodes)
    points : (n_points, 3)
        Of all nodes.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])
    >>> place, nodes, size = Faces([("quad", [0, 1, 2, 3])], corners).nearest(np.array([1.0, 1.0, 0.5]))
    >>> place.distance, nodes, round(size, 3)
    (0.5, array([0, 1, 2, 3]), 2.828)
    """

    def __init__(self, cells: Sequence[tuple[str, Sequence[int]]], points: Sequence[np.ndarray] | np.ndarray) -> None:
        self.cells = cells
        self.corners = [np.array([points[i] for i in nodes]) for _, nodes in cells]
        centres = np.array([p.mean(axis=0) for p in self.corners])
        self.radius = np.array(
            [np.linalg.norm(p - c, axis=1).max() for p, c in zip(self.corners, centres, strict=True)]
        )
        self.tree = cKDTree(centres)

    def nearest(self, at: np.ndarray) -> tuple[Place, np.ndarray, float]:
        """Return the point of the faces next to `at (3,)`, the nodes of its face, and the size of that face."""
        near = self.tree.query(at)[0]
        around = self.tree.query_ball_point(at, near + self.radius.max())
        places = [(nearest(self.cells[k][0], self.corners[k], at), k) for k in around]
        place, k = min(places, key=lambda one: one[0].distance)
        return place, np.asarray(self.cells[k][1]), 2 * float(self.radius[k])


def nearest(kind: str, points: np.ndarray, at: np.ndarray) -> Place:
    """Return the point of a face ``points (n, 3)`` next to `at (3,)`.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])
    >>> place = nearest("quad", square, np.array([0.5, 3.0, 1.0]))
    >>> place.point, place.weights.round(3)
    (array([0.5, 2. , 0. ]), array([0.  , 0.  , 0.25, 0.75]))
    """
    corners = CELLS[kind].corners
    centre = corners.mean(axis=0)
    found = [_newton(kind, points, at, centre, np.eye(2))]
    if not _inside(kind, found[0]):
        ends = zip(corners, np.roll(corners, -1, axis=0), strict=True)
        found = [_on_edge(kind, points, at, a, b) for a, b in ends]
    return min((_place(kind, points, at, x) for x in found), key=lambda place: place.distance)


def _place(kind: str, points: np.ndarray, at: np.ndarray, x: np.ndarray) -> Place:
    weights, slopes = _shapes(kind, x)
    point = weights @ points
    return Place(float(np.linalg.norm(point - at)), weights, slopes, point)


def _on_edge(kind: str, points: np.ndarray, at: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    x = _newton(kind, points, at, (a + b) / 2, (b - a)[None])
    s = np.clip((x - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return a + s * (b - a)


def _newton(kind: str, points: np.ndarray, at: np.ndarray, start: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Gauss and Newton from `start` in the directions `along (m, 2)` of the unit cell."""
    x = start
    for _ in range(STEPS):
        N, dN = _shapes(kind, x)
        tangent = along @ dN.T @ points
        step = np.linalg.lstsq(tangent.T, at - N @ points, rcond=None)[0] @ along
        x = np.clip(x + step, -2.0, 3.0)
        if np.abs(step).max() < SETTLED:
            break
    return x


def _inside(kind: str, x: np.ndarray) -> bool:
    high = x.sum() if CELLS[kind].shape == "triangle" else x.max()
    return bool(x.min() >= -1e-12 and high <= 1 + 1e-12)


def _shapes(kind: str, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the shape functions (n,) and their gradients (n, 2) at a point of the unit cell."""
    N, dN = polynomial_shapes(CELLS[kind], x[:, None])
    return N[0], dN[0]
