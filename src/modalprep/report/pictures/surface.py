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
    return _coloured(pyvista.PolyData(np.array(points), faces=_counted(skin.triangles)), amount)


def segments(ends: np.ndarray, points: np.ndarray, amount: np.ndarray | None = None) -> pyvista.PolyData | None:
    """Return lines between nodes ``ends (n, 2)``, as `surface` does the triangles; None without any."""
    if not len(ends):
        return None
    return _coloured(pyvista.PolyData(np.array(points), lines=_counted(ends)), amount)


def tubes(skin: Skin, points: np.ndarray, radius: float, amount: np.ndarray | None = None) -> pyvista.PolyData | None:
    """Return the beams as tubes of `radius` (m), joined where elements meet; None without any."""
    drawn = segments(skin.lines, points, amount)
    return None if drawn is None else drawn.strip(join=True).tube(radius=radius, n_sides=20, capping=True)


def _counted(rows: np.ndarray) -> np.ndarray:
    """Return the nodes of each face or line behind their number, as VTK reads them."""
    return np.column_stack([np.full(len(rows), rows.shape[1]), rows]).ravel()


def _coloured(drawn: pyvista.PolyData, amount: np.ndarray | None) -> pyvista.PolyData:
    if amount is not None:
        drawn["amount"] = amount
    return drawn
