"""Reference cells: scikit-fem's elements and quadrature, in the node order of meshio, and those that it lacks."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.special import roots_jacobi
from skfem import element as skfem_element
from skfem.element import ElementH1
from skfem.quadrature import get_quadrature
from skfem.refdom import Refdom, RefLine, RefTri

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.polynomial_shapes import polynomial_shapes

IN_PLANE = {("wedge15", 4): 2}  # degree of the triangle's rule in a wedge, where it is not that along its edges
NODES = 0  # in place of a degree: the nodes of the cell with equal weights, for what is evaluated there


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
        self.refdom = RefPyramid if self._cell.shape == "pyramid" else nodal_element(self._cell.shape).refdom
        self.doflocs = self._cell.node_coordinates()
        self.edge_dofs = int(self._cell.second_order)
        self.dofnames = ["u"] * (1 + self.edge_dofs)

    def lbasis(self, X: np.ndarray, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the value and the gradient of a function at points ``X (3, nq)``."""
        N, dN = polynomial_shapes(self._cell, X)
        return N[:, i], dN[:, i].T


def nodal_element(kind: str) -> ElementH1:
    """Return a new element of the shape functions of a cell.

    Examples
    --------
    >>> type(nodal_element("hexahedron20")).__name__, type(nodal_element("wedge15")).__name__
    ('ElementHexS2', 'PolynomialElement')
    """
    name = CELLS[kind].reference
    return PolynomialElement(kind) if name is None else getattr(skfem_element, name)()


@cache
def shapes(kind: str, degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return shape functions ``N (nq, nn)``, gradients ``dN (nq, nn, dim)`` and weights at a rule of that degree.

    Examples
    --------
    >>> N, dN, weight = shapes("wedge", 2)
    >>> bool(np.allclose(N.sum(axis=1), 1)), round(float(weight.sum()), 12)
    (True, 0.5)
    """
    X, weight = quadrature(kind, degree)
    return *shapes_at(kind, X), weight


def shapes_at(kind: str, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shape functions ``(nq, nn)`` and gradients ``(nq, nn, dim)`` at points ``X (dim, nq)``."""
    if CELLS[kind].reference is None:
        return polynomial_shapes(CELLS[kind], X)
    element = nodal_element(kind)
    own = np.array([element.lbasis(X, i)[0] + 0 * X[0] for i in range(len(element.doflocs))])
    slope = np.array([np.broadcast_to(element.lbasis(X, i)[1], X.shape) for i in range(len(element.doflocs))])
    order = node_order(kind, element.doflocs)
    return np.ascontiguousarray(own[order].T), np.ascontiguousarray(slope[order].transpose(2, 0, 1))


def quadrature(kind: str, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points ``(dim, nq)`` and weights of a rule of the cell, or its `NODES`.

    The rule of a wedge is that of a triangle times that of a line; that of a pyramid has equal points in all sections.
    """
    if degree == NODES:
        X = CELLS[kind].node_coordinates().T
        return X, np.full(X.shape[1], quadrature(kind, 1)[1].sum() / X.shape[1])
    if CELLS[kind].shape == "pyramid":
        return _pyramid(degree // 2 + 1)
    if CELLS[kind].shape != "wedge":
        return get_quadrature(nodal_element(kind), degree)
    # scikit-fem 12 has coordinates of the triangle's points in all pairs, and weights that sum to 1/4 instead of 1/2
    XY, plane = get_quadrature(RefTri, IN_PLANE.get((kind, degree), degree))
    Z, line = get_quadrature(RefLine, degree)
    X = np.concatenate([np.repeat(XY, Z.shape[1], axis=1), np.tile(Z, XY.shape[1])])
    return X, np.repeat(plane, len(line)) * np.tile(line, len(plane))


def _pyramid(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points of squares on those of Jacobi along the height, whose weight ``(1 - z)^2`` is their area."""
    line, share = np.polynomial.legendre.leggauss(n)
    height, weight = roots_jacobi(n, 2, 0)
    x, y, z = np.meshgrid(line / 2, line / 2, (1 + height) / 2, indexing="ij")
    weights = np.einsum("i,j,k->ijk", share / 2, share / 2, weight / 8)
    return np.stack([0.5 + x * (1 - z), 0.5 + y * (1 - z), z]).reshape(3, -1), weights.ravel()


def node_order(kind: str, located: np.ndarray) -> np.ndarray:
    """Return which of the points ``located (n, dim)`` of the unit cell each node of a cell is."""
    distance = np.abs(CELLS[kind].node_coordinates()[:, None] - np.asarray(located)).max(axis=2)
    return np.argmin(distance, axis=1)


@cache
def node_of_function(kind: str) -> np.ndarray:
    """Return which node of a cell each function of `nodal_element` belongs to.

    Examples
    --------
    >>> node_of_function("hexahedron").tolist()
    [6, 2, 5, 7, 1, 3, 4, 0]
    """
    return np.argsort(node_order(kind, nodal_element(kind).doflocs))
