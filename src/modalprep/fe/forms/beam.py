"""Beams as scikit-fem (theory 7.1)."""

from __future__ import annotations

import numpy as np
from skfem.helpers import cross, dot, grad

from modalprep.fe.elements.arms import node_transformation
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.beam3 import ThreeNodeBeamBlock
from modalprep.fe.elements.beam_shapes import Along
from modalprep.fe.forms.basis import DofMap, ModelBasis, cell_basis
from modalprep.fe.forms.bilinear import AllTrials
from modalprep.fe.forms.corotation import at_nodes, cell_forces, rotating_terms, spin
from modalprep.fe.forms.elements import Field, FieldElement, Levered
from modalprep.fe.forms.mass import Mass
from modalprep.fe.forms.terms import Term


# --8<-- [start:forms]
def in_axes(w, a):
    """Components of a vector along e1, e2, e3."""
    return np.einsum("ij...,j...->i...", w.axes, a)


def along(w, u):
    """Components of the rate of a field along the axis, ``u'``."""
    return in_axes(w, np.einsum("ij...,j...->i...", grad(u), w.axes[0]))


def strains(w, u, t):
    """``u', v' - tz, w' + ty`` of the shear centre at (y, z); ``tx', ty', tz'``."""
    (e, v, s), k, (_, ty, tz) = along(w, u), along(w, t), in_axes(w, t)
    y, z = w.shear_centre
    return np.array([e, v - z * k[0] - tz, s + y * k[0] + ty, *k])


@AllTrials
def stiffness(u, t, v, s, w):
    """``int C e(u, t) . e(v, s)`` with ``C = diag(EA, ky GA, kz GA, GJ, EIy, EIz)``."""
    return dot(w.C * strains(w, u, t), strains(w, v, s))


@AllTrials
def geometric_stiffness(u, t, o, v, s, q, w):
    """(7.3) of the slopes against the axes, which rotate by o and q; torque on rotation vectors."""

    def against(u, t, o):
        _, v, w_ = along(w, u) - in_axes(w, cross(o, w.axes[0]))
        return v, w_, in_axes(w, t) - in_axes(w, o), along(w, t)

    (vx, wx, r, k), (vy, wy, p, m) = against(u, t, o), against(v, s, q)
    return (
        w.N * (vx * vy + wx * wy + w.polar * k[0] * m[0])
        - w.My * (vx * m[0] + k[0] * vy)
        - w.Mz * (wx * m[0] + k[0] * wy)
        - w.Vz * (vx * p[0] + r[0] * vy)
        + w.Vy * (wx * p[0] + r[0] * wy)
        - w.T / 2 * (r[1] * m[2] + k[2] * p[1] - r[2] * m[1] - k[1] * p[2])
    )


@AllTrials
def end_moments(u, t, o, v, s, q, w):
    """Moments of the ends on rotation vectors, ``tx (my tz - mz ty) / 2``."""
    r, p = in_axes(w, t) - in_axes(w, o), in_axes(w, s) - in_axes(w, q)
    my, mz = in_axes(w, w.moment)[1:]
    return (my * (r[0] * p[2] + r[2] * p[0]) - mz * (r[0] * p[1] + r[1] * p[0])) / 2


# --8<-- [end:forms]


class BeamMotion(FieldElement):
    """Displacement u and rotation t of the sections of beams, and the rotation o of their axes; mesh axes.

    The interdependent shapes (7.2), which follow from equilibrium for tapered beams too.
    """

    def __init__(self, block: BeamBlock, fields: Along, *, rotating: bool = False) -> None:
        super().__init__("line")
        self.block, self.along, self.rotating = block, fields, rotating

    def fields(self, X: np.ndarray) -> tuple[Field, ...]:
        """Return the fields at the points of the quadrature, or at the ends."""
        to_mesh = np.swapaxes(self.block.frame, 1, 2)[:, None]
        both = []
        for k in (slice(0, 3), slice(3, 6)):
            value, rate = (to_mesh @ field[:, :, k] for field in (self.along.value, self.along.grad))
            both.append((value, np.einsum("eqal,eb->eqabl", rate, self.block.frame[:, 0])))
        if self.rotating:
            nq = self.along.value.shape[1]
            both.append((np.repeat(spin(self.block)[:, None], nq, axis=1), None))
        return tuple(both)


class PlainBeam:
    """The terms of beams of two nodes and one property."""

    def __init__(self, block: BeamBlock, dofmap: DofMap) -> None:
        self.block, self.dofmap = block, dofmap
        self.inside = block.at_nodes
        self.ends = block.outside.transformed(node_transformation(block.frame, block.arm))

    def motions(self, *, rotating: bool = False) -> list[ModelBasis]:
        """Return the basis of displacement u and rotation t of the centroid line, ``(3, ne, nq)`` each."""
        return [self._basis(BeamMotion(self.block, self.inside, rotating=rotating))]

    def stiffness(self) -> list[Term]:
        """Return the stiffness of the section."""
        C = self.inside.elasticity(self.block.section)
        given = {"C": np.moveaxis(C[None], 2, 0), "shear_centre": tuple(self.block.section.shear_centre)}
        return [Term(stiffness, self.motions()[0], given | self._axes)]

    def geometric_stiffness(self, d: np.ndarray) -> list[Term]:
        """Return the stiffness of the section forces of the displacements ``d (n_dof,)``."""
        forces = cell_forces(self.stiffness(), self.block.nodes, self.dofmap, d)
        own = d[self.dofmap.dof[self.block.nodes]].reshape(len(forces), -1)
        inside = Term(geometric_stiffness, self.motions(rotating=True)[0], self._section_forces(own) | self._axes)
        moment = forces[:, :, 3:] - np.cross(self.block.arm, forces[:, :, :3])
        motion = BeamMotion(self.block, self.ends, rotating=True)
        ends = at_nodes("line", self.block.nodes, self.dofmap, motion)
        at_ends = Term(end_moments, ends, {"moment": np.moveaxis(moment, 2, 0)} | self._axes)
        return [inside, at_ends, *rotating_terms(self.block, self.dofmap, forces)]

    def masses(self) -> list[Mass]:
        """Return the mass of the line, and of the section along e2 and e3."""
        own, rho = self.block.inside, self.block.section.material.rho
        motion = BeamMotion(self.block, self.inside)
        basis = self._basis(Levered(motion))
        found = [Mass(basis, rho * own.A + own.nsm, np.asarray(basis.global_coordinates()))]
        for direction, second in ((1, own.Iz), (2, own.Iy)):
            e = self.block.frame[:, None, direction]
            at = np.broadcast_to(np.moveaxis(e, 2, 0), found[0].at.shape)
            found.append(Mass(self._basis(Levered(motion, e, unit=0.0)), rho * second, at, 0.0))
        return found

    @property
    def _axes(self) -> dict[str, np.ndarray]:
        return {"axes": np.moveaxis(self.block.frame, 0, -1)[..., None]}

    def _basis(self, element: FieldElement) -> ModelBasis:
        own = self.block.inside
        weight = own.dx[0] / own.dx[0].sum()
        return cell_basis("line", self.block.nodes, self.dofmap, element, at=(own.at[None], weight), x=self.block.ends)

    def _section_forces(self, d: np.ndarray) -> dict[str, np.ndarray]:
        """Return N, T, My, Mz, Vy and Vz ``(ne, nq)`` of displacements ``d (ne, 12)``, and ``(Iy + Iz) / A``."""
        own = self.block.inside
        E, G = self.block.section.material.E, self.block.section.material.G
        first, second = ((x @ d[:, None, :, None])[..., 0] for x in (self.inside.grad, self.inside.rate))
        return {
            "N": E * own.A * first[..., 0],
            "T": G * own.J * first[..., 3],
            "My": E * own.Iy * first[..., 4],
            "Mz": E * own.Iz * first[..., 5],
            "Vz": E * own.Iy * second[..., 0],
            "Vy": -E * own.Iz * second[..., 1],
            "polar": ((own.Iy + own.Iz) / own.A)[None],
        }


class PlainThreeNodeBeam:
    """The terms of beams of three nodes: of two beams that meet at the middle node."""

    def __init__(self, block: ThreeNodeBeamBlock, dofmap: DofMap) -> None:
        self.halves = [PlainBeam(half, dofmap) for half in block.halves]

    def motions(self) -> list[ModelBasis]:
        """Return the bases of both halves."""
        return [basis for half in self.halves for basis in half.motions()]

    def stiffness(self) -> list[Term]:
        """Return the stiffness of both halves."""
        return [term for half in self.halves for term in half.stiffness()]

    def geometric_stiffness(self, d: np.ndarray) -> list[Term]:
        """Return the stiffness of the section forces of the displacements ``d (n_dof,)``."""
        return [term for half in self.halves for term in half.geometric_stiffness(d)]

    def masses(self) -> list[Mass]:
        """Return the mass of both halves."""
        return [mass for half in self.halves for mass in half.masses()]
