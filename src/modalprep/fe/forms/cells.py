"""Cells of meshes in scikit-fem: the mesh of their corners, and the element of their shape functions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import skfem
from skfem.element import Element, ElementH1
from skfem.refdom import Refdom

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.polynomial_shapes import polynomial_shapes
from modalprep.fe.mesh.reference_cells import node_order


class RefPyramid(Refdom):
    """The unit pyramid, which scikit-fem lacks."""

    p = CELLS["pyramid"].corners.T
    t = np.arange(5)[:, None]
    facets = [[*face, face[0]][:4] for face in CELLS["pyramid"].faces]  # noqa: RUF012 (scikit-fem's type)
    edges = CELLS["pyramid"].edges.tolist()
    nnodes = 5
    nfacets = 5
    nedges = 8
    name = "Pyramid"


class PolynomialElement(ElementH1):
    """Shape functions that span monomials: pyramids and wedges of second order, in meshio's order of nodes."""

    maxdeg = 2
    nodal_dofs = 1

    def __init__(self, kind: str) -> None:
        self._cell = CELLS[kind]
        self.refdom = reference(kind)
        self.doflocs = self._cell.node_coordinates()
        self.edge_dofs = int(self._cell.second_order)
        self.dofnames = ["u"] * (1 + self.edge_dofs)

    def lbasis(self, X: np.ndarray, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the value and the gradient of a function at points ``X (3, nq)``."""
        N, dN = polynomial_shapes(self._cell, X)
        return N[:, i], dN[:, i].T


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


def reference(kind: str) -> type[Refdom]:
    """Return the unit cell of a kind.

    Examples
    --------
    >>> reference("tetra10").name
    'Tetrahedral'
    """
    return MESHES[CELLS[kind].shape].elem.refdom


def nodal_element(kind: str) -> ElementH1:
    """Return a new element of the shape functions of a cell.

    Examples
    --------
    >>> type(nodal_element("hexahedron20")).__name__, type(nodal_element("wedge15")).__name__
    ('ElementHexS2', 'PolynomialElement')
    """
    name = CELLS[kind].reference
    return PolynomialElement(kind) if name is None else getattr(skfem, name)()


def corner_mesh(kind: str, points: np.ndarray, nodes: np.ndarray) -> skfem.Mesh:
    """Return scikit-fem's mesh of cells ``nodes (ne, nn)``; its vertices are all ``points (n, 3)``.

    Examples
    --------
    >>> mesh = corner_mesh("tetra", np.eye(4)[:, 1:], np.array([[0, 1, 2, 3]]))
    >>> mesh.t.ravel().tolist(), len(mesh.boundary_facets())
    ([0, 1, 2, 3], 4)
    """
    corners = CELLS[kind].corners
    order = [int(np.argmin(np.abs(corners - at).sum(axis=1))) for at in reference(kind).p.T]
    t = np.ascontiguousarray(nodes[:, order].T, dtype=np.int32)
    return MESHES[CELLS[kind].shape](np.ascontiguousarray(points.T), t, sort_t=False)


@cache
def node_of_function(kind: str) -> np.ndarray:
    """Return which node of a cell each function of `nodal_element` belongs to.

    Examples
    --------
    >>> node_of_function("hexahedron").tolist()
    [6, 2, 5, 7, 1, 3, 4, 0]
    """
    return np.argsort(node_order(kind, np.asarray(nodal_element(kind).doflocs)))
