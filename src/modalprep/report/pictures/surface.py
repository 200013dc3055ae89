"""The drawable parts of a mesh: outer surface, element edges, beams."""

from __future__ import annotations

import meshio
import numpy as np
import pyvista

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import RenderError
from modalprep.fe.mesh.cells import CELLS
from modalprep.report.pictures.skin import outer_skin

LINES = {kind: cell for kind, cell in CELLS.items() if cell.dimension == 1}


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
    grid = _grid(body, points)
    if not grid.n_cells:
        return None
    if amount is not None:
        grid["amount"] = amount
    return _skin(grid, 1)


def edges(body: FlexibleBody, points: np.ndarray) -> pyvista.PolyData:
    """Return the element edges on the surface, straight between corner nodes."""
    return _skin(_grid(body, points), 0).extract_all_edges()


def outline(body: FlexibleBody, points: np.ndarray) -> pyvista.PolyData | None:
    """Return the borders and sharp folds of the undeformed surface at the points (n_points, 3); None without any.

    A deformation that is drawn large folds a surface between any two faces.
    """
    ends = outer_skin(body.points, body.cells).outline
    if not len(ends):
        return None
    return pyvista.PolyData(np.array(points), lines=np.column_stack([np.full(len(ends), 2), ends]).ravel())


def _grid(body: FlexibleBody, points: np.ndarray) -> pyvista.UnstructuredGrid:
    cells = [(kind, nodes) for kind, nodes in body.cells.items() if kind not in LINES and kind != "vertex"]
    try:
        return pyvista.from_meshio(meshio.Mesh(np.array(points), [block for block in cells if len(block[1])]))
    except KeyError as error:
        raise RenderError(f"cells of type {error.args[0]} cannot be drawn") from None


def _skin(grid: pyvista.UnstructuredGrid, cuts: int) -> pyvista.PolyData:
    """Return the outer faces, each side cut so many times at its mid-side node."""
    return grid.extract_surface(
        algorithm="dataset_surface", nonlinear_subdivision=cuts, pass_pointid=False, pass_cellid=False
    )


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
