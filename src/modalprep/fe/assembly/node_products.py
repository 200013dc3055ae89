"""Mass of elements whose nodes move it by ``N u + R t``: products of these functions instead of six mass matrices."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import bsr_array, coo_array, csr_array

from modalprep.fe.assembly.sparse_kernels import add_functions, scatter_blocks
from modalprep.fe.assembly.sparsity import Pattern, pairs_of
from modalprep.fe.elements.kernels import in_threads

ROWS = 1024  # nodes at a time
COUNT, N = 10, 9  # functions of a node: R (3, 3) by rows, then N


class NodeProducts:
    """Integrals of rho times two functions of `mass.NodalFunctions`, of all pairs of nodes that share an element.

    A hundred numbers for a pair of nodes, where six matrices ``M_ab`` have 216.

    Parameters
    ----------
    graph : (n_nodes, n_nodes) csr
        The pairs, sorted.
    dof : (n_nodes, 6) int
    """

    def __init__(self, graph: csr_array, dof: np.ndarray) -> None:
        self.graph, self.dof = graph, dof
        self.data = np.zeros((graph.nnz, COUNT, COUNT))

    def add(self, nodes: np.ndarray, values: np.ndarray) -> None:
        """Add the products ``values (ne, 10 nn, 10 nn)`` of elements ``nodes (ne, nn)``."""
        span = range(int(nodes.min()), int(nodes.max()) + 1)
        blocks = values.reshape(*nodes.shape, COUNT, -1, COUNT)
        in_threads(scatter_blocks, span, blocks, nodes, pairs_of(self.graph, nodes), self.data)

    def add_mass(self, pattern: Pattern, M: np.ndarray) -> None:
        """Add the mass matrix to the data of a pattern that contains the graph."""
        graph = self.graph
        in_threads(add_functions, graph.shape[0], graph.indptr, graph.indices, self.data, pattern.place, M)

    def matrix(self, a: int, b: int, n: int) -> csr_array:
        """Return ``M_ab (n, n)`` over the DOFs."""
        left, right = (self._pick(c, n) for c in (a, b))
        m = self.graph.shape[0]
        values = self.data[:, _rows(a)][:, :, _rows(b)]
        products = bsr_array((values, self.graph.indices, self.graph.indptr), shape=(4 * m, 4 * m))
        return (left.T @ products @ right).tocsr()

    def project(self, Phi: np.ndarray, columns: list[slice]) -> np.ndarray:
        """Return ``P (3, 3, n, n)``, ``P[a, b] = Phi^T M_ab Phi`` for a <= b, some columns of Phi at a time."""
        P = np.zeros((3, 3, Phi.shape[1], Phi.shape[1]))
        for J in columns:
            for b in range(3):
                X = self._functions(slice(None), b, Phi[:, J])
                for some, matrix in self._of_rows(b):
                    force = (matrix @ X).reshape(-1, 3 * b + 4, X.shape[1])
                    for a in range(b + 1):
                        own = np.concatenate([force[:, 3 * a : 3 * a + 3], force[:, -1:]], axis=1)
                        P[a, b][:, J] += self._functions(some, a, Phi).T @ own.reshape(-1, X.shape[1])
        return P

    def _of_rows(self, b: int) -> Iterator[tuple[slice, bsr_array]]:
        """Yield the products of the functions of displacements a <= b of some nodes with those of b of all."""
        indptr = self.graph.indptr
        m = self.graph.shape[0]
        rows = np.append(np.arange(3 * b + 3), N)
        for some in (slice(k, min(k + ROWS, m)) for k in range(0, m, ROWS)):
            held = slice(indptr[some.start], indptr[some.stop])
            values = self.data[held, rows[:, None], _rows(b)]
            place = self.graph.indices[held], indptr[some.start : some.stop + 1] - held.start
            shape = (some.stop - some.start) * len(rows), 4 * m
            yield some, bsr_array((values, *place), shape=shape)

    def _functions(self, nodes: slice, b: int, Phi: np.ndarray) -> np.ndarray:
        """Rotations and displacement b ``(4 k, n)`` of some nodes, what the functions `_rows` of b multiply."""
        dofs = self.dof[nodes][:, [3, 4, 5, b]]  # a node without rotations (-1) has no entries in the graph
        return Phi[dofs.ravel()]

    def _pick(self, b: int, n: int) -> csr_array:
        dofs = self.dof[:, [3, 4, 5, b]].ravel()
        held = np.flatnonzero(dofs >= 0)
        return coo_array((np.ones(len(held)), (held, dofs[held])), shape=(len(dofs), n)).tocsr()


def _rows(b: int) -> np.ndarray:
    return np.array([3 * b, 3 * b + 1, 3 * b + 2, N])
