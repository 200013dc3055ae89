"""The assembled finite-element model: FORMULATION section 1."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array, csr_array

from modalprep.fe.block import Block, RigidInertia
from modalprep.fe.interface import InterfaceFrame
from modalprep.fe.links import PlacedLink, transferred
from modalprep.fe.pattern import Pattern
from modalprep.fe.totals import MassTensor
from modalprep.records import Record
from modalprep.vectors import skew


@dataclass(frozen=True, eq=False, kw_only=True)
class FEModel(Record):
    """The assembled model, in a frame with the root interface at its origin and the axes of the mesh.

    The DOFs are those of the mesh nodes, then six for each RBE2 frame. `C` expresses them by the independent
    ones (a rigid link's nodes follow its frame), so ``C.T @ K @ C`` is the stiffness that is solved.

    Attributes
    ----------
    points : (n_points, 3)
        Mesh nodes, m.
    cells : {type: (k, nodes)}
        The structural cells.
    dof : (n_nodes, 6) int
        Number of each DOF (ux, uy, uz, rx, ry, rz), -1 where a node has none; mesh nodes, then RBE2 frames.
    K, M : (n_dof, n_dof) csr
        N/m, kg and their rotational kin.
    g : (n_dof, 3)
        ``int rho N_a``.
    h : (n_dof, 3, 3)
        ``h[:, a, b] = int rho x_b N_a``.
    M_ab : MassTensor
        ``M_ab[a, b] (n_dof, n_dof)`` is ``int rho N_a^T N_b``.
    rigid : RigidInertia
        m, s0, E0 about the origin.
    C : (n_dof, n_free) csr
    free : (n_free,) int
        The independent DOFs.
    interfaces : tuple of InterfaceFrame
        The root first.
    geometric_stiffness : GeometricStiffness
        ``(d, load) -> (n_dof, n_dof) csr``: the stiffness of the prestress that displacement ``d (n_dof,)`` means,
        with ``load (n_dof,)`` the nodal load that holds it.
    origin : (3,)
        The root interface in mesh coordinates, m.
    source : dict of str
        Name and hash of the mesh.
    notes : tuple of str
        What the user should know: cells left out, hidden hinges.
    """

    points: np.ndarray
    cells: dict[str, np.ndarray]
    dof: np.ndarray
    K: csr_array
    M: csr_array
    g: np.ndarray
    h: np.ndarray
    M_ab: MassTensor
    rigid: RigidInertia
    C: csr_array
    free: np.ndarray
    interfaces: tuple[InterfaceFrame, ...]
    geometric_stiffness: GeometricStiffness
    origin: np.ndarray
    source: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def n_dof(self) -> int:
        """Number of DOFs, dependent ones included."""
        return self.K.shape[0]

    @property
    def inertia_loads(self) -> np.ndarray:
        """(n_dof, 12) loads of unit ``A_a`` (3), then unit ``W_ab`` (9, row by row): ``-g_a``, ``-h_ab``."""
        return -np.concatenate([self.g, self.h.reshape(-1, 9)], axis=1)

    def rigid_body(self) -> np.ndarray:
        """(n_dof, 6) displacements of unit translations and unit rotations about the origin."""
        nodes = np.concatenate([self.points, [f.position for f in self.interfaces if len(f.nodes)]]) \
            if any(len(f.nodes) for f in self.interfaces) else self.points  # fmt: skip
        full = np.zeros((len(nodes), 6, 6))
        full[:, :, :] = np.eye(6)
        full[:, :3, 3:] = -skew(nodes)
        R = np.zeros((self.n_dof, 6))
        present = self.dof >= 0
        R[self.dof[present]] = full[present]
        return R

    def __repr__(self) -> str:
        """Size, mass and interfaces."""
        names = ", ".join(f.name for f in self.interfaces)
        return f"FEModel({len(self.points)} nodes, {self.n_dof} DOFs, m={self.rigid.m:.6g} kg; interfaces {names})"


@dataclass(frozen=True, eq=False)
class GeometricStiffness:
    """``Kg(sigma)`` of every element, and of the rigid links that carry force (links.py)."""

    blocks: list[Block]
    pattern: Pattern
    K: csr_array
    dof: np.ndarray
    links: list[PlacedLink]
    step: csr_array

    def __call__(self, d: np.ndarray, load: np.ndarray) -> csr_array:
        """Return ``Kg (n_dof, n_dof)`` of the prestress that displacement d means under the nodal load (N)."""
        data = self.pattern.zeros()
        for block in self.blocks:
            own = d[self.dof[block.nodes, : block.components]].reshape(len(block.nodes), -1)
            values = block.geometric_stiffness(own)
            if values is not None:
                self.pattern.add(data, block.nodes, values)
        return (self.pattern.csr(data) + self._links(self.K @ d - load)).tocsr()

    def project(self, static: np.ndarray, loads: np.ndarray, Phi: np.ndarray) -> np.ndarray:
        """Return ``Phi^T Kg Phi (k, n, n)`` of the prestress of each static answer (n_dof, k) under its load.

        Solids have one matrix over nodes for all three displacement components: a ninth of the full one.
        """
        u = [np.where(self.dof[:, c : c + 1] >= 0, Phi[self.dof[:, c]], 0.0) for c in range(3)]
        out = np.zeros((loads.shape[1], Phi.shape[1], Phi.shape[1]))
        for k in np.flatnonzero(np.any(loads, axis=0)):
            scalar, rest = self._sum(static[:, k])
            Kg = sum(x.T @ (scalar @ x) for x in u) if scalar is not None else 0.0
            other = self._links(self.K @ static[:, k] - loads[:, k])
            other = other if rest is None else other + self.pattern.csr(rest)
            Kg = Kg + Phi.T @ (other @ Phi)
            out[k] = (Kg + Kg.T) / 2
        return out

    def _sum(self, d: np.ndarray) -> tuple[csr_array | None, np.ndarray | None]:
        """Matrix over nodes of the solids, and data over DOFs of every other element."""
        scalar = rest = None
        for block in self.blocks:
            own = d[self.dof[block.nodes, : block.components]].reshape(len(block.nodes), -1)
            if hasattr(block, "geometric_scalar"):
                scalar = np.zeros(self.pattern.graph.nnz) if scalar is None else scalar
                self.pattern.add_scalar(scalar, block.nodes, block.geometric_scalar(own))
                continue
            values = block.geometric_stiffness(own)
            if values is not None:
                rest = self.pattern.zeros() if rest is None else rest
                self.pattern.add(rest, block.nodes, values)
        graph = self.pattern.graph
        return None if scalar is None else csr_array((scalar, graph.indices, graph.indptr), shape=graph.shape), rest

    def _links(self, held: np.ndarray) -> csr_array:
        """`held (n_dof,)`: the force that links exert on each DOF."""
        n = self.K.shape[0]
        total = transferred(self.step, held)
        rows, cols, values = [], [], []
        for link in self.links:
            turn = link.frame[3:]
            rows.append(np.repeat(turn, 3))
            cols.append(np.tile(turn, 3))
            values.append(link.geometric_stiffness(_link_force(link, held, total)).ravel())
        if not rows:
            return csr_array((n, n))
        return coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(cols))), shape=(n, n)).tocsr()


def _link_force(link: PlacedLink, held: np.ndarray, total: np.ndarray) -> np.ndarray:
    """Force ``(k, 3)`` that the frame of a link exerts on its nodes; an rbe3 only needs the sum."""
    if link.kind == "rbe2":
        return total[link.dofs[:, :3]]
    if link.keeps_frame:
        return held[link.dofs[:, :3]]
    force = np.zeros((len(link.dofs), 3))
    force[0] = -total[link.frame[:3]]
    return force
