"""Mass of elements: linear vectors, mass tensor and rigid inertia from samples of the mass (theory 1.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
SAME = [PAIRS.index((a, a)) for a in range(3)]
Form = Literal["scalar", "functions", "pairs"]


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

    Attributes
    ----------
    g : (ne, nl, 3)
    h : (ne, nl, 3, 3)
        ``h[..., a, b] = int rho x_b N_a``.
    rigid : RigidInertia
    form : {"scalar", "functions", "pairs"}
    tensor : array
        "scalar": ``(ne, nn, nn)``, where every component of displacement has the same shapes; "functions":
        ``(ne, 10 nn, 10 nn)``, products of the functions of `NodalFunctions`; "pairs": ``(ne, 6, nl, nl)`` in the order
        of PAIRS.
    """

    g: np.ndarray
    h: np.ndarray
    rigid: RigidInertia
    form: Form
    tensor: np.ndarray

    def rows(self, some: np.ndarray) -> MassObjects:
        """Return the objects of `some` of the elements; `rigid` stays that of all."""
        return self._replace(g=self.g[some], h=self.h[some], tensor=self.tensor[some])

    def matrix(self) -> np.ndarray:
        """Return the mass matrices ``(ne, nl, nl)``."""
        ne, nl = self.g.shape[:2]
        if self.form == "pairs":
            return self.tensor[:, SAME].sum(axis=1)
        if self.form == "scalar":
            nn = self.tensor.shape[1]
            unit = np.diag(np.arange(nl // nn) < 3).astype(float)
            return np.einsum("eij,ab->eiajb", self.tensor, unit).reshape(ne, nl, nl)
        pick = _functions(nl // 6)
        return (pick.swapaxes(1, 2) @ self.tensor[:, None] @ pick).sum(axis=1)

    def of_pair(self, a: int, b: int) -> np.ndarray:
        """Return ``int rho N_a^T N_b (ne, nl, nl)`` for a <= b."""
        ne, nl = self.g.shape[:2]
        if self.form == "pairs":
            return self.tensor[:, PAIRS.index((a, b))]
        if self.form == "functions":
            pick = _functions(nl // 6)
            return pick[a].T @ self.tensor @ pick[b]
        nn = self.tensor.shape[1]
        matrix = np.zeros((ne, nn, nl // nn, nn, nl // nn))
        matrix[:, :, a, :, b] = self.tensor
        return matrix.reshape(ne, nl, nl)

    def of_translations(self) -> np.ndarray:
        """Rows ``(ne, nn, 3, nl)`` of the mass matrix at the translations of nodes with six DOFs."""
        ne, nl = self.g.shape[:2]
        nn = nl // 6
        if self.form == "pairs":
            return self.matrix().reshape(ne, nn, 6, nl)[:, :, :3]
        products = self.tensor.reshape(ne, nn, 10, nn, 10)[:, :, 9]
        rows = np.zeros((ne, nn, 3, nn, 6))
        for a in range(3):
            rows[:, :, a, :, a] = products[..., 9]
            rows[:, :, a, :, 3:] = products[..., 3 * a : 3 * a + 3]
        return rows.reshape(ne, nn, 3, nl)


def _functions(nn: int) -> np.ndarray:
    """Return what each displacement component is of the functions of nn nodes, ``(3, 10 nn, 6 nn)``."""
    pick = np.zeros((3, nn, 10, nn, 6))
    for a in range(3):
        for i in range(nn):
            pick[a, i, 9, i, a] = 1.0
            pick[a, i, 3 * a : 3 * a + 3, i, 3:] = np.eye(3)
    return pick.reshape(3, 10 * nn, 6 * nn)


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


class NodalFunctions(NamedTuple):
    """Quadrature of the mass as in `MassSamples`, where every node moves a sample by ``N u + R t``.

    Attributes
    ----------
    weight, unit, position
        As there.
    values : (ne, ns, nn, 10)
        ``R`` (3, 3) by rows and N, one factor on the displacement of the node in every direction.
    """

    weight: np.ndarray
    unit: np.ndarray
    position: np.ndarray
    values: np.ndarray

    def shape(self) -> np.ndarray:
        """Displacement ``(ne, ns, 3, 6 nn)`` per nodal DOF."""
        ne, ns, nn, _ = self.values.shape
        shape = np.zeros((ne, ns, 3, nn, 6))
        for a in range(3):
            shape[:, :, a, :, a] = self.values[..., 9]
            shape[:, :, a, :, 3:] = self.values[..., 3 * a : 3 * a + 3]
        return shape.reshape(ne, ns, 3, 6 * nn)

    def mass(self) -> MassObjects:
        """Sum g, h, the products of the functions and the rigid inertia of theory 1."""
        ne, ns, nn, _ = self.values.shape
        values = self.values.reshape(ne, ns, 10 * nn)
        weighted = np.swapaxes(self.weight[..., None] * values, 1, 2)
        unit = np.broadcast_to(self.unit[:, None], (ne, ns, 1))
        moments = (weighted @ np.concatenate([unit, self.position], axis=2)).reshape(ne, nn, 10, 4)
        g = np.zeros((ne, nn, 6, 3))
        h = np.zeros((ne, nn, 6, 3, 3))
        for a in range(3):
            moved = moments[:, :, 9]
            turned = moments[:, :, 3 * a : 3 * a + 3]
            g[:, :, a, a], g[:, :, 3:, a] = moved[..., 0], turned[..., 0]
            h[:, :, a, a], h[:, :, 3:, a] = moved[..., 1:], turned[..., 1:]
        rigid = rigid_from_samples(self.weight, self.unit, self.position)
        linear = g.reshape(ne, 6 * nn, 3), h.reshape(ne, 6 * nn, 3, 3)
        return MassObjects(*linear, rigid, "functions", weighted @ values)


def mass_from_samples(s: MassSamples) -> MassObjects:
    """Sum g, h, M_ab and the rigid inertia of theory 1 over mass samples."""
    shape = np.ascontiguousarray(np.moveaxis(s.shape, 2, 0))  # component first: (3, ne, ns, nl)
    weighted = s.weight[..., None] * shape
    g = (s.unit @ weighted).transpose(1, 2, 0)
    h = np.swapaxes(s.position, 1, 2) @ weighted  # (3 of a, ne, 3 of b, nl)
    pairs = np.empty((len(s.weight), len(PAIRS), *2 * shape.shape[3:]), dtype=weighted.dtype)
    for k, (a, b) in enumerate(PAIRS):
        values = np.swapaxes(shape[a], 1, 2) @ weighted[b]
        pairs[:, k] = (values + values.transpose(0, 2, 1)) / 2 if a == b else values  # symmetric to the last bit
    rigid = rigid_from_samples(s.weight, s.unit, s.position)
    return MassObjects(g, h.transpose(1, 3, 0, 2), rigid, "pairs", pairs)


def rigid_from_samples(weight: np.ndarray, unit: np.ndarray, position: np.ndarray) -> RigidInertia:
    """Mass, first and second moments of the samples."""
    at = position.reshape(-1, 3)
    mass = weight.reshape(-1, 1)
    return RigidInertia(m=np.sum(weight @ unit).item(), s0=(weight * unit).reshape(-1) @ at, E0=at.T @ (mass * at))
