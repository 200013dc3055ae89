"""Plane faces of the skin of a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.fe.features.skin import Skin
from modalprep.records import Record

LEVEL = np.radians(0.2)  # between the normals of neighbours on one plane
SHARE = 0.01  # of the skin, from which a plane face is worth naming
SAME = 1e-5  # of the size: distance of faces on one plane


@dataclass(frozen=True, eq=False, kw_only=True)
class PlaneFace(Record):
    """A plane face; several on one plane are one.

    Attributes
    ----------
    point : (3,)
        m, its centroid.
    normal : (3,)
        Outward, of length one.
    area : float
        m^2.
    """

    point: np.ndarray
    normal: np.ndarray
    area: float


def plane_faces(skin: Skin, most: int = 12) -> list[PlaneFace]:
    """Return the largest plane faces of a skin, the largest first.

    Examples
    --------
    >>> from modalprep.fe.features.skin import skin_of
    >>> from modalprep.fe.mesh.mesh import Mesh
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> skin = skin_of(Mesh(points=points, cells={"tetra": np.array([[0, 1, 2, 3]])}, groups={}))
    >>> [round(face.area, 3) for face in plane_faces(skin)]
    [0.866, 0.5, 0.5, 0.5]
    """
    if not len(skin.faces):
        return []
    size = float(np.ptp(skin.points, axis=0).max())
    found = []
    for rows in skin.regions(skin.neighbours(LEVEL)):
        plane = _plane(skin, rows)
        off = np.abs((skin.points[skin.nodes(rows)] - plane.point) @ plane.normal).max()
        if off > SAME * size:
            continue
        same = [k for k, one in enumerate(found) if _same(one, plane, SAME * size)]
        if same:
            found[same[0]] = _joined(found[same[0]], plane)
        else:
            found.append(plane)
    large = [one for one in found if one.area > SHARE * skin.area.sum()]
    return sorted(large, key=lambda one: -one.area)[:most]


def _plane(skin: Skin, rows: np.ndarray) -> PlaneFace:
    area = skin.area[rows]
    middle = skin.points[skin.faces[rows]]
    weight = np.where(skin.faces[rows, 2] == skin.faces[rows, 3], 0.0, 1.0)[:, None]
    middle = (middle[:, :3].sum(axis=1) + weight * middle[:, 3]) / (3 + weight)
    normal = area @ skin.normals[rows]
    return PlaneFace(point=area @ middle / area.sum(), normal=normal / np.linalg.norm(normal), area=float(area.sum()))


def _same(one: PlaneFace, other: PlaneFace, slack: float) -> bool:
    return bool(one.normal @ other.normal > 1 - 1e-8 and abs((one.point - other.point) @ one.normal) < slack)


def _joined(one: PlaneFace, other: PlaneFace) -> PlaneFace:
    area = one.area + other.area
    return PlaneFace(point=(one.area * one.point + other.area * other.point) / area, normal=one.normal, area=area)
