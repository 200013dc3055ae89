"""Curved shells of six, eight and nine nodes: tied strains of a mid-surface with directors (theory 7.8).

Every element takes the normals of its own surface at its nodes as directors. Its strains at finite displacements, where
a director rotates by the rotation vector of its node, are products of nodal vectors with the coefficients of
`tied_triangles` and `tied_quads`: stiffness, geometric stiffness and strain energy are the second derivative, the third
derivative and the value of one expression. The drilling rotation is tied to the membrane.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.elements.arms import RotatingArms
from modalprep.fe.elements.block import Block, NodalStress
from modalprep.fe.elements.kernels import in_threads, quadratic
from modalprep.fe.elements.mass import MassObjects, NodalFunctions
from modalprep.fe.elements.shells.curved_surface import Points, surface_points, tangents
from modalprep.fe.elements.shells.frames import given, material_angle, shell_frames
from modalprep.fe.elements.shells.laminate import faces, rotated_moduli, section_moduli, shell_section, total_thickness
from modalprep.fe.elements.shells.thickness import thickness_ratio
from modalprep.fe.elements.shells.tied_quads import quad_forms
from modalprep.fe.elements.shells.tied_strains import CURVATURE, Forms
from modalprep.fe.elements.shells.tied_triangles import triangle_forms
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.reference_cells import NODES, shapes, shapes_at
from modalprep.fe.properties.properties import Shell
from modalprep.vectors import skew

DEGREE = {"triangle6": 4, "quad8": 5, "quad9": 5}  # of the quadrature: 6 or 3 x 3 points
DRILLING = 1e-3  # of the membrane's shear stiffness: ten times more changes the tests by 1e-4 to 1e-2
STEEPEST = 0.25  # cosine between the plane of the corners and the surface: an element spans 75 degrees at most


@dataclass(frozen=True, eq=False)
class CurvedShell(Block):
    """Curved shells of one kind and property: geometry, strains, stiffness and mass.

    `curved.CurvedShellBlock` adds finite displacements.

    Attributes
    ----------
    kind : {"triangle6", "quad8", "quad9"}
    nodes : (ne, n) int
    x : (ne, n, 3)
        Mid-surface at the nodes in the model's frame, m.
    normal : (ne, n, 3)
        Unit normals there, mesh axes.
    frame : (ne, 3, 3)
        Rows e1 as that of flat shells on the corners, e2, e3 normal to the plane of the corners.
    offset : (ne,)
        From the nodes to the mid-surface along the normals, m.
    angle : (ne,)
        From e1 to axis 1 of the material, rad.
    ratio : (ne, n) or None
        Thickness at the nodes over that of the section, where the mesh prescribes it.
    """

    components = 6
    alike = (2,)
    tensor = "functions"
    kind: str
    section: Shell
    nodes: np.ndarray
    x: np.ndarray
    normal: np.ndarray
    frame: np.ndarray
    offset: np.ndarray
    angle: np.ndarray
    ratio: np.ndarray | None = None

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> Self:
        """Take the elements ``nodes (ne, n)`` at ``points (k, 3)`` (mesh axes); `origin` is the model's origin.

        `data` may override ``axis (ne, 3)``, ``angle (ne,)``, ``offset (ne,)`` and the thickness.

        Raises
        ------
        InputError
            When an element has no area, is folded or too strongly curved, or its material axis is normal to it.
        """
        at = points[nodes]
        corners = points[nodes[:, : len(CELLS[kind].corners)]]
        frame = shell_frames(corners)
        _refuse_bad_shape(kind, at, frame)
        normal = tangents(kind, at, NODES)[1]
        offset = given(data, "offset", section.offset, len(nodes))
        x = at + offset[:, None, None] * normal - origin
        angle = material_angle(corners, frame, section, data)
        ratio = thickness_ratio(kind, section, data, len(nodes))
        return cls(kind, section, nodes, x, normal, frame, offset, angle, ratio)

    @property
    def degree(self) -> int:
        """Degree of the quadrature."""
        return DEGREE[self.kind]

    @property
    def shapes(self) -> np.ndarray:
        """Shape functions ``(nq, n)`` at its points."""
        return shapes(self.kind, self.degree)[0]

    def forms(self, degree: int) -> list[Forms]:
        """Coefficients of the covariant strains at the points of a rule; of quads, of what is added to all points.

        Where sides are not parallel, the means of tied and plain strains differ; `_missing` is the difference, as
        it is between straight sides. A constant stress is then exact.
        """
        if self.kind == "triangle6":
            return [triangle_forms(degree)]
        return [quad_forms(self.kind, degree), self._missing]

    @cached_property
    def _missing(self) -> Forms:
        tied, plain = (quad_forms(self.kind, self.degree, tied) for tied in (True, False))
        corners = shapes_at("quad", CELLS[self.kind].node_coordinates().T)[0] @ self.x[:, :4]
        normal = np.broadcast_to(self.frame[:, None, 2], corners.shape)
        at = surface_points(self.kind, corners, normal, self.frame, self.degree)
        weight = shapes(self.kind, self.degree)[2]
        share = at.cartesian * (at.dx / weight / at.dx.sum(axis=1, keepdims=True))[..., None, None]
        share = (share - np.tensordot(share, weight, (1, 0))[:, None]) * weight[:, None, None]
        gaps = (np.tensordot(share, b - a, ((1, 3), (0, 1))) for a, b in zip(tied[:3], plain[:3], strict=True))
        return Forms(*gaps, lead="e")

    @cached_property
    def points(self) -> Points:
        """The surface at the points of the quadrature."""
        return self._points(self.degree)

    @cached_property
    def strain(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Strain rows ``B (ne, nq, 9, 6n)`` per nodal DOF, moduli ``(ne or 1, 9, 9)`` and ``dx (ne, nq)``, m^2.

        Rows: membrane 3, curvature 3, shear 2, drilling 1, in the axes of `Points`. Where the thickness varies, area
        and curvature are enlarged as it is, for the moduli of the section.
        """
        B = np.concatenate([self._rows(self.degree), self._drilling(self.points)[:, :, None]], axis=2)
        return self.relaxed(self.thickened(B, self.degree)), self.row_moduli, self._area

    @property
    def _area(self) -> np.ndarray:
        return self.points.dx * self._growth(self.degree)

    def thickened(self, strain: np.ndarray, degree: int) -> np.ndarray:
        """Multiply the curvatures of strains ``(ne, nq, 8 or more, k)`` by the thickness over that of the section."""
        if self.ratio is None:
            return strain
        strain = strain.copy()
        strain[:, :, CURVATURE] *= self._growth(degree)[..., None, None]
        return strain

    @cached_property
    def row_moduli(self) -> np.ndarray:
        """Moduli ``(ne or 1, 9, 9)`` of the rows of `strain`; complex where those of the section are."""
        C, S = section_moduli(shell_section(self.section), self.angle)
        moduli = np.zeros((len(C), 9, 9), dtype=np.result_type(C, S))
        moduli[:, :6, :6] = C
        moduli[:, 6:8, 6:8] = S
        moduli[:, 8, 8] = DRILLING * C[:, 2, 2]
        return moduli

    def relaxed(self, strain: np.ndarray) -> np.ndarray:
        """Add to strains ``(ne, nq, 9, k)`` those of the internal rotations that bring the energy to its minimum."""
        forms = self.forms(self.degree)
        dx = self._area
        if not forms[0].turned.any():
            return strain
        own = self.along_axes(self.points, *(form.of_tau(self.x, self.frame[:, :2]) for form in forms))
        own = self.thickened(np.concatenate([own, np.zeros((*dx.shape, 1, 2))], axis=2), self.degree)
        weighted = np.swapaxes(own, 2, 3) @ (self.row_moduli[:, None] * dx[..., None, None])
        size = np.linalg.solve((weighted @ own).sum(axis=1), (weighted @ strain).sum(axis=1))
        return strain - own @ size[:, None]

    def stiffness(self) -> np.ndarray:
        """Elastic stiffness ``(ne, 6n, 6n)``."""
        B, C, dx = self.strain
        K = np.zeros((len(dx), *2 * B.shape[3:]))
        in_threads(quadratic, len(dx), np.ascontiguousarray(B), C, dx, K)
        return K

    def mass(self) -> MassObjects:
        """Every mass object of theory 1: samples of the surface of the mass, and of the thickness."""
        return self._samples().mass()

    def rotating_arms(self) -> RotatingArms:
        """Mass on the directors of the nodes: of eccentric and unsymmetric sections, and through the thickness."""
        samples = self._samples()
        N = self.shapes
        weight = samples.weight
        position = samples.position
        shape = samples.shape()
        ne = len(weight)
        nq, n = N.shape
        rotation = np.zeros((ne, n, 3, n, 6))
        for i in range(n):
            rotation[:, i, :, i, 3:] = np.eye(3)
        parts = []
        for some, arm, unit in (
            (slice(0, nq), self._height[:, None, None] * self.normal, 1.0),
            (slice(nq, None), self.normal, 0.0),
        ):
            share = weight[:, :, None][:, some] * N  # (ne, nq, n)
            fields = np.zeros((ne, n, 3, 12))
            for a in range(3):
                fields[:, :, a, a] = unit * share.sum(axis=1)
                fields[:, :, a, 3 + 3 * a : 6 + 3 * a] = share.transpose(0, 2, 1) @ position[:, some]
            inertia = np.einsum("eqi,eqaj->eiaj", share, shape[:, some], optimize=True)
            parts.append(RotatingArms(arm, rotation.reshape(ne, n, 3, 6 * n), fields, inertia))
        return RotatingArms.joined(parts)

    def volume(self) -> np.ndarray:
        """Area times thickness ``(ne,)``, m^3."""
        return total_thickness(self.section) * self._area.sum(axis=1)

    def nodal_stress(self, d: np.ndarray) -> NodalStress:
        """Stress ``xx, yy, xy`` in both faces at the nodes for displacements ``d (ne, 6n, k)``.

        Along the projection of e1 on the surface and across it; the top is towards the normal.
        """
        strain = self.thickened(self._rows(NODES)[:, :, :6] @ d[:, None], NODES)
        at = {}
        for face, (stretched, bent) in faces(self.section).items():
            Q = np.concatenate([rotated_moduli(Q, self.angle) for Q in (stretched, bent)], axis=2)
            at[face] = (("xx", "yy", "xy"), Q[:, None] @ strain)
        return at

    def piece(self, some: slice | np.ndarray) -> Self:
        """Return the block of `some` of the elements."""
        names = ("nodes", "x", "normal", "frame", "offset", "angle")
        ratio = None if self.ratio is None else self.ratio[some]
        return replace(self, ratio=ratio, **{name: getattr(self, name)[some] for name in names})

    @property
    def _height(self) -> np.ndarray:
        """Height ``(ne,)`` of the surface of the mass over the nodes, m."""
        s = shell_section(self.section)
        return self.offset + s.lift

    def _samples(self) -> NodalFunctions:
        """Samples of the surface of the mass, then of the thickness about it."""
        s = shell_section(self.section)
        N = self.shapes
        dx = self.points.dx
        height = self._height
        ratio = self._growth(self.degree)
        nsm = self.section.nsm
        thick = np.zeros((*dx.shape, N.shape[1], 10))
        thick[..., :9] = N[..., None] * -skew(self.normal).reshape(len(dx), 1, -1, 9)
        surface = height[:, None, None, None] * thick
        surface[..., 9] = N
        at = N @ (self.x + (height - self.offset)[:, None, None] * self.normal)
        return NodalFunctions(
            weight=np.concatenate(
                [(nsm + (s.mass - nsm) * ratio) * dx, (s.second - s.first * s.lift) * ratio**3 * dx], axis=1
            ),
            unit=np.repeat([1.0, 0.0], len(N)),
            position=np.concatenate([at, N @ self.normal], axis=1),
            values=np.concatenate([surface, thick], axis=1),
        )

    def _points(self, degree: int) -> Points:
        return surface_points(self.kind, self.x, self.normal, self.frame, degree)

    def _growth(self, degree: int) -> np.ndarray:
        """Thickness over that of the section, ``(ne, nq)`` or ``(1, 1)``."""
        return np.ones((1, 1)) if self.ratio is None else self.ratio @ shapes(self.kind, degree)[0].T

    def slopes(self, forms: Forms) -> tuple[np.ndarray, np.ndarray]:
        """Slopes ``(ne, nq, 8, n, 3)`` of covariant strains by displacements and by directors of the nodes."""
        by_x, by_t = forms.slopes(self.x, self.normal)
        return by_x, by_t + self.offset.reshape(-1, *[1] * (by_x.ndim - 1)) * by_x

    def along_axes(self, at: Points, tied: np.ndarray, *missing: np.ndarray) -> np.ndarray:
        """Strains ``(ne, nq, 8, k)`` along the axes of the points, from those of each of the `forms`."""
        strain = at.cartesian @ tied
        return strain + missing[0][:, None] if missing else strain

    def _rows(self, degree: int) -> np.ndarray:
        """Rows ``(ne, nq, 8, 6n)`` of the strains along the axes of `Points`, per nodal DOF."""
        rows = []
        for forms in self.forms(degree):
            by_x, by_t = self.slopes(forms)
            turning = np.cross(self.normal.reshape(len(by_t), *[1] * (by_t.ndim - 3), -1, 3), by_t)
            rows.append(np.concatenate([by_x, turning], axis=-1).reshape(*by_x.shape[:-2], -1))
        return self.along_axes(self.points if degree == self.degree else self._points(degree), *rows)

    def _drilling(self, at: Points) -> np.ndarray:
        """Rotation of the surface about its normal less that of the nodes, rows ``(ne, nq, 6n)``."""
        N, (e1, e2), (p1, p2) = self.shapes, *self.plane(at)
        by_x = at.gradient[:, :, 0, :, None] * e2[:, :, None] - at.gradient[:, :, 1, :, None] * e1[:, :, None]
        turning = N[..., None] * (np.cross(e2, p1) - np.cross(e1, p2))[:, :, None]
        turning += self.offset[:, None, None, None] * np.cross(self.normal[:, None], by_x)
        return np.concatenate([by_x, turning], axis=3).reshape(*at.dx.shape, -1) / 2

    def plane(self, at: Points) -> tuple[np.ndarray, np.ndarray]:
        """Axes e1 and e2, and the slopes of the surface along them, each ``(2, ne, nq, 3)``."""
        return np.moveaxis(at.axes[:, :, :2], 2, 0), np.moveaxis(at.gradient @ self.x[:, None], 2, 0)


def _refuse_bad_shape(kind: str, x: np.ndarray, frame: np.ndarray) -> None:
    """Refuse elements ``x (ne, n, 3)`` without area or folded at a node or at a point of the quadrature."""
    size = np.ptp(x, axis=1).max(axis=1) ** 2
    bad = np.zeros(len(x), dtype=bool)
    for degree in (NODES, DEGREE[kind]):
        base, normal = tangents(kind, x, degree)
        area = np.linalg.norm(np.cross(base[:, :, 0], base[:, :, 1]), axis=2)
        steep = np.einsum("eqa,ea->eq", normal, frame[:, 2]) < STEEPEST
        bad |= np.any(steep | (area <= 1e-9 * size[:, None]), axis=1)
    if np.any(bad):
        at = ", ".join(f"{v:.4g}" for v in x[np.argmax(bad)].mean(axis=0))
        raise InputError(
            f"{bad.sum()} of {len(bad)} curved shell elements have no area, are folded or span more than 75 degrees, "
            f"the first near ({at}) m; move their mid-side nodes to the middle of the sides or mesh there finer"
        )
