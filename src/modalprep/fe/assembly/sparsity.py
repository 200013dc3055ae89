"""The sparsity pattern of a model: which nodes share an element, and where their DOFs are in the CSR arrays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from modalprep.fe.assembly.sparse_kernels import (
    column_numbers,
    diagonal,
    find_pairs,
    scatter,
    scatter_blocks,
    spread_scalar,
)
from modalprep.fe.elements.kernels import in_threads

NODES = 50_000  # at a time
LIGHT = 4096  # nodes of a thread, in loops that only copy numbers


@dataclass(frozen=True, eq=False)
class Pattern:
    """Common pattern of K, M and Kg: every pair of nodes that shares an element.

    Attributes
    ----------
    graph : (n_nodes, n_nodes) csr
        The pairs, sorted.
    column : (graph.nnz,) int
        Where the DOFs of a neighbour start within a row.
    row : (n_nodes, 6) int
        Where each row of a node starts in the data.
    indptr, indices : int
        CSR arrays of the DOF matrix.
    """

    graph: csr_array
    column: np.ndarray
    row: np.ndarray
    indptr: np.ndarray
    indices: np.ndarray

    @classmethod
    def build(cls, connectivity: Iterable[np.ndarray], dof: np.ndarray) -> Pattern:
        """Pattern of elements ``(ne, nn)`` with DOF numbers ``dof (n_nodes, 6)``: a node has the first 0, 3 or 6."""
        graph = node_graph(connectivity, len(dof))
        count = np.sum(dof >= 0, axis=1)
        width = count[graph.indices]
        before = np.cumsum(width) - width
        length = np.add.reduceat(np.append(width, 0), graph.indptr[:-1]) * (np.diff(graph.indptr) > 0)
        column = before - np.repeat(before[np.minimum(graph.indptr[:-1], len(before) - 1)], np.diff(graph.indptr))
        indptr = np.concatenate([[0], np.cumsum(np.repeat(length, count))])
        indptr = indptr.astype(np.int32 if indptr[-1] < 2**31 else np.int64)
        row = np.where(dof >= 0, indptr[dof], 0)
        indices = np.empty(indptr[-1], dtype=np.int32)
        in_threads(column_numbers, len(dof), dof, count, graph.indptr, graph.indices, column, row, indices, least=LIGHT)
        return cls(graph, column, row, indptr, indices)

    def zeros(self) -> np.ndarray:
        """Data of an empty matrix."""
        return np.zeros(len(self.indices))

    def add(self, data: np.ndarray, nodes: np.ndarray, pairs: np.ndarray, values: np.ndarray) -> None:
        """Add element matrices ``values (ne, k, nl, nl)`` of elements ``nodes (ne, nn)`` to ``data (k, nnz)``.

        ``pairs (ne, nn, nn)`` are those of `pairs_of`.
        """
        in_threads(scatter, _span(nodes), values, nodes, pairs, self.column, self.row, data)

    def add_scalar(self, data: np.ndarray, nodes: np.ndarray, pairs: np.ndarray, values: np.ndarray) -> None:
        """Add ``values (ne, nn, nn, k)`` to ``data (graph.nnz, k)`` of k matrices whose rows are nodes."""
        in_threads(scatter_blocks, _span(nodes), values[:, :, None], nodes, pairs, data[:, None])

    @property
    def place(self) -> tuple[np.ndarray, ...]:
        """Arrays of the compiled loops that look for pairs of nodes themselves."""
        return self.graph.indptr, self.graph.indices, self.column, self.row

    def spread(self, data: np.ndarray, scalar: np.ndarray) -> None:
        """Add a matrix over nodes, ``scalar (graph.nnz,)``, to each of the three displacement components."""
        in_threads(spread_scalar, len(self.row), scalar, self.graph.indptr, self.column, self.row, data, least=LIGHT)

    def csr(self, data: np.ndarray) -> csr_array:
        """Return the matrix; its arrays are shared."""
        n = len(self.indptr) - 1
        matrix = csr_array((n, n))
        matrix.data, matrix.indices, matrix.indptr = data, self.indices, self.indptr  # its constructor copies views
        matrix.has_canonical_format = True
        return matrix


def pairs_of(graph: csr_array, nodes: np.ndarray) -> np.ndarray:
    """Return where a graph has the pairs of nodes of elements ``nodes (ne, nn)``, ``(ne, nn, nn)``.

    Examples
    --------
    >>> nodes = np.array([[0, 2]])
    >>> pairs_of(node_graph([nodes], 3), nodes)
    array([[[0, 1],
            [2, 3]]])
    """
    pairs = np.empty((*nodes.shape, nodes.shape[1]), dtype=np.int64)
    in_threads(find_pairs, len(nodes), nodes, graph.indptr, graph.indices, pairs)
    return pairs


def _span(nodes: np.ndarray) -> range:
    return range(int(nodes.min()), int(nodes.max()) + 1)


def node_graph(connectivity: Iterable[np.ndarray], n_nodes: int) -> csr_array:
    """Return which nodes share an element, sorted CSR.

    Examples
    --------
    >>> node_graph([np.array([[0, 2]])], 3).toarray().astype(int)
    array([[1, 0, 1], [0, 0, 0], [1, 0, 1]])
    """
    total = None
    for conn in connectivity:
        ends = np.arange(0, conn.size + 1, conn.shape[1])
        incidence = csr_array((np.ones(conn.size, dtype=np.int32), conn.ravel(), ends), shape=(len(conn), n_nodes))
        pairs = incidence.T.tocsr() @ incidence
        total = pairs if total is None else (total + pairs).tocsr()
    if total is None:
        return csr_array((n_nodes, n_nodes), dtype=np.int32)
    total.sort_indices()
    return total


def by_components(graph: csr_array, scalar: np.ndarray, dof: np.ndarray, n: int) -> csr_array:
    """Return the matrix (n, n) that has ``scalar (graph.nnz,)`` between equal displacement components of nodes.

    It has a third of the entries of `Pattern`.

    Examples
    --------
    >>> graph = node_graph([np.array([[0, 1]])], 2)
    >>> dof = np.arange(6).reshape(2, 3)
    >>> by_components(graph, np.array([2.0, 1.0, 1.0, 2.0]), dof, 6).toarray()[0]
    array([2., 0., 0., 1., 0., 0.])
    """
    count = np.diff(graph.indptr)
    used = np.flatnonzero(count)
    length = np.zeros(n, dtype=np.int64)
    length[dof[used, :3]] = count[used, None]
    indptr = np.concatenate([[0], np.cumsum(length)])
    indices, data = np.empty(indptr[-1], dtype=np.int32), np.empty(indptr[-1])
    for nodes in (used[k : k + NODES] for k in range(0, len(used), NODES)):
        own = slice(graph.indptr[nodes[0]], graph.indptr[nodes[-1] + 1])
        within = np.arange(own.start, own.stop) - np.repeat(graph.indptr[nodes], count[nodes])
        for component in range(3):
            place = within + np.repeat(indptr[dof[nodes, component]], count[nodes])
            indices[place] = dof[graph.indices[own], component]
            data[place] = scalar[own]
    matrix = csr_array((data, indices, indptr.astype(np.int32 if indptr[-1] < 2**31 else np.int64)), shape=(n, n))
    matrix.eliminate_zeros()
    return matrix


def diagonal_of(matrix: csr_array) -> np.ndarray:
    """Return the diagonal (n,) of a square matrix; scipy's takes every entry of it.

    Examples
    --------
    >>> diagonal_of(csr_array(np.array([[2.0, 1.0], [0.0, 3.0]])))
    array([2., 3.])
    """
    if not matrix.has_sorted_indices:
        return matrix.diagonal()
    out = np.zeros(matrix.shape[0])
    in_threads(diagonal, len(out), matrix.indptr, matrix.indices, matrix.data, out, least=LIGHT)
    return out
