"""Nodal forces of a pressure on a face."""

from __future__ import annotations

import numpy as np

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.reference_cells import shapes

DEGREE = 4  # products of two quadratic shapes are exact on faces with straight sides


def face_forces(kind: str, points: np.ndarray, pressure: np.ndarray, along: np.ndarray | None = None) -> np.ndarray:
    """Return the forces ``(n, 3)`` on the nodes of a face under a pressure at its corners, by its shape functions.

    The pressure acts along the right-hand normal of the face ``points (n, 3)``, or `along` a direction.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
    >>> face_forces("quad", square, np.full(4, 6.0))[:, 2]
    array([3., 3., 3., 3.])
    """
    N, dN, weight = shapes(kind, DEGREE)
    tangents = np.einsum("qnd,na->qda", dN, points)
    area = np.cross(tangents[:, 0], tangents[:, 1])
    if along is not None:
        area = np.linalg.norm(area, axis=1)[:, None] * along
    local = shapes(CELLS[kind].shape, DEGREE)[0] @ pressure
    return np.einsum("q,qn,qa->na", weight * local, N, area)
