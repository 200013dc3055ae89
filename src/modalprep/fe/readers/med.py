"""MED files, as Salome, Code_Aster and gmsh write them: names of groups, and the order of nodes in volumes."""

from __future__ import annotations

from typing import Any

import numpy as np

from modalprep.fe.mesh.cells import CELLS, cell_of

# MED counts the base of a volume the other way round than VTK: corners of a VTK cell among those of MED.
CORNERS = {
    "tetra": (0, 2, 1, 3),
    "pyramid": (0, 3, 2, 1, 4),
    "wedge": (0, 2, 1, 3, 5, 4),
    "hexahedron": (0, 3, 2, 1, 4, 7, 6, 5),
}


def learn_cells() -> None:
    """Tell meshio of quadratic cells that it reads and has no dimension for."""
    from meshio._mesh import topological_dimension

    topological_dimension.update({kind: 3 for kind in ("wedge15", "pyramid13") if kind not in topological_dimension})


def name_groups(raw: Any) -> None:
    """Give the families of cells and nodes of a file that meshio read the names of their groups."""
    names = getattr(raw, "cell_tags", {})
    families = raw.cell_data.pop("cell_tags", []) if names else []
    for group in sorted({name for found in names.values() for name in found}):
        members = [family for family, found in names.items() if group in found]
        raw.cell_sets[group] = [np.flatnonzero(np.isin(block, members)) for block in families]
    nodes = getattr(raw, "point_tags", {})
    tags = raw.point_data.get("point_tags", np.zeros(0))
    for group in sorted({name for found in nodes.values() for name in found}):
        members = [family for family, found in nodes.items() if group in found]
        raw.point_sets[group] = np.flatnonzero(np.isin(tags, members))


def in_vtk_order(kind: str, conn: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return volumes ``(n, count)`` in the order of VTK; those of other programs that have it already are kept.

    Examples
    --------
    >>> corners = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1.0]])
    >>> in_vtk_order("tetra", np.array([[0, 1, 2, 3]]), corners)
    array([[0, 2, 1, 3]])
    """
    cell = cell_of(kind)
    if cell is None or cell.shape not in CORNERS or kind not in CELLS:
        return conn
    corner, a, b, c = next(t for t in cell.triads() if t[0] == 0)
    sides = points[conn[:, [a, b, c]]] - points[conn[:, [corner]]]
    return conn[:, _order(kind)] if np.mean(np.linalg.det(sides) < 0) > 0.5 else conn


def _order(kind: str) -> list[int]:
    """Return the place in MED of each node of a VTK cell: those in the middle follow the corners around them."""
    cell = CELLS[kind]
    corners = CORNERS[cell.shape]
    around = [{int(k) for k in edge} for edge in cell.edges] + [set(face) for face in cell.faces if len(face) == 4]
    first = len(cell.corners)
    middle = [first + around.index({corners[k] for k in nodes}) for nodes in around]
    order = [*corners, *(k for k in middle)][: cell.count]
    return order + list(range(len(order), cell.count))
