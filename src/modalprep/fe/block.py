"""What every element family shares: mass objects from mass samples, arms of eccentric nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from modalprep.fe.interface import link_geometric_stiffness
from modalprep.vectors import skew

if TYPE_CHECKING:
    from modalprep.fe.rotating import RotatingArms

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


# Stress at the nodes of elements, by place of the section (face of a shell, fibre of a beam; "" where there is only
# one): names of the components along the axes of the elements' `frame (ne, 3, 3)`, and values (ne, nn, c, k) in Pa.
NodalStress = dict[str, tuple[tuple[str, ...], np.ndarray]]


class Block(Protocol):
    """Elements of one kind and property: what assembly asks of a family.

    Element matrices are ``(ne, nl, nl)`` with ``nl = nn * components``, node by node, in mesh axes.
    """

    nodes: np.ndarray  # (ne, nn)
    components: int  # 3 or 6

    def stiffness(self) -> np.ndarray | None:
        """Elastic stiffness; None where the family has none."""

    def mass(self) -> MassObjects | None:
        """Mass objects; None where the family has none."""

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray | None:
        """Stiffness of the prestress of the nodal displacements ``d (ne, nl)``."""

    def energy(self, d: np.ndarray) -> np.ndarray:
        """Strain energy ``(ne,)`` at finite displacements ``d (ne, nl)``, rotation vectors at the nodes."""

    def rotating_arms(self) -> RotatingArms | None:
        """Mass beside the nodes that turns with them; None where the family has none."""

    def volume(self) -> np.ndarray:
        """Volume of material ``(ne,)``, m^3; zero where the family has none."""


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


def node_transformation(frame: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return ``(ne, 6 nn, 6 nn)``: motions of eccentric points in the element frame per nodal DOF in mesh axes.

    ``u_loc = R (u + th x arm)``, ``th_loc = R th`` with `frame (ne, 3, 3)` and `arm (ne, nn, 3)`, mesh axes, m.
    """
    ne, nn = arm.shape[:2]
    T = np.zeros((ne, nn, 6, nn, 6))
    for i in range(nn):
        T[:, i, :3, i, :3] = T[:, i, 3:, i, 3:] = frame
        T[:, i, :3, i, 3:] = -frame @ skew(arm[:, i])
    return T.reshape(ne, 6 * nn, 6 * nn)


def add_arms(Kg: np.ndarray, force: np.ndarray, arm: np.ndarray) -> None:
    """Add to ``Kg (ne, 6 nn, 6 nn)`` the work of `force (ne, nn, 3)` on the second-order motion of rigid arms."""
    nn = arm.shape[1]
    for i in range(nn):
        if np.any(arm[:, i]):
            rows = slice(6 * i + 3, 6 * i + 6)
            Kg[:, rows, rows] += link_geometric_stiffness(force[:, i, None], arm[:, i, None])
