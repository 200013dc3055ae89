"""Shape functions that span monomials, from the nodes of their cell; those of pyramids have rational terms too."""

from __future__ import annotations

from functools import cache

import numpy as np

from modalprep.fe.mesh.cells import Cell


def polynomial_shapes(cell: Cell, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shape functions ``(nq, nn)`` and gradients ``(nq, nn, dim)`` of a cell at points ``X (dim, nq)``.

    At the apex of a pyramid, where its shapes have no gradient, it is the limit along the axis.

    References
    ----------
    G. Bedrosian, Shape functions and integration formulas for three-dimensional finite element analysis, Int. J.
    Numer. Methods Eng. 35 (1992) 95: pyramids.

    Examples
    --------
    >>> from modalprep.fe.mesh.cells import CELLS
    >>> N, dN = polynomial_shapes(CELLS["pyramid"], np.array([[0.5], [0.5], [0.5]]))
    >>> N.round(12)
    array([[0.125, 0.125, 0.125, 0.125, 0.5  ]])
    """
    inverse = _coefficients(cell)
    step = 1e-30j * np.eye(cell.dimension)  # complex step: the derivative without rounding
    slope = np.stack([np.imag(_basis(cell, X.T + s)) / 1e-30 for s in step], axis=2)
    return _basis(cell, X.T) @ inverse, np.einsum("qka,ki->qia", slope, inverse)


@cache
def _coefficients(cell: Cell) -> np.ndarray:
    """Return the coefficients (function, node) of the shapes."""
    return np.linalg.inv(_basis(cell, cell.node_coordinates()))


def _basis(cell: Cell, x: np.ndarray) -> np.ndarray:
    """Return the functions that span the shapes, ``(points, count)``; the axis of a pyramid is at x = y = 0."""
    pyramid = cell.shape == "pyramid"
    x = (x - (0.5, 0.5, 0.0)) * (2, 2, 1) if pyramid else x
    powers = np.stack([np.ones_like(x), x, x * x])  # (power, point, axis)
    exponents = np.array(cell.powers)
    basis = np.prod([powers[exponents[:, a], :, a] for a in range(cell.dimension)], axis=0).T
    if not pyramid:
        return basis
    x, y, z = np.moveaxis(x, -1, 0)
    ratio = x * y / np.where(z == 1, 1.0, 1 - z)  # the products vanish at the apex
    more = [ratio] if cell.count == len(cell.corners) else [ratio * z, ratio * x, ratio * y]
    return np.column_stack([basis, *more])
