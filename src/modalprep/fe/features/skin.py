"""The skin of the volumes of a mesh, and its patches: smooth regions, or the faces that a CAD file names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from modalprep.fe.mesh.facets import boundary, corners, numbered, of_dimension
from modalprep.fe.mesh.mesh import Mesh
from modalprep.records import Record


@dataclass(frozen=True, eq=False, kw_only=True)
class Skin(Record):
    """Faces where volumes end.

    Attributes
    ----------
    points : (n, 3)
        m, of the mesh.
    faces : (k, 4) int
        Corners, seen from outside; the last of a triangle twice.
    normals : (k, 3)
        Outward, of length one.
    area : (k,)
        m^2.
    """

    points: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    area: np.ndarray

    def nodes(self, chosen: np.ndarray) -> np.ndarray:
        """Return the sorted nodes of some faces."""
        return np.unique(self.faces[chosen])

    def neighbours(self, angle: float) -> np.ndarray:
        """Return pairs (m, 2) of faces that share an edge and whose normals differ by at most `angle` (rad)."""
        pairs = np.stack([self.faces, np.roll(self.faces, -1, axis=1)], axis=2).reshape(-1, 2)
        owner = np.repeat(np.arange(len(self.faces)), 4)
        real = pairs[:, 0] != pairs[:, 1]
        number = numbered(pairs[real])
        order = np.argsort(number, kind="stable")
        owner = owner[real][order]
        same = np.flatnonzero(np.diff(number[order]) == 0)
        found = np.stack([owner[same], owner[same + 1]], axis=1)
        cosine = np.einsum("ij,ij->i", self.normals[found[:, 0]], self.normals[found[:, 1]])
        return found[cosine >= np.cos(angle)]

    def regions(self, pairs: np.ndarray, among: np.ndarray | None = None) -> Iterator[np.ndarray]:
        """Yield the faces of each region that pairs of neighbours connect, of all faces or of some."""
        among = np.arange(len(self.faces)) if among is None else among
        inside = np.zeros(len(self.faces), dtype=bool)
        inside[among] = True
        pairs = pairs[inside[pairs].all(axis=1)]
        count = len(self.faces)
        graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count))
        label = connected_components(graph, directed=False)[1][among]
        order = np.argsort(label, kind="stable")
        yield from np.split(among[order], np.flatnonzero(np.diff(label[order])) + 1) if len(among) else ()


def skin_of(mesh: Mesh) -> Skin:
    """Return the skin of the volumes of a mesh; without volumes it is empty.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> skin = skin_of(Mesh(points=points, cells={"tetra": np.array([[0, 1, 2, 3]])}, groups={}))
    >>> len(skin.faces), skin.area.round(3).tolist()
    (4, [0.5, 0.5, 0.866, 0.5])
    """
    faces = corners(boundary(of_dimension(mesh.cells, 3)).items())
    at = mesh.points[faces]
    vector = np.cross(at[:, 2] - at[:, 0], at[:, 3] - at[:, 1]) / 2
    area = np.linalg.norm(vector, axis=1)
    return Skin(points=mesh.points, faces=faces, normals=vector / np.maximum(area, 1e-300)[:, None], area=area)


def named_patches(mesh: Mesh, skin: Skin) -> dict[str, np.ndarray]:
    """Return the faces of the skin in each group of surface cells."""
    keys = {frozenset(row): k for k, row in enumerate(skin.faces.tolist())}
    found = {}
    for name in mesh.groups:
        faces = corners(of_dimension(mesh.group(name), 2)).tolist()
        rows = [keys[key] for row in faces if (key := frozenset(row)) in keys]
        if rows and len(rows) == len(faces):
            found[name] = np.array(rows)
    return found
