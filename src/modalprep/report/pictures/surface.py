"""The skin of a scene as meshes of pyvista: surface, edges, beams."""

from __future__ import annotations

import numpy as np
import pyvista

from modalprep.report.scene.skin import Skin


def surface(skin: Skin, points: np.ndarray, amount: np.ndarray | None = None) -> pyvista.PolyData | None:
    """Return the outer surface of shells and solids through their mid-side nodes; None without any.

    Parameters
    ----------
    points : (n_points, 3)
        The nodes, possibly displaced.
    amount : (n_points,), optional
        Scalar ``amount`` of each node, for its colour.
    """
    if not len(skin.triangles):
        return None
    used, rows = _used(skin.triangles, len(points))
    return _coloured(pyvista.PolyData(points[used], faces=_counted(rows)), used, amount)


def segments(ends: np.ndarray, points: np.ndarray, amount: np.ndarray | None = None) -> pyvista.PolyData | None:
    """Return lines between nodes ``ends (n, 2)``, as `surface` does the triangles; None without any."""
    if not len(ends):
        return None
    used, rows = _used(ends, len(points))
    return _coloured(pyvista.PolyData(points[used], lines=_counted(rows)), used, amount)


def tubes(skin: Skin, points: np.ndarray, radius: float, amount: np.ndarray | None = None) -> pyvista.PolyData | None:
    """Return the beams as tubes of `radius` (m), joined where elements meet; None without any."""
    drawn = segments(skin.lines, points, amount)
    return None if drawn is None else drawn.strip(join=True).tube(radius=radius, n_sides=20, capping=True)


def _used(rows: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return which of the nodes faces or lines have, and their rows by the numbers among these."""
    used = np.zeros(count, dtype=bool)
    used[rows] = True
    return used, (np.cumsum(used) - 1)[rows]


def _counted(rows: np.ndarray) -> np.ndarray:
    """Return the nodes of each face or line behind their number, as VTK reads them."""
    return np.column_stack([np.full(len(rows), rows.shape[1]), rows]).ravel()


def _coloured(drawn: pyvista.PolyData, used: np.ndarray, amount: np.ndarray | None) -> pyvista.PolyData:
    if amount is not None:
        drawn["amount"] = amount[used]
    return drawn
