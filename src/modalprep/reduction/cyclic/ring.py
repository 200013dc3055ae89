"""Modes of the model of a whole ring by nodal diameter, each from the DOFs of one sector (theory 3.9)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.spatial import cKDTree

from modalprep.fe.assembly.model import FEModel
from modalprep.fe.mesh.cyclic import CyclicSymmetry
from modalprep.linalg.algebra import DIRECT, Algebra
from modalprep.linalg.congruent import Congruent, stored
from modalprep.linalg.factor import Factor
from modalprep.linalg.modes import Modes
from modalprep.linalg.unique import made_unique
from modalprep.reduction.cyclic.problem import single_modes

NEAR = 1e-6  # of the size of the model: how far a node may lie from where the rotation moves its partner
ALIKE = 1e-9  # of K x: what may differ after the rotation, of a matrix with this symmetry
SPARE = 2  # further modes for each nodal diameter in the first attempt


def ring_algebra(model: FEModel, cyclic: CyclicSymmetry, base: Algebra = DIRECT) -> Algebra:
    """Return linear algebra that finds the fixed-interface modes of a ring from problems of the size of one sector.

    They are those of `base` to round-off. Matrices that the rotation by one sector changes are left to `base`.

    Parameters
    ----------
    model : FEModel
        Of the whole ring, such as that of `make_ring`.
    cyclic : CyclicSymmetry
    base : Algebra

    Returns
    -------
    Algebra
        For `craig_bampton`.

    References
    ----------
    Theory 3.9.

    Examples
    --------
    >>> from modalprep.examples import disc_sector, disc_ring
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> _, _, cyclic = disc_sector()
    >>> ring = disc_ring()
    >>> craig_bampton(ring, modes=6, algebra=ring_algebra(ring, cyclic)).frequency[:4].round(3)
    array([48.814, 48.814, 52.994, 64.578])
    """
    turn = _turn(model, cyclic)
    if turn is None:
        return base

    def lowest_modes(
        K: csr_array | Congruent,
        M: csr_array | Congruent,
        n: int,
        *,
        factor: Factor | None = None,
        shift: float = 0.0,
        solver: str = "auto",
    ) -> Modes:
        if shift or K.shape != turn.S.shape or not (turn.keeps(K) and turn.keeps(M)):
            return base.lowest_modes(K, M, n, factor=factor, shift=shift, solver=solver)
        return _ring_modes(turn, K, M, min(n, int(np.count_nonzero(M.diagonal()))), solver)

    return replace(base, lowest_modes=lowest_modes)


@dataclass(frozen=True, eq=False)
class Turn:
    """Rotation of a ring by one sector: ``S (n_i, n_i)`` on its interior DOFs; those of one sector, ``own (p,)``."""

    S: csr_array
    own: np.ndarray
    sectors: int

    def keeps(self, A: csr_array | Congruent) -> bool:
        """Whether the rotation changes nothing of a matrix."""
        x = np.random.default_rng(0).standard_normal(len(self.own))
        y = np.zeros(A.shape[0])
        y[self.own] = x
        there = self.S @ (A @ y)
        return bool(np.linalg.norm(A @ (self.S @ y) - there) <= ALIKE * np.linalg.norm(there))

    @cached_property
    def copies(self) -> list[csr_array]:
        """``S^j E (n_i, p)``: the DOFs of each sector by those of the first, turned."""
        size = (self.S.shape[0], len(self.own))
        found = [coo_array((np.ones(size[1]), (self.own, np.arange(size[1]))), shape=size).tocsr()]
        for _ in range(1, self.sectors):
            found.append((self.S @ found[-1]).tocsr())
        return found

    def blocks(self, A: csr_array) -> list[csr_array]:
        """Return ``E^T A S^j E (p, p)`` of each sector j: how the first is coupled to it."""
        rows = A[self.own]
        return [(rows @ copy).tocsr() for copy in self.copies]

    def phases(self, n: int) -> np.ndarray:
        """Return ``e^{i n alpha j}`` of each sector j with n nodal diameters; real where modes are single."""
        angle = 2 * np.pi * n * np.arange(self.sectors) / self.sectors
        return np.round(np.cos(angle)) if _share(self, n) == 1 else np.exp(1j * angle)

    def of(self, blocks: list[csr_array], n: int) -> csr_array:
        """Return the Hermitian matrix of n nodal diameters of `blocks`."""
        parts = [phase * block for phase, block in zip(self.phases(n), blocks, strict=True) if block.nnz]
        A = sum(parts[1:], start=parts[0])
        return ((A + A.conj().T) / 2).tocsr()

    def shapes(self, Z: np.ndarray, n: int) -> np.ndarray:
        """Return the real shapes ``(n_i, k)`` of unit modal mass in the ring, those of a pair beside each other."""
        shape = sum(phase * (copy @ Z) for phase, copy in zip(self.phases(n), self.copies, strict=True))
        shape *= np.sqrt(_share(self, n) / self.sectors)
        if _share(self, n) == 1:
            return shape
        return np.stack([shape.real, shape.imag], axis=2).reshape(len(shape), -1)


def _turn(model: FEModel, cyclic: CyclicSymmetry) -> Turn | None:
    """Return the rotation of the DOFs outside the fixed interfaces; None where nodes have no partners of their own."""
    frames = [frame.position for frame in model.interfaces if len(frame.nodes)]
    points = np.concatenate([model.points, np.reshape(frames, (-1, 3))])
    turned = cyclic.with_(point=cyclic.point - model.origin).turned(points, 1)
    fixed = [frame.dofs for frame in model.interfaces if frame.boundary == "fixed"]
    place = np.full(model.n_dof, -1)
    inside = np.setdiff1d(model.free, np.concatenate(fixed))
    place[inside] = np.arange(len(inside))
    dofs = np.where(model.dof >= 0, place[model.dof], -1)
    moving = np.flatnonzero(np.any(dofs >= 0, axis=1))
    distance, nearest = cKDTree(points[moving]).query(turned[moving])
    partner = moving[nearest]
    whole = len(np.unique(partner)) == len(moving) and np.array_equal(dofs[moving] >= 0, dofs[partner] >= 0)
    triples = dofs[moving].reshape(-1, 3)
    if not whole or distance.max() > NEAR * np.ptp(points) or np.any((triples >= 0).any(1) != (triples >= 0).all(1)):
        return None
    there = dofs[partner].reshape(-1, 3)
    kept = triples[:, 0] >= 0
    rows, columns = np.repeat(there[kept], 3, axis=1), np.tile(triples[kept], (1, 3))
    values = np.tile(cyclic.rotation(1).ravel(), int(kept.sum()))
    S = coo_array((values, (rows.ravel(), columns.ravel())), shape=(len(inside), len(inside))).tocsr()
    first = _first_of_each(partner, moving, len(points), cyclic.sectors)
    return None if first is None else Turn(S, np.sort(dofs[first][dofs[first] >= 0]), cyclic.sectors)


def _first_of_each(partner: np.ndarray, moving: np.ndarray, n: int, sectors: int) -> np.ndarray | None:
    """Return the first of each cycle of nodes; None where one has not all sectors, such as a node on the axis."""
    follows = np.arange(n)
    follows[moving] = partner
    least, at = np.arange(n), np.arange(n)
    for k in range(sectors):
        at = follows[at]
        if k < sectors - 1 and np.any(at[moving] == moving):
            return None
        least = np.minimum(least, at)
    return moving[least[moving] == moving] if np.array_equal(at, np.arange(n)) else None


def _ring_modes(turn: Turn, K: csr_array | Congruent, M: csr_array | Congruent, n: int, solver: str) -> Modes:
    """Return the n lowest modes of the ring: of each nodal diameter as many as lie below the n-th."""
    stiffness = turn.blocks(stored(K))
    mass = turn.blocks(stored(M))
    count = dict.fromkeys(range(turn.sectors // 2 + 1), ceil(n / turn.sectors) + SPARE)
    found: dict[int, Modes] = {}
    short = set(count)
    while short:
        for d in short:
            found[d] = single_modes(turn.of(stiffness, d), turn.of(mass, d), count[d], solver=solver)
        every = np.sort(np.concatenate([np.repeat(w2, _share(turn, d)) for d, (w2, _, _) in found.items()]))
        last = every[n - 1] if len(every) >= n else np.inf
        short = {d for d, (w2, _, _) in found.items() if len(w2) == count[d] and w2[-1] <= last}
        count |= {d: 2 * count[d] for d in short}
    w2 = np.concatenate([np.repeat(w2, _share(turn, d)) for d, (w2, _, _) in found.items()])
    phi = np.concatenate([turn.shapes(Z, d) for d, (_, Z, _) in found.items()], axis=1)
    counted = "counted for each nodal diameter" if all(own.counted for own in found.values() if len(own.w2)) else ""
    order = np.argsort(w2, kind="stable")[:n]
    return Modes(w2[order], made_unique(w2[order], phi[:, order], K), counted)


def _share(turn: Turn, d: int) -> int:
    """Return how many modes of the ring one of a nodal diameter is."""
    return 1 if 2 * d % turn.sectors == 0 else 2
