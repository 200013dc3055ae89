"""The model of a sector whose high edge follows its low edge: matrices by nodal diameter (theory 3.9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import block_array, block_diag, coo_array, csr_array, eye_array

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.links.sector_edges import SectorEdges, sector_edges
from modalprep.fe.mesh.cyclic import CyclicSymmetry
from modalprep.fe.mesh.mesh import Mesh

ALONE = 1e-9  # of a direction that a node on the axis shares with its image: (R e^{i n alpha} - 1) u
NOTHING = 1e-9  # of a displacement: what a held node of one edge may ask of the other


@dataclass(frozen=True, eq=False)
class Sector:
    """A sector on the DOFs that its constraints, its held interfaces and its low edge leave.

    Attributes
    ----------
    model : FEModel
    cyclic : CyclicSymmetry
    edges : SectorEdges
    C : (n_dof, m) csr
        From the independent DOFs that are not held to all.
    own, followed : (m, p) csr
        ``own + e^{i n alpha turns} followed`` makes the m DOFs of the p that remain, those on the axis last.
    on_axis : int
        Triples of translations or rotations of nodes on the axis, among the last of the p.
    """

    model: FEModel
    cyclic: CyclicSymmetry
    edges: SectorEdges
    C: csr_array
    own: csr_array
    followed: csr_array
    on_axis: int

    def single(self, diameter: int) -> bool:
        """Whether the modes of a nodal diameter are single: neighbouring sectors move alike, or opposite."""
        return 2 * diameter % self.cyclic.sectors == 0

    def map(self, diameter: int) -> csr_array:
        """Return T ``(m, p_n)``, complex except for single modes: the DOFs by those free to move with n diameters."""
        angle = self.cyclic.angle * diameter * self.edges.turns
        phase = np.cos(angle) if self.single(diameter) else np.exp(1j * angle)
        T = self.own + phase * self.followed
        if not self.on_axis:
            return T.tocsr()
        unit = _kept_by(self.cyclic.rotation(self.edges.turns) * phase)
        others = T.shape[1] - 3 * self.on_axis
        if not unit.size:
            return T.tocsc()[:, :others].tocsr()
        return (T @ block_diag([eye_array(others), *[coo_array(unit)] * self.on_axis])).tocsr()

    def notes(self) -> tuple[str, ...]:
        """Return notes on the edges: also where elements have hourglass stiffness that those of a ring lack."""
        on = np.zeros(len(self.model.points), dtype=bool)
        on[self.edges.high] = True
        on[self.edges.weights.indices] = True
        parts = self.model.elements.parts if self.model.elements else ()
        alone = [on[p.nodes].any(axis=1) & p.data["free_faces"].any(axis=1) for p in parts if "free_faces" in p.data]
        count = sum(int(own.sum()) for own in alone)
        said = (
            f"{count} hexahedra of reduced integration at the edges count as if nothing followed there (theory 7.5), "
            "so that modes differ from those of the ring; take two elements around, or full integration"
        )
        return (*self.edges.notes, said) if count else self.edges.notes

    def reduced(self, A: csr_array) -> csr_array:
        """Return the symmetric ``C^T A C`` of a matrix of all DOFs."""
        return (self.C.T.tocsr() @ A @ self.C).tocsr()


def make_sector(model: FEModel, mesh: Mesh, cyclic: CyclicSymmetry, held: bool) -> Sector:
    """Return the sector of a model, with its fixed interfaces held or without.

    Raises
    ------
    InputError
        When the edges do not fit each other, or something other than the sector before drives the high edge.

    Examples
    --------
    >>> from modalprep.examples import disc_sector
    >>> mesh, model, cyclic = disc_sector()
    >>> make_sector(model, mesh, cyclic, held=True).map(2).dtype
    dtype('complex128')
    """
    if len(mesh.points) > len(model.points):
        raise InputError(f"the mesh has {len(mesh.points)} nodes, the model {len(model.points)}; give its own mesh")
    used = np.flatnonzero(model.dof[: len(model.points), 0] >= 0)
    edges = sector_edges(mesh.with_(points=model.points + model.origin), cyclic, used)
    _refuse_twice(model, edges)
    fixed = [frame.dofs for frame in model.interfaces if frame.boundary == "fixed"] if held else []
    kept = np.setdiff1d(model.free, np.concatenate([np.zeros(0, dtype=int), *fixed]))
    C = model.C.tocsc()[:, np.searchsorted(model.free, kept)].tocsr()
    place = np.full(model.n_dof, -1)
    place[kept] = np.arange(len(kept))
    high, follows = _following(model, cyclic, edges)
    asked = follows @ C
    _refuse_driven(model, high, C, asked, place)
    alone = place[high] >= 0
    to = place[high[alone]]
    axis = _axis_triples(model, edges, place)
    columns = np.append(np.setdiff1d(np.arange(len(kept)), np.append(to, axis)), axis).astype(int)
    if abs(asked.tocsc()[:, to]).sum():
        raise InputError("cyclic symmetry: a constraint joins nodes of the low edge with nodes of the high one")
    unit = eye_array(len(kept), format="csc")
    followed = (unit[:, to] @ asked[alone]).tocsc()[:, columns].tocsr()
    return Sector(model, cyclic, edges, C, unit[:, columns].tocsr(), followed, len(axis) // 3)


def pair(A: csr_array) -> csr_array:
    """Return the real symmetric ``[[Re, -Im], [Im, Re]]`` of a Hermitian matrix: each eigenvalue twice.

    Examples
    --------
    >>> pair(csr_array(np.array([[1.0, 2j], [-2j, 1.0]]))).toarray()[:2]
    array([[ 1.,  0., -0., -2.],
           [ 0.,  1.,  2., -0.]])
    """
    return block_array([[A.real, -A.imag], [A.imag, A.real]]).tocsr()


def _kept_by(A: np.ndarray) -> np.ndarray:
    """Return orthonormal vectors (3, k) with ``A u = u``, of a rotation with a phase."""
    _, size, V = np.linalg.svd(A - np.eye(3))
    return V.conj().T[:, size < ALONE]


def _following(model: FEModel, cyclic: CyclicSymmetry, edges: SectorEdges) -> tuple[np.ndarray, csr_array]:
    """Return the DOFs (k,) of the high edge, and those of the low one that they follow, turned ``(k, n_dof)``."""
    R = cyclic.rotation(edges.turns)
    W = edges.weights.tocoo()
    to, of = model.dof[edges.high[W.row]], model.dof[W.col]
    odd = np.any((to >= 0) != (of >= 0), axis=1)
    if odd.any():
        node = edges.high[W.row[odd][0]]
        raise InputError(
            f"cyclic symmetry: node {node + 1} of the high edge has rotations and its partner on the low edge has "
            "none, or the reverse; let the elements of both edges be of one kind"
        )
    own = model.dof[edges.high]
    high = own[own >= 0]
    number = np.full(model.n_dof, -1)
    number[high] = np.arange(len(high))
    parts = []
    for triple in (slice(0, 3), slice(3, 6)):
        there = to[:, triple.start] >= 0
        values = (W.data[there, None, None] * R).ravel()
        rows = np.repeat(number[to[there, triple]], 3, axis=1).ravel()
        columns = np.tile(of[there, triple], (1, 3)).ravel()
        parts.append(coo_array((values, (rows, columns)), shape=(len(high), model.n_dof)))
    return high, (parts[0] + parts[1]).tocsr()


def _refuse_driven(model: FEModel, high: np.ndarray, C: csr_array, asked: csr_array, place: np.ndarray) -> None:
    """Refuse DOFs of the high edge that something else drives; both edges may be held alike."""
    other = place[high] < 0
    driven = other & (np.diff(C[high].indptr) > 0)
    alone = other & (np.asarray(abs(asked).sum(axis=1)).ravel() > NOTHING)
    for wrong, why in (
        (
            driven,
            "follows a link or an equation beside the low edge; keep links off the edges, or hold their interface",
        ),
        (alone, "is held and its partner on the low edge is not; hold both"),
    ):
        if wrong.any():
            node = int(np.nonzero(model.dof == high[np.argmax(wrong)])[0][0])
            raise InputError(f"cyclic symmetry: node {node + 1} of the high edge {why}")


def _axis_triples(model: FEModel, edges: SectorEdges, place: np.ndarray) -> np.ndarray:
    """Return the columns of the translations and rotations of nodes on the axis that are not held, by triples."""
    dofs = model.dof[edges.axis].reshape(-1, 3)
    triples = place[dofs[dofs[:, 0] >= 0]]
    free = np.sum(triples >= 0, axis=1)
    if np.any((free > 0) & (free < 3)):
        raise InputError(
            "cyclic symmetry: a node on the axis is held in some directions only, or follows others; hold all of it or "
            "none"
        )
    return triples[free == 3].ravel()


def _refuse_twice(model: FEModel, edges: SectorEdges) -> None:
    """Refuse elements that lie on both edges, or on the axis: the ring would have them twice, or in every sector."""
    axis, high, low = (np.zeros(len(model.points), dtype=bool) for _ in range(3))
    axis[edges.axis] = True
    high[np.append(edges.high, edges.axis)] = True
    low[np.append(np.unique(edges.weights.indices), edges.axis)] = True
    for kind, conn in model.cells.items():
        inside = [side[conn].all(axis=1) for side in (axis, high, low)]
        if inside[0].any():
            why = "lies on the axis, where every sector would have it; leave such elements out"
        elif inside[1].any() and inside[2].any():
            why = "lies on both edges, where the ring would have it twice; keep such elements on one edge"
        else:
            continue
        node = conn[inside[0] if inside[0].any() else inside[1]][0, 0]
        raise InputError(f"cyclic symmetry: a cell of type {kind!r} (node {node + 1}) {why}")
