"""Reference cells: shape functions of scikit-fem at its quadrature points, in the node order of mesh files."""

from __future__ import annotations

from functools import cache

import numpy as np
from skfem import element as skfem_element
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine, RefTri

_HEXAHEDRON = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
_EDGES = {
    "tetra": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    "hexahedron": [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
}
_FACES = [(0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)]  # VTK: x, y, z; low, high
CORNERS = {
    "triangle": [[0, 0], [1, 0], [0, 1]],
    "quad": [[0, 0], [1, 0], [1, 1], [0, 1]],
    "tetra": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "wedge": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]],
    "hexahedron": _HEXAHEDRON,
}
ELEMENT = {
    "triangle": skfem_element.ElementTriP1,
    "quad": skfem_element.ElementQuad1,
    "tetra": skfem_element.ElementTetP1,
    "tetra10": skfem_element.ElementTetP2,
    "wedge": skfem_element.ElementWedge1,
    "hexahedron": skfem_element.ElementHex1,
    "hexahedron20": skfem_element.ElementHexS2,
    "hexahedron27": skfem_element.ElementHex2,
}


def node_coordinates(kind: str) -> np.ndarray:
    """Return the nodes of a cell type on the unit cell ``(nn, dim)``, in meshio's (VTK's) order.

    Examples
    --------
    >>> node_coordinates("tetra10")[4:6]
    array([[0.5, 0. , 0. ], [0.5, 0.5, 0. ]])
    """
    name = kind.rstrip("0123456789")
    corners = np.array(CORNERS[name], dtype=float)
    more = [corners]
    if kind != name:
        more.append(corners[np.array(_EDGES[name])].mean(axis=1))
    if kind == "hexahedron27":
        more += [corners[np.array(_FACES)].mean(axis=1), [[0.5, 0.5, 0.5]]]
    return np.concatenate(more)


NODES = 0  # in place of a degree: the nodes of the cell with equal weights, for what is evaluated there


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
    element = ELEMENT[kind]()
    own = np.array([element.lbasis(X, i)[0] + 0 * X[0] for i in range(len(element.doflocs))])
    slope = np.array([np.broadcast_to(element.lbasis(X, i)[1], X.shape) for i in range(len(element.doflocs))])
    order = _order(kind, np.asarray(element.doflocs))
    return np.ascontiguousarray(own[order].T), np.ascontiguousarray(slope[order].transpose(2, 0, 1))


def quadrature(kind: str, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points ``(dim, nq)`` and weights of a rule of the cell, or its `NODES`; a wedge is triangle times line."""
    if degree == NODES:
        X = node_coordinates(kind).T
        return X, np.full(X.shape[1], quadrature(kind, 1)[1].sum() / X.shape[1])
    if kind != "wedge":
        return get_quadrature(ELEMENT[kind].refdom, degree)
    (XY, plane), (Z, line) = get_quadrature(RefTri, degree), get_quadrature(RefLine, degree)
    X = np.concatenate([np.repeat(XY, Z.shape[1], axis=1), np.tile(Z, XY.shape[1])])
    return X, np.repeat(plane, len(line)) * np.tile(line, len(plane))


def _order(kind: str, located: np.ndarray) -> np.ndarray:
    distance = np.abs(node_coordinates(kind)[:, None] - located[None]).max(axis=2)
    return np.argmin(distance, axis=1)
