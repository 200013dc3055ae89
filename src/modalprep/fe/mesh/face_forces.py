"""Nodal forces of pressures on faces."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.reference_cells import shapes

DEGREE = 4  # products of two quadratic shapes are exact on faces with straight sides


class LoadedFace(NamedTuple):
    """A face with pressures at its corners, along its right-hand normal or along a direction."""

    kind: str
    nodes: Sequence[int]
    pressure: np.ndarray
    along: np.ndarray | None = None

    def times(self, factor: float) -> LoadedFace:
        """Return the face with its pressures times a factor."""
        return self._replace(pressure=factor * self.pressure)


def faces_load(faces: Iterable[LoadedFace], points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes ``(k,)``, which may occur several times, and their forces ``(k, 3)``, of nodes at ``points (n, 3)``.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
    >>> nodes, forces = faces_load([LoadedFace("quad", [0, 1, 2, 3], np.full(4, 6.0))], square)
    >>> nodes, forces[:, 2]
    (array([0, 1, 2, 3]), array([3., 3., 3., 3.]))
    """
    alike: dict[tuple[str, bool], list[LoadedFace]] = {}
    for face in faces:
        alike.setdefault((face.kind, face.along is None), []).append(face)
    nodes = [np.zeros(0, dtype=int)]
    forces = [np.zeros((0, 3))]
    for (kind, normal), own in alike.items():
        conn = np.array([face.nodes for face in own])
        along = None if normal else np.array([face.along for face in own])
        nodes.append(conn.ravel())
        forces.append(_forces(kind, points[conn], np.array([face.pressure for face in own]), along).reshape(-1, 3))
    return np.concatenate(nodes), np.concatenate(forces)


def _forces(kind: str, points: np.ndarray, pressure: np.ndarray, along: np.ndarray | None) -> np.ndarray:
    """Return the forces ``(f, n, 3)`` on the nodes of faces at ``points (f, n, 3)``, by their shape functions."""
    N, dN, weight = shapes(kind, DEGREE)
    tangents = np.einsum("qnd,fna->fqda", dN, points)
    area = np.cross(tangents[:, :, 0], tangents[:, :, 1])
    if along is not None:
        area = np.linalg.norm(area, axis=2)[..., None] * along[:, None]
    local = pressure @ shapes(CELLS[kind].shape, DEGREE)[0].T
    return np.einsum("q,fq,qn,fqa->fna", weight, local, N, area, optimize=True)
