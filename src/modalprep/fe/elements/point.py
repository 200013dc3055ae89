"""Point masses and springs: elements without volume."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from modalprep.fe.elements.arms import RotatingArms, mass_arms, node_transformation, section_arms
from modalprep.fe.elements.beam import line_frames
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.corotation import Corotational
from modalprep.fe.elements.mass import MassObjects, MassSamples, mass_from_samples
from modalprep.fe.properties.points import PointMass, Spring, Vector6
from modalprep.vectors import inertia_tensor, skew

ROUNDING = 1e-14


@dataclass(frozen=True, eq=False)
class MassBlock(Block):
    """Rigid masses at nodes: four samples, the mass centre and one along each principal axis of inertia.

    Attributes
    ----------
    nodes : (ne, 1) int
    at : (ne, 3)
        m, in the model's frame.
    """

    tensor = "pairs"
    section: PointMass
    nodes: np.ndarray
    at: np.ndarray
    components: int

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> MassBlock:
        """Take the nodes ``(ne, 1)`` at ``points (n, 3)`` (mesh axes); `origin` is the model's origin."""
        return cls(section, nodes, points[nodes[:, 0]] - origin, 6 if _has_rotations(section) else 3)

    def mass(self) -> MassObjects:
        """Every mass object of theory 1.

        ``int x x^T dm = tr(J)/2 - J`` about the mass centre; each principal axis of it is a sample whose
        displacement is ``theta x axis``.
        """
        s = self.section
        ne = len(self.nodes)
        size, axes = np.linalg.eigh(second_moment(s.inertia))
        position = np.concatenate([(self.at + s.offset)[:, None], np.repeat(axes.T[None], ne, axis=0)], axis=1)
        shape = np.zeros((ne, 4, 3, 6))
        shape[:, 0, :, :3] = np.eye(3)
        shape[:, :, :, 3:] = -skew(np.concatenate([[s.offset], axes.T]))
        weight = np.tile([s.mass, *size], (ne, 1))
        samples = MassSamples(weight, np.array([1.0, 0, 0, 0]), position, shape[..., : self.components])
        return mass_from_samples(samples)

    def piece(self, some: slice | np.ndarray) -> MassBlock:
        """Return the block of `some` of the masses."""
        return replace(self, nodes=self.nodes[some], at=self.at[some])

    def rotating_arms(self) -> RotatingArms | None:
        """Arms to the mass centre, and along the principal axes of inertia."""
        if self.components == 3:
            return None
        s = self.section
        ne = len(self.nodes)
        size, axes = np.linalg.eigh(second_moment(s.inertia))
        rotation = np.zeros((ne, 1, 3, 6))
        rotation[..., 3:] = np.eye(3)
        parts = [
            section_arms(np.full((ne, 1), weight), np.tile(axis, (ne, 1, 1)), rotation)
            for weight, axis in zip(size, axes.T, strict=True)
        ]
        if any(s.offset):
            offset = np.tile(s.offset, (ne, 1, 1))
            shape = np.concatenate([np.tile(np.eye(3), (ne, 1, 1, 1)), -skew(offset)], axis=3)
            parts.append(mass_arms(np.full((ne, 1), s.mass), self.at[:, None] + offset, shape, offset, rotation))
        return RotatingArms.joined(parts)


def second_moment(inertia: tuple[float, ...]) -> np.ndarray:
    """Return ``int x x^T dm (3, 3)`` of the inertia tensor ``xx, yy, zz, xy, xz, yz`` (kg m^2).

    Examples
    --------
    >>> second_moment((2.0, 2.0, 4.0, 0.0, 0.0, 0.0)).diagonal()
    array([2., 2., 0.])
    """
    J = inertia_tensor(inertia)
    return np.trace(J) / 2 * np.eye(3) - J


def _has_rotations(section: PointMass) -> bool:
    return any(section.inertia) or any(section.offset)


@dataclass(frozen=True, eq=False)
class SpringBlock(Corotational):
    """Springs between two nodes or from a node to the ground.

    Attributes
    ----------
    nodes : (ne, 1 or 2) int
    strain : (ne, 6, nl)
        Relative motion at the elastic centre, in the spring's axes, per nodal DOF in mesh axes.
    arm : (ne, nn, 3)
        From each node to the elastic centre, mesh axes, m.
    sign : (nn,)
        -1 at the first of two nodes.
    """

    section: Spring
    nodes: np.ndarray
    strain: np.ndarray
    arm: np.ndarray
    sign: np.ndarray
    frame: np.ndarray
    components: int

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> SpringBlock:
        """Take the elements ``nodes (ne, 1 or 2)`` at ``points (n, 3)``; `data` may give ``frame (ne, 3, 3)``."""
        at = points[nodes]
        centre = (1 - section.location) * at[:, :1] + section.location * at[:, -1:]
        arm = centre - at
        frame = _spring_frames(at, nodes, section, data)
        rotates = bool(any(section.k[3:]) or any(section.c[3:]) or np.any(arm))
        sign = np.array([1.0]) if nodes.shape[1] == 1 else np.array([-1.0, 1.0])
        T = node_transformation(frame, arm).reshape(len(nodes), nodes.shape[1], 6, nodes.shape[1], 6)
        strain = np.stack([sign[i] * T[:, i, :, i] for i in range(len(sign))], axis=2)[..., : 6 if rotates else 3]
        strain = np.ascontiguousarray(strain).reshape(len(nodes), 6, -1)
        strain[np.abs(strain) <= ROUNDING * np.abs(arm).max()] = 0.0  # a rotation that does nothing is no DOF
        return cls(section, nodes, strain, arm, sign, frame, 6 if rotates else 3)

    def stiffness(self) -> np.ndarray:
        """``B^T k B``."""
        return self._weighted(self.section.k)

    def damping(self) -> np.ndarray | None:
        """``B^T c B``; None without dampers."""
        return self._weighted(self.section.c) if any(self.section.c) else None

    def _weighted(self, of: Vector6) -> np.ndarray:
        K = self.strain.transpose(0, 2, 1) @ (self.strain * np.asarray(of)[:, None])
        return (K + K.transpose(0, 2, 1)) / 2

    def piece(self, some: slice | np.ndarray) -> SpringBlock:
        """Return the block of `some` of the springs."""
        return replace(self, **{name: getattr(self, name)[some] for name in ("nodes", "strain", "arm", "frame")})

    @property
    def position(self) -> np.ndarray:
        """(ne, nn, 3): both ends are at the elastic centre."""
        return np.zeros_like(self.arm)

    @property
    def axes_rotation(self) -> np.ndarray:
        """(ne, 3, 6 nn) rotation of the spring's axes per local DOF: the mean of its ends; none on the ground."""
        nn = len(self.sign)
        spin = np.zeros((len(self.nodes), 3, nn, 6))
        spin[..., 3:] = np.eye(3)[:, None] / 2 if nn == 2 else 0.0
        return spin.reshape(len(self.nodes), 3, 6 * nn)

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray:
        """Work of the spring's force and moment on the rotation of its axes and arms; zero without rotations."""
        return super().geometric_stiffness(d) if self.components == 6 else np.zeros((*d.shape, d.shape[1]))

    def energy(self, d: np.ndarray) -> np.ndarray:
        """Return the strain energy ``(ne,)`` at finite displacements; without rotations the axes are fixed."""
        if self.components == 6:
            return super().energy(d)
        return np.einsum("ei,eij,ej->e", d, self.stiffness(), d) / 2


def _spring_frames(at: np.ndarray, nodes: np.ndarray, section: Spring, data: dict) -> np.ndarray:
    given = data.get("frame", np.full((len(nodes), 3, 3), np.nan))
    frame = np.repeat(np.eye(3)[None], len(nodes), axis=0)
    length = np.linalg.norm(at[:, -1] - at[:, 0], axis=1)
    apart = length > 1e-9 * max(1.0, float(np.abs(at).max()))
    own = apart & ~np.all(np.isfinite(given), axis=(1, 2))
    if np.any(own):
        up = np.broadcast_to(np.asarray(section.up, dtype=float), (int(own.sum()), 3))
        frame[own] = line_frames(at[own], nodes[own], up)[1]
    return np.where(np.isfinite(given), given, frame)
