"""Shape gradients of second-order volumes, by which the mesh check finds curved cells that are inverted."""

from __future__ import annotations

from functools import cache

import numpy as np

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.polynomial_shapes import polynomial_shapes


@cache
def curved_gradient(shape: str, count: int) -> np.ndarray | None:
    """Return shape gradients ``(points, 3, nodes)`` of a second-order volume, or None for other cells.

    The points are the nodes and the centre; the apex of a pyramid, where its shapes have no gradient, is left out.
    A pyramid of 14 nodes is taken without its last node.

    Examples
    --------
    >>> gradient = curved_gradient("tetra", 10)
    >>> gradient.shape, float(abs(gradient.sum(axis=2)).max()) < 1e-12
    ((11, 3, 10), True)
    """
    cell = CELLS.get(f"{shape}{13 if shape == 'pyramid' and count == 14 else count}")
    if cell is None or cell.dimension != 3:
        return None
    nodes = cell.node_coordinates()
    points = np.vstack([nodes, nodes.mean(axis=0)])
    if shape == "pyramid":
        points = np.delete(points, 4, axis=0)
    return polynomial_shapes(cell, points.T)[1].transpose(0, 2, 1)
