"""Two-node 3D beam: interdependent interpolation, exact in statics, Timoshenko or Euler-Bernoulli.

Six section motions ``(u, v, w, tx, ty, tz)`` in the element frame e1, e2, e3; with
``phi_y = 12 E Iz / (ky G A L^2)`` the shear angle is constant along the element and ``phi = 0`` gives
Euler-Bernoulli. The displacement of a section point at ``(y, z)`` is ``u + theta x (0, y, z)``, so rotary
inertia enters every mass integral by itself.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from skfem import Basis, MeshLine1
from skfem.element import DiscreteField, Element
from skfem.refdom import RefLine

from modalprep.errors import InputError
from modalprep.fe.elements.arms import RotatingArms, nodal_arms, node_transformation, section_arms
from modalprep.fe.elements.block import NodalStress
from modalprep.fe.elements.corotation import Corotational, line_rotation
from modalprep.fe.elements.mass import MassObjects, MassSamples, mass_from_samples
from modalprep.fe.properties.properties import Beam

QUADRATURE = 6  # degree: cubic shapes squared; 4 Gauss points


class ElementBeam(Element):
    """scikit-fem element of the 12 beam shape functions; value, grad, hess of the six section motions."""

    refdom = RefLine
    nodal_dofs = 6
    maxdeg = 3

    def __init__(self, phi_y: np.ndarray, phi_z: np.ndarray) -> None:
        self.phi_y, self.phi_z = phi_y, phi_z

    def gbasis(self, mapping, X, i, tind=None):  # noqa: D102 - scikit-fem's protocol
        length = mapping.detDF(X)
        motion = np.zeros((3, 6, *length.shape))  # derivative order, component, element, point
        node, component = divmod(i, 6)
        if component in (0, 3):  # u, tx: linear
            motion[0, component] = X[0] if node else 1 - X[0]
            motion[1, component] = (2 * node - 1) / length
        else:
            self._bend(motion, X[0], length, node, component)
        return (DiscreteField(value=motion[0], grad=motion[1][:, None], hess=motion[2][:, None, None]),)

    def _bend(self, motion, s, L, node, component):
        in_xy = component in (1, 5)
        phi = (self.phi_y if in_xy else self.phi_z)[:, None]
        rotational = component > 2
        deflection, slope = _bending_shapes(s, L, phi, 2 * node + rotational)
        lateral, angle, sign = (1, 5, 1.0) if in_xy else (2, 4, -1.0)  # in x-z the slope is -ty
        own = sign if rotational else 1.0
        motion[:, lateral] = own * deflection
        motion[:, angle] = own * sign * slope


def _bending_shapes(s, L, phi, k):
    """Return the deflection and slope of shape k (w1, slope1, w2, slope2) and their first two derivatives."""
    m = 1 / (1 + phi)
    zero = 0 * L
    if k % 2 == 0:
        sign = 1 if k == 0 else -1
        w = (1 - 3 * s**2 + 2 * s**3 + phi * (1 - s), -6 * s + 6 * s**2 - phi, -6 + 12 * s)
        deflection = np.array([sign * m * w[0] + (k == 2), sign * m * w[1] / L, sign * m * w[2] / L**2])
        slope = sign * 6 * m / L * np.array([s**2 - s + zero, (2 * s - 1) / L, 2 / L**2])
    elif k == 1:
        w = (
            s - 2 * s**2 + s**3 + phi / 2 * (s - s**2),
            1 - 4 * s + 3 * s**2 + phi / 2 * (1 - 2 * s),
            -4 + 6 * s - phi,
        )
        deflection = m * L * np.array([w[0] + zero, w[1] / L, w[2] / L**2])
        slope = m * np.array([1 - 4 * s + 3 * s**2 + phi * (1 - s), (-4 + 6 * s - phi) / L, 6 / L**2])
    else:
        w = (
            -(s**2) + s**3 + phi / 2 * (s**2 - s),
            -2 * s + 3 * s**2 + phi / 2 * (2 * s - 1),
            -2 + 6 * s + phi,
        )
        deflection = m * L * np.array([w[0] + zero, w[1] / L, w[2] / L**2])
        slope = m * np.array([3 * s**2 - 2 * s + phi * s, (6 * s - 2 + phi) / L, 6 / L**2])
    return deflection, slope


@dataclass(frozen=True, eq=False)
class BeamBlock(Corotational):
    """Line elements of one property, evaluated at their quadrature points.

    Attributes
    ----------
    nodes : (ne, 2) int
    frame : (ne, 3, 3)
        Rows e1, e2, e3.
    centre : (ne, nq, 3)
        Centroids of the section at the quadrature points in the model's frame, m.
    arm : (ne, 2, 3)
        From the nodes to the ends of the centroid line, mesh axes, m.
    motion, grad, hess : (ne, nq, 6, 12)
        Section motions in the element frame per nodal DOF in mesh axes, and their derivatives along e1.
    dx : (ne, nq)
    """

    alike = (0, 1, 2)
    components = 6
    tensor = "pairs"
    section: Beam
    nodes: np.ndarray
    frame: np.ndarray
    centre: np.ndarray
    arm: np.ndarray
    motion: np.ndarray
    grad: np.ndarray
    hess: np.ndarray
    dx: np.ndarray

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> BeamBlock:
        """Evaluate the shapes of the elements ``nodes (ne, 2)`` at ``points (n, 3)`` (mesh axes).

        `data` may override ``up (ne, 3)`` and give ``ends (ne, 2, 3)``; `origin` is the model's origin.

        Raises
        ------
        InputError
            When an element has no length, or `up` is parallel to it.
        """
        up = data.get("up", np.full((len(nodes), 3), np.nan))
        up = np.where(np.isfinite(up), up, np.asarray(section.up, dtype=float))
        arm = np.nan_to_num(data.get("ends", np.zeros((len(nodes), 2, 3))))
        _, frame = line_frames(points[nodes] + arm, nodes, up)
        arm = arm + np.einsum("k,eka->ea", section.offset, frame[:, 1:])[:, None]
        ends = points[nodes] + arm
        length, frame = line_frames(ends, nodes, up)
        basis = _basis(length, section)
        T = node_transformation(frame, arm)
        fields = [_stack(basis, name) @ T[:, None] for name in ("value", "grad", "hess")]
        at = basis.X[0][None, :, None]
        centre = (1 - at) * ends[:, None, 0] + at * ends[:, None, 1] - origin
        return cls(section, nodes, frame, centre, arm, *fields, basis.dx)

    def stiffness(self) -> np.ndarray:
        """``int B^T C B`` with strains (u', v' - tz, w' + ty, tx', ty', tz')."""
        B, C = self._strain()
        return _contract(B, B * (self.dx[:, :, None] * C)[..., None])

    def _strain(self) -> tuple[np.ndarray, np.ndarray]:
        s, mat = self.section, self.section.material
        shear = (s.ky * mat.G * s.A, s.kz * mat.G * s.A) if s.theory == "timoshenko" else (0.0, 0.0)
        C = np.array([mat.E * s.A, *shear, mat.G * s.J, mat.E * s.Iy, mat.E * s.Iz])
        B = self.grad.copy()
        B[:, :, 1] -= self.motion[:, :, 5]
        B[:, :, 2] += self.motion[:, :, 4]
        return B, C

    def mass(self) -> MassObjects:
        """Every mass object of theory 1; the section adds two samples per point."""
        s, nq = self.section, self.dx.shape[1]
        tx, ty, tz = np.moveaxis(self.motion[:, :, 3:], 2, 0)
        zero = np.zeros_like(tx)
        local = (self.motion[:, :, :3], np.stack([-tz, zero, tx], 2), np.stack([ty, -tx, zero], 2))
        shapes = np.concatenate([np.einsum("eca,eqcj->eqaj", self.frame, f) for f in local], axis=1)
        e2, e3 = (np.repeat(self.frame[:, None, k], nq, axis=1) for k in (1, 2))
        rho = s.material.rho
        samples = MassSamples(
            weight=np.concatenate([f * self.dx for f in (rho * s.A + s.nsm, rho * s.Iz, rho * s.Iy)], axis=1),
            unit=np.repeat([1.0, 0.0, 0.0], nq),
            position=np.concatenate([self.centre, e2, e3], axis=1),
            shape=shapes,
        )
        return mass_from_samples(samples)

    def rotating_arms(self) -> RotatingArms:
        """Mass off the line of the nodes: of the section, and on the arms of eccentric beams."""
        s = self.section
        rotation = np.swapaxes(self.frame, 1, 2)[:, None] @ self.motion[:, :, 3:]
        inertia = ((s.Iz, self.frame[:, None, 1]), (s.Iy, self.frame[:, None, 2]))
        parts = [section_arms(s.material.rho * size * self.dx, axis, rotation) for size, axis in inertia]
        if np.any(self.arm):
            parts.append(nodal_arms(self.mass(), self.arm))
        return RotatingArms.joined(parts)

    def volume(self) -> np.ndarray:
        """Area times length ``(ne,)``, m^3."""
        return self.section.A * self.dx.sum(axis=1)

    def nodal_stress(self, d: np.ndarray) -> NodalStress:
        """Stress in each fibre of the section at both ends, for displacements ``d (ne, 12, k)``.

        Along the beam ``E (u' + z ty' - y tz')`` of normal force and bending, and the shear of the torque where the
        section knows it. The shear of transverse forces, none at outer fibres, is left out.
        """
        s, mat = self.section, self.section.material
        ends = _basis(self.dx.sum(axis=1), s, (np.array([[0.0, 1.0]]), np.full(2, 0.5)))
        rates = (_stack(ends, "grad") @ node_transformation(self.frame, self.arm)[:, None]) @ d[:, None]
        stretch, twist, bend_y, bend_z = (rates[:, :, i] for i in (0, 3, 4, 5))
        at = {}
        for number, (y, z, *torsion) in enumerate(s.fibres, start=1):
            values = [mat.E * (stretch + z * bend_y - y * bend_z), *(w * mat.G * s.J * twist for w in torsion)]
            label = str(number) if len(s.fibres) > 1 else ""
            at[label] = (("xx", "torsion")[: len(values)], np.stack(values, axis=2))
        return at

    def piece(self, some: slice | np.ndarray) -> BeamBlock:
        """Return the block of `some` of the elements."""
        return replace(self, **{f.name: getattr(self, f.name)[some] for f in fields(self) if f.name != "section"})

    @property
    def position(self) -> np.ndarray:
        """(ne, 2, 3) ends of the centroid line in the element's axes, m."""
        position = np.zeros((len(self.nodes), 2, 3))
        position[:, 1, 0] = self.dx.sum(axis=1)
        return position

    @property
    def axes_rotation(self) -> np.ndarray:
        """(ne, 3, 12) rotation of the element's axes per local DOF."""
        return line_rotation(self.dx.sum(axis=1))

    def inner_fields(self) -> tuple[np.ndarray, np.ndarray]:
        """v', w', tx', tx, ty, tz, ty', tz' at the quadrature points; rotations of both ends."""
        back = np.linalg.inv(node_transformation(self.frame, self.arm))[:, None]
        motion, grad = self.motion @ back, self.grad @ back
        ends = np.eye(12)[[3, 4, 5, 9, 10, 11]]
        fields = np.concatenate([grad[:, :, 1:4], motion[:, :, 3:], grad[:, :, 4:]], axis=2)
        return fields, np.tile(ends, (len(self.nodes), 1, 1))

    def inner_weights(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Work of normal force, shears and moments on the slopes against the element.

        Theory 7.1: ``N(v'dv' + w'dw' + (Iy+Iz)/A tx'dtx') - My(v'dtx'+..) - Mz(w'dtx'+..)
        - Vz(v'dtx+..) + Vy(w'dtx+..)`` with ``Vz = My'``, ``Vy = -Mz'``, for slopes v', w' at the ends; and
        ``T (tz dty' - ty dtz' + ..) / 2``. The nodes rotate by rotation vectors, so that beams may meet at an angle:
        ``v' = tz + tx ty / 2``, ``w' = -ty + tx tz / 2``; on these the end moments do ``tx (my tz - mz ty) / 2``.
        """
        s, E = self.section, self.section.material.E
        first, second = ((x @ d[:, None, :, None])[..., 0] for x in (self.grad, self.hess))
        N, My, Mz = E * s.A * first[..., 0], E * s.Iy * first[..., 4], E * s.Iz * first[..., 5]
        Vz, Vy = E * s.Iy * second[..., 4], -E * s.Iz * second[..., 5]
        G = np.zeros((*self.dx.shape, 8, 8))
        G[..., 0, 0] = G[..., 1, 1] = N
        G[..., 2, 2] = N * (s.Iy + s.Iz) / s.A
        half = 0.5 * s.material.G * s.J * first[..., 3]
        for i, j, value in ((0, 2, -My), (1, 2, -Mz), (0, 3, -Vz), (1, 3, Vy), (4, 7, -half), (5, 6, half)):
            G[..., i, j] = G[..., j, i] = value
        force, moment = np.split((self.stiffness() @ d[..., None]).reshape(-1, 2, 6), 2, axis=2)
        moment = (moment - np.cross(self.arm, force)) @ self.frame.transpose(0, 2, 1)
        W = np.zeros((len(d), 6, 6))
        for tx in (0, 3):
            for other, value in ((1, -moment[:, tx // 3, 2] / 2), (2, moment[:, tx // 3, 1] / 2)):
                W[:, tx, tx + other] = W[:, tx + other, tx] = value
        return G * self.dx[..., None, None], W


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


def _basis(length: np.ndarray, s: Beam, rule: tuple[np.ndarray, np.ndarray] | None = None) -> Basis:
    """Disjoint flat line elements, so that scikit-fem sees one-dimensional geometry; at points and weights `rule`."""
    ne, mat = len(length), s.material
    ratio = 12 * mat.E / (mat.G * s.A * length**2) if s.theory == "timoshenko" else np.zeros(ne)
    mesh = MeshLine1(np.stack([0 * length, length], 1).reshape(1, -1), np.arange(2 * ne).reshape(ne, 2).T)
    element = ElementBeam(ratio * s.Iz / s.ky, ratio * s.Iy / s.kz)
    return Basis(mesh, element, intorder=QUADRATURE, quadrature=rule, disable_doflocs=True)


def _stack(basis: Basis, name: str) -> np.ndarray:
    """Collect one field of all 12 shapes as (ne, nq, 6, 12)."""
    fields = [np.asarray(shape[0] if name == "value" else getattr(shape[0], name)) for shape in basis.basis]
    return np.moveaxis(np.array([f.reshape(6, *basis.dx.shape) for f in fields]), (0, 1), (3, 2))


def _contract(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """``sum_q left^T right`` of (ne, nq, k, nl) arrays, as one matrix product per element."""
    ne, nq, k, nl = left.shape
    K = left.reshape(ne, nq * k, nl).transpose(0, 2, 1) @ right.reshape(ne, nq * k, nl)
    return (K + K.transpose(0, 2, 1)) / 2  # symmetric to the last bit
