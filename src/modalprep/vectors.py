"""Vectors and tensors in three dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from modalprep.errors import InputError

VectorLike = Sequence[float] | np.ndarray
MatrixLike = Sequence[VectorLike] | np.ndarray
RotationLike = MatrixLike | VectorLike | tuple[VectorLike, float]  # see `as_rotation`
UNIT = np.eye(3)
ROUNDING = 1e-3  # of an inertia tensor that is given by a few digits, as on the cards of a deck
PROPER = 1e-6  # of an entry of R R' - 1, and of the length of a quaternion


def vector(value: VectorLike, what: str = "") -> np.ndarray:
    """Return numbers that are given as a list, a tuple or an array.

    Raises
    ------
    InputError
        When they are no numbers, with `what` they are.

    Examples
    --------
    >>> vector((0, 0, 1))
    array([0., 0., 1.])
    >>> vector("x", "axis")
    Traceback (most recent call last):
    modalprep.errors.InputError: axis 'x' has no numbers; give a list of numbers such as [0, 0, 1]
    """
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{what} {value!r} has no numbers; give a list of numbers such as [0, 0, 1]") from None


def matrix(value: MatrixLike | VectorLike, what: str = "") -> np.ndarray:
    """Return rows of numbers that are given as lists, tuples or an array.

    Examples
    --------
    >>> matrix([[1, 2], [3, 4]]).tolist()
    [[1.0, 2.0], [3.0, 4.0]]
    """
    return np.asarray(value, dtype=float)


def skew(r: np.ndarray) -> np.ndarray:
    """Return ``r~ (..., 3, 3)`` with ``r~ v = r x v`` for ``r (..., 3)``.

    Examples
    --------
    >>> skew(np.array([1.0, 2, 3])) @ np.array([0.0, 0, 1])
    array([ 2., -1.,  0.])
    """
    r = np.asarray(r, dtype=float)
    found = np.zeros((*r.shape, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[..., i, j], found[..., j, i] = -r[..., k], r[..., k]
    return found


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross product of two vectors (3,); a tenth of the time that `numpy.cross` takes for one pair.

    Examples
    --------
    >>> cross(np.array([1.0, 0, 0]), np.array([0, 2.0, 0]))
    array([0., 0., 2.])
    """
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def on_both(R: np.ndarray) -> np.ndarray:
    """Return ``[R 0; 0 R] (6, 6)``, a rotation (3, 3) of translations and of rotations.

    Examples
    --------
    >>> on_both(np.eye(3)).trace()
    np.float64(6.0)
    """
    found = np.zeros((6, 6))
    found[:3, :3] = found[3:, 3:] = R
    return found


def frame_of_axes(axes: Any, what: str) -> np.ndarray:
    """Return the rows e1, e2, e3 of a frame ``(3, 3)`` by e1 and a direction in the plane of e1 and e2.

    Raises
    ------
    InputError
        When the two lie on one line; `what` has these axes.

    Examples
    --------
    >>> frame_of_axes(((0, 2.0, 0), (-1.0, 1.0, 0)), "a support").tolist()
    [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    e1, plane = (np.asarray(v, dtype=float) for v in axes)
    e3 = np.cross(e1, plane)
    if not np.linalg.norm(e3) > PROPER * np.linalg.norm(e1) * np.linalg.norm(plane):
        given = ", ".join(str(v.tolist()) for v in (e1, plane))
        raise InputError(f"axes {given} of {what} lie on one line; give e1 and a direction in the plane of e1 and e2")
    e1, e3 = e1 / np.linalg.norm(e1), e3 / np.linalg.norm(e3)
    return np.array([e1, np.cross(e3, e1), e3]) + 0.0


def rotation_matrix(vector: np.ndarray) -> np.ndarray:
    """Return the rotations ``(..., 3, 3)`` of rotation vectors ``(..., 3)``, rad.

    Examples
    --------
    >>> rotation_matrix(np.array([0, 0, np.pi / 2])).round(12) @ [1.0, 0, 0]
    array([0., 1., 0.])
    """
    return scipy.spatial.transform.Rotation.from_rotvec(vector.reshape(-1, 3)).as_matrix().reshape(*vector.shape, 3)


def as_rotation(value: RotationLike, what: str = "rotation") -> np.ndarray:
    """Return the rotation matrix (3, 3) that is given as a matrix, a quaternion, or an axis and an angle.

    Parameters
    ----------
    value : (3, 3), (4,) or ((3,), float)
        A matrix whose columns are the turned axes; a quaternion w, x, y, z of length 1; an axis of any length and the
        angle about it, rad.
    what : str
        Begins the sentence of an error.

    Returns
    -------
    (3, 3) float
        The rotation.

    Raises
    ------
    InputError
        When it is none of these, or no rotation.

    Examples
    --------
    >>> quarter = as_rotation(((0, 0, 2.0), np.pi / 2), "joint")
    >>> quarter.round(12) @ [1.0, 0, 0]
    array([0., 1., 0.])
    >>> bool(np.allclose(as_rotation([0.5**0.5, 0, 0, 0.5**0.5], "joint"), quarter))
    True
    """
    if isinstance(value, tuple | list) and len(value) == 2:
        return _about_axis(value[0], value[1], what)
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape == (4,) and abs(np.linalg.norm(found) - 1) < PROPER:
        return scipy.spatial.transform.Rotation.from_quat(found, scalar_first=True).as_matrix()
    if not _proper(found):
        raise InputError(
            f"{what} is no rotation: give an orthonormal matrix of 3 x 3, a quaternion (w, x, y, z) of length 1, or an "
            "axis and an angle (rad)"
        )
    return found


def _proper(matrix: np.ndarray) -> bool:
    """Whether a matrix is a rotation."""
    if matrix.shape != (3, 3):
        return False
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return bool(np.abs(matrix @ matrix.T - UNIT).max() < PROPER) and determinant > 0


def _about_axis(axis: Any, angle: Any, what: str) -> np.ndarray:
    axis = np.asarray(axis, dtype=float)
    if axis.shape != (3,) or not 0 < np.linalg.norm(axis) < np.inf or not np.isfinite(angle):
        raise InputError(f"{what}: axis {axis.tolist()} with angle {angle} has no direction")
    return scipy.spatial.transform.Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()


def inertia_tensor(inertia: Sequence[float]) -> np.ndarray:
    """Return the tensor (3, 3) of ``xx, yy, zz (, xy, xz, yz)``.

    Examples
    --------
    >>> inertia_tensor([1.0, 2.0, 3.0])
    array([[1., 0., 0.],
           [0., 2., 0.],
           [0., 0., 3.]])
    """
    xx, yy, zz, xy, xz, yz = [*inertia, 0.0, 0.0, 0.0][:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def refuse_impossible_inertia(inertia: np.ndarray, what: str = "") -> None:
    """Raise an `InputError` for a tensor (3, 3) that no distribution of mass has; `what` starts the message.

    Of the principal moments none exceeds the sum of the others.

    Examples
    --------
    >>> refuse_impossible_inertia(np.diag([1.0, 1.0, 2.0]))
    >>> refuse_impossible_inertia(np.diag([1.0, 1.0, 3.0]), "hub: ")
    Traceback (most recent call last):
    modalprep.errors.InputError: hub: inertia is physically impossible: of its principal moments [1.0, 1.0, 3.0] the \
largest exceeds the sum of the others
    """
    if inertia.shape != (3, 3) or not np.all(np.isfinite(inertia)):
        raise InputError(f"{what}inertia needs a tensor of 3 x 3 finite numbers")
    if why := impossible_inertia(inertia):
        raise InputError(f"{what}inertia is physically impossible: {why}")


def impossible_inertia(inertia: np.ndarray) -> str:
    """Return why no distribution of mass has a tensor (3, 3); empty where one has.

    Examples
    --------
    >>> impossible_inertia(np.diag([0.0, 0.0, 1.0]))
    'of its principal moments [0.0, 0.0, 1.0] the largest exceeds the sum of the others'
    """
    moments = np.linalg.eigvalsh(inertia)
    if 2 * moments.max() <= moments.sum() * (1 + ROUNDING):
        return ""
    return f"of its principal moments {moments.round(6).tolist()} the largest exceeds the sum of the others"
