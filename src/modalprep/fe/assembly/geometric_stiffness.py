"""Geometric stiffness of a model, assembled for one prestress or projected on a basis for many."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from math import ceil
from typing import Protocol

import numpy as np
from scipy.sparse import csr_array

from modalprep.fe.assembly.link_stiffness import LinkStiffness
from modalprep.fe.assembly.sparse_kernels import products
from modalprep.fe.assembly.sparsity import Pattern, pairs_of
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.kernels import THREADS, ahead
from modalprep.fe.elements.solid import SolidBlock
from modalprep.linalg.blas import add_inner_alone

COLUMNS, WIDTH = 80, 26  # of the basis at a time, and of those in one dense product, which begins at the diagonal
ROWS = 192  # of the basis in a dense product, whose forces caches keep
FEW, MANY = 8, 48  # prestresses of a thread: products of fewer take longer, and caches do not keep those of more
BYTES = 6e8  # of the matrices of all threads
AT_ONCE = 200_000  # numbers of element matrices held in memory: 1.6 MB, which caches keep


class PrestressStiffness(Protocol):
    """The geometric stiffness of a model, of elements or given by the user."""

    def __call__(self, d: np.ndarray, load: np.ndarray) -> csr_array:
        """Return ``Kg (n_dof, n_dof)`` of the prestress due to displacement d under the nodal load (N)."""
        ...

    def project(self, static: np.ndarray, loads: np.ndarray, Phi: np.ndarray) -> np.ndarray:
        """Return ``Phi^T Kg Phi (k, n, n)`` of the prestress of each static response (n_dof, k) under its load."""
        ...


@dataclass(frozen=True, eq=False)
class GeometricStiffness:
    """Geometric stiffness of the elements, and of the rigid links that carry force.

    Attributes
    ----------
    blocks : list of Block
    pattern : Pattern
        Of every element.
    dof : (n_nodes, 6) int
    links : LinkStiffness
    """

    blocks: list[Block]
    pattern: Pattern
    dof: np.ndarray
    links: LinkStiffness

    def __call__(self, d: np.ndarray, load: np.ndarray) -> csr_array:
        """Return ``Kg (n_dof, n_dof)`` of the prestress due to displacement d under the nodal load (N)."""
        total = self.pattern.csr(over_dofs(self.blocks, self.pattern, self.dof, d[:, None])[:, 0])
        return (total + self.links(d, load)).tocsr()

    def energy(self, d: np.ndarray) -> float:
        """Return the strain energy (J) at finite displacements ``d (n_dof,)``, rotation vectors at the nodes.

        Dependent nodes follow their links finitely. `__call__` is its third derivative, less what the stress of the
        displacements themselves adds; see `body.verify.check_geometric_stiffness`.
        """
        d = self.links.constraints.with_dependent(d)
        own = ((block, d[self.dof[block.nodes, : block.components]]) for block in self.blocks)
        return float(sum(np.sum(block.energy(u.reshape(len(u), -1))) for block, u in own))

    def project(self, static: np.ndarray, loads: np.ndarray, Phi: np.ndarray) -> np.ndarray:
        """Return ``Phi^T Kg Phi (k, n, n)`` of the prestress of each static response (n_dof, k) under its load.

        Several prestresses at a time, whose matrices have the same pattern: their products with the basis read it
        once. Solids have one matrix over nodes for all three displacement components: a ninth of the full one.
        """
        out = np.zeros((loads.shape[1], Phi.shape[1], Phi.shape[1]))
        active = np.flatnonzero(np.any(loads, axis=0))
        if not len(active):
            return out
        solid = [block for block in self.blocks if isinstance(block, SolidBlock)]
        other = [block for block in self.blocks if not isinstance(block, SolidBlock)]
        if solid:
            run = partial(self._over_nodes, solid)
            for some, part in _shared(run, self.pattern.graph, self.dof[:, :3], static, active, Phi):
                out[some] += part
        if other:
            run = partial(over_dofs, other, self.pattern, self.dof)
            dofs = np.arange(len(Phi))[:, None]
            for some, part in _shared(run, self.pattern, dofs, static, active, Phi):
                out[some] += part
        if self.links.constraints.links:
            out[active] += self.links.project(static[:, active], loads[:, active], Phi)
        return out

    def _over_nodes(self, blocks: list[SolidBlock], d: np.ndarray) -> np.ndarray:
        """Return ``data (graph.nnz, k)`` over nodes of solids, for displacements ``d (n_dof, k)``."""
        data = np.zeros((self.pattern.graph.nnz, d.shape[1]))
        for block in blocks:
            ne, nn = block.nodes.shape
            step = max(1, int(AT_ONCE / (nn * nn * d.shape[1])))
            for piece in (block.piece(slice(k, k + step)) for k in range(0, ne, step)):
                values = piece.geometric_scalar(d[self.dof[piece.nodes, :3]])
                self.pattern.add_scalar(data, piece.nodes, pairs_of(self.pattern.graph, piece.nodes), values)
        return data


def over_dofs(blocks: list[Block], pattern: Pattern, dof: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Return the entries ``(nnz, k)`` on a pattern of the geometric stiffness of displacements ``d (n_dof, k)``."""
    data = np.array([pattern.zeros() for _ in range(d.shape[1])])
    for block in blocks:
        own = d[dof[block.nodes, : block.components]].reshape(len(block.nodes), -1, d.shape[1])
        pairs = pairs_of(pattern.graph, block.nodes)
        for k, values in enumerate(block.geometric_stiffnesses(own)):
            pattern.add(data[k : k + 1], block.nodes, pairs, values[:, None])
    return np.ascontiguousarray(data.T)


def _shared(matrices, pattern, dofs, static, active, Phi) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield numbers of prestresses and their ``Phi^T A_k Phi (k, n, n)``; threads share the prestresses.

    ``matrices(d)`` are the entries ``(nnz, k)`` on a pattern, each applied to every column of ``dofs (m, w)``.
    """
    most = min(MANY, max(1, int(BYTES / (8 * THREADS * len(pattern.indices)))))
    least = ceil(len(active) / most)
    even = THREADS * ceil(len(active) / (THREADS * most))
    groups = np.array_split(active, max(least, min(even, len(active) // FEW)))
    run = partial(_projected, pattern.indptr, pattern.indices, dofs=dofs, Phi=Phi)
    return zip(groups, ahead(lambda some: run(matrices(static[:, some])), groups), strict=True)


def _projected(indptr: np.ndarray, indices: np.ndarray, data: np.ndarray, dofs: np.ndarray, Phi: np.ndarray):
    """Return ``Phi^T A_k Phi (k, n, n)`` for ``data (nnz, k)``, by the calling thread alone."""
    n, k = Phi.shape[1], data.shape[1]
    out = np.empty((k, n, n))
    ends = np.linspace(0, n, ceil(n / COLUMNS) + 1).astype(int)
    for J in map(slice, ends[:-1], ends[1:]):
        for first, total in _lower(indptr, indices, data, dofs, Phi, J):
            part = total.reshape(len(total), -1, k).transpose(2, 0, 1)
            columns = slice(first, first + part.shape[2])
            out[:, first:, columns] = part
            out[:, columns, first:] = part.transpose(0, 2, 1)
            square = out[:, columns, columns]
            square[:] = (square + square.transpose(0, 2, 1)) / 2
    return out


def _lower(indptr, indices, data, dofs, Phi, J: slice) -> list[tuple[int, np.ndarray]]:
    """Return the columns J of ``Phi^T A_k Phi`` from the diagonal on: first columns, and ``(n', b k)`` of some.

    Rows of nodes that do not move are left out.
    """
    k = data.shape[1]
    w = dofs.shape[1]
    b = J.stop - J.start
    X = Phi[:, J][dofs].reshape(len(dofs), -1)
    moving = np.flatnonzero(np.any(np.any(Phi, axis=1)[dofs], axis=1))
    found = [(j, np.zeros((Phi.shape[1] - j, min(WIDTH, J.stop - j) * k))) for j in range(J.start, J.stop, WIDTH)]
    force = np.empty((max(1, ROWS // w), w * b, k))
    for start in range(0, len(moving), len(force)):
        rows = moving[start : start + len(force)]
        products(rows, indptr, indices, data, X, force)
        left = Phi[dofs[rows]].reshape(-1, Phi.shape[1])
        right = force[: len(rows)].reshape(-1, b * k)
        for j, total in found:
            place = (j - J.start) * k
            add_inner_alone(left[:, j:], right[:, place : place + total.shape[1]], total)
    return found
