"""Mass of elements: linear vectors, mass tensor and rigid inertia from samples of the mass (theory 1.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from modalprep.fe.elements.kernels import in_threads, sum_samples

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
    else six ``pairs (ne, 6, nl, nl)`` in the order of `PAIRS`.
    """

    g: np.ndarray  # (ne, nl, 3)
    h: np.ndarray  # (ne, nl, 3, 3), h[..., a, b] = int rho x_b N_a
    scalar: np.ndarray | None
    pairs: np.ndarray | None
    rigid: RigidInertia

    @property
    def total(self) -> np.ndarray:
        """Mass matrices ``(ne, nl, nl)`` of the pairs."""
        return sum(self.pairs[:, PAIRS.index((a, a))] for a in range(3))


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
    ne, _, _, nl = s.shape.shape
    g, h, pairs = (np.zeros((ne, *shape)) for shape in ((nl, 3), (nl, 3, 3), (len(PAIRS), nl, nl)))
    in_threads(sum_samples, ne, s.weight, s.unit, s.position, np.ascontiguousarray(s.shape), g, h, pairs)
    return MassObjects(g, h, None, pairs, rigid_from_samples(s.weight, s.unit, s.position))


def rigid_from_samples(weight: np.ndarray, unit: np.ndarray, position: np.ndarray) -> RigidInertia:
    """Mass, first and second moments of the samples."""
    at, mass = position.reshape(-1, 3), weight.reshape(-1, 1)
    return RigidInertia(m=float(np.sum(weight @ unit)), s0=(weight * unit).reshape(-1) @ at, E0=at.T @ (mass * at))
