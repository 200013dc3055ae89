"""Shape of the cells of one type: edges, angles, Jacobians and warpage, vectorised over the cells.

Arrays are laid out ``(node, axis, cell)``, so that every operation runs along the cells.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from modalprep.fe.mesh.cells import Cell, cell_of, mid_nodes
from modalprep.fe.mesh.curved_gradients import curved_gradient

FLAT = 1e-10  # relative: a triple product below this times the longest edge cubed is no volume (as fe.solid)
NOTHING = 1e-9  # relative to the extent of the mesh: a line shorter than this has no length
STRAIGHT = 1e-6  # mid-side nodes off the middle by less than this share of the edge make no curved element
CHUNK = 20_000  # curved cells evaluated at once: bounds the memory


@dataclass(frozen=True, eq=False)
class Shape:
    """Numbers of the shape of each cell; NaN where a kind of cell has no such number.

    Attributes
    ----------
    size : (n,) float
        Mean length of the edges, m.
    aspect : (n,) float
        Longest over shortest edge.
    small, large : (n,) float
        Smallest and largest angle between the edges of a face, degrees.
    jacobian : (n,) float
        Smallest scaled Jacobian at the corners: 1 for the best shape, 0 flat, negative inverted.
    warpage : (n,) float
        Quadrilaterals: distance of the corners from their mean plane over the mean diagonal.
    mid : (n,) float
        Second order: largest distance of a mid-side node from the middle of its edge, over the edge.
    degenerate, inverted, crossed : (n,) bool
        No length, area or volume or a node used twice; negative Jacobian; crossed or re-entrant quadrilateral.
    """

    size: np.ndarray
    aspect: np.ndarray
    small: np.ndarray
    large: np.ndarray
    jacobian: np.ndarray
    warpage: np.ndarray
    mid: np.ndarray
    degenerate: np.ndarray
    inverted: np.ndarray
    crossed: np.ndarray

    def sound(self) -> Shape:
        """Return the shapes with NaN in every number of a cell that is degenerate, inverted or crossed."""
        bad = self.degenerate | self.inverted | self.crossed
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return Shape(**{k: v if v.dtype == bool else np.where(bad, np.nan, v) for k, v in values.items()})


def measure(kind: str, conn: np.ndarray, points: np.ndarray) -> Shape | None:
    """Return the shapes of the cells ``conn (n, nodes)`` of a meshio type; None for a type unknown here.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
    >>> shape = measure("quad", np.array([[0, 1, 2, 3]]), square)
    >>> print(shape.size, shape.aspect, shape.small, shape.jacobian)
    [1.5] [2.] [90.] [1.]
    """
    cell = cell_of(kind)
    if cell is None:
        return None
    x = np.ascontiguousarray(np.moveaxis(points[conn], 0, 2))
    edge = x[cell.edges[:, 1]] - x[cell.edges[:, 0]]
    length = np.linalg.norm(edge, axis=1)
    unit = edge / np.where(length > 0, length, 1)[:, None]
    triple = _triple(cell, unit, length) if cell.dimension == 3 else None
    small, large = _angles(cell, unit)
    plain = np.full(len(conn), np.nan)
    warpage, crossed = _quads(x) if len(cell.corners) == 4 and cell.dimension == 2 else (plain, plain > 0)
    jacobian = _scaled(cell, triple, small, large, crossed)
    mid = _mid_offset(kind, conn, x, cell, length)
    degenerate = _degenerate(cell, conn, unit, length, triple) | (length.max(axis=0) <= NOTHING * _extent(points))
    inverted = _inverted(kind, x, triple, mid) & ~degenerate
    shortest = length.min(axis=0)
    aspect = length.max(axis=0) / np.where(shortest > 0, shortest, np.nan)
    crossed = crossed & ~degenerate
    return Shape(length.mean(axis=0), aspect, small, large, jacobian, warpage, mid, degenerate, inverted, crossed)


def _extent(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(points[np.isfinite(points).all(axis=1)], axis=0)))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of ``(3, ...)`` arrays."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("i...,i...->...", a, b)


def _towards(cell: Cell, along: np.ndarray, start: int, end: int) -> np.ndarray:
    """Return the vectors ``along (edge, 3, n)`` of the edge between two corners, from start to end."""
    for k, (a, b) in enumerate(cell.edges):
        if (a, b) == (start, end):
            return along[k]
        if (b, a) == (start, end):
            return -along[k]
    raise ValueError(f"no edge between corners {start} and {end}")


def _edge_number(cell: Cell, a: int, b: int) -> int:
    return int(np.flatnonzero((np.sort(cell.edges, axis=1) == sorted((a, b))).all(axis=1))[0])


def _triple(cell: Cell, unit: np.ndarray, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the triple products of the edges at each corner, ``(corner, n)``: of unit edges, and of the edges."""
    scaled, volume = [], []
    for corner, *near in cell.triads():
        a, b, c = (_towards(cell, unit, corner, end) for end in near)
        scaled.append(_dot(_cross(a, b), c))
        volume.append(scaled[-1] * np.prod([length[_edge_number(cell, corner, end)] for end in near], axis=0))
    return np.array(scaled), np.array(volume)


def _angles(cell: Cell, unit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and largest angle of the faces in degrees; NaN for lines."""
    low, high = np.full((2, unit.shape[2]), [[np.inf], [-np.inf]])
    for face in cell.faces:
        for before, corner, after in zip(face[-1:] + face[:-1], face, face[1:] + face[:1], strict=True):
            cosine = _dot(_towards(cell, unit, corner, before), _towards(cell, unit, corner, after))
            low = np.minimum(low, cosine)
            high = np.maximum(high, cosine)
    if not cell.faces:
        none = np.full(unit.shape[2], np.nan)
        return none, none
    return np.degrees(np.arccos(np.clip(high, -1, 1))), np.degrees(np.arccos(np.clip(low, -1, 1)))


def _scaled(cell: Cell, triple, small, large, crossed) -> np.ndarray:
    """Return the smallest scaled Jacobian; of a surface it is the sine of its worst angle."""
    if triple is not None:
        return np.minimum(cell.regular * triple[0].min(axis=0), 1.0)
    sine = np.minimum(np.sin(np.radians(small)), np.sin(np.radians(large)))
    return cell.regular * np.where(crossed, -sine, sine)


def _quads(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return warpage and whether an interior angle exceeds 180 degrees, as it does where edges cross."""
    corner = np.array([_cross(x[k] - x[k - 1], x[(k + 1) % 4] - x[k]) for k in range(4)])
    one, two = x[2] - x[0], x[3] - x[1]
    total = _cross(one, two)
    area = np.linalg.norm(corner, axis=1)
    largest = np.take_along_axis(corner, area.argmax(axis=0)[None, None], axis=0)[0]
    size = np.linalg.norm(total, axis=0)
    normal = np.where(size > 1e-6 * area.sum(axis=0), total, largest)  # an even bow-tie has no area
    against = _dot(np.moveaxis(corner, 1, 0), normal[:, None]) < -1e-9 * area.max(axis=0) * np.linalg.norm(
        normal, axis=0
    )
    diagonal = (np.linalg.norm(one, axis=0) + np.linalg.norm(two, axis=0)) / 2
    offset = np.abs(_dot(total, x[0] - x[1] + x[2] - x[3])) / 4
    scale = size * diagonal
    return offset / np.where(scale > 0, scale, np.nan), against.any(axis=0)


def _mid_offset(kind: str, conn: np.ndarray, x: np.ndarray, cell: Cell, length: np.ndarray) -> np.ndarray:
    count = mid_nodes(kind, conn).shape[1]
    if not count:
        return np.full(len(conn), np.nan)
    start = len(cell.corners)
    middle = (x[cell.edges[:, 0]] + x[cell.edges[:, 1]]) / 2
    off = np.linalg.norm(x[start : start + count] - middle, axis=1)
    return (off / np.where(length > 0, length, np.nan)).max(axis=0)


def _degenerate(cell: Cell, conn: np.ndarray, unit: np.ndarray, length: np.ndarray, triple) -> np.ndarray:
    """Whether a node is used twice, an edge has no length, or the cell no area or no volume."""
    longest = length.max(axis=0)
    twice = (np.diff(np.sort(conn, axis=1), axis=1) == 0).any(axis=1)
    bad = twice | (length.min(axis=0) <= FLAT * longest)
    if cell.dimension == 2:
        corner = [_cross(unit[k - 1], unit[k]) for k in range(len(unit))]
        bad |= np.linalg.norm(corner, axis=1).max(axis=0) <= FLAT
    elif triple is not None:
        bad |= np.abs(triple[1]).max(axis=0) <= FLAT * longest**3
    return bad


def _inverted(kind: str, x: np.ndarray, triple, mid: np.ndarray) -> np.ndarray:
    """Whether the Jacobian of a volume is negative at a corner or, where its edges are curved, at any node."""
    cell = cell_of(kind)
    if triple is None or cell is None:
        return np.zeros(x.shape[2], dtype=bool)
    bad = (triple[0] < -FLAT).any(axis=0)
    gradient = curved_gradient(cell.shape, x.shape[0])
    if gradient is None:
        return bad
    curved = np.flatnonzero((mid > STRAIGHT) & ~bad) if x.shape[0] not in (18, 27) else np.flatnonzero(~bad)
    for start in range(0, len(curved), CHUNK):
        rows = curved[start : start + CHUNK]
        bad[rows] = _least_determinant(gradient, x[: gradient.shape[2], :, rows]) <= 0
    return bad


def _least_determinant(gradient: np.ndarray, x: np.ndarray) -> np.ndarray:
    slope = np.tensordot(gradient, x, axes=(2, 0))  # (point, reference axis, axis, cell)
    a, b, c = np.moveaxis(slope, (1, 2), (0, 1))
    return _dot(_cross(a, b), c).min(axis=0)
