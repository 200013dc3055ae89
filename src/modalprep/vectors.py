"""Vectors in three dimensions."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation


def skew(r: np.ndarray) -> np.ndarray:
    """Return ``r~ (..., 3, 3)`` with ``r~ v = r x v`` for ``r (..., 3)``.

    Examples
    --------
    >>> skew(np.array([1.0, 2, 3])) @ np.array([0.0, 0, 1])
    array([ 2., -1.,  0.])
    """
    x, y, z = np.moveaxis(np.asarray(r, dtype=float), -1, 0)
    o = np.zeros_like(x)
    return np.moveaxis(np.array([[o, -z, y], [z, o, -x], [-y, x, o]]), (0, 1), (-2, -1))


def rotation_matrix(vector: np.ndarray) -> np.ndarray:
    """Return the rotations ``(..., 3, 3)`` of rotation vectors ``(..., 3)``, rad.

    Examples
    --------
    >>> rotation_matrix(np.array([0, 0, np.pi / 2])).round(12) @ [1.0, 0, 0]
    array([0., 1., 0.])
    """
    return Rotation.from_rotvec(vector.reshape(-1, 3)).as_matrix().reshape(*vector.shape, 3)
