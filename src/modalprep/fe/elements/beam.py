"""Two-node 3D beam: interdependent interpolation, exact in statics, Timoshenko or Euler-Bernoulli.

Six section motions ``(u, v, w, tx, ty, tz)`` in the element frame e1, e2, e3; with
``phi_y = 12 E Iz / (ky G A L^2)`` the shear angle is constant along the element and ``phi = 0`` gives
Euler-Bernoulli. The displacement of a section point at ``(y, z)`` is ``u + theta x (0, y, z)``, so rotary
inertia enters every mass integral by itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.elements.arms import RotatingArms, nodal_arms, node_transformation, section_arms
from modalprep.fe.elements.beam_shapes import Along, along, contract
from modalprep.fe.elements.block import NodalStress
from modalprep.fe.elements.corotation import Corotational, line_rotation
from modalprep.fe.elements.mass import MassObjects, MassSamples, mass_from_samples
from modalprep.fe.properties.properties import Beam


@dataclass(frozen=True, eq=False)
class BeamBlock(Corotational):
    """Line elements of one property, evaluated at their quadrature points.

    Attributes
    ----------
    nodes : (ne, 2) int
    frame : (ne, 3, 3)
        Rows e1, e2, e3.
    ends : (ne, 2, 3)
        Of the centroid line in the model's frame, m.
    arm : (ne, 2, 3)
        From the nodes to the ends of the centroid line, mesh axes, m.
    inside, outside : Along
        Section motions in the element frame per local DOF of the ends, at quadrature points and at the ends.
    """

    alike = (0, 1, 2)
    components = 6
    tensor = "pairs"
    section: Beam
    nodes: np.ndarray
    frame: np.ndarray
    ends: np.ndarray
    arm: np.ndarray
    inside: Along
    outside: Along

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> BeamBlock:
        """Evaluate the shapes of the elements ``nodes (ne, 2)`` at ``points (n, 3)`` (mesh axes).

        `data` may override ``up (ne, 3)`` and give ``ends (ne, 2, 3)``, ``pins (ne, 12)``, and ``arm (ne, 2, 3)`` in
        place of `ends` and the offset; `origin` is the model's origin.

        Raises
        ------
        InputError
            When an element has no length, `up` is parallel to it, or its pins let it move without strain.
        """
        up = data.get("up", np.full((len(nodes), 3), np.nan))
        up = np.where(np.isfinite(up), up, np.asarray(section.up, dtype=float))
        arm = data["arm"] if "arm" in data else _arms(points, nodes, up, section.offset, data)
        ends = points[nodes] + arm
        length, frame = line_frames(ends, nodes, up)
        pins = np.nan_to_num(data["pins"]) > 0 if "pins" in data else None
        return cls(section, nodes, frame, ends - origin, arm, *along(length, section, pins))

    @property
    def dx(self) -> np.ndarray:
        """(ne, nq) lengths of the quadrature points, m."""
        return self.inside.dx

    @cached_property
    def at_nodes(self) -> Along:
        """`inside` per nodal DOF in mesh axes."""
        return self.inside.transformed(node_transformation(self.frame, self.arm))

    @property
    def centre(self) -> np.ndarray:
        """(ne, nq, 3) centroids at the quadrature points in the model's frame, m."""
        at = self.inside.at[None, :, None]
        return (1 - at) * self.ends[:, None, 0] + at * self.ends[:, None, 1]

    def stiffness(self) -> np.ndarray:
        """``int B^T C B`` with strains (u', v' - tz, w' + ty, tx', ty', tz')."""
        B = self.at_nodes.strain()
        return contract(B, B * (self.dx[:, :, None] * self.inside.elasticity(self.section))[..., None])

    @property
    def line_mass(self) -> np.ndarray:
        """(ne, nq) mass of the quadrature points, kg."""
        return (self.section.material.rho * self.inside.A + self.inside.nsm) * self.dx

    def nodal_masses(self) -> np.ndarray:
        """Mass ``(ne, 2)`` of the two ends that keeps the centre of mass, kg."""
        at = self.inside.at
        return self.line_mass @ np.stack([1 - at, at], axis=1)

    def mass(self) -> MassObjects:
        """Every mass object of theory 1; the section adds two samples per point."""
        s = self.section
        own = self.inside
        nq = self.dx.shape[1]
        motion = self.at_nodes.value
        tx, ty, tz = np.moveaxis(motion[:, :, 3:], 2, 0)
        zero = np.zeros_like(tx)
        local = (motion[:, :, :3], np.stack([-tz, zero, tx], 2), np.stack([ty, -tx, zero], 2))
        shapes = np.concatenate([np.einsum("eca,eqcj->eqaj", self.frame, f) for f in local], axis=1)
        e2, e3 = (np.repeat(self.frame[:, None, k], nq, axis=1) for k in (1, 2))
        rho = s.material.rho
        samples = MassSamples(
            weight=np.concatenate([self.line_mass, rho * own.Iz * self.dx, rho * own.Iy * self.dx], axis=1),
            unit=np.repeat([1.0, 0.0, 0.0], nq),
            position=np.concatenate([self.centre, e2, e3], axis=1),
            shape=shapes,
        )
        return mass_from_samples(samples)

    def rotating_arms(self) -> RotatingArms:
        """Mass off the line of the nodes: of the section, and on the arms of eccentric beams."""
        rho, own = self.section.material.rho, self.inside
        rotation = np.swapaxes(self.frame, 1, 2)[:, None] @ self.at_nodes.value[:, :, 3:]
        inertia = ((own.Iz, self.frame[:, None, 1]), (own.Iy, self.frame[:, None, 2]))
        parts = [section_arms(rho * size * self.dx, axis, rotation) for size, axis in inertia]
        if np.any(self.arm):
            parts.append(nodal_arms(self.mass(), self.arm))
        return RotatingArms.joined(parts)

    def volume(self) -> np.ndarray:
        """Area times length ``(ne,)``, m^3."""
        return self.dx @ self.inside.A

    def nodal_stress(self, d: np.ndarray) -> NodalStress:
        """Stress in each fibre of the section at both ends, for displacements ``d (ne, 12, k)``.

        Along the beam ``E (u' + z ty' - y tz')`` of normal force and bending, and the shear of the torque where the
        section knows it. The shear of transverse forces, none at outer fibres, is left out.
        """
        s, mat, ends = self.section, self.section.material, self.outside
        rates = (ends.grad @ node_transformation(self.frame, self.arm)[:, None]) @ d[:, None]
        stretch, twist, bend_y, bend_z = (rates[:, :, i] for i in (0, 3, 4, 5))
        twist = ends.J[:, None] * twist
        at = {}
        for number, (y, z, *torsion) in enumerate(s.fibres, start=1):
            values = [mat.E * (stretch + z * bend_y - y * bend_z), *(w * mat.G * twist for w in torsion)]
            label = str(number) if len(s.fibres) > 1 else ""
            at[label] = (("xx", "torsion")[: len(values)], np.stack(values, axis=2))
        return at

    def piece(self, some: slice | np.ndarray) -> BeamBlock:
        """Return the block of `some` of the elements."""
        arrays = {name: getattr(self, name)[some] for name in ("nodes", "frame", "ends", "arm")}
        return replace(self, inside=self.inside.piece(some), outside=self.outside.piece(some), **arrays)

    @property
    def position(self) -> np.ndarray:
        """(ne, 2, 3) ends of the centroid line in the element's axes, m."""
        position = np.zeros((len(self.nodes), 2, 3))
        position[:, 1, 0] = self.dx.sum(axis=1)
        return position

    @property
    def axes_rotation(self) -> np.ndarray:
        """(ne, 3, 12) rotation of the element's axes per local DOF."""
        return line_rotation(self.dx.sum(axis=1)) @ self.outside.ends()

    def inner_fields(self) -> tuple[np.ndarray, np.ndarray]:
        """v', w', tx', tx, ty, tz, ty', tz' at the quadrature points; rotations of both ends."""
        own = self.inside
        ends = self.outside.ends()
        fields = np.concatenate([own.grad[:, :, 1:4], own.value[:, :, 3:], own.grad[:, :, 4:]], axis=2)
        return fields, ends[:, [3, 4, 5, 9, 10, 11]]

    def inner_weights(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Work of normal force, shears and moments on the slopes against the element.

        Theory 7.1: ``N(v'dv' + w'dw' + (Iy+Iz)/A tx'dtx') - My(v'dtx'+..) - Mz(w'dtx'+..)
        - Vz(v'dtx+..) + Vy(w'dtx+..)`` with ``Vz = My'``, ``Vy = -Mz'``, for slopes v', w' at the ends; and
        ``T (tz dty' - ty dtz' + ..) / 2``. The nodes rotate by rotation vectors, so that beams may meet at an angle:
        ``v' = tz + tx ty / 2``, ``w' = -ty + tx tz / 2``; on these the end moments do ``tx (my tz - mz ty) / 2``.
        """
        own, E, G = self.inside, self.section.material.E, self.section.material.G
        first, second = ((x @ d[:, None, :, None])[..., 0] for x in (self.at_nodes.grad, self.at_nodes.rate))
        N = E * own.A * first[..., 0]
        My = E * own.Iy * first[..., 4]
        Mz = E * own.Iz * first[..., 5]
        Vz, Vy = E * own.Iy * second[..., 0], -E * own.Iz * second[..., 1]
        weight = np.zeros((*self.dx.shape, 8, 8))
        weight[..., 0, 0] = weight[..., 1, 1] = N
        weight[..., 2, 2] = N * (own.Iy + own.Iz) / own.A
        half = 0.5 * G * own.J * first[..., 3]
        for i, j, value in ((0, 2, -My), (1, 2, -Mz), (0, 3, -Vz), (1, 3, Vy), (4, 7, -half), (5, 6, half)):
            weight[..., i, j] = weight[..., j, i] = value
        force, moment = np.split((self.stiffness() @ d[..., None]).reshape(-1, 2, 6), 2, axis=2)
        moment = (moment - np.cross(self.arm, force)) @ self.frame.transpose(0, 2, 1)
        W = np.zeros((len(d), 6, 6))
        for tx in (0, 3):
            for other, value in ((1, -moment[:, tx // 3, 2] / 2), (2, moment[:, tx // 3, 1] / 2)):
                W[:, tx, tx + other] = W[:, tx + other, tx] = value
        return weight * self.dx[..., None, None], W


def _arms(points, nodes, up, offset, data) -> np.ndarray:
    """From the nodes to the ends ``(ne, 2, 3)``: what the mesh says of each end, and the offset of the section."""
    arm = np.nan_to_num(data.get("ends", np.zeros((len(nodes), 2, 3))))
    _, frame = line_frames(points[nodes] + arm, nodes, up)
    return arm + np.einsum("k,eka->ea", offset, frame[:, 1:])[:, None]


def line_frames(ends: np.ndarray, nodes: np.ndarray, up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return lengths ``(ne,)`` and frames ``(ne, 3, 3)``, rows e1 (first to second end), ``e2 = up x e1``, e3.

    Raises
    ------
    InputError
        When an element has no length or ``up (ne, 3)`` is parallel to it.
    """
    axis = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(axis, axis=1)
    if np.any(length == 0):
        bad = int(np.argmin(length))
        raise InputError(f"line element between nodes {nodes[bad][0] + 1} and {nodes[bad][1] + 1} has no length")
    e1 = axis / length[:, None]
    e2 = np.cross(up, e1)
    size = np.linalg.norm(e2, axis=1, keepdims=True)
    parallel = size[:, 0] <= 1e-6 * np.linalg.norm(up, axis=1)
    if np.any(parallel):
        bad = int(np.argmax(parallel))
        raise InputError(
            f"beam direction 'up' = {up[bad].tolist()} is zero or parallel to the beam between nodes "
            f"{nodes[bad][0] + 1} and {nodes[bad][1] + 1}; choose another direction"
        )
    e2 = e2 / size
    return length, np.stack([e1, e2, np.cross(e1, e2)], axis=1)
