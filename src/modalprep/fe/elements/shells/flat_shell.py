"""Flat three-node and warped four-node shells: the plane strain fields in space, with eccentricity.

Bending and shear are DKMT/DKMQ (Katili 1993): the rotation field ``b = (ty, -tx)`` is linear plus one edge function per
side, whose size follows from the side's shear strain. Membrane: OPT, Felippa's optimal triangle with drilling freedoms
(2003), or constant strain; QM6 (Wilson, Taylor) for quads. Constant strain and QM6 tie the drilling rotation to the
membrane's (Hughes and Brezzi).

Every field is built per nodal DOF in mesh axes. A node at a height over the mean plane, or a mid-surface at a distance
from the nodes, is connected by a rigid arm along the normal: without it a warped quad would resist rigid rotation. The
drilling rotation carries no mass.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from modalprep.fe.elements.arms import RotatingArms, mass_arms, nodal_arms, node_transformation, section_arms
from modalprep.fe.elements.block import Block, NodalStress
from modalprep.fe.elements.kernels import in_threads
from modalprep.fe.elements.mass import MassObjects, NodalFunctions
from modalprep.fe.elements.shells.flat_fields import FlatCells, rule
from modalprep.fe.elements.shells.flat_kernels import Geometry, mass_samples, stiffness, strain_rows
from modalprep.fe.elements.shells.flat_strains import Moduli
from modalprep.fe.elements.shells.frames import given, material_angle, refuse_bad_shape, shell_frames
from modalprep.fe.elements.shells.laminate import (
    ShellSection,
    faces,
    rotated_moduli,
    section_moduli,
    shell_section,
    total_thickness,
)
from modalprep.fe.elements.shells.thickness import thickness_ratio
from modalprep.fe.elements.shells.yielding import yielding_map, yielding_nodes
from modalprep.fe.mesh.reference_cells import NODES
from modalprep.fe.properties.properties import Shell

STIFFNESS_DEGREE = {"triangle": 2, "quad": 3}
MASS_DEGREE = {"triangle": (4, 2), "quad": (4, 3)}  # of the displacement, quadratic across, and of the rotation
DRILLING = {"quad": 0.05, "triangle": 1e-2}  # much less is too soft, much more stiffens curved shells (theory 7.4)
OPT_BETA = 0.01  # lower bound of the OPT triangle's beta_0, which vanishes at nu = 1/2


@dataclass(frozen=True, eq=False)
class FlatShell(Block):
    """Shells of one kind and property: geometry, strains, stiffness and mass; `shell.ShellBlock` adds second order.

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
    height : (ne, n)
        From the nodes to the mid-surface along the normal, m.
    offset : (ne,)
        From the mean plane of the nodes to the mid-surface, m.
    angle : (ne,)
        From e1 to axis 1 of the material, rad.
    ratio : (ne, n) or None
        Thickness at the nodes over that of the section, where the mesh prescribes it.
    yields : (ne, n) bool or None
        Where the drilling rotation yields to eccentric beams (`yielding`); None where it does nowhere.
    """

    alike = (2,)
    tensor = "functions"
    components = 6
    kind: str
    section: Shell
    nodes: np.ndarray
    frame: np.ndarray
    centre: np.ndarray
    xy: np.ndarray
    height: np.ndarray
    offset: np.ndarray
    angle: np.ndarray
    ratio: np.ndarray | None = None
    yields: np.ndarray | None = None

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> Self:
        """Take the elements ``nodes (ne, n)`` at ``points (k, 3)`` (mesh axes); `origin` is the model's origin.

        `data` may override ``axis (ne, 3)``, ``angle (ne,)``, ``offset (ne,)`` and the thickness, and give the arms of
        beams, ``beam_arm (ne, n, 3)``.

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
        height = offset[:, None] - local[..., 2]
        angle = material_angle(corners, frame, section, data)
        ratio = thickness_ratio(kind, section, data, len(nodes))
        xy = local[..., :2].copy()
        yields = None
        if "beam_arm" in data:
            yields = yielding_nodes(data["beam_arm"], frame[:, 2], offset, xy)
            yields = yields if yields.any() else None
        return cls(kind, section, nodes, frame, centre - origin, xy, height, offset, angle, ratio, yields)

    @property
    def arm(self) -> np.ndarray:
        """(ne, n, 3) from the nodes to the mid-surface, mesh axes, m."""
        return self.height[..., None] * self.frame[:, None, 2]

    @cached_property
    def _section(self) -> ShellSection:
        return shell_section(self.section)

    @property
    def _geometry(self) -> Geometry:
        return Geometry(self.xy, self.frame, self.height)

    @cached_property
    def moduli(self) -> tuple[np.ndarray, np.ndarray]:
        """``[[A, B], [B, D]] (ne or 1, 6, 6)`` and ``S (ne or 1, 2, 2)`` in the element's axes.

        Where the thickness varies, means over the element: of it, and of its cube for D.
        """
        C, S = section_moduli(self._section, self.angle)
        if self.ratio is None:
            return C, S
        first, third = self._mean_ratio
        grown = np.repeat([first, third], 3, axis=0).T
        return C * np.sqrt(grown[:, :, None] * grown[:, None, :]), S * first[:, None, None]

    @cached_property
    def _mean_ratio(self) -> tuple[np.ndarray, np.ndarray]:
        """Means (ne,) over the element of the thickness over that of the section, and of its cube."""
        cells = FlatCells(self.kind, self.xy, MASS_DEGREE[self.kind][0])
        ratio = self._ratio_at(cells.N)
        share = cells.mapped[1]
        first, third = (np.sum(share * ratio**k, axis=1) / np.sum(share, axis=1) for k in (1, 3))
        return first, third

    def _ratio_at(self, N: np.ndarray) -> np.ndarray:
        """Thickness over that of the section, ``(ne, nq)`` or ``(1, 1)``, where the shapes are ``N (nq, n)``."""
        return np.ones((1, 1)) if self.ratio is None else self.ratio @ N.T

    @cached_property
    def strain(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Strain rows ``B (ne, nq, ns, 6n)`` per nodal DOF in mesh axes, moduli ``(ne or 1, ns, ns)`` and ``dx``.

        Rows: membrane 3, curvature 3, shear 2, then drilling (1) or the OPT triangle's higher-order strains (3).
        """
        B, dx = self._strain_rows(STIFFNESS_DEGREE[self.kind])
        plane, bend, coupling = self.row_moduli
        membrane = slice(0, 3)
        moduli = np.zeros((len(plane), *2 * B.shape[2:3]))
        rows = np.r_[membrane, 8 : B.shape[2]]
        moduli[:, rows[:, None], rows], moduli[:, 3:8, 3:8] = plane, bend
        moduli[:, membrane, 3:6] = moduli[:, 3:6, membrane] = coupling
        return B, moduli, dx

    def _strain_rows(self, degree: int) -> tuple[np.ndarray, np.ndarray]:
        """Strain rows ``B (ne, nq, ns, 6n)`` and ``dx (ne, nq)`` at the points of a rule."""
        own = rule(self.kind, STIFFNESS_DEGREE[self.kind])
        at = rule(self.kind, degree)
        ne, n = self.nodes.shape
        nq = len(at.weight)
        ns = 5 + self.row_moduli.plane.shape[1]
        B = np.empty((ne, nq, ns, 6 * n))
        dx = np.empty((ne, nq))
        in_threads(strain_rows, ne, self._geometry, self.row_moduli, self._optimal, own, at, B, dx)
        if self._felt is not None:
            some, felt = self._felt
            B[some] = B[some] @ felt[:, None]
        return B, dx

    @cached_property
    def _felt(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Elements whose drilling rotations yield (k,), and what they feel per nodal DOF, mesh axes (k, 6n, 6n)."""
        if self.yields is None:
            return None
        some = np.flatnonzero(self.yields.any(axis=1))
        ends = node_transformation(self.frame[some], self.arm[some])
        return some, np.linalg.solve(ends, yielding_map(self.kind, self.xy[some], self.yields[some]) @ ends)

    @property
    def _optimal(self) -> bool:
        return self.kind == "triangle" and self.section.membrane == "opt"

    @cached_property
    def row_moduli(self) -> Moduli:
        """Moduli of the rows of `strain`; complex where those of the section are."""
        C, S = self.moduli
        extra = DRILLING[self.kind] * C[:, 2:3, 2:3]
        if self._optimal:
            nu2 = C[:, 0, 1] ** 2 / (C[:, 0, 0] * C[:, 1, 1])
            extra = 9 / 4 * np.maximum((1 - 4 * nu2) / 2, OPT_BETA)[:, None, None] * C[:, :3, :3]
        kind = np.result_type(C, S)
        plane, bend = (np.zeros((len(C), m, m), dtype=kind) for m in (3 + extra.shape[1], 5))
        plane[:, :3, :3] = C[:, :3, :3]
        plane[:, 3:, 3:] = extra
        bend[:, :3, :3] = C[:, 3:, 3:]
        bend[:, 3:, 3:] = S
        return Moduli(plane, bend, np.ascontiguousarray(C[:, :3, 3:]))

    def stiffness(self) -> np.ndarray:
        """Elastic stiffness ``(ne, 6n, 6n)``."""
        ne, n = self.nodes.shape
        K = np.empty((ne, 6 * n, 6 * n))
        at = rule(self.kind, STIFFNESS_DEGREE[self.kind])
        in_threads(stiffness, ne, self._geometry, self.row_moduli, self._optimal, at, K)
        if self._felt is not None:
            some, felt = self._felt
            K[some] = felt.transpose(0, 2, 1) @ K[some] @ felt
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
        strain = self._strain_rows(NODES)[0][:, :, :6] @ d[:, None]
        strain[:, :, 3:] *= self._ratio_at(np.eye(self.nodes.shape[1]))[..., None, None]
        at = {}
        for face, (stretched, bent) in faces(self.section).items():
            Q = np.concatenate([rotated_moduli(Q, self.angle) for Q in (stretched, bent)], axis=2)
            at[face] = (("xx", "yy", "xy"), Q[:, None] @ strain)
        return at

    def piece(self, some: slice | np.ndarray) -> Self:
        """Return the block of `some` of the elements."""
        names = ("nodes", "frame", "centre", "xy", "height", "offset", "angle")
        ratio, yields = (None if x is None else x[some] for x in (self.ratio, self.yields))
        return replace(self, ratio=ratio, yields=yields, **{name: getattr(self, name)[some] for name in names})

    def mass(self) -> MassObjects:
        """Every mass object of theory 1: samples of the mid-surface, and of the thickness."""
        return self._mass_samples.mass()

    def rotating_arms(self) -> RotatingArms:
        """Mass off the surface of the nodes: through the thickness, of unsymmetric laminates, of eccentric elements."""
        at = self._mass_samples
        count = self._counts[0]
        normal = self.frame[:, None, 2]
        surface, sheet = MASS_DEGREE[self.kind]
        parts = [nodal_arms(at.mass(), self.arm)] if np.any(self.arm) else []
        parts.append(section_arms(at.weight[:, count:], normal, self._rotations(sheet)))
        if self._lift:
            own = at.weight[:, :count], at.position[:, :count], at.shape()[:, :count]
            parts.append(mass_arms(*own, self._lift * normal, self._rotations(surface)))
        return RotatingArms.joined(parts)

    @property
    def _lift(self) -> float:
        """Height of the mass over the mid-surface, m."""
        return self._section.lift

    @property
    def _counts(self) -> list[int]:
        """Numbers of samples of the surface of the mass, and of the thickness."""
        return [len(rule(self.kind, degree).weight) for degree in MASS_DEGREE[self.kind]]

    @property
    def _mass_samples(self) -> NodalFunctions:
        """Samples of the surface of the mass, then of the thickness about it."""
        ne, n = self.nodes.shape
        ns = sum(self._counts)
        rules = [rule(self.kind, k) for k in MASS_DEGREE[self.kind]]
        dx = np.empty((ne, ns))
        position = np.empty((ne, ns, 3))
        values = np.empty((ne, ns, n, 10))
        middle = self.centre + self.offset[:, None] * self.frame[:, 2]
        in_threads(mass_samples, ne, self._geometry, middle, self._lift, *rules, dx, position, values)
        s, nsm = self._section, self.section.nsm
        surface, sheet = np.split(dx, self._counts[:1], axis=1)
        ratio = [self._ratio_at(at.N) for at in rules]
        surface = (nsm + (s.mass - nsm) * ratio[0]) * surface
        sheet = (s.second - s.mass * self._lift**2) * ratio[1] ** 3 * sheet
        weight = np.concatenate([surface, sheet], axis=1)
        return NodalFunctions(weight, np.repeat([1.0, 0.0], self._counts), position, values)

    def _rotations(self, degree: int) -> np.ndarray:
        """Rotation ``(ne, nq, 3, 6n)`` per nodal DOF, mesh axes."""
        N = rule(self.kind, degree).N
        ne, n = self.nodes.shape
        t = np.zeros((ne, len(N), 3, n, 6))
        for a in range(3):
            t[:, :, a, :, 3 + a] = N
        return t.reshape(ne, len(N), 3, 6 * n)

    def volume(self) -> np.ndarray:
        """Area times thickness ``(ne,)``, m^3."""
        area = FlatCells(self.kind, self.xy, STIFFNESS_DEGREE[self.kind]).mapped[1].sum(axis=1)
        return total_thickness(self.section) * area * (1.0 if self.ratio is None else self._mean_ratio[0])
