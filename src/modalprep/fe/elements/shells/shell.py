"""Flat three-node and warped four-node shells: the plane strain fields in space, with eccentricity.

Every field is built per nodal DOF in mesh axes. A node at a height over the mean plane, or a mid-surface at a distance
from the nodes, is connected by a rigid arm along the normal: without it a warped quad would resist rigid rotation. The
drilling rotation carries no mass.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from modalprep.fe.elements.arms import RotatingArms, mass_arms, nodal_arms, node_transformation, section_arms
from modalprep.fe.elements.block import NodalStress
from modalprep.fe.elements.kernels import in_threads, quadratic
from modalprep.fe.elements.mass import MassObjects, MassSamples, mass_from_samples
from modalprep.fe.elements.shells.flat_fields import (
    DRILLING,
    TX,
    TY,
    FlatCells,
    bending,
    edge_rotation,
    incompatible_membrane,
    linked,
    membrane,
    nodal_rotations,
    optimal_membrane,
    shear,
)
from modalprep.fe.elements.shells.frames import given, material_angle, refuse_bad_shape, shell_frames
from modalprep.fe.elements.shells.laminate import (
    ShellSection,
    faces,
    rotated_moduli,
    section_moduli,
    shell_section,
    total_thickness,
)
from modalprep.fe.elements.shells.second_order import STIFFNESS_DEGREE, ShellInside
from modalprep.fe.mesh.reference_cells import NODES
from modalprep.fe.properties.properties import Shell

MASS_DEGREE = {"triangle": (4, 2), "quad": (4, 3)}  # of the displacement, quadratic across, and of the rotation
OPT_BETA = 0.01  # lower bound of the OPT triangle's beta_0, which vanishes at nu = 1/2


@dataclass(frozen=True, eq=False)
class ShellBlock(ShellInside):
    """Shells of one kind and property.

    Attributes
    ----------
    kind : {"triangle", "quad"}
    nodes : (ne, n) int
    frame : (ne, 3, 3)
        Rows e1, e2, e3 (normal).
    centre : (ne, 3)
        Mean of the nodes in the model's frame, m.
    xy : (ne, n, 2)
        Nodes in the mean plane, m.
    arm : (ne, n, 3)
        From the nodes to the mid-surface, mesh axes, m.
    angle : (ne,)
        From e1 to axis 1 of the material, rad.
    """

    alike = (2,)
    components = 6
    kind: str
    section: Shell
    nodes: np.ndarray
    frame: np.ndarray
    centre: np.ndarray
    xy: np.ndarray
    arm: np.ndarray
    offset: np.ndarray
    angle: np.ndarray

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> ShellBlock:
        """Take the elements ``nodes (ne, n)`` at ``points (k, 3)`` (mesh axes); `origin` is the model's origin.

        `data` may override ``axis (ne, 3)``, ``angle (ne,)`` and ``offset (ne,)``.

        Raises
        ------
        InputError
            When an element has no area, is crossed, or its material axis is normal to it.
        """
        corners = points[nodes]
        centre = corners.mean(axis=1)
        frame = shell_frames(corners)
        local = np.einsum("eka,eia->eik", frame, corners - centre[:, None])
        refuse_bad_shape(local[..., :2], centre)
        offset = given(data, "offset", section.offset, len(nodes))
        arm = (offset[:, None] - local[..., 2])[..., None] * frame[:, None, 2]
        angle = material_angle(corners, frame, section, data)
        return cls(kind, section, nodes, frame, centre - origin, local[..., :2], arm, offset, angle)

    @cached_property
    def _section(self) -> ShellSection:
        return shell_section(self.section)

    @cached_property
    def _to_local(self) -> np.ndarray:
        return node_transformation(self.frame, self.arm)

    @cached_property
    def moduli(self) -> tuple[np.ndarray, np.ndarray]:
        """``[[A, B], [B, D]] (ne or 1, 6, 6)`` and ``S (ne or 1, 2, 2)`` in the element's axes."""
        return section_moduli(self._section, self.angle)

    @cached_property
    def strain(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Strain rows ``B (ne, nq, ns, 6n)`` per nodal DOF in mesh axes, moduli ``(ne or 1, ns, ns)`` and ``dx``.

        Rows: membrane 3, curvature 3, shear 2, then drilling (1) or the OPT triangle's higher-order strains (3).
        """
        cells = FlatCells(self.kind, self.xy, STIFFNESS_DEGREE[self.kind])
        B, moduli = self._compatible(cells)
        if self.kind == "quad":
            B[:, :, :3] += incompatible_membrane(cells) @ _condensed(cells, B, moduli)[:, None]
        return self._of_nodes(B), moduli, cells.mapped[1]

    def _compatible(self, cells: FlatCells) -> tuple[np.ndarray, np.ndarray]:
        """Strain rows per local DOF, without the internal displacements of quads, and moduli."""
        C, S = self.moduli
        size, side = edge_rotation(cells, C[:, 3:, 3:], S)
        first, last, extra = self._membrane(cells, C)
        B = np.concatenate([first, bending(cells, size), shear(cells, side), last], axis=2)
        moduli = np.zeros((len(C), B.shape[2], B.shape[2]))
        moduli[:, :6, :6], moduli[:, 6:8, 6:8], moduli[:, 8:, 8:] = C, S, extra
        return B, moduli

    def _of_nodes(self, B: np.ndarray) -> np.ndarray:
        """Rows ``(ne, nq, ns, 6n)`` per local DOF, per nodal DOF in mesh axes."""
        ne, nq, ns, nl = B.shape
        return (B.reshape(ne, nq * ns, nl) @ self._to_local).reshape(B.shape)

    def _membrane(self, cells: FlatCells, C: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Membrane strains, the rows that stabilise drilling, and the moduli of these."""
        if self.kind == "triangle" and self.section.membrane == "opt":
            basic, higher = optimal_membrane(cells)
            nu2 = C[:, 0, 1] ** 2 / (C[:, 0, 0] * C[:, 1, 1])
            beta = np.maximum((1 - 4 * nu2) / 2, OPT_BETA)
            return np.repeat(basic[:, None], len(cells.N), axis=1), higher, 9 / 4 * beta[:, None, None] * C[:, :3, :3]
        B = membrane(cells)
        return B[:, :, :3], B[:, :, 3:], DRILLING[self.kind] * C[:, 2:3, 2:3]

    def stiffness(self) -> np.ndarray:
        """Elastic stiffness ``(ne, 6n, 6n)``."""
        B, C, dx = self.strain
        K = np.zeros((len(dx), B.shape[3], B.shape[3]))
        in_threads(quadratic, len(dx), B, C, dx, K)
        return K

    def forces(self, d: np.ndarray) -> np.ndarray:
        """Membrane forces and moments ``(ne, nq, 6)``: N/m and N, element axes, for displacements ``d (ne, 6n)``."""
        B, C, _ = self.strain
        strain = np.einsum("eqbj,ej->eqb", B[:, :, :6], d)
        return strain @ C[:, :6, :6]

    def nodal_stress(self, d: np.ndarray) -> NodalStress:
        """Stress ``xx, yy, xy`` in both faces at the nodes, element axes, for displacements ``d (ne, 6n, k)``.

        Of the membrane strains and curvatures that make `forces`; the top is towards +e3.
        """
        own, nodes = (FlatCells(self.kind, self.xy, degree) for degree in (STIFFNESS_DEGREE[self.kind], NODES))
        B = self._compatible(nodes)[0]
        if self.kind == "quad":
            B[:, :, :3] += incompatible_membrane(nodes) @ _condensed(own, *self._compatible(own))[:, None]
        strain = self._of_nodes(B)[:, :, :6] @ d[:, None]
        at = {}
        for face, (stretched, bent) in faces(self.section).items():
            Q = np.concatenate([rotated_moduli(Q, self.angle) for Q in (stretched, bent)], axis=2)
            at[face] = (("xx", "yy", "xy"), Q[:, None] @ strain)
        return at

    def piece(self, some: slice | np.ndarray) -> ShellBlock:
        """Return the block of `some` of the elements."""
        names = ("nodes", "frame", "centre", "xy", "arm", "offset", "angle")
        return replace(self, **{name: getattr(self, name)[some] for name in names})

    def mass(self) -> MassObjects:
        """Every mass object of theory 1: samples of the mid-surface, and of the thickness."""
        s = self._section
        surface, sheet = (FlatCells(self.kind, self.xy, degree) for degree in MASS_DEGREE[self.kind])
        z = s.first / s.mass
        middle, thick = self._translation(surface), self._rotation(sheet)
        if z:
            middle += z * self._rotation(surface)
        at = self._surface_points(surface, z)
        shape = self._mesh_axes(np.concatenate([middle, thick], axis=1))
        normal = np.repeat(self.frame[:, None, 2], len(sheet.N), axis=1)
        dx = surface.mapped[1], sheet.mapped[1]
        weight = np.concatenate([s.mass * dx[0], (s.second - s.mass * z**2) * dx[1]], axis=1)
        unit = np.repeat([1.0, 0.0], [len(surface.N), len(sheet.N)])
        return mass_from_samples(MassSamples(weight, unit, np.concatenate([at, normal], axis=1), shape))

    def rotating_arms(self) -> RotatingArms:
        """Mass off the surface of the nodes: through the thickness, of unsymmetric laminates, of eccentric elements."""
        s, mass = self._section, self.mass()
        surface, sheet = (FlatCells(self.kind, self.xy, degree) for degree in MASS_DEGREE[self.kind])
        z = s.first / s.mass
        normal = self.frame[:, None, 2]
        parts = [nodal_arms(mass, self.arm)] if np.any(self.arm) else []
        thick = (s.second - s.mass * z**2) * sheet.mapped[1]
        parts.append(section_arms(thick, normal, self._rotations(sheet)))
        if z:
            shape = self._mesh_axes(self._translation(surface) + z * self._rotation(surface))
            at = self._surface_points(surface, z)
            parts.append(mass_arms(s.mass * surface.mapped[1], at, shape, z * normal, self._rotations(surface)))
        return RotatingArms.joined(parts)

    def _rotations(self, cells: FlatCells) -> np.ndarray:
        """Rotation ``(ne, nq, 3, 6n)`` per nodal DOF, mesh axes."""
        return self._mesh_axes(nodal_rotations(cells)[0])

    def _mesh_axes(self, rows: np.ndarray) -> np.ndarray:
        """Vectors ``(ne, nq, 3, 6n)`` in the element's axes per local DOF, in mesh axes per nodal DOF."""
        turned = np.swapaxes(self.frame, 1, 2)[:, None] @ rows
        return (turned.reshape(len(rows), -1, rows.shape[3]) @ self._to_local).reshape(rows.shape)

    def _surface_points(self, cells: FlatCells, z: float) -> np.ndarray:
        """Points ``(ne, nq, 3)`` at the distance z from the mid-surface, model frame, m."""
        at = (cells.N @ self.xy) @ self.frame[:, :2] + self.centre[:, None]
        return at + ((self.offset + z)[:, None] * self.frame[:, 2])[:, None]

    def _translation(self, cells: FlatCells) -> np.ndarray:
        """Mid-surface displacement ``(ne, nq, 3, 6n)``; w is linked to the rotations by its edge functions."""
        n, (ne, nq) = self.xy.shape[1], cells.mapped[1].shape
        u = np.zeros((ne, nq, 3, n, 6))
        for a in range(3):
            u[:, :, a, :, a] = cells.N
        u = u.reshape(ne, nq, 3, 6 * n)
        u[:, :, 2] += cells.bubbles()[0] @ linked(cells)
        return u

    def _rotation(self, cells: FlatCells) -> np.ndarray:
        """Displacement ``(ty, -tx, 0)`` per unit distance from the mid-surface ``(ne, nq, 3, 6n)``."""
        n, (ne, nq) = self.xy.shape[1], cells.mapped[1].shape
        b = np.zeros((ne, nq, 3, n, 6))
        b[:, :, 0, :, TY], b[:, :, 1, :, TX] = cells.N, -cells.N
        return b.reshape(ne, nq, 3, 6 * n)

    def volume(self) -> np.ndarray:
        """Area times thickness ``(ne,)``, m^3."""
        area = FlatCells(self.kind, self.xy, STIFFNESS_DEGREE[self.kind]).mapped[1].sum(axis=1)
        return total_thickness(self.section) * area


def _condensed(cells: FlatCells, B: np.ndarray, C: np.ndarray) -> np.ndarray:
    """Internal displacements of QM6 per local DOF ``(ne, 4, 24)``."""
    inner, dx = incompatible_membrane(cells), cells.mapped[1]
    weighted = np.swapaxes(inner, 2, 3) @ (C[:, None, :3] * dx[..., None, None])  # (ne, nq, 4, ns)
    ne, nq, m, ns = weighted.shape
    K_bb = (weighted[..., :3] @ inner).sum(axis=1)
    K_ba = weighted.transpose(0, 2, 1, 3).reshape(ne, m, nq * ns) @ B.reshape(ne, nq * ns, -1)
    return -np.linalg.solve(K_bb, K_ba)
