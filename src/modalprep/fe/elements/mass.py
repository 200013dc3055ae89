"""Mass of elements: linear vectors, mass tensor and rigid inertia from samples of the mass (theory 1.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


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
    """Mass of one block: linear vectors, mass tensor and rigid inertia of theory 1.

    The tensor is `scalar (ne, nn, nn)` where every component of displacement has the same shapes (solids),
    else six ``pairs[a, b] (ne, nl, nl)``.
    """

    g: np.ndarray  # (ne, nl, 3)
    h: np.ndarray  # (ne, nl, 3, 3), h[..., a, b] = int rho x_b N_a
    scalar: np.ndarray | None
    pairs: dict[tuple[int, int], np.ndarray]
    rigid: RigidInertia


class MassSamples(NamedTuple):
    """Quadrature of the mass: ``sum_s weight f(s)`` replaces ``int rho f dV``.

    A beam section adds, per point, one sample for each section axis: the part of displacement and position that
    is proportional to the offset, with ``unit = 0`` because the offset itself integrates to zero; a shell adds
    one for its thickness.
    """

    weight: np.ndarray  # (ne, ns)
    unit: np.ndarray  # (ns,)
    position: np.ndarray  # (ne, ns, 3)
    shape: np.ndarray  # (ne, ns, 3, nl), displacement component a per DOF


def mass_from_samples(s: MassSamples) -> MassObjects:
    """Sum g, h, M_ab and the rigid inertia of theory 1 over mass samples."""
    shape = np.ascontiguousarray(np.moveaxis(s.shape, 2, 0))  # component first: (3, ne, ns, nl)
    weighted = s.weight[..., None] * shape
    g = (s.unit @ weighted).transpose(1, 2, 0)
    h = np.swapaxes(s.position, 1, 2) @ weighted  # (3 of a, ne, 3 of b, nl)
    pairs = {}
    for a, b in PAIRS:
        values = np.swapaxes(shape[a], 1, 2) @ weighted[b]
        pairs[a, b] = (values + values.transpose(0, 2, 1)) / 2 if a == b else values  # symmetric to the last bit
    rigid = rigid_from_samples(s.weight, s.unit, s.position)
    return MassObjects(g, h.transpose(1, 3, 0, 2), None, pairs, rigid)


def rigid_from_samples(weight: np.ndarray, unit: np.ndarray, position: np.ndarray) -> RigidInertia:
    """Mass, first and second moments of the samples."""
    at, mass = position.reshape(-1, 3), weight.reshape(-1, 1)
    return RigidInertia(m=float(np.sum(weight @ unit)), s0=(weight * unit).reshape(-1) @ at, E0=at.T @ (mass * at))
