"""Cells of meshes in scikit-fem: the mesh of their corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import skfem
from skfem.element import Element

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.reference_cells import PolynomialElement, RefPyramid, node_of_function


class PyramidCorner(PolynomialElement):
    """The element of the corners of pyramids, by which scikit-fem knows the cells of a mesh."""

    refdom = RefPyramid

    def __init__(self) -> None:
        super().__init__("pyramid")


@dataclass(repr=False)
class MeshPyramid1(skfem.mesh.Mesh3D):
    """A mesh of pyramids."""

    elem: type[Element] = PyramidCorner


MESHES = {
    "line": skfem.MeshLine1,
    "triangle": skfem.MeshTri1,
    "quad": skfem.MeshQuad1,
    "tetra": skfem.MeshTet1,
    "pyramid": MeshPyramid1,
    "wedge": skfem.MeshWedge1,
    "hexahedron": skfem.MeshHex1,
}


def corner_mesh(kind: str, points: np.ndarray, nodes: np.ndarray) -> skfem.Mesh:
    """Return scikit-fem's mesh of cells ``nodes (ne, nn)``; its vertices are all ``points (n, 3)``.

    Examples
    --------
    >>> mesh = corner_mesh("tetra", np.eye(4)[:, 1:], np.array([[0, 1, 2, 3]]))
    >>> mesh.t.ravel().tolist(), len(mesh.boundary_facets())
    ([0, 1, 2, 3], 4)
    """
    shape = CELLS[kind].shape
    t = np.ascontiguousarray(nodes[:, node_of_function(shape)].T, dtype=np.int32)
    return MESHES[shape](np.ascontiguousarray(points.T), t, sort_t=False)
