"""Where the frame of a node set sits: in the centroid of its surface, and on the axis of a cylinder."""

from __future__ import annotations

import numpy as np

from modalprep.fe.mesh.facets import boundary, corners, distinct, of_dimension
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.select import NodeSet


def set_centroid(mesh: Mesh, spec: NodeSet, nodes: np.ndarray) -> np.ndarray:
    """Return the centroid (m, mesh coordinates) of the surface of a set, of its nodes where it has none.

    A cylinder has the point of its axis in the middle of its surface; where no face of the mesh lies on it, in the
    middle between its ends.

    Examples
    --------
    >>> points = np.array([[3.0, 0, 0], [0, 3, 0], [-3, 0, 0], [-3, 0, 1]])  # more of them on one side
    >>> mesh = Mesh(points=points, cells={}, groups={})
    >>> set_centroid(mesh, NodeSet(cylinder=((0, 0, 9), (0, 0, 2), 3)), np.arange(4)).tolist()
    [0.0, 0.0, 0.5]
    """
    if spec.cylinder:
        return _on_axis(mesh, np.asarray(spec.cylinder[0], dtype=float), spec.cylinder_axis(), nodes)
    faces = corners(of_dimension(mesh.group(spec.group), 2)) if spec.group else np.zeros((0, 4), dtype=int)
    if not len(faces):
        return mesh.points[nodes].mean(axis=0)
    middle, normal = _triangles(mesh.points, faces)
    area = np.linalg.norm(normal, axis=1)
    return area @ middle / area.sum()


def _on_axis(mesh: Mesh, point: np.ndarray, axis: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Only the part of a face that looks away from the axis counts: caps on the ends of a pin do not."""
    middle, normal = _triangles(mesh.points, outer_faces(mesh, nodes))
    area = np.linalg.norm(np.cross(normal, axis), axis=1)
    along = (mesh.points[nodes] - point) @ axis
    if area.sum() > 0:
        return point + (area @ (middle - point) @ axis / area.sum()) * axis
    return point + (along.min() + along.max()) / 2 * axis


def outer_faces(mesh: Mesh, nodes: np.ndarray) -> np.ndarray:
    """Return the corners (k, 4) of the faces between `nodes`: of surface cells, and of volumes where no other follows.

    Examples
    --------
    >>> two = {"tetra": np.array([[0, 1, 2, 3], [1, 2, 3, 4]])}
    >>> outer_faces(Mesh(points=np.zeros((5, 3)), cells=two, groups={}), np.arange(4)).tolist()
    [[0, 2, 1, 1], [0, 1, 3, 3], [0, 3, 2, 2]]
    """
    chosen = np.zeros(len(mesh.points), dtype=bool)
    chosen[nodes] = True
    skin = boundary(of_dimension(mesh.cells, 3))
    faces = corners(distinct([*skin.items(), *of_dimension(mesh.cells, 2)]).items())
    return faces[np.all(chosen[faces], axis=1)]


def _triangles(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the middles and twice the area vectors of the two triangles of each face."""
    corners = points[np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])]
    return corners.mean(axis=1), np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
