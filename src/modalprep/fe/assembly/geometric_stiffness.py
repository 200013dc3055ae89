"""Geometric stiffness of a model, assembled for one prestress or projected on a basis for many."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.sparse import coo_array, csr_array

from modalprep.fe.assembly.sparse_kernels import products
from modalprep.fe.assembly.sparsity import Pattern
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.corotation import Corotational
from modalprep.fe.elements.kernels import ahead
from modalprep.fe.elements.solid import SolidBlock
from modalprep.fe.links.constraints import Constraints
from modalprep.linalg.blas import add_inner_alone

COLUMNS, ROWS = 32, 512  # of the basis and of the matrices at a time
CACHED = 64  # rows whose forces caches keep
BYTES = 3e8  # of the matrices of a batch of prestresses
AT_ONCE = 500_000  # numbers of element matrices held in memory: 4 MB, which caches keep


@dataclass(frozen=True, eq=False)
class GeometricStiffness:
    """Geometric stiffness of the elements, and of the rigid links that carry force."""

    blocks: list[Block]
    pattern: Pattern | None  # None without blocks
    K: csr_array
    dof: np.ndarray
    constraints: Constraints

    def __call__(self, d: np.ndarray, load: np.ndarray) -> csr_array:
        """Return ``Kg (n_dof, n_dof)`` of the prestress due to displacement d under the nodal load (N)."""
        total = self.pattern.csr(self._over_dofs(self.blocks, d[:, None])[:, 0])
        return (total + self.of_links(self.K @ d - load)).tocsr()

    def energy(self, d: np.ndarray) -> float:
        """Return the strain energy (J) at finite displacements ``d (n_dof,)``, rotation vectors at the nodes.

        Dependent nodes follow their links finitely. `__call__` is its third derivative, less what the stress of the
        displacements themselves adds; see `body.verify.check_geometric_stiffness`.
        """
        d = self.constraints.followed(d)
        own = ((block, d[self.dof[block.nodes, : block.components]]) for block in self.blocks)
        return float(sum(np.sum(block.energy(u.reshape(len(u), -1))) for block, u in own))

    def project(self, static: np.ndarray, loads: np.ndarray, Phi: np.ndarray) -> np.ndarray:
        """Return ``Phi^T Kg Phi (k, n, n)`` of the prestress of each static response (n_dof, k) under its load.

        Several prestresses at a time, whose matrices have the same pattern: their products with the basis read it
        once. Solids have one matrix over nodes for all three displacement components: a ninth of the full one.
        """
        out = np.zeros((loads.shape[1], Phi.shape[1], Phi.shape[1]))
        active = np.flatnonzero(np.any(loads, axis=0))
        solid = [block for block in self.blocks if hasattr(block, "geometric_scalar")]
        other = [block for block in self.blocks if not hasattr(block, "geometric_scalar")]
        graph, reused = self.pattern.graph, np.zeros(0)
        for some in _batches(active, graph.nnz) if solid else ():
            data = reused = self._over_nodes(solid, static[:, some], reused)
            out[some] += _projected(graph.indptr, graph.indices, data, self.dof[:, :3], Phi)
        for some in _batches(active, len(self.pattern.indices)) if other else ():
            data = self._over_dofs(other, static[:, some])
            rows = np.arange(len(Phi))[:, None]
            out[some] += _projected(self.pattern.indptr, self.pattern.indices, data, rows, Phi)
        if self.constraints.links:
            out[active] += self._projected_links(static[:, active], loads[:, active], Phi)
        return np.tril(out) + np.tril(out, -1).transpose(0, 2, 1)

    def _over_nodes(self, blocks: list[SolidBlock], d: np.ndarray, reused: np.ndarray) -> np.ndarray:
        """Return ``data (graph.nnz, k)`` over nodes of solids, for displacements ``d (n_dof, k)``.

        It takes the memory of an array that is no longer needed, where that suffices.
        """
        shape = self.pattern.graph.nnz, d.shape[1]
        data = (reused if reused.size >= np.prod(shape) else np.empty(shape)).ravel()[: np.prod(shape)].reshape(shape)
        data[:] = 0.0
        for block in blocks:
            ne, nn = block.nodes.shape
            step = max(1, int(AT_ONCE / (nn * nn * d.shape[1])))
            for piece in (block.piece(slice(k, k + step)) for k in range(0, ne, step)):
                self.pattern.add_scalar(data, piece.nodes, piece.geometric_scalar(d[self.dof[piece.nodes, :3]]))
        return data

    def _over_dofs(self, blocks: list[Block], d: np.ndarray) -> np.ndarray:
        """Return the data ``(nnz, k)`` over DOFs of any blocks, for the displacements ``d (n_dof, k)``."""
        data = np.array([self.pattern.zeros() for _ in range(d.shape[1])])
        for block in blocks:
            own = d[self.dof[block.nodes, : block.components]].reshape(len(block.nodes), -1, d.shape[1])
            for k, values in enumerate(_stiffnesses(block, own)):
                self.pattern.add(data[k : k + 1], block.nodes, values[:, None])
        return np.ascontiguousarray(data.T)

    def _projected_links(self, static: np.ndarray, loads: np.ndarray, Phi: np.ndarray) -> np.ndarray:
        """Return ``Phi^T Kg Phi (k, n, n)`` of the links, of each static response (n_dof, k) under its load."""
        links, step = self.constraints.links, self.constraints.step
        rows = np.concatenate([np.flatnonzero(np.diff(step.indptr)), *(np.append(x.dofs, x.frame) for x in links)])
        rows, held = np.unique(rows[rows >= 0]), np.zeros_like(loads)
        held[rows] = self.K[rows] @ static - loads[rows]
        total, out = self.constraints.transferred(held), np.zeros((held.shape[1], Phi.shape[1], Phi.shape[1]))
        for link in self.constraints.links:
            turn = Phi[link.frame[3:]]
            for k, form in enumerate(out):
                K, between, others = link.geometric_stiffness(total[:, k])
                half = turn.T @ (K @ turn / 2 + between @ Phi[others])
                form += half + half.T
        return out

    def of_links(self, held: np.ndarray) -> csr_array:
        """Return the part of the links, ``(n_dof, n_dof)``; `held (n_dof,)` is the force they exert on each DOF."""
        n = self.K.shape[0]
        total = self.constraints.transferred(held)
        rows, cols, values = [], [], []
        for link in self.constraints.links:
            K, between, others = link.geometric_stiffness(total)
            turn = link.frame[3:]
            first = np.concatenate([np.repeat(turn, 3), np.repeat(turn, len(others))])
            second = np.concatenate([np.tile(turn, 3), np.tile(others, 3)])
            rows += [first, second[9:]]
            cols += [second, first[9:]]
            values += [K.ravel(), between.ravel(), between.ravel()]
        if not rows:
            return csr_array((n, n))
        return coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(cols))), shape=(n, n)).tocsr()


def _stiffnesses(block: Block, d: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the geometric stiffness of each of the displacements ``d (ne, nl, k)``, nothing where there is none."""
    if isinstance(block, Corotational) and block.components == 6:
        yield from block.geometric_stiffnesses(d)
        return
    for k in range(d.shape[2]):
        values = block.geometric_stiffness(d[..., k])
        if values is None:
            return
        yield values


def _batches(active: np.ndarray, entries: int) -> Iterator[np.ndarray]:
    size = max(1, int(BYTES / (8 * entries)))
    return (active[k : k + size] for k in range(0, len(active), size))


def _projected(indptr: np.ndarray, indices: np.ndarray, data: np.ndarray, dofs: np.ndarray, Phi: np.ndarray):
    """Return the lower triangles ``(k, n, n)`` of ``Phi^T A_k Phi``, in blocks of columns and rows.

    ``data (nnz, k)`` of matrices of one pattern, each applied to every column of ``dofs (m, w)``, the rows of Phi.
    """
    n, k = Phi.shape[1], data.shape[1]
    out = np.zeros((k, n, n))
    for J in (slice(j, min(j + COLUMNS, n)) for j in range(0, n, COLUMNS)):
        share = partial(_share, indptr, indices, data, Phi[:, J][dofs.T], dofs, Phi[:, J.start :])
        for part in ahead(share, range(0, len(dofs), ROWS)):
            out[:, J.start :, J] += part.transpose(1, 0, 2)
    return out


def _share(indptr, indices, data, X, dofs, Phi, first: int) -> np.ndarray:
    """Return what `ROWS` rows from `first` on add to ``Phi^T A_k X (n, k, b)``, by the calling thread alone."""
    k, (w, m, b) = data.shape[1], X.shape
    total, force = np.zeros((Phi.shape[1], k * b)), np.empty((CACHED, w, k, b))
    end = min(first + ROWS, m)
    for start in range(first, end, CACHED):
        rows = slice(start, min(start + CACHED, end))
        left = Phi[dofs[rows]]
        products(start, rows.stop, indptr, indices, data, X, force)
        add_inner_alone(left.reshape(-1, left.shape[2]), force[: len(left)].reshape(-1, k * b), total)
    return total.reshape(-1, k, b)
