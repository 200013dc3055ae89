"""Openings and pins of a mesh: full cylinders of its skin, and round edges of its shells."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from modalprep.fe.features.cylinder import Cylinder, fit_cylinder
from modalprep.fe.features.rims import rims
from modalprep.fe.features.skin import Skin
from modalprep.fe.mesh.mesh import Mesh
from modalprep.records import Record

SMOOTH = np.radians(50.0)  # between neighbours of one surface: a circle of eight elements has 45 degrees
FULL = np.radians(100.0)  # largest angle without nodes around a full circle, which may have four of them
CURVED = np.radians(2.0)  # between neighbours of a cylinder, where the search for one begins
TRIES = 60  # starts of that search in one smooth region
SLACK = 1e-4  # of the radius, by which halves of one opening may differ


@dataclass(frozen=True, eq=False, kw_only=True)
class Opening(Record):
    """A round opening, or a pin or round rim.

    Attributes
    ----------
    cylinder : Cylinder
        Its point is the middle of the opening.
    nodes : (k,) int
        Corner nodes of the faces on it.
    hole : bool
        Whether the material is outside.
    length : float
        m, along the axis; 0 for the edge of a shell.
    """

    cylinder: Cylinder
    nodes: np.ndarray
    hole: bool
    length: float

    @property
    def centre(self) -> np.ndarray:
        """The middle of the opening on its axis (3,), m."""
        return self.cylinder.point


def openings(mesh: Mesh, skin: Skin, patches: Iterable[np.ndarray] = ()) -> list[Opening]:
    """Return the openings and pins of a mesh, sorted along its longest, then its middle extension.

    Parameters
    ----------
    mesh : Mesh
    skin : Skin
        Of the mesh.
    patches : iterable of (k,) int
        Faces of the skin on each surface of a CAD file; without them smooth regions are searched.

    Notes
    -----
    Cylinders with one axis and radius are one opening, as the two lugs of a fork, or halves of one hole.
    """
    patches = list(patches)
    searched = (_cylinder_of_faces(skin, rows) for rows in patches) if patches else _searched(skin)
    found = [
        (*cylinder, _concave(skin, *cylinder)) for cylinder in searched if cylinder is not None and len(cylinder[1])
    ]
    round_ones = [*_merged(skin, found), *(Opening(**rim) for rim in rims(mesh))]
    order = np.argsort(-np.ptp(mesh.points, axis=0), kind="stable") if len(mesh.points) else [0, 1, 2]
    size = max(float(np.ptp(mesh.points, axis=0).max(initial=0.0)), 1e-300)
    return sorted(round_ones, key=lambda one: tuple((one.centre[order] / size).round(4)))


def _cylinder_of_faces(skin: Skin, rows: np.ndarray) -> tuple[Cylinder, np.ndarray] | None:
    """Return the cylinder of some faces with these faces, None where they lie on none."""
    fitted = fit_cylinder(skin.points[skin.nodes(rows)], skin.area[rows, None] * skin.normals[rows])
    if fitted is None or not _lie_on(skin, rows, fitted).all():
        return None
    return fitted, rows


def _lie_on(skin: Skin, rows: np.ndarray, cylinder: Cylinder) -> np.ndarray:
    """Return which faces lie on a cylinder: all their corners, with normals along its radius."""
    corners = skin.points[skin.faces[rows]]
    off = np.abs(cylinder.distance(corners.reshape(-1, 3))).reshape(-1, 4).max(axis=1)
    radial = cylinder.radial(corners.mean(axis=1))
    cosine = np.einsum("ij,ij->i", radial, skin.normals[rows]) / np.maximum(np.linalg.norm(radial, axis=1), 1e-300)
    return (off <= 2e-3 * cylinder.radius) & (np.abs(cosine) > 0.9)


def _searched(skin: Skin) -> Iterator[tuple[Cylinder, np.ndarray] | None]:
    """Yield cylinders in the smooth regions of a skin: a whole region, or what grows from a curved place in it."""
    pairs = skin.neighbours(SMOOTH)
    for region in skin.regions(pairs):
        whole = _cylinder_of_faces(skin, region) if len(region) > 3 else None
        if whole is not None or len(region) < 4:
            yield whole
        else:
            yield from _grown(skin, pairs, region)


def _grown(skin: Skin, pairs: np.ndarray, region: np.ndarray) -> Iterator[tuple[Cylinder, np.ndarray]]:
    """Yield the cylinders inside a smooth region, each from a start at two neighbours that are curved."""
    free = np.zeros(len(skin.faces), dtype=bool)
    free[region] = True
    inner = pairs[free[pairs].all(axis=1)]
    cosine = np.einsum("ij,ij->i", skin.normals[inner[:, 0]], skin.normals[inner[:, 1]])
    curved = inner[cosine < np.cos(CURVED)]
    for _ in range(TRIES):
        curved = curved[free[curved].all(axis=1)]
        if not len(curved):
            return
        start = curved[len(curved) // 2]
        found = _around(skin, inner, region[free[region]], start)
        if found is None:
            free[start] = False
            continue
        free[found[1]] = False
        yield found


def _around(skin: Skin, pairs: np.ndarray, among: np.ndarray, start: np.ndarray) -> tuple[Cylinder, np.ndarray] | None:
    """Return the cylinder through two faces and what touches them, with all faces of the region on it."""
    inside = np.zeros(len(skin.faces), dtype=bool)
    inside[among] = True
    pairs = pairs[inside[pairs].all(axis=1)]
    patch, found = start, None
    for _ in range(2):
        near = np.zeros(len(skin.faces), dtype=bool)
        near[patch] = True
        patch = np.union1d(patch, pairs[near[pairs].any(axis=1)])
        found = _cylinder_of_faces(skin, patch)
        if found is not None:
            break
    while found is not None:
        on = among[_lie_on(skin, among, found[0])]
        grown = next((rows for rows in skin.regions(pairs, on) if np.isin(start, rows).all()), found[1])
        if len(grown) <= len(found[1]):
            break
        found = _cylinder_of_faces(skin, grown) or (found[0], grown)
    return found


def _concave(skin: Skin, cylinder: Cylinder, rows: np.ndarray) -> bool:
    radial = cylinder.radial(skin.points[skin.faces[rows]].mean(axis=1))
    return bool((skin.area[rows] * np.einsum("ij,ij->i", radial, skin.normals[rows])).sum() < 0)


def _merged(skin: Skin, openings: list[tuple[Cylinder, np.ndarray, bool]]) -> Iterator[Opening]:
    """Yield the full cylinders, of faces with one axis and radius together."""
    while openings:
        first, _, hole = openings[0]
        slack = SLACK * first.radius
        same = [one for one in openings if one[2] == hole and first.coaxial(one[0], slack)]
        openings = [one for one in openings if not any(one is other for other in same)]
        rows = np.concatenate([one[1] for one in same])
        cylinder = (_cylinder_of_faces(skin, rows) or (first, rows))[0]
        nodes = skin.nodes(rows)
        if cylinder.gap(skin.points[nodes]) < FULL:
            yield _placed(cylinder, skin, rows, hole)


def _placed(cylinder: Cylinder, skin: Skin, rows: np.ndarray, hole: bool) -> Opening:
    """Return an opening whose point is the middle of its faces."""
    nodes = skin.nodes(rows)
    along = (skin.points[nodes] - cylinder.point) @ cylinder.axis
    middle = cylinder.point + (along.max() + along.min()) / 2 * cylinder.axis
    placed = Cylinder(point=middle, axis=cylinder.axis, radius=cylinder.radius)
    return Opening(cylinder=placed, nodes=nodes, hole=hole, length=float(np.ptp(along)))
