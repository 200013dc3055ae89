"""Point masses and springs: elements without volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.fe.beam import line_frames
from modalprep.fe.block import MassObjects, MassSamples, add_arms, mass_from_samples, node_transformation
from modalprep.fe.properties import PointMass, Spring
from modalprep.vectors import skew


@dataclass(frozen=True, eq=False)
class MassBlock:
    """Rigid masses at nodes: four samples, the mass centre and one along each principal axis of inertia.

    Attributes
    ----------
    nodes : (ne, 1) int
    at : (ne, 3)
        m, in the model's frame.
    """

    section: PointMass
    nodes: np.ndarray
    at: np.ndarray
    components: int

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> MassBlock:
        """Take the nodes ``(ne, 1)`` at ``points (n, 3)`` (mesh axes); `origin` is the model's origin."""
        return cls(section, nodes, points[nodes[:, 0]] - origin, 6 if _turns(section) else 3)

    def stiffness(self) -> None:
        """None: a mass has no stiffness."""

    def geometric_stiffness(self, d: np.ndarray) -> None:
        """None: a mass has no stress."""

    def volume(self) -> np.ndarray:
        """Zero ``(ne,)``: a point has no volume."""
        return np.zeros(len(self.nodes))

    def mass(self) -> MassObjects:
        """Every mass object of theory 1.

        ``int x x^T dm = tr(J)/2 - J`` about the mass centre; each principal axis of it is a sample whose
        displacement is ``theta x axis``.
        """
        s, ne = self.section, len(self.nodes)
        size, axes = np.linalg.eigh(second_moment(s.inertia))
        offset = np.asarray(s.offset)
        position = np.concatenate([(self.at + offset)[:, None], np.repeat(axes.T[None], ne, axis=0)], axis=1)
        shape = np.zeros((ne, 4, 3, 6))
        arms = np.concatenate([offset[None], axes.T])
        shape[:, 0, :, :3] = np.eye(3)
        shape[:, :, :, 3:] = -skew(arms)
        weight = np.tile([s.mass, *size], (ne, 1))
        samples = MassSamples(weight, np.array([1.0, 0, 0, 0]), position, shape[..., : self.components])
        return mass_from_samples(samples)


def second_moment(inertia: tuple[float, ...]) -> np.ndarray:
    """Return ``int x x^T dm (3, 3)`` of the inertia tensor ``xx, yy, zz, xy, xz, yz`` (kg m^2).

    Examples
    --------
    >>> second_moment((2.0, 2.0, 4.0, 0.0, 0.0, 0.0)).diagonal()
    array([2., 2., 0.])
    """
    xx, yy, zz, xy, xz, yz = inertia
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.trace(J) / 2 * np.eye(3) - J


def _turns(section: PointMass) -> bool:
    return any(section.inertia) or any(section.offset)


@dataclass(frozen=True, eq=False)
class SpringBlock:
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
        turns = bool(any(section.k[3:]) or np.any(arm))
        sign = np.array([1.0]) if nodes.shape[1] == 1 else np.array([-1.0, 1.0])
        T = node_transformation(frame, arm).reshape(len(nodes), nodes.shape[1], 6, nodes.shape[1], 6)
        strain = np.stack([sign[i] * T[:, i, :, i] for i in range(len(sign))], axis=2)[..., : 6 if turns else 3]
        strain = np.ascontiguousarray(strain).reshape(len(nodes), 6, -1)
        return cls(section, nodes, strain, arm, sign, frame, 6 if turns else 3)

    def stiffness(self) -> np.ndarray:
        """``B^T k B``."""
        weighted = self.strain * np.asarray(self.section.k)[:, None]
        K = self.strain.transpose(0, 2, 1) @ weighted
        return (K + K.transpose(0, 2, 1)) / 2

    def mass(self) -> None:
        """None: a spring has no mass."""

    def volume(self) -> np.ndarray:
        """Zero ``(ne,)``: a spring has no volume."""
        return np.zeros(len(self.nodes))

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray | None:
        """Work of the spring's force on the second-order motion of its rigid arms."""
        if not np.any(self.arm):
            return None
        force = (self.strain @ d[:, :, None])[:, :3, 0] * np.asarray(self.section.k[:3])
        force = np.einsum("ek,eka->ea", force, self.frame)
        Kg = np.zeros((len(d), d.shape[1], d.shape[1]))
        add_arms(Kg, self.sign[None, :, None] * force[:, None], self.arm)
        return Kg


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
