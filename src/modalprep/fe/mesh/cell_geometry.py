"""Reference cells in meshio's node order: corners, edges, faces, and the gradients of curved solids."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

SECOND_ORDER = {
    "line": (3,),
    "triangle": (6, 7),
    "quad": (8, 9),
    "tetra": (10,),
    "pyramid": (13, 14),
    "wedge": (15, 18),
    "hexahedron": (20, 27),
}
_SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
_TRIANGLE = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))


@dataclass(frozen=True, eq=False)
class Cell:
    """A reference cell.

    Attributes
    ----------
    corners : (n, 3) float
        Where the corner nodes lie.
    edges : (m, 2) int
        Corner nodes at the ends of each edge, in the order of the mid-side nodes.
    faces : tuple of tuples of int
        Corner nodes around each face; a surface cell is its own face, a line has none.
    regular : float
        Factor that makes the smallest scaled Jacobian of the best shape one.
    """

    corners: np.ndarray
    edges: np.ndarray
    faces: tuple[tuple[int, ...], ...]
    regular: float = 1.0

    @property
    def dimension(self) -> int:
        """1 line, 2 surface, 3 volume."""
        return int(np.sum(np.ptp(self.corners, axis=0) > 0))

    def triads(self) -> list[tuple[int, int, int, int]]:
        """Return (corner, neighbours a, b, c) of a volume where three edges meet, right-handed."""
        found = []
        for k, corner in enumerate(self.corners):
            near = [int(b if a == k else a) for a, b in self.edges if k in (a, b)]
            if len(near) == 3:
                right = np.linalg.det(self.corners[near] - corner) > 0
                found.append((k, *(near if right else near[::-1])))
        return found


def _cell(corners, edges, faces=(), regular=1.0) -> Cell:
    corners = np.array([(*c, 0.0, 0.0)[:3] for c in corners])
    return Cell(corners, np.array(edges), faces, regular)


CELLS = {
    "line": _cell([(0,), (1,)], [(0, 1)]),
    "triangle": _cell(_TRIANGLE, [(0, 1), (1, 2), (2, 0)], ((0, 1, 2),), 2 / 3**0.5),
    "quad": _cell(_SQUARE, [(0, 1), (1, 2), (2, 3), (3, 0)], ((0, 1, 2, 3),)),
    "tetra": _cell(
        [*_TRIANGLE, (0, 0, 1)],
        [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
        ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
        2**0.5,
    ),
    "pyramid": _cell(
        [*_SQUARE, (0.5, 0.5, 1)],
        [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)],
        ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
        2**0.5,
    ),
    "wedge": _cell(
        [*_TRIANGLE, *((x, y, 1) for x, y in _TRIANGLE)],
        [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
        ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
        2 / 3**0.5,
    ),
    "hexahedron": _cell(
        [*_SQUARE, *((x, y, 1) for x, y in _SQUARE)],
        [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
        ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    ),
}


def cell_of(kind: str) -> Cell | None:
    """Return the reference cell of a meshio cell type; None for points and types unknown here.

    Examples
    --------
    >>> len(cell_of("tetra10").edges), cell_of("vertex")
    (6, None)
    """
    return CELLS.get(kind.rstrip("0123456789"))


def mid_nodes(kind: str, conn: np.ndarray) -> np.ndarray:
    """Return the mid-side nodes ``(n, edges)`` of second-order cells; no column for others.

    Examples
    --------
    >>> mid_nodes("line3", np.array([[4, 6, 5]]))
    array([[5]])
    """
    cell = cell_of(kind)
    if cell is None or conn.shape[1] not in SECOND_ORDER[kind.rstrip("0123456789")]:
        return conn[:, :0]
    return conn[:, len(cell.corners) : len(cell.corners) + len(cell.edges)]


@cache
def curved_gradient(family: str, count: int) -> np.ndarray | None:
    """Return shape gradients ``(points, 3, nodes)`` of a second-order volume, or None for other cells.

    The points are the nodes and the centre; the apex of a pyramid, where its shapes have no gradient, is left out.
    A pyramid of 14 nodes is taken without its last node.

    Examples
    --------
    >>> gradient = curved_gradient("tetra", 10)
    >>> gradient.shape, float(abs(gradient.sum(axis=2)).max()) < 1e-12
    ((11, 3, 10), True)
    """
    if family not in _EXPONENTS or count not in SECOND_ORDER[family]:
        return None
    nodes = _nodes(family, count)
    place = np.vstack([nodes, nodes.mean(axis=0)])
    if family == "pyramid":
        place = np.delete(place, 4, axis=0)
    step = 1e-30j * np.eye(3)  # complex step: the derivative without rounding
    slope = np.stack([_basis(family, len(nodes), place + s).imag / 1e-30 for s in step], axis=1)
    return slope @ np.linalg.inv(_basis(family, len(nodes), nodes))


def _nodes(family: str, count: int) -> np.ndarray:
    """Return the reference coordinates of the nodes; those of a pyramid have the axis at x = y = 0."""
    cell = CELLS[family]
    corners = cell.corners.copy()
    if family == "pyramid":
        corners[:, :2] = 2 * corners[:, :2] - 1
        count = 13
    nodes = np.vstack([corners, corners[cell.edges].mean(axis=1)])
    if count in (18, 27):
        faces = np.array([corners[list(f)].mean(axis=0) for f in cell.faces if len(f) == 4])
        order = [5, 3, 2, 4, 0, 1] if family == "hexahedron" else [0, 1, 2]  # VTK: -x +x -y +y -z +z
        nodes = np.vstack([nodes, faces[order], *([corners.mean(axis=0)] if count == 27 else [])])
    return nodes


_ALL = list(product(range(3), repeat=3))
_EXPONENTS = {
    "tetra": {10: [e for e in _ALL if sum(e) <= 2]},
    "pyramid": {13: [e for e in _ALL if sum(e) <= 2]},
    "wedge": {
        15: [e for e in _ALL if e[0] + e[1] <= (2 if e[2] < 2 else 1)],
        18: [e for e in _ALL if e[0] + e[1] <= 2],
    },
    "hexahedron": {
        20: [e for e in _ALL if sum(p for p in e if p > 1) <= 2 and sum(e) <= 4],
        27: _ALL,
    },
}


def _basis(family: str, count: int, x: np.ndarray) -> np.ndarray:
    """Return the monomials that span the shapes, ``(points, count)``."""
    powers = np.stack([np.ones_like(x), x, x * x])  # (power, point, axis)
    exponents = np.array(_EXPONENTS[family][count])
    basis = np.prod([powers[exponents[:, a], :, a] for a in range(3)], axis=0).T
    if family != "pyramid":
        return basis
    x, y, z = np.moveaxis(x, -1, 0)
    below = np.where(z == 1, 1.0, 1 - z)  # at the apex x = y = 0: the products vanish there
    return np.column_stack([basis, x * y * z / below, x * x * y / below, x * y * y / below])
