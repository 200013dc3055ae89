"""The drawable parts of a mesh: outer surface, element edges, beams."""

from __future__ import annotations

import numpy as np
import pyvista
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import RenderError

# meshio name: VTK cell type, and type and number of nodes of the same cell without its mid-side nodes
CELLS = {
    "triangle": (5, 5, 3),
    "quad": (9, 9, 4),
    "tetra": (10, 10, 4),
    "hexahedron": (12, 12, 8),
    "wedge": (13, 13, 6),
    "pyramid": (14, 14, 5),
    "triangle6": (22, 5, 3),
    "quad8": (23, 9, 4),
    "tetra10": (24, 10, 4),
    "hexahedron20": (25, 12, 8),
    "wedge15": (26, 13, 6),
    "pyramid13": (27, 14, 5),
    "quad9": (28, 9, 4),
    "hexahedron27": (29, 12, 8),
}
ORDER = {"line": [0, 1], "line3": [0, 2, 1]}  # along the beam: meshio puts the middle node last


def surface(body: FlexibleBody, points: np.ndarray, amount: np.ndarray | None = None) -> pyvista.PolyData | None:
    """Return the outer surface of shells and solids through their mid-side nodes; None without any.

    Parameters
    ----------
    points : (n_points, 3)
        The nodes, possibly displaced.
    amount : (n_points,), optional
        Scalar ``amount`` of each node, for its colour.

    Raises
    ------
    RenderError
        When a cell type cannot be drawn.
    """
    cells = {kind: nodes for kind, nodes in body.cells.items() if kind not in ORDER and kind != "vertex"}
    unknown = sorted(cells.keys() - CELLS.keys())
    if unknown:
        raise RenderError(f"cells of type {', '.join(unknown)} cannot be drawn; known are {', '.join(CELLS)}")
    if not any(len(nodes) for nodes in cells.values()):
        return None
    grid = pyvista.UnstructuredGrid({CELLS[kind][0]: nodes for kind, nodes in cells.items()}, np.array(points))
    if amount is not None:
        grid["amount"] = amount
    return _skin(grid)


def edges(body: FlexibleBody, points: np.ndarray) -> pyvista.PolyData:
    """Return the element edges on the surface, straight between corner nodes."""
    grid = pyvista.UnstructuredGrid(_linear(body), np.array(points))
    return _skin(grid).extract_all_edges()


def _linear(body: FlexibleBody) -> dict[int, np.ndarray]:
    """Return {VTK type: corner nodes}; two kinds may share a linear type."""
    parts: dict[int, list[np.ndarray]] = {}
    for kind, nodes in body.cells.items():
        if kind in CELLS:
            _, linear, count = CELLS[kind]
            parts.setdefault(linear, []).append(nodes[:, :count])
    return {linear: np.concatenate(blocks) for linear, blocks in parts.items()}


def _skin(grid: pyvista.UnstructuredGrid) -> pyvista.PolyData:
    skin = vtkDataSetSurfaceFilter()
    skin.SetInputData(grid)
    skin.SetNonlinearSubdivisionLevel(1)  # split at the mid-side nodes
    skin.Update()
    return pyvista.wrap(skin.GetOutput())


def lines(body: FlexibleBody, points: np.ndarray, amount: np.ndarray | None = None) -> pyvista.PolyData | None:
    """Return the beams as lines, as `surface` does the rest; None without any."""
    strips = [np.asarray(body.cells[kind])[:, order] for kind, order in ORDER.items() if kind in body.cells]
    rows = [np.column_stack([np.full(len(s), s.shape[1]), s]).ravel() for s in strips if len(s)]
    if not rows:
        return None
    drawn = pyvista.PolyData(np.array(points), lines=np.concatenate(rows))
    if amount is not None:
        drawn["amount"] = amount
    return drawn


def tubes(
    body: FlexibleBody, points: np.ndarray, radius: float, amount: np.ndarray | None = None
) -> pyvista.PolyData | None:
    """Return the beams as tubes of `radius` (m), joined where elements meet; None without any."""
    drawn = lines(body, points, amount)
    return None if drawn is None else drawn.strip(join=True).tube(radius=radius, n_sides=20, capping=True)
