"""Solids as scikit-fem (theory 7.5)."""

from __future__ import annotations

import numpy as np
from skfem.element import DiscreteField, ElementHex1, ElementVector
from skfem.helpers import ddot, dot, grad

from modalprep.fe.elements.hourglass import hourglass_motions
from modalprep.fe.elements.solid import PRESTRESS, SolidBlock
from modalprep.fe.forms.basis import DofMap, ModelBasis, cell_basis
from modalprep.fe.forms.bilinear import AllTrials
from modalprep.fe.forms.condensed import Condensed
from modalprep.fe.forms.elements import Field, FieldElement
from modalprep.fe.forms.mass import Mass
from modalprep.fe.forms.terms import Term


# --8<-- [start:forms]
def stress(c, u):
    """``sigma_ab = c_abkl u_k,l``."""
    return np.einsum("abkl...,kl...->ab...", c, grad(u))


@Condensed
def stiffness(u, v, w):
    """``int sigma(v) : grad u``."""
    return ddot(stress(w.c, v), grad(u))


@AllTrials
def geometric_stiffness(u, v, w):
    """``int sigma_kl u_i,k v_i,l`` of the stress of the displacements d."""
    return ddot(np.einsum("kl...,il...->ik...", w.sigma, grad(v)), grad(u))


@AllTrials
def hourglass(u, v, w):
    """Stiffness against the hourglass motions u of faces that no other element holds."""
    return dot(w.held * u, v)


# --8<-- [end:forms]


class IncompatibleHexahedron(ElementVector):
    """The eight-node hexahedron with three incompatible displacements in each direction (Wilson, Taylor).

    Internal displacements ``4 xi (1 - xi)`` whose gradients are mapped as at the centre of the cell, so that the patch
    test holds.
    """

    internal = 9

    def __init__(self) -> None:
        super().__init__(ElementHex1(), 3)
        self.interior_dofs = 9
        self.dofnames = [*self.dofnames, *(f"inner^{k + 1}" for k in range(9))]
        self.doflocs = np.vstack([self.doflocs, np.full((9, 3), 0.5)])

    def gbasis(self, mapping, X, i, tind=None):
        """Return a displacement of the nodes, or an internal one, of which only the gradient counts."""
        if i < 24:
            return super().gbasis(mapping, X, i, tind)
        k, a = divmod(i - 24, 3)
        centre = np.full((3, 1), 0.5)
        scale = mapping.detDF(centre, tind) / mapping.detDF(X, tind)
        value = np.zeros((3, *scale.shape))
        slope = np.zeros((3, *value.shape))
        slope[a] = (4 - 8 * X[k]) * scale * mapping.invDF(centre, tind)[k]
        return (DiscreteField(value, slope),)


class HourglassMotions(FieldElement):
    """Sizes of the hourglass motions of the six faces of hexahedra of 20 nodes."""

    width = 3

    def __init__(self, block: SolidBlock) -> None:
        super().__init__(block.kind)
        self.x = block.x

    def fields(self, X: np.ndarray) -> tuple[Field, ...]:
        """Return the six sizes, the same at all points."""
        return ((hourglass_motions(self.x)[:, None], None),)


class PlainSolid:
    """The terms of solids of one kind and property."""

    def __init__(self, block: SolidBlock, dofmap: DofMap) -> None:
        self.block, self.dofmap = block, dofmap
        self.c = moduli(block)

    def motions(self) -> list[ModelBasis]:
        """Return the basis of the displacement ``u (3, ne, nq)``."""
        return [self._motion()]

    def stiffness(self) -> list[Term]:
        """Return the elastic stiffness."""
        elastic = Term(stiffness, self._straining(self.block.degree), {"c": self.c})
        return [elastic] if self.block.free_faces is None else [elastic, self._hourglass(elastic)]

    def _hourglass(self, elastic: Term) -> Term:
        """Return the stiffness of the free faces of hexahedra of reduced integration, of the size of that of a node."""
        own = elastic.coo().tolocal()
        held = self.block.free_faces * (np.trace(own, axis1=1, axis2=2) / own.shape[1])[:, None]
        motions = HourglassMotions(self.block)
        basis = cell_basis(self.block.kind, self.block.nodes, self.dofmap, motions, degree=1)
        basis.dx = np.full_like(basis.dx, 1 / basis.dx.shape[1])  # a sum over faces, not an integral
        return Term(hourglass, basis, {"held": held.T[..., None]})

    def geometric_stiffness(self, d: np.ndarray) -> list[Term]:
        """Return the stiffness of the stress of the displacements ``d (n_dof,)``."""
        degree = max(self.block.degree, PRESTRESS.get(self.block.kind, 0))
        basis = self._straining(degree)
        u = basis.interpolate(stiffness.with_internal(basis, d, c=self.c))
        return [Term(geometric_stiffness, self._motion(degree), {"sigma": stress(self.c, u)})]

    def masses(self) -> list[Mass]:
        """Return the mass."""
        basis = self._motion(self.block.mass_degree)
        return [Mass(basis, np.array(self.block.section.material.rho), np.asarray(basis.global_coordinates()))]

    def _motion(self, degree: int | None = None) -> ModelBasis:
        return cell_basis(self.block.kind, self.block.nodes, self.dofmap, degree=degree)

    def _straining(self, degree: int) -> ModelBasis:
        element = IncompatibleHexahedron() if self.block.kind == "hexahedron" else None
        return cell_basis(self.block.kind, self.block.nodes, self.dofmap, element, degree=degree)


def moduli(block: SolidBlock) -> np.ndarray:
    """Return ``c (3, 3, 3, 3, ne or 1, 1)`` in mesh axes, Pa."""
    given = block.elasticity.moduli
    if isinstance(given, tuple):
        lam, mu = given
        one = np.eye(3)
        shear = np.einsum("ak,bl->abkl", one, one) + np.einsum("al,bk->abkl", one, one)
        given = (lam * np.einsum("ab,kl->abkl", one, one) + mu * shear)[None]
    return np.moveaxis(given, 0, -1)[..., None]
