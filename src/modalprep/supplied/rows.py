"""Further rows of a reduced body in the coordinates of its supplier: points that are drawn, and recovery matrices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.body.recovery import Recovery
from modalprep.errors import InputError


class Points(NamedTuple):
    """Further points of a body, of which its supplier says how they move.

    Attributes
    ----------
    position : (p, 3)
        In basic axes and the unit of the nodes.
    shape : (p, 3, rows)
        Displacement per row of the matrices, in basic axes and the units of the matrices.
    """

    position: np.ndarray
    shape: np.ndarray


class Rows(NamedTuple):
    """A recovery matrix: ``values = matrix @ coordinates`` in the supplier's units.

    Attributes
    ----------
    quantity : str
    labels, units : tuple of str
        Of each row, the unit after conversion.
    factor : (k,)
        SI units in a unit of the row.
    matrix : (k, rows)
    """

    quantity: str
    labels: tuple[str, ...]
    units: tuple[str, ...]
    factor: np.ndarray
    matrix: np.ndarray


def recovered(name: str, rows: Rows, motion: np.ndarray) -> Recovery:
    """Return a recovery matrix per modal coordinate.

    Parameters
    ----------
    motion : (rows, n)
        The supplier's coordinates per modal coordinate, in the supplier's units.

    Raises
    ------
    InputError
        When the matrix has another number of columns than the stiffness, or is not finite.

    Examples
    --------
    >>> rows = Rows("force", ("axial",), ("N",), np.array([1e-3]), np.array([[4.0, 0.0]]))
    >>> recovered("MEF1", rows, np.array([[0.5], [1.0]])).q
    array([[[0.002]]])
    """
    matrix = np.asarray(rows.matrix, dtype=float)
    if matrix.shape != (len(rows.labels), len(motion)) or not np.all(np.isfinite(matrix)):
        raise InputError(
            f"recovery matrix {name} has shape {matrix.shape}; it needs {len(rows.labels)} rows and, as the stiffness, "
            f"{len(motion)} columns of finite numbers"
        )
    values = (matrix * rows.factor[:, None]) @ motion
    return Recovery.of_rows(kind=rows.quantity, labels=rows.labels, units=rows.units, rows=values)


def drawn(points: Points | None, motion: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return position (p, 3), m, and displacement (p, 3, n) of further points per modal coordinate.

    Raises
    ------
    InputError
        When sizes do not match.

    Examples
    --------
    >>> drawn(None, np.ones((8, 2)), 1.0)[1].shape
    (0, 3, 2)
    """
    if points is None:
        return np.zeros((0, 3)), np.zeros((0, 3, motion.shape[1]))
    position, shape = (np.asarray(x, dtype=float) for x in points)
    if shape.shape != (*position.shape, len(motion)) or position.shape[1:] != (3,):
        raise InputError(
            f"points {position.shape} with shapes {shape.shape} do not match: give (p, 3) and (p, 3, {len(motion)})"
        )
    return position * length, length * (shape @ motion)
