"""What every element family shares: local matrices with their places, and mass objects from mass samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


class Triplets(NamedTuple):
    """Local matrices ``values (ne, r, c)`` at global ``rows (ne, r)`` and ``cols (ne, c)``."""

    rows: np.ndarray
    cols: np.ndarray
    values: np.ndarray

    @classmethod
    def square(cls, dofs: np.ndarray, values: np.ndarray) -> Triplets:
        """Local matrices whose rows and columns are the same DOFs."""
        return cls(dofs, dofs, values)


def csr_of(triplets: list[Triplets], n: int, *, symmetric: bool = False) -> csr_array:
    """Sum local matrices into one (n, n) matrix; `symmetric` removes the round-off asymmetry."""
    rows = [np.repeat(t.rows, t.cols.shape[1], axis=1).ravel() for t in triplets]
    cols = [np.tile(t.cols, (1, t.rows.shape[1])).ravel() for t in triplets]
    values = [t.values.ravel() for t in triplets]
    place = tuple(np.concatenate(x) if x else np.zeros(0, dtype=np.int64) for x in (rows, cols))
    A = coo_array((np.concatenate(values) if values else np.zeros(0), place), shape=(n, n)).tocsr()
    return ((A + A.T) * 0.5).tocsr() if symmetric else A


@dataclass(frozen=True)
class RigidInertia:
    """``int rho``, ``int rho x`` and ``int rho x x^T`` about the frame origin."""

    m: float
    s0: np.ndarray
    E0: np.ndarray

    def __add__(self, other: RigidInertia) -> RigidInertia:
        """Sum of two parts."""
        return RigidInertia(self.m + other.m, self.s0 + other.s0, self.E0 + other.E0)


class MassObjects(NamedTuple):
    """Mass of one block: linear vectors at `dofs`, mass tensor triplets per pair (a, b), rigid inertia."""

    dofs: np.ndarray
    g: np.ndarray  # (ne, nl, 3)
    h: np.ndarray  # (ne, nl, 3, 3), h[..., a, b] = int rho x_b N_a
    tensor: dict[tuple[int, int], list[Triplets]]
    rigid: RigidInertia


class MassSamples(NamedTuple):
    """Quadrature of the mass: ``sum_s weight f(s)`` replaces ``int rho f dV``.

    A solid's samples are its quadrature points. A beam section adds, per point, one sample for each section
    axis: the part of displacement and position that is proportional to the offset, with ``unit = 0`` because
    the offset itself integrates to zero.
    """

    weight: np.ndarray  # (ne, ns)
    unit: np.ndarray  # (ns,)
    position: np.ndarray  # (ne, ns, 3)
    shape: np.ndarray  # (ne, ns, 3, nl), displacement component a per DOF


def mass_from_samples(dofs: np.ndarray, s: MassSamples) -> MassObjects:
    """Assemble g, h, M_ab and the rigid inertia of FORMULATION section 1 from mass samples."""
    weighted = s.weight[:, :, None, None] * s.shape
    g = np.einsum("esaj,s->eja", weighted, s.unit)
    h = np.einsum("esaj,esb->ejab", weighted, s.position, optimize=True)
    tensor = {}
    for a, b in PAIRS:
        values = s.shape[:, :, a].transpose(0, 2, 1) @ weighted[:, :, b]
        tensor[a, b] = [Triplets.square(dofs, values)]
    return MassObjects(dofs, g, h, tensor, rigid_from_samples(s.weight, s.unit, s.position))


def rigid_from_samples(weight: np.ndarray, unit: np.ndarray, position: np.ndarray) -> RigidInertia:
    """Mass, first and second moments of the samples."""
    return RigidInertia(
        m=float(np.sum(weight * unit)),
        s0=np.einsum("es,s,esa->a", weight, unit, position),
        E0=np.einsum("es,esa,esb->ab", weight, position, position, optimize=True),
    )
