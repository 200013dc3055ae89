"""Axes of flat shell elements and of their material."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.properties.properties import Shell


def shell_frames(corners: np.ndarray) -> np.ndarray:
    """Return the axes ``(ne, 3, 3)`` of triangles or quads with ``corners (ne, n, 3)``: rows e1, e2, e3 (normal).

    Examples
    --------
    >>> square = np.array([[[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]])
    >>> shell_frames(square)[0].round(12) + 0.0
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    if corners.shape[1] == 3:
        along = corners[:, 1] - corners[:, 0]
        normal = np.cross(along, corners[:, 2] - corners[:, 0])
    else:
        first = _unit(corners[:, 2] - corners[:, 0])
        second = _unit(corners[:, 3] - corners[:, 1])
        along = first - second
        normal = np.cross(first, second)
    e1, e3 = _unit(along), _unit(normal)
    return np.stack([e1, np.cross(e3, e1), e3], axis=1)


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), np.finfo(float).tiny)


def refuse_bad_shape(xy: np.ndarray, centre: np.ndarray) -> None:
    """Refuse elements ``xy (ne, n, 2)`` without area or crossed; `centre (ne, 3)` locates them in the message, m.

    Raises
    ------
    InputError
        When there is any.
    """
    after, before = np.roll(xy, -1, axis=1) - xy, np.roll(xy, 1, axis=1) - xy
    area = after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0]
    bad = np.any(area <= 1e-9 * np.ptp(xy, axis=1).max(axis=1, keepdims=True) ** 2, axis=1)
    if np.any(bad):
        at = ", ".join(f"{v:.4g}" for v in centre[np.argmax(bad)])
        raise InputError(
            f"{bad.sum()} of {len(bad)} shell elements have no area or a corner of 180 degrees or more (crossed), "
            f"the first near ({at}) m; repair the mesh"
        )


def material_angle(corners: np.ndarray, frame: np.ndarray, section: Shell, data: dict) -> np.ndarray:
    """Return the angle (ne,), rad, from e1 to axis 1: of the projected `axis`, else of the first side, plus `angle`.

    Raises
    ------
    InputError
        When the axis is normal to an element.
    """
    axis = np.full((len(corners), 3), np.nan) if section.axis is None else np.tile(section.axis, (len(corners), 1))
    axis = np.where(np.isfinite(data.get("axis", np.nan)), data.get("axis", np.nan), axis)
    axis = np.where(np.isfinite(axis), axis, corners[:, 1] - corners[:, 0])
    x, y, _ = np.einsum("eka,ea->ke", frame, axis)
    normal = np.hypot(x, y) <= 1e-6 * np.linalg.norm(axis, axis=1)
    if np.any(normal):
        raise InputError(f"material axis {axis[np.argmax(normal)].tolist()} is normal to {normal.sum()} shell elements")
    return np.arctan2(y, x) + given(data, "angle", section.angle, len(corners))


def given(data: dict, name: str, default: float, n: int) -> np.ndarray:
    """Return the values (ne,) that the mesh prescribes for single elements, elsewhere the default."""
    value = data.get(name, np.full(n, np.nan))
    return np.where(np.isfinite(value), value, default)
