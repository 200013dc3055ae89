"""Registry of the cell types of meshes: geometry, shape functions, and names in other programs.

Nodes are in the order that meshio and VTK share: corners, middles of the edges, middles of the faces, centre.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

Powers = tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class Cell:
    """A cell type on its unit cell.

    Attributes
    ----------
    name : str
        Name of the type in meshio.
    count : int
        Number of nodes.
    shape : str
        Name of the cell of first order with the same corners.
    corners : (n, dim) float
        Coordinates of the corner nodes.
    edges : (m, 2) int
        Corner nodes at the ends of each edge, in the order of the mid-side nodes.
    faces : tuple of tuples of int
        Corner nodes around each face, seen from outside, in the order of the nodes in the middles of the faces; a
        surface is its own face, a line has none.
    regular : float
        Factor that makes the smallest scaled Jacobian of the best shape one.
    reference : str or None
        The element of scikit-fem that has the shape functions; None where they follow from `powers`, if at all.
    powers : tuple of tuples of int
        Exponents of the monomials that span the shape functions of faces and of volumes; pyramids have further terms.
    vtk : int or None
        Cell type of VTK; None for cells that VTK does not draw.
    uff : (int, tuple of int) or None
        FE descriptor of the linear element in dataset 2412 of universal files, and its nodes among the corners.
    nastran : tuple of str
        Names of the element cards in Nastran decks.
    nastran_order : tuple of int
        Position on the card of each node of the cell; empty for the same order.
    """

    name: str
    count: int
    shape: str
    corners: np.ndarray
    edges: np.ndarray
    faces: tuple[tuple[int, ...], ...] = ()
    regular: float = 1.0
    reference: str | None = None
    powers: Powers = ()
    vtk: int | None = None
    uff: tuple[int, tuple[int, ...]] | None = None
    nastran: tuple[str, ...] = ()
    nastran_order: tuple[int, ...] = ()

    @property
    def dimension(self) -> int:
        """0 point, 1 line, 2 surface, 3 volume."""
        return self.corners.shape[1]

    @property
    def second_order(self) -> bool:
        """Whether the cell has nodes beside its corners."""
        return self.count > len(self.corners)

    @property
    def along(self) -> list[int]:
        """Nodes of a line from one end to the other."""
        return [0, *range(2, self.count), 1]

    def node_coordinates(self) -> np.ndarray:
        """Return the coordinates ``(count, dim)`` of the nodes on the unit cell.

        Examples
        --------
        >>> CELLS["tetra10"].node_coordinates()[4:6]
        array([[0.5, 0. , 0. ], [0.5, 0.5, 0. ]])
        """
        corners = self.corners
        faces = [corners[list(f)].mean(axis=0) for f in self.faces if self.dimension == 3 and len(f) == 4]
        middles = corners[self.edges].mean(axis=1)
        return np.vstack([corners, middles, *faces, corners.mean(axis=0)])[: self.count]

    def face(self, number: int) -> tuple[str, list[int]]:
        """Return the cell type of a face and its nodes among those of the cell, in the order of that type.

        Examples
        --------
        >>> CELLS["tetra10"].face(1)
        ('triangle6', [0, 1, 3, 4, 8, 7])
        """
        corners = self.faces[number]
        nodes = list(corners)
        if self.second_order:
            place = {frozenset(map(int, edge)): len(self.corners) + k for k, edge in enumerate(self.edges)}
            nodes += [place[frozenset(edge)] for edge in zip(corners, (*corners[1:], corners[0]), strict=True)]
        quads = [k for k, face in enumerate(self.faces) if len(face) == 4]
        own = len(self.corners) + len(self.edges)
        if number in quads and self.dimension == 3 and self.count >= own + len(quads):
            nodes.append(own + quads.index(number))
        return {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}[len(nodes)], nodes

    @cached_property
    def facets(self) -> list[tuple[str, list[int]]]:
        """Cell types of the faces of a volume or the edges of a surface, and their nodes among those of the cell."""
        if self.dimension == 3:
            return [self.face(k) for k in range(len(self.faces))]
        if self.dimension < 2:
            return []
        middles = len(self.corners) + np.arange(len(self.edges))[:, None]
        edges = np.hstack([self.edges, middles[:, : int(self.second_order)]])
        return [("line3" if self.second_order else "line", edge) for edge in edges.tolist()]

    def triads(self) -> list[tuple[int, int, int, int]]:
        """Return (corner, neighbours a, b, c) of a volume where three edges meet, right-handed."""
        found = []
        for k, corner in enumerate(self.corners):
            near = [int(b if a == k else a) for a, b in self.edges if k in (a, b)]
            if len(near) == 3:
                right = np.linalg.det(self.corners[near] - corner) > 0
                found.append((k, *(near if right else near[::-1])))
        return found


CELLS: dict[str, Cell] = {}
_ALL = tuple(product(range(3), repeat=3))
_SQUARE = ((0, 0), (1, 0), (1, 1), (0, 1))
_TRIANGLE = ((0, 0), (1, 0), (0, 1))
_PLANE = ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 1), (1, 2), (2, 2))  # of quadrilaterals, by order


def _first(name: str, corners, edges, faces=(), **given) -> None:
    """Register a cell of first order."""
    corners = np.array(corners, dtype=float)
    edges = np.array(edges, dtype=int).reshape(-1, 2)
    CELLS[name] = Cell(name=name, count=len(corners), shape=name, corners=corners, edges=edges, faces=faces, **given)


def _second(shape: str, count: int, **given) -> None:
    """Register a cell with nodes beside the corners of the first-order cell `shape`."""
    first = CELLS[shape]
    common = {key: getattr(first, key) for key in ("shape", "corners", "edges", "faces", "regular", "uff")}
    CELLS[f"{shape}{count}"] = Cell(name=f"{shape}{count}", count=count, **common, **given)


_first("vertex", np.zeros((1, 0)), (), vtk=1)
_first(
    "line",
    [(0,), (1,)],
    [(0, 1)],
    reference="ElementLineP1",
    vtk=3,
    uff=(21, (0, 1)),
)
_second("line", 3, reference="ElementLineP2", vtk=21)
_first(
    "triangle",
    _TRIANGLE,
    [(0, 1), (1, 2), (2, 0)],
    ((0, 1, 2),),
    regular=2 / 3**0.5,
    reference="ElementTriP1",
    powers=((0, 0), (1, 0), (0, 1)),
    vtk=5,
    uff=(91, (0, 1, 2)),
    nastran=("CTRIA3", "CTRIAR"),
)
_second(
    "triangle",
    6,
    reference="ElementTriP2",
    powers=((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2)),
    vtk=22,
    nastran=("CTRIA6",),
)
_second("triangle", 7)
_first(
    "quad",
    _SQUARE,
    [(0, 1), (1, 2), (2, 3), (3, 0)],
    ((0, 1, 2, 3),),
    reference="ElementQuad1",
    powers=_PLANE[:4],
    vtk=9,
    uff=(94, (0, 1, 2, 3)),
    nastran=("CQUAD4", "CQUADR"),
)
_second("quad", 8, reference="ElementQuadS2", powers=_PLANE[:8], vtk=23, nastran=("CQUAD8",))
_second("quad", 9, reference="ElementQuad2", powers=_PLANE, vtk=28)
_first(
    "tetra",
    [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    regular=2**0.5,
    reference="ElementTetP1",
    vtk=10,
    uff=(111, (0, 1, 2, 3)),
    nastran=("CTETRA",),
)
_second(
    "tetra",
    10,
    reference="ElementTetP2",
    powers=tuple(e for e in _ALL if sum(e) <= 2),
    vtk=24,
    nastran=("CTETRA",),
)
_first(
    "pyramid",
    [(x, y, 0) for x, y in _SQUARE] + [(0.5, 0.5, 1)],
    [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)],
    ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    regular=2**0.5,
    powers=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    vtk=14,
    nastran=("CPYRAM",),
    uff=(115, (0, 1, 2, 3, 4, 4, 4, 4)),  # a brick whose upper corners are one point
)
_second("pyramid", 13, powers=tuple(e for e in _ALL if sum(e) <= 2), vtk=27, nastran=("CPYRAM",))
_second("pyramid", 14, powers=tuple(e for e in _ALL if sum(e) <= 2))
_first(
    "wedge",
    [(*c, z) for z in (0, 1) for c in _TRIANGLE],
    [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    regular=2 / 3**0.5,
    reference="ElementWedge1",
    vtk=13,
    uff=(112, (0, 1, 2, 3, 4, 5)),
    nastran=("CPENTA",),
)
_second(
    "wedge",
    15,
    powers=tuple(e for e in _ALL if e[0] + e[1] <= (2 if e[2] < 2 else 1)),
    vtk=26,
    nastran=("CPENTA",),
    nastran_order=(*range(9), 12, 13, 14, 9, 10, 11),  # Nastran lists the upright edges before those of the top
)
_second("wedge", 18, powers=tuple(e for e in _ALL if e[0] + e[1] <= 2))
_first(
    "hexahedron",
    [(*c, z) for z in (0, 1) for c in _SQUARE],
    [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
    ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (2, 3, 7, 6), (0, 3, 2, 1), (4, 5, 6, 7)),
    reference="ElementHex1",
    vtk=12,
    uff=(115, (0, 1, 2, 3, 4, 5, 6, 7)),
    nastran=("CHEXA",),
)
_second(
    "hexahedron",
    20,
    reference="ElementHexS2",
    powers=tuple(e for e in _ALL if sum(p for p in e if p > 1) <= 2 and sum(e) <= 4),
    vtk=25,
    nastran=("CHEXA",),
    nastran_order=(*range(12), 16, 17, 18, 19, 12, 13, 14, 15),
)
_second("hexahedron", 27, reference="ElementHex2", powers=_ALL, vtk=29)


def cell_of(kind: str) -> Cell | None:
    """Return the record of a meshio cell type, of the first-order cell for an unknown order; None for other types.

    Examples
    --------
    >>> len(cell_of("tetra10").edges), cell_of("polygon")
    (6, None)
    """
    return CELLS.get(kind) or CELLS.get(kind.rstrip("0123456789"))


def cell_dimension(kind: str) -> int:
    """Return the dimension of a meshio cell type: 0 point, 1 line, 2 surface, 3 volume or unknown.

    Examples
    --------
    >>> cell_dimension("tetra10"), cell_dimension("line")
    (3, 1)
    """
    cell = cell_of(kind)
    return 3 if cell is None else cell.dimension


def mid_nodes(kind: str, conn: np.ndarray) -> np.ndarray:
    """Return the mid-side nodes ``(n, edges)`` of second-order cells; no column for others.

    Examples
    --------
    >>> mid_nodes("line3", np.array([[4, 6, 5]]))
    array([[5]])
    """
    cell = cell_of(kind)
    if cell is None or not CELLS.get(f"{cell.shape}{conn.shape[1]}"):
        return conn[:, :0]
    return conn[:, len(cell.corners) : len(cell.corners) + len(cell.edges)]
