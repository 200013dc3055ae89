"""Sums over the elements: K, M, the twelve linear vectors, the mass tensor and the rigid inertia."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from modalprep.fe.assembly.node_products import NodeProducts
from modalprep.fe.assembly.sparse_kernels import scatter_rows
from modalprep.fe.assembly.sparsity import Pattern, by_components, pairs_of
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.mass import PAIRS, MassObjects, RigidInertia
from modalprep.linalg.blas import inner
from modalprep.linalg.sparse import times

ROWS = 2048  # of the basis at a time
BLOCK = 16  # columns of a basis at a time: products with a sparse matrix are as quick as with all


def column_blocks(n: int) -> list[slice]:
    """Return slices of `BLOCK` columns that cover n.

    Examples
    --------
    >>> column_blocks(20)
    [slice(0, 16, None), slice(16, 32, None)]
    """
    return [slice(j, j + BLOCK) for j in range(0, n, BLOCK)]


class MassTensor:
    """``M_ab = int rho N_a^T N_b`` of theory 1.

    Solids have the same shapes for every component, so that one matrix over nodes serves all nine; shells add
    products of functions of the nodes, and beams six matrices over DOFs.

    Parameters
    ----------
    dof : (n_nodes, 6) int
    scalar : (n_nodes, n_nodes) csr or None
    functions : NodeProducts or None
    pairs : {(a, b): (n_dof, n_dof) csr}, a <= b
    n : int
        Number of DOFs.
    exact : bool
        False where the displacement field was not known (matrix_mass.py).
    """

    def __init__(
        self,
        dof: np.ndarray,
        scalar: csr_array | None,
        functions: NodeProducts | None,
        pairs: dict[tuple[int, int], csr_array],
        n: int,
        exact: bool = True,
    ) -> None:
        self._dof = dof
        self._scalar = scalar
        self._functions = functions
        self._pairs = pairs
        self._n, self.exact = n, exact

    def __getitem__(self, pair: tuple[int, int]) -> csr_array:
        """Return ``M_ab (n_dof, n_dof)``, kg, kg m and kg m^2."""
        a, b = pair
        if a > b:
            return self[b, a].T.tocsr()
        total = self._pairs.get(pair, csr_array((self._n, self._n)))
        if self._functions is not None:
            total = total + self._functions.matrix(a, b, self._n)
        if self._scalar is None:
            return total
        pick = [self._translation(c) for c in pair]
        return (total + pick[0].T @ self._scalar @ pick[1]).tocsr()

    def with_pairs(self, pairs: dict[tuple[int, int], csr_array]) -> MassTensor:
        """Return the tensor with matrices ``{(a, b): (n_dof, n_dof)}``, a <= b, added."""
        total = {pair: self._pairs[pair] + own if pair in self._pairs else own for pair, own in pairs.items()}
        return MassTensor(self._dof, self._scalar, self._functions, total, self._n, self.exact)

    def __add__(self, other: MassTensor) -> MassTensor:
        """Return the sum with a tensor that has matrices over pairs alone."""
        total = self.with_pairs(other._pairs)
        total.exact = self.exact and other.exact
        return total

    def project(self, Phi: np.ndarray) -> np.ndarray:
        """Return ``P (3, 3, n, n)``, ``P[a, b] = Phi^T M_ab Phi``; allocates a third of ``Phi (n_dof, n)``."""
        n = Phi.shape[1]
        P = np.zeros((3, 3, n, n))
        if self._functions is not None:
            P += self._functions.project(Phi, column_blocks(n))
        for (a, b), matrix in self._pairs.items():
            for J in column_blocks(n):
                P[a, b][:, J] += Phi.T @ (matrix @ np.ascontiguousarray(Phi[:, J]))
        if self._scalar is not None:
            for b in range(3):
                u = Phi[self._dof[:, b]]  # a node without DOFs (-1) has no entries in the matrix
                for rows in (slice(r, r + ROWS) for r in range(0, len(u), ROWS)):
                    force = times(self._scalar[rows], u)
                    for a in range(b + 1):
                        P[a, b] += inner(Phi[self._dof[rows, a]], force)
        for a, b in PAIRS:
            P[b, a] = P[a, b].T
        return P

    def _translation(self, component: int) -> csr_array:
        """Matrix (n_nodes, n_dof) that picks one displacement component of every node."""
        nodes = np.flatnonzero(self._dof[:, component] >= 0)
        place = (nodes, self._dof[nodes, component])
        return csr_array((np.ones(len(nodes)), place), shape=(len(self._dof), self._n))


class Totals:
    """Sums over blocks of elements.

    Parameters
    ----------
    pattern : Pattern
        Of every element.
    graph : (n_nodes, n_nodes) csr or None
        Pairs of nodes of the elements whose mass tensor has the form "functions" of `MassObjects`; None without any.
    thin : Pattern or None
        Of those with the form "pairs".
    dof : (n_nodes, 6) int
    """

    def __init__(self, pattern: Pattern, graph: csr_array | None, thin: Pattern | None, dof: np.ndarray) -> None:
        self.pattern, self.thin, self.dof = pattern, thin, dof
        self.n = len(pattern.indptr) - 1
        self.K = pattern.zeros()
        self.g, self.h = np.zeros((self.n, 3)), np.zeros((self.n, 9))
        self.rigid = RigidInertia(0.0, np.zeros(3), np.zeros((3, 3)))
        self.scalar: np.ndarray | None = None
        self.functions = None if graph is None else NodeProducts(graph, dof)
        self.pairs = np.zeros((len(PAIRS), len(thin.indices) if thin else 0))

    @cached_property
    def M(self) -> np.ndarray:
        """Entries of the mass matrix in the pattern of K; masses of the form "scalar" alone go without."""
        return self.pattern.zeros()

    def add(self, block: Block, pairs: np.ndarray, stiffness: np.ndarray | None, mass: MassObjects | None) -> None:
        """Add one block's stiffness and mass; ``pairs (ne, nn, nn)`` of its nodes, in the graph of `pattern`."""
        if stiffness is not None:
            self.pattern.add(self.K[None], block.nodes, pairs, stiffness[:, None])
        if mass is None:
            return
        self.rigid += mass.rigid
        self._add_linear(block, mass)
        if mass.form == "scalar":
            self.scalar = np.zeros(self.pattern.graph.nnz) if self.scalar is None else self.scalar
            self.pattern.add_scalar(self.scalar[:, None], block.nodes, pairs, mass.tensor[..., None])
        elif mass.form == "functions":
            assert self.functions is not None  # the parts of this form are in its graph
            self.functions.add(block.nodes, mass.tensor)
        else:
            assert self.thin is not None  # the parts of this form are in its pattern
            self.pattern.add(self.M[None], block.nodes, pairs, mass.matrix()[:, None])
            self.thin.add(self.pairs, block.nodes, pairs_of(self.thin.graph, block.nodes), mass.tensor)

    def _add_linear(self, block: Block, mass: MassObjects) -> None:
        dofs = self.dof[block.nodes, : block.components].ravel()
        scatter_rows(dofs, mass.g.reshape(len(dofs), 3), self.g)
        scatter_rows(dofs, mass.h.reshape(len(dofs), 9), self.h)

    def stiffness(self) -> csr_array:
        """Return K of all elements."""
        return self.pattern.csr(self.K)

    def mass(self) -> csr_array:
        """Return M of all elements; once, as it is summed up in place."""
        if self.scalar is not None and self.functions is None and self.thin is None:
            return by_components(self.pattern.graph, self.scalar, self.dof, self.n)
        if self.scalar is not None:
            self.pattern.spread(self.M, self.scalar)
        if self.functions is not None:
            self.functions.add_mass(self.pattern, self.M)
        return self.pattern.csr(self.M)

    def tensor(self) -> MassTensor:
        """Return the mass tensor."""
        scalar = None
        if self.scalar is not None:
            graph = self.pattern.graph
            scalar = csr_array((self.scalar, graph.indices, graph.indptr), shape=graph.shape)
        pairs = dict(zip(PAIRS, map(self.thin.csr, self.pairs), strict=True)) if self.thin else {}
        return MassTensor(self.dof, scalar, self.functions, pairs, self.n)
