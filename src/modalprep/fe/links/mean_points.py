"""The points whose mean motion an rbe3 has: its nodes, or those of an integral over faces and edges (theory 1.4)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array, vstack

from modalprep.fe.mesh.cells import CELLS, cell_dimension
from modalprep.fe.mesh.facets import Cells, Facets, alone, distinct, facets, of_dimension
from modalprep.fe.mesh.mapping import CellMapping
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.reference_cells import quadrature, shapes_at
from modalprep.fe.mesh.select import NodeSet

DEGREE = 4  # products of two quadratic shapes are exact on faces with straight sides
CROSS = 1e-3  # arms on a straight line, of its radius of gyration: short, so that they count about the line alone


class MeanPoints(NamedTuple):
    """Points that move as ``share (q, k)`` of the nodes, on arms ``(q, 3)`` from there; ``weight (q,)`` sums to one."""

    share: csr_array
    arm: np.ndarray
    weight: np.ndarray

    @classmethod
    def at_nodes(cls, weights: np.ndarray) -> MeanPoints:
        """Return the nodes themselves with ``weights (k,)``."""
        k = len(weights)
        share = csr_array((np.ones(k), np.arange(k), np.arange(k + 1)), shape=(k, k))
        return cls(share, np.zeros((k, 3)), weights / weights.sum())

    @classmethod
    def over(cls, points: np.ndarray, nodes: np.ndarray, cells: Cells) -> MeanPoints:
        """Return the points of an integral over cells between ``nodes (k,)`` of a mesh with ``points (n, 3)``.

        Examples
        --------
        >>> square = np.array([[0.0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1]])
        >>> over = MeanPoints.over(np.pad(square, ((0, 0), (0, 1))), np.arange(8), {"quad8": np.arange(8)[None]})
        >>> over.nodal.round(3)  # of a uniform traction
        array([-0.083, -0.083, -0.083, -0.083,  0.333,  0.333,  0.333,  0.333])
        """
        place = np.full(len(points), -1)
        place[nodes] = np.arange(len(nodes))
        weights, shares = [], []
        for kind, conn in cells.items():
            X, rule = quadrature(kind, DEGREE)
            size = CellMapping(kind, points[conn]).detDF(X)
            weights.append((size * rule).ravel())
            number = np.arange(size.size).reshape(size.shape)
            of = np.broadcast_arrays(shapes_at(kind, X)[0], number[..., None], place[conn][:, None])
            N, row, column = (part.ravel() for part in of)
            shares.append(coo_array((N, (row, column)), shape=(size.size, len(nodes))))
        weight = np.concatenate(weights)
        return cls(vstack(shares, format="csr"), np.zeros((len(weight), 3)), weight / weight.sum())

    @property
    def nodal(self) -> np.ndarray:
        """The weight ``(k,)`` of each node in the mean translation."""
        return self.share.T @ self.weight

    def places(self, nodes: np.ndarray) -> np.ndarray:
        """Return the places ``(q, 3)`` of the points for nodes at ``(k, 3)``."""
        return self.share @ nodes + self.arm

    def crossed(self, nodes: np.ndarray) -> MeanPoints:
        """Return four points around each node at ``(k, 3)`` of a straight line, on arms that turn with the node."""
        w = self.nodal
        r = nodes - w @ nodes
        across = np.linalg.svd(r, full_matrices=False)[2][1:]
        arm = CROSS * np.sqrt(w @ np.sum(r**2, axis=1)) * np.concatenate([across, -across])
        share = MeanPoints.at_nodes(w).share
        rows = np.repeat(np.arange(len(w)), len(arm))
        return MeanPoints(share[rows].tocsr(), np.tile(arm, (len(w), 1)), np.repeat(w, len(arm)) / len(arm))


def cells_of(mesh: Mesh, spec: NodeSet, nodes: np.ndarray) -> tuple[dict[str, np.ndarray], str]:
    """Return the cells over which the mean of a node set is taken, and a note where its faces leave out some nodes.

    They are those of its group with the highest dimension, or else the outer faces between its nodes, or the edges of
    shells between them; none, so that every node counts alike, where these do not have all nodes.

    Examples
    --------
    >>> mesh = Mesh(points=np.eye(4, 3), cells={"quad": np.array([[0, 1, 2, 3]])}, groups={})
    >>> cells_of(mesh, NodeSet(node=1), np.array([0, 1]))
    ({'line': array([[0, 1]])}, '')
    """
    found = _of_group(mesh, spec)
    if _missed(found, nodes):
        found = _outer_faces(mesh, nodes) or _edges(mesh, nodes)
    missed = _missed(found, nodes)
    if not missed:
        return found, ""
    return {}, f"{missed} of its {len(nodes)} nodes lie on none of its faces or edges: every node counts alike" * bool(
        found
    )


def _of_group(mesh: Mesh, spec: NodeSet) -> dict[str, np.ndarray]:
    rows = mesh.groups[spec.group] if spec.group else {}
    cells = {kind: mesh.cells[kind][own] for kind, own in rows.items() if kind in mesh.cells and len(own)}
    top = max((cell_dimension(kind) for kind in cells), default=0)
    return {kind: conn for kind, conn in cells.items() if cell_dimension(kind) == top > 0}


def _missed(cells: Cells, nodes: np.ndarray) -> int:
    """Return how many of the nodes the cells do not have; all where their shapes are unknown or they have others."""
    used = np.unique(np.concatenate([np.zeros(0, dtype=int), *(conn.ravel() for conn in cells.values())]))
    known = all(kind in CELLS and (CELLS[kind].reference or CELLS[kind].powers) for kind in cells)
    return int(np.sum(~np.isin(nodes, used))) if known and np.isin(used, nodes).all() else len(nodes)


def _outer_faces(mesh: Mesh, nodes: np.ndarray) -> dict[str, np.ndarray]:
    """Return the shells between the nodes, and the faces of volumes where no other follows."""
    skin = alone(_between(mesh, nodes, facets(of_dimension(mesh.cells, 3))))
    return distinct([*_between(mesh, nodes, of_dimension(mesh.cells, 2)), *skin.items()])


def _edges(mesh: Mesh, nodes: np.ndarray) -> dict[str, np.ndarray]:
    """Return the edges of shells between the nodes."""
    return distinct(_between(mesh, nodes, facets(of_dimension(mesh.cells, 2))))


def _between(mesh: Mesh, nodes: np.ndarray, cells: Facets) -> Facets:
    """Yield those of the cells that have no other nodes."""
    chosen = np.zeros(len(mesh.points), dtype=bool)
    chosen[nodes] = True
    for kind, conn in cells:
        own = conn[chosen[conn].all(axis=1)]
        if len(own):
            yield kind, own
