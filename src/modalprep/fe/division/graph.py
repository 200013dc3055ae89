"""Distances along a mesh, and which of its elements touch."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel

LINKED = 1e-12  # coefficients of a dependent DOF, of the largest


def node_positions(model: FEModel) -> np.ndarray:
    """Return the places (n_nodes, 3) of the rows of ``model.dof``: mesh nodes, then the frames of interfaces, m."""
    frames = [frame.position for frame in model.interfaces if len(frame.nodes)]
    return np.concatenate([model.points, np.reshape(frames, (-1, 3))])


def element_nodes(model: FEModel) -> list[np.ndarray]:
    """Return the nodes (ne, nn) of each block of elements.

    Raises
    ------
    InputError
        When the elements are not known.
    """
    if model.groups is None:
        raise InputError("large_deflection needs the elements of the mesh, and this model has matrices alone")
    return [inertia.nodes for inertia in model.groups.inertias]


def linked_nodes(model: FEModel, *, root: bool) -> np.ndarray:
    """Return pairs of nodes (k, 2) of which one follows the other by a rigid link or an equation.

    `root` also gives those that follow the frame of the root.
    """
    owner = np.zeros(model.n_dof, dtype=int)
    nodes, places = np.nonzero(model.dof >= 0)
    owner[model.dof[nodes, places]] = nodes
    C = model.C.tocoo()
    some = np.abs(C.data) > LINKED * np.abs(C.data).max(initial=0.0)
    pairs = np.stack([owner[C.row[some]], owner[model.free[C.col[some]]]], axis=1)
    pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    if root:
        return pairs
    return pairs[~np.any(pairs == owner[model.interfaces[0].dofs[0]], axis=1)]


def distances(model: FEModel) -> np.ndarray:
    """Return the distance (n_nodes,) of each node from the root along the elements, m; infinite where none leads."""
    at = node_positions(model)
    pairs = [linked_nodes(model, root=True)]
    for nodes in element_nodes(model):
        pairs += [nodes[:, [i, j]] for i, j in combinations(range(nodes.shape[1]), 2)]
    edges = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
    length = np.linalg.norm(at[edges[:, 0]] - at[edges[:, 1]], axis=1)
    length = np.maximum(length, 1e-12 * length.max(initial=1.0))  # an edge of length zero is none to a sparse graph
    graph = coo_array((length, (edges[:, 0], edges[:, 1])), shape=(len(at), len(at))).tocsr()
    return dijkstra(graph, directed=False, indices=_root_nodes(model), min_only=True)


def _root_nodes(model: FEModel) -> np.ndarray:
    root = model.interfaces[0]
    own = np.flatnonzero(model.dof[:, 0] == root.dofs[0])
    return np.concatenate([own, root.nodes])


def touching(model: FEModel) -> csr_array:
    """Return which elements (n, n) share a node, or have nodes that a link joins; the root's frame joins none."""
    blocks = element_nodes(model)
    rows, columns, start = [], [], 0
    for nodes in blocks:
        rows.append(np.repeat(np.arange(start, start + len(nodes)), nodes.shape[1]))
        columns.append(nodes.ravel())
        start += len(nodes)
    row, column = np.concatenate(rows), np.concatenate(columns)
    n = len(model.dof)
    E = coo_array((np.ones(len(row)), (row, column)), shape=(start, n)).tocsr()
    links = linked_nodes(model, root=False)
    L = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(n, n)).tocsr()
    return (E @ E.T + E @ (L + L.T) @ E.T).tocsr()
