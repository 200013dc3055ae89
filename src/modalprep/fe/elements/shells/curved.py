"""Curved six-node shell: tied strains of a mid-surface with directors, drilling tied to the membrane (theory 7.8).

Every element takes the normals of its own surface at its nodes as directors. Strains are those of `tied_strains` at
finite displacements, where a director rotates by the rotation vector of its node: stiffness, geometric stiffness and
strain energy are the second derivative, the third derivative and the value of one expression.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.elements.arms import RotatingArms
from modalprep.fe.elements.block import NodalStress
from modalprep.fe.elements.kernels import in_threads, quadratic
from modalprep.fe.elements.mass import MassObjects, NodalFunctions
from modalprep.fe.elements.shells.frames import given, material_angle, shell_frames
from modalprep.fe.elements.shells.laminate import faces, rotated_moduli, section_moduli, shell_section, total_thickness
from modalprep.fe.elements.shells.tied_strains import CELL, Points, bubble_forms, strain_forms, surface_points, tangents
from modalprep.fe.links.interface import link_geometric_stiffness
from modalprep.fe.mesh.reference_cells import NODES, shapes
from modalprep.fe.properties.properties import Shell
from modalprep.vectors import rotation_matrix, skew

DEGREE = 4  # of the quadrature: the shear strains of a straight-sided element are quadratic
DRILLING = 1e-3  # of the membrane's shear stiffness: ten times more changes the tests by 1e-4 to 1e-2
STEEPEST = 0.25  # cosine between the plane of the corners and the surface: an element spans 75 degrees at most


@dataclass(frozen=True, eq=False)
class CurvedShellBlock:
    """Six-node shells of one property.

    Attributes
    ----------
    nodes : (ne, 6) int
    x : (ne, 6, 3)
        Mid-surface at the nodes in the model's frame, m.
    normal : (ne, 6, 3)
        Unit normals there, mesh axes.
    frame : (ne, 3, 3)
        Rows e1 along the first side, e2, e3 normal to the plane of the corners.
    offset : (ne,)
        From the nodes to the mid-surface along the normals, m.
    angle : (ne,)
        From e1 to axis 1 of the material, rad.
    """

    components = 6
    alike = (2,)
    tensor = "functions"
    section: Shell
    nodes: np.ndarray
    x: np.ndarray
    normal: np.ndarray
    frame: np.ndarray
    offset: np.ndarray
    angle: np.ndarray

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> CurvedShellBlock:
        """Take the elements ``nodes (ne, 6)`` at ``points (k, 3)`` (mesh axes); `origin` is the model's origin.

        `data` may override ``axis (ne, 3)``, ``angle (ne,)`` and ``offset (ne,)``.

        Raises
        ------
        InputError
            When an element has no area, is folded or too strongly curved, or its material axis is normal to it.
        """
        at, corners = points[nodes], points[nodes[:, :3]]
        frame = shell_frames(corners)
        _refuse_bad_shape(at, frame)
        normal = tangents(at, NODES)[1]
        offset = given(data, "offset", section.offset, len(nodes))
        x = at + offset[:, None, None] * normal - origin
        return cls(section, nodes, x, normal, frame, offset, material_angle(corners, frame, section, data))

    @cached_property
    def strain(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Strain rows ``B (ne, nq, 9, 36)`` per nodal DOF, moduli ``(ne or 1, 9, 9)`` and ``dx (ne, nq)``, m^2.

        Rows: membrane 3, curvature 3, shear 2, drilling 1, in the axes of `Points`.
        """
        at = self._points(DEGREE)
        B = np.concatenate([self._rows(DEGREE), self._drilling(at)[:, :, None]], axis=2)
        return self._relaxed(B), self._moduli, at.dx

    @cached_property
    def _moduli(self) -> np.ndarray:
        C, S = section_moduli(shell_section(self.section), self.angle)
        moduli = np.zeros((len(C), 9, 9))
        moduli[:, :6, :6], moduli[:, 6:8, 6:8], moduli[:, 8, 8] = C, S, DRILLING * C[:, 2, 2]
        return moduli

    def _relaxed(self, strain: np.ndarray) -> np.ndarray:
        """Add to strains ``(ne, nq, 9, k)`` those of the internal rotations that bring the energy to its minimum."""
        at = self._points(DEGREE)
        own = np.einsum("qci,eia,eka->eqck", bubble_forms(DEGREE), self.x, self.frame[:, :2], optimize=True)
        own = np.concatenate([at.cartesian @ own, np.zeros((*at.dx.shape, 1, 2))], axis=2)
        weighted = np.swapaxes(own, 2, 3) @ (self._moduli[:, None] * at.dx[..., None, None])
        size = np.linalg.solve((weighted @ own).sum(axis=1), (weighted @ strain).sum(axis=1))
        return strain - own @ size[:, None]

    def stiffness(self) -> np.ndarray:
        """Elastic stiffness ``(ne, 36, 36)``."""
        B, C, dx = self.strain
        K = np.zeros((len(dx), 36, 36))
        in_threads(quadratic, len(dx), np.ascontiguousarray(B), C, dx, K)
        return K

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray:
        """Geometric stiffness ``(ne, 36, 36)`` of the prestress from the displacements ``d (ne, 36)``, mesh axes."""
        B, C, dx = self.strain
        force = np.einsum("eqbj,ej->eqb", B, d, optimize=True) @ C * dx[..., None]
        at = self._points(DEGREE)
        covariant = (force[:, :, None, :8] @ at.cartesian)[:, :, 0]
        xx, xt = (np.einsum("eqc,qcij->eij", covariant, form, optimize=True) for form in strain_forms(DEGREE))
        pull = np.einsum("eqc,eqcja->eja", covariant, self._slopes(DEGREE)[1], optimize=True)
        o, lever = self.offset[:, None, None], -skew(self.normal)
        both = xt + 2 * o * xx
        K = np.zeros((len(d), 6, 6, 6, 6))
        for a in range(3):
            K[:, :, a, :, a] = 2 * xx
        K[:, :, :3, :, 3:] = np.einsum("eij,ejab->eiajb", both, lever)
        K[:, :, 3:, :, 3:] = np.einsum("eij,eica,ejcb->eiajb", o * (both + xt.transpose(0, 2, 1)), lever, lever)
        self._add_drilling(K, pull, force[:, :, 8], at)
        for i, own in enumerate(link_geometric_stiffness(pull[:, :, None], self.normal[:, :, None]).swapaxes(0, 1)):
            K[:, i, 3:, i, 3:] += own
        K[:, :, 3:, :, :3] = K[:, :, :3, :, 3:].transpose(0, 3, 4, 1, 2)
        K = K.reshape(len(d), 36, 36)
        return (K + K.transpose(0, 2, 1)) / 2

    def energy(self, d: np.ndarray) -> np.ndarray:
        """Return the strain energy ``(ne,)`` at finite displacements ``d (ne, 36)``, rotation vectors at the nodes."""
        u, vector = np.split(d.reshape(len(d), 6, 6), 2, axis=2)
        R = rotation_matrix(vector)
        t = np.einsum("eiab,eib->eia", R, self.normal)
        x = self.x + u + self.offset[:, None, None] * (t - self.normal)
        at, (_, C, dx) = self._points(DEGREE), self.strain
        grown = _covariant(x, t) - _covariant(self.x, self.normal)
        strain = np.concatenate([np.einsum("eqbc,eqc->eqb", at.cartesian, grown), self._drilled(at, x, R)], axis=2)
        strain = self._relaxed(strain[..., None])[..., 0]
        return np.einsum("eqa,eqab,eqb,eq->e", strain, np.broadcast_to(C[:, None], (*dx.shape, 9, 9)), strain, dx) / 2

    def mass(self) -> MassObjects:
        """Every mass object of theory 1: samples of the surface of the mass, and of the thickness."""
        return self._samples().mass()

    def rotating_arms(self) -> RotatingArms:
        """Mass on the directors of the nodes: of eccentric and unsymmetric sections, and through the thickness."""
        samples, N = self._samples(), shapes(CELL, DEGREE)[0]
        weight, position, shape = samples.weight, samples.position, samples.shape()
        ne, nq = len(weight), len(N)
        rotation = np.zeros((ne, 6, 3, 6, 6))
        for i in range(6):
            rotation[:, i, :, i, 3:] = np.eye(3)
        parts = []
        for some, arm, unit in (
            (slice(0, nq), self._height[:, None, None] * self.normal, 1.0),
            (slice(nq, None), self.normal, 0.0),
        ):
            share = weight[:, :, None][:, some] * N  # (ne, nq, 6)
            fields = np.zeros((ne, 6, 3, 12))
            for a in range(3):
                fields[:, :, a, a] = unit * share.sum(axis=1)
                fields[:, :, a, 3 + 3 * a : 6 + 3 * a] = share.transpose(0, 2, 1) @ position[:, some]
            inertia = np.einsum("eqi,eqaj->eiaj", share, shape[:, some], optimize=True)
            parts.append(RotatingArms(arm, rotation.reshape(ne, 6, 3, 36), fields, inertia))
        return RotatingArms.joined(parts)

    def volume(self) -> np.ndarray:
        """Area times thickness ``(ne,)``, m^3."""
        return total_thickness(self.section) * self._points(DEGREE).dx.sum(axis=1)

    def nodal_stress(self, d: np.ndarray) -> NodalStress:
        """Stress ``xx, yy, xy`` in both faces at the nodes for displacements ``d (ne, 36, k)``.

        Along the projection of e1 on the surface and across it; the top is towards the normal.
        """
        strain = self._rows(NODES)[:, :, :6] @ d[:, None]
        at = {}
        for face, (stretched, bent) in faces(self.section).items():
            Q = np.concatenate([rotated_moduli(Q, self.angle) for Q in (stretched, bent)], axis=2)
            at[face] = (("xx", "yy", "xy"), Q[:, None] @ strain)
        return at

    def piece(self, some: slice | np.ndarray) -> CurvedShellBlock:
        """Return the block of `some` of the elements."""
        names = ("nodes", "x", "normal", "frame", "offset", "angle")
        return replace(self, **{name: getattr(self, name)[some] for name in names})

    @property
    def _height(self) -> np.ndarray:
        """Height ``(ne,)`` of the surface of the mass over the nodes, m."""
        s = shell_section(self.section)
        return self.offset + s.first / s.mass

    def _samples(self) -> NodalFunctions:
        """Samples of the surface of the mass, then of the thickness about it."""
        s, N, dx = shell_section(self.section), shapes(CELL, DEGREE)[0], self._points(DEGREE).dx
        height = self._height
        thick = np.zeros((*dx.shape, 6, 10))
        thick[..., :9] = N[..., None] * -skew(self.normal).reshape(-1, 1, 6, 9)
        surface = height[:, None, None, None] * thick
        surface[..., 9] = N
        at = N @ (self.x + (height - self.offset)[:, None, None] * self.normal)
        return NodalFunctions(
            weight=np.concatenate([s.mass * dx, (s.second - s.first**2 / s.mass) * dx], axis=1),
            unit=np.repeat([1.0, 0.0], len(N)),
            position=np.concatenate([at, N @ self.normal], axis=1),
            values=np.concatenate([surface, thick], axis=1),
        )

    def _points(self, degree: int) -> Points:
        return surface_points(self.x, self.normal, self.frame, degree)

    def _slopes(self, degree: int) -> tuple[np.ndarray, np.ndarray]:
        """Slopes ``(ne, nq, 8, 6, 3)`` of the covariant strains by displacements and by directors of the nodes."""
        xx, xt = strain_forms(degree)
        by_x = np.einsum("qcij,eja->eqcia", 2 * xx, self.x) + np.einsum("qcij,eja->eqcia", xt, self.normal)
        by_t = np.einsum("qcij,eia->eqcja", xt, self.x)
        return by_x, by_t + self.offset[:, None, None, None, None] * by_x

    def _rows(self, degree: int) -> np.ndarray:
        """Rows ``(ne, nq, 8, 36)`` of the strains along the axes of `Points`, per nodal DOF."""
        by_x, by_t = self._slopes(degree)
        turning = np.cross(self.normal[:, None, None], by_t)
        covariant = np.concatenate([by_x, turning], axis=4).reshape(*by_x.shape[:3], 36)
        return self._points(degree).cartesian @ covariant

    def _drilling(self, at: Points) -> np.ndarray:
        """Rotation of the surface about its normal less that of the nodes, rows ``(ne, nq, 36)``."""
        N, (e1, e2), (p1, p2) = shapes(CELL, DEGREE)[0], *self._plane(at)
        by_x = at.gradient[:, :, 0, :, None] * e2[:, :, None] - at.gradient[:, :, 1, :, None] * e1[:, :, None]
        turning = N[..., None] * (np.cross(e2, p1) - np.cross(e1, p2))[:, :, None]
        turning += self.offset[:, None, None, None] * np.cross(self.normal[:, None], by_x)
        return np.concatenate([by_x, turning], axis=3).reshape(*at.dx.shape, 36) / 2

    def _plane(self, at: Points) -> tuple[np.ndarray, np.ndarray]:
        """Axes e1 and e2, and the slopes of the surface along them, each ``(2, ne, nq, 3)``."""
        return np.moveaxis(at.axes[:, :, :2], 2, 0), np.moveaxis(at.gradient @ self.x[:, None], 2, 0)

    def _drilled(self, at: Points, x: np.ndarray, R: np.ndarray) -> np.ndarray:
        """The strain of `_drilling` ``(ne, nq, 1)`` where nodes are at ``x (ne, 6, 3)`` and have rotated by R."""
        (e1, e2), N = self._plane(at)[0], shapes(CELL, DEGREE)[0]
        change = 0.0
        for own, rotations in ((x, R), (self.x, np.broadcast_to(np.eye(3), R.shape))):
            mean, sign = np.einsum("qi,eiab->eqab", N, rotations), 1 if own is x else -1
            p1, p2 = np.moveaxis(at.gradient @ own[:, None], 2, 0)
            change = change + sign * (_dot(p1, mean, e2) - _dot(p2, mean, e1))
        return change[..., None] / 2

    def _add_drilling(self, K: np.ndarray, pull: np.ndarray, moment: np.ndarray, at: Points) -> None:
        """Add the work of drilling moments ``(ne, nq)`` on the second order of `_drilled` to K, and to `pull`."""
        N, axes, slopes = shapes(CELL, DEGREE)[0], *self._plane(at)
        o, lever = self.offset, -skew(self.normal)
        for k, work in enumerate((moment / 2, -moment / 2)):
            e, p, slope = axes[1 - k], slopes[k], at.gradient[:, :, k]
            mixed = np.einsum("eq,eqi,qj,eqab->eiajb", work, slope, N, -skew(e), optimize=True)
            K[:, :, :3, :, 3:] += mixed
            arm = np.einsum("e,eica,eicjb->eiajb", o, lever, mixed)
            K[:, :, 3:, :, 3:] += arm + arm.transpose(0, 3, 4, 1, 2)
            pull += np.einsum("e,eq,eqi,eqa->eia", o, work, slope, e, optimize=True)
            own = np.einsum("eq,qi,eqab->ieab", work, N, link_geometric_stiffness(p[:, :, None], e[:, :, None]))
            for i in range(6):
                K[:, i, 3:, i, 3:] += own[i]


def _dot(p: np.ndarray, mean: np.ndarray, e: np.ndarray) -> np.ndarray:
    return np.einsum("eqa,eqab,eqb->eq", p, mean, e, optimize=True)


def _covariant(x: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Covariant strain measures ``(ne, nq, 8)`` of nodal positions and directors ``(ne, 6, 3)``."""
    products = np.einsum("eia,eja->eij", x, x), np.einsum("eia,eja->eij", x, t)
    return sum(np.einsum("qcij,eij->eqc", form, own) for form, own in zip(strain_forms(DEGREE), products, strict=True))


def _refuse_bad_shape(x: np.ndarray, frame: np.ndarray) -> None:
    """Refuse elements ``x (ne, 6, 3)`` without area or folded at a node or at a point of the quadrature."""
    size = np.ptp(x, axis=1).max(axis=1) ** 2
    bad = np.zeros(len(x), dtype=bool)
    for degree in (NODES, DEGREE):
        base, normal = tangents(x, degree)
        area = np.linalg.norm(np.cross(base[:, :, 0], base[:, :, 1]), axis=2)
        steep = np.einsum("eqa,ea->eq", normal, frame[:, 2]) < STEEPEST
        bad |= np.any(steep | (area <= 1e-9 * size[:, None]), axis=1)
    if np.any(bad):
        at = ", ".join(f"{v:.4g}" for v in x[np.argmax(bad)].mean(axis=0))
        raise InputError(
            f"{bad.sum()} of {len(bad)} six-node shell elements have no area, are folded or span more than 75 degrees, "
            f"the first near ({at}) m; move their mid-side nodes to the middle of the sides or mesh there finer"
        )
