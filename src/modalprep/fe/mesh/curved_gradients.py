"""Shape gradients of second-order volumes, by which the mesh check finds curved cells that are inverted."""

from __future__ import annotations

from functools import cache

import numpy as np

from modalprep.fe.mesh.cells import CELLS, Cell


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
    cell = CELLS.get(f"{shape}{count}")
    if cell is None or cell.dimension != 3:
        return None
    nodes = reference_nodes(cell)
    points = np.vstack([nodes, nodes.mean(axis=0)])
    if shape == "pyramid":
        points = np.delete(points, 4, axis=0)
    step = 1e-30j * np.eye(3)  # complex step: the derivative without rounding
    slope = np.stack([_basis(cell, points + s).imag / 1e-30 for s in step], axis=1)
    return slope @ np.linalg.inv(_basis(cell, nodes))


def reference_nodes(cell: Cell) -> np.ndarray:
    """Return the nodes ``(n, 3)`` of a second-order volume; those of a pyramid are 13, its axis at x = y = 0."""
    nodes = cell.node_coordinates()
    if cell.shape == "pyramid":
        nodes = nodes[:13]
        nodes[:, :2] = 2 * nodes[:, :2] - 1
    return nodes


def _basis(cell: Cell, x: np.ndarray) -> np.ndarray:
    """Return the monomials that span the shapes, ``(points, count)``."""
    powers = np.stack([np.ones_like(x), x, x * x])  # (power, point, axis)
    exponents = np.array(cell.powers)
    basis = np.prod([powers[exponents[:, a], :, a] for a in range(3)], axis=0).T
    if cell.shape != "pyramid":
        return basis
    x, y, z = np.moveaxis(x, -1, 0)
    below = np.where(z == 1, 1.0, 1 - z)  # at the apex x = y = 0: the products vanish there
    return np.column_stack([basis, x * y * z / below, x * x * y / below, x * y * y / below])
