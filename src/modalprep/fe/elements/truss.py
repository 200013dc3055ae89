"""Two-node bar: axial force, and torque where its section has a torsion constant."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.elements.block import NodalStress
from modalprep.fe.elements.corotation import Corotational, line_rotation
from modalprep.fe.elements.mass import MassObjects, RigidInertia
from modalprep.fe.properties.properties import Truss

LINEAR_MASS = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6


@dataclass(frozen=True, eq=False)
class TrussBlock(Corotational):
    """Bars of one property.

    Attributes
    ----------
    nodes : (ne, 2) int
    ends : (ne, 2, 3)
        m, in the model's frame.
    axis : (ne, 3)
    length : (ne,)
        m.
    components : int
        3, or 6 where the bar carries torque.
    """

    alike = (0,)
    tensor = "scalar"
    section: Truss
    nodes: np.ndarray
    ends: np.ndarray
    axis: np.ndarray
    length: np.ndarray
    components: int

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> TrussBlock:
        """Take the elements ``nodes (ne, 2)`` at ``points (n, 3)`` (mesh axes); `origin` is the model's origin.

        Raises
        ------
        InputError
            When a bar has no length.
        """
        ends = points[nodes] - origin
        axis = ends[:, 1] - ends[:, 0]
        length = np.linalg.norm(axis, axis=1)
        if np.any(length == 0):
            bad = nodes[np.argmin(length)]
            raise InputError(f"truss element between nodes {bad[0] + 1} and {bad[1] + 1} has no length")
        return cls(section, nodes, ends, axis / length[:, None], length, 6 if section.J else 3)

    def stiffness(self) -> np.ndarray:
        """``EA/L`` along the axis and ``GJ/L`` about it."""
        s, mat = self.section, self.section.material
        along = np.einsum("ea,eb->eab", self.axis, self.axis) / self.length[:, None, None]
        return self._between_nodes(mat.E * s.A * along, mat.G * s.J * along)

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray:
        """``N/L`` across the axis, and the work of a torque; from the displacements ``d (ne, nl)``."""
        if self.components == 6:
            return super().geometric_stiffness(d)
        u = d.reshape(len(d), 2, 3)
        strain = np.einsum("ea,ea->e", self.axis, u[:, 1] - u[:, 0]) / self.length
        tension = self.section.material.E * self.section.A * strain
        across = np.eye(3) - np.einsum("ea,eb->eab", self.axis, self.axis)
        return self._between_nodes((tension / self.length)[:, None, None] * across, np.zeros_like(across))

    def energy(self, d: np.ndarray) -> np.ndarray:
        """Return the strain energy ``(ne,)`` at finite displacements ``d (ne, nl)``."""
        if self.components == 6:
            return super().energy(d)
        u = d.reshape(len(d), 2, 3)
        long = np.linalg.norm(self.length[:, None] * self.axis + u[:, 1] - u[:, 0], axis=1)
        return self.section.material.E * self.section.A / self.length * (long - self.length) ** 2 / 2

    @property
    def arm(self) -> np.ndarray:
        """(ne, 2, 3): none."""
        return np.zeros((len(self.nodes), 2, 3))

    @property
    def position(self) -> np.ndarray:
        """(ne, 2, 3) ends in the bar's axes, m."""
        position = np.zeros((len(self.nodes), 2, 3))
        position[:, 1, 0] = self.length
        return position

    @property
    def axes_rotation(self) -> np.ndarray:
        """(ne, 3, 12) rotation of the bar's axes per local DOF."""
        return line_rotation(self.length)

    @property
    def frame(self) -> np.ndarray:
        """(ne, 3, 3) right-handed axes, the first row along each bar."""
        aside = np.eye(3)[np.argmin(np.abs(self.axis), axis=1)]
        e2 = np.cross(aside, self.axis)
        e2 /= np.linalg.norm(e2, axis=1, keepdims=True)
        return np.stack([self.axis, e2, np.cross(self.axis, e2)], axis=1)

    def nodal_stress(self, d: np.ndarray) -> NodalStress:
        """Axial stress for displacements ``d (ne, nl, k)``."""
        u = d.reshape(len(d), 2, self.components, -1)[:, :, :3]
        strain = np.einsum("ea,eak->ek", self.axis, u[:, 1] - u[:, 0]) / self.length[:, None]
        values = np.repeat(self.section.material.E * strain[:, None, None], 2, axis=1)
        return {"": (("xx",), values)}

    def piece(self, some: slice | np.ndarray) -> TrussBlock:
        """Return the block of `some` of the bars."""
        names = ("nodes", "ends", "axis", "length")
        return replace(self, **{name: getattr(self, name)[some] for name in names})

    def volume(self) -> np.ndarray:
        """Area times length ``(ne,)``, m^3."""
        return self.section.A * self.length

    def mass(self) -> MassObjects:
        """Consistent mass of a line without thickness."""
        rho = (self.section.material.rho * self.section.A + self.section.nsm) * self.length
        ne = len(rho)
        c = self.components
        scalar = rho[:, None, None] * LINEAR_MASS
        g = np.zeros((ne, 2, c, 3))
        h = np.zeros((ne, 2, c, 3, 3))
        moment = scalar @ self.ends
        for a in range(3):
            g[:, :, a, a] = rho[:, None] / 2
            h[:, :, a, a] = moment
        E0 = np.einsum("eia,eij,ejb->ab", self.ends, scalar, self.ends)
        rigid = RigidInertia(float(rho.sum()), moment.sum(axis=(0, 1)), (E0 + E0.T) / 2)
        return MassObjects(g.reshape(ne, -1, 3), h.reshape(ne, -1, 3, 3), rigid, "scalar", scalar)

    def _between_nodes(self, translation: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        """Put ``[[k, -k], [-k, k]]`` of ``(ne, 3, 3)`` matrices on the DOFs."""
        ne = len(self.length)
        c = self.components
        K = np.zeros((ne, 2, c, 2, c))
        for i in range(2):
            for j in range(2):
                sign = 1 if i == j else -1
                K[:, i, :3, j, :3] = sign * translation
                K[:, i, 3:, j, 3:] = sign * rotation[:, : c - 3, : c - 3]
        return K.reshape(ne, 2 * c, 2 * c)
