"""Trusses as scikit-fem (theory 7.2)."""

from __future__ import annotations

import numpy as np
from skfem.helpers import dot, grad

from modalprep.fe.elements.truss import TrussBlock
from modalprep.fe.forms.basis import DofMap, ModelBasis, cell_basis
from modalprep.fe.forms.bilinear import AllTrials
from modalprep.fe.forms.corotation import cell_forces, rotating_terms
from modalprep.fe.forms.mass import Mass
from modalprep.fe.forms.terms import Term
from modalprep.fe.properties.properties import Truss


# --8<-- [start:forms]
def along(u, w):
    """Rate of a field along the axis, ``u'``."""
    return np.einsum("ij...,j...->i...", grad(u), w.n)


@AllTrials
def stiffness(u, v, w):
    """``int EA u' v'`` of the displacements along the axis."""
    return w.EA * dot(along(u, w), w.n) * dot(along(v, w), w.n)


@AllTrials
def geometric_stiffness(u, v, w):
    """``int N u' v'`` of the displacements across the axis."""
    a, b = along(u, w), along(v, w)
    return w.N * (dot(a, b) - dot(a, w.n) * dot(b, w.n))


@AllTrials
def twist(u, v, w):
    """``int GJ t' s'`` of the rotations about the axis."""
    return w.GJ * dot(along(u, w), w.n) * dot(along(v, w), w.n)


# --8<-- [end:forms]


class PlainTruss:
    """The terms of bars of one property."""

    def __init__(self, block: TrussBlock, dofmap: DofMap) -> None:
        self.block, self.dofmap = block, dofmap

    def motions(self) -> list[ModelBasis]:
        """Return the basis of the displacement ``u (3, ne, nq)``."""
        return [self._motion()]

    def stiffness(self) -> list[Term]:
        """Return the stiffness along the axis and, where the section has a torsion constant, about it."""
        section = self.block.section
        terms = [Term(stiffness, self._motion(1), {"EA": section.material.E * section.A})]
        if section.J:
            terms.append(Term(twist, self._rotation(), {"GJ": section.material.G * section.J}))
        return terms

    def geometric_stiffness(self, d: np.ndarray) -> list[Term]:
        """Return the stiffness of the tension and the torque of the displacements ``d (n_dof,)``."""
        if self.block.components == 6:
            forces = cell_forces(self.stiffness(), self.block.nodes, self.dofmap, d)
            return rotating_terms(self.block, self.dofmap, forces)
        basis = self._motion(1)
        return [Term(geometric_stiffness, basis, {"N": tension(basis, d, self.block.section)})]

    def masses(self) -> list[Mass]:
        """Return the mass of a line."""
        basis = self._motion(2)
        section = self.block.section
        line = np.array(section.material.rho * section.A + section.nsm)
        return [Mass(basis, line, np.asarray(basis.global_coordinates()))]

    def _motion(self, degree: int | None = None) -> ModelBasis:
        return cell_basis("line", self.block.nodes, self.dofmap, degree=degree)

    def _rotation(self) -> ModelBasis:
        """Return the basis of the rotation vector, whose DOFs are the last three of the nodes."""
        dof = np.roll(self.dofmap.dof, 3, axis=1)
        return cell_basis("line", self.block.nodes, self.dofmap._replace(dof=dof), degree=1)


def tension(basis: ModelBasis, d: np.ndarray, section: Truss) -> np.ndarray:
    """Return the normal force ``(ne, nq)`` of displacements ``d (n_dof,)``, N."""
    axis = basis.mapping.normals(basis.X)
    strain = np.einsum("ij...,i...,j...->...", basis.interpolate(d).grad, axis, axis)
    return section.material.E * section.A * strain
