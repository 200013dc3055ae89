"""Directions from which a body and its motion are visible."""

from __future__ import annotations

import numpy as np

PLANE = 0.15  # extent of the motion normal to a plane over that in it, below which the plane is viewed square-on
TILT = 0.1
CORNER = np.array([0.5, -0.8, 0.55])  # the usual three-quarter view, z up
ABOVE = np.array([0.35, -0.75, 1.1])  # of a body flat in x-y
SLENDER, FLAT = 0.1, 0.25  # extent across, over extent along, of a body seen square-on, from above


def view(points: np.ndarray, shape: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors (3,) from the body to the camera, and up.

    A slender body is seen square to its axis and its motion, with the axis to the right; any other from a corner.

    Examples
    --------
    >>> beam = np.linspace([0.0, 0, 0], [1.0, 0, 0], 5)
    >>> towards, up = view(beam, beam[:, [1, 2, 0]])  # moves along z
    >>> bool(towards[1] < -0.9), bool(up[2] > 0.9)
    (True, True)
    """
    centred = points - points.mean(axis=0)
    extent, axes = np.linalg.svd(centred, full_matrices=False)[1:]
    extent = np.pad(extent, (0, 3 - len(extent)))
    if len(axes) and extent[1] < SLENDER * extent[0]:
        return _square_on(axes[0], shape)
    flat = np.ptp(points[:, 2]) < FLAT * np.ptp(points[:, :2], axis=0).min()
    towards = ABOVE if flat else CORNER
    return upright_camera(towards, np.array([0.0, 0.0, 1.0]))


def _square_on(axis: np.ndarray, shape: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Look square at the axis; the motion is up, or what is nearest to vertical where it is along the axis."""
    axis = _positive(axis)
    motion = np.zeros(3)
    if shape is not None:
        motion = shape[np.argmax(np.linalg.norm(shape, axis=1))]
        across = motion - (motion @ axis) * axis
        motion = across if np.linalg.norm(across) > 0.05 * np.linalg.norm(motion) else np.zeros(3)
    if not motion.any():
        motion = np.array([0.0, 0, 1]) if abs(axis[2]) < 0.9 else np.array([1.0, 0, 0])
    up = _positive(motion - (motion @ axis) * axis)
    return upright_camera(np.cross(axis, up) + 0.12 * up, up)


def _positive(v: np.ndarray) -> np.ndarray:
    """Unit vector along v whose largest component is positive."""
    return v / np.linalg.norm(v) * np.sign(v[np.argmax(np.abs(v))])


def upright_camera(towards: np.ndarray, up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the unit direction towards the camera, and the up direction of the picture, normal to it."""
    towards = towards / np.linalg.norm(towards)
    up = up - (up @ towards) * towards
    return towards, up / np.linalg.norm(up)


def viewpoint(seen: np.ndarray, gravity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors (3,) to the camera and up: square to a plane motion, else from a corner; gravity is down.

    Examples
    --------
    >>> plane = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    >>> towards, up = viewpoint(plane, np.array([0, -9.81, 0]))
    >>> bool(towards[2] > 0.9), bool(up[1] > 0.9)
    (True, True)
    """
    extent, axes = np.linalg.svd(seen - seen.mean(axis=0), full_matrices=False)[1:]
    plane = len(extent) == 3 and extent[2] < PLANE * extent[0]
    normal = axes[-1] * np.sign(axes[-1][np.argmax(np.abs(axes[-1]))])
    down = np.linalg.norm(gravity) > 0
    up = -gravity / np.linalg.norm(gravity) if down else np.array([0.0, 0, 1])
    if plane and abs(up @ normal) > 0.9:  # a plane to stand on
        if not down and abs(normal[2]) > 0.9:
            return upright_camera(normal, np.array([0.0, 1, 0]))
        side = np.eye(3)[np.argmin(np.abs(up))]
        return upright_camera(0.8 * up + 0.6 * np.cross(side, up), up)
    if plane:
        if normal[1] > 0.9:  # x to the right
            normal = -normal
        return upright_camera(normal + TILT * up, up)
    first = np.eye(3)[0] - up[0] * up if abs(up[0]) < 0.9 else np.eye(3)[1]
    return upright_camera(0.5 * first + 0.55 * up - 0.8 * np.cross(up, first), up)
