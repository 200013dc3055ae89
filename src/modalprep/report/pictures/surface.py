"""The drawable parts of a mesh: outer surface, element edges, beams."""

from __future__ import annotations

import numpy as np
import pyvista
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import RenderError
from modalprep.fe.mesh.cells import CELLS

DRAWN = {kind: cell for kind, cell in CELLS.items() if cell.vtk and cell.dimension > 1}
LINES = {kind: cell for kind, cell in CELLS.items() if cell.dimension == 1}


def surface(body: FlexibleBody, points: np.ndarray, amount: np.ndarray | None = None) -> pyvista.PolyData | None:
    """Return the outer surface of shells and solids through their mid-side nodes; None without any.

    Parameters
    ----------
    points : (n_points, 3)
        The nodes, perhaps displaced.
    amount : (n_points,), optional
        Scalar ``amount`` of each node, for its colour.

    Raises
    ------
    RenderError
        When a cell type cannot be drawn.
    """
    cells = {kind: nodes for kind, nodes in body.cells.items() if kind not in LINES and kind != "vertex"}
    unknown = sorted(cells.keys() - DRAWN.keys())
    if unknown:
        raise RenderError(f"cells of type {', '.join(unknown)} cannot be drawn; known are {', '.join(DRAWN)}")
    if not any(len(nodes) for nodes in cells.values()):
        return None
    grid = pyvista.UnstructuredGrid({DRAWN[kind].vtk: nodes for kind, nodes in cells.items()}, np.array(points))
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
        if kind in DRAWN:
            first = CELLS[DRAWN[kind].shape]
            parts.setdefault(first.vtk, []).append(nodes[:, : first.count])
    return {linear: np.concatenate(blocks) for linear, blocks in parts.items()}


def _skin(grid: pyvista.UnstructuredGrid) -> pyvista.PolyData:
    skin = vtkDataSetSurfaceFilter()
    skin.SetInputData(grid)
    skin.SetNonlinearSubdivisionLevel(1)  # one cut at the mid-side nodes
    skin.Update()
    return pyvista.wrap(skin.GetOutput())


def lines(body: FlexibleBody, points: np.ndarray, amount: np.ndarray | None = None) -> pyvista.PolyData | None:
    """Return the beams as lines, as `surface` does the rest; None without any."""
    strips = [np.asarray(body.cells[kind])[:, cell.along] for kind, cell in LINES.items() if kind in body.cells]
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
