"""Where the frame of a node set sits: in the centroid of its surface, and on the axis of a cylinder."""

from __future__ import annotations

import numpy as np

from modalprep.fe.mesh.cells import cell_dimension, cell_of
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.select import NodeSet

CORNERS = 4  # of the widest face


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
    faces = cell_faces(mesh.group(spec.group) if spec.group else {})
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
    volumes, count = distinct_faces(cell_faces(mesh.cells, dimension=3))
    faces = distinct_faces(np.concatenate([volumes[count == 1], cell_faces(mesh.cells)]))[0]
    return faces[np.all(chosen[faces], axis=1)]


def cell_faces(cells: dict[str, np.ndarray], dimension: int = 2) -> np.ndarray:
    """Return the corners (k, 4) of every face of the cells of a dimension, the last of a triangle twice."""
    found = [np.zeros((0, CORNERS), dtype=int)]
    for kind, conn in cells.items():
        for face in cell.faces if (cell := cell_of(kind)) and cell_dimension(kind) == dimension else ():
            found.append(np.pad(conn[:, list(face)], ((0, 0), (0, CORNERS - len(face))), mode="edge"))
    return np.concatenate(found)


def distinct_faces(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return each face once, whatever its direction, and how often it occurs."""
    _, first, count = np.unique(face_keys(faces), axis=0, return_index=True, return_counts=True)
    return faces[first], count


def face_keys(faces: np.ndarray) -> np.ndarray:
    """Return the corners (k, 4) of faces in an order that their direction does not change, -1 first for triangles."""
    key = faces.copy()
    key[faces[:, 3] == faces[:, 2], 3] = -1
    return np.sort(key, axis=1)


def _triangles(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the middles and twice the area vectors of the two triangles of each face."""
    corners = points[np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])]
    return corners.mean(axis=1), np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
