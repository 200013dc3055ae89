"""Curved shells as scikit-fem: tied strains of a mid-surface with directors (theory 7.8)."""

from __future__ import annotations

import numpy as np
from skfem.helpers import cross, mul

from modalprep.fe.elements.shells.curved import CurvedShellBlock
from modalprep.fe.elements.shells.laminate import shell_section
from modalprep.fe.elements.shells.tied_strains import CURVATURE, MEMBRANE, SHEAR, Forms
from modalprep.fe.forms.basis import DofMap, ModelBasis, cell_basis
from modalprep.fe.forms.bilinear import AllTrials
from modalprep.fe.forms.elements import Field, FieldElement, interpolated
from modalprep.fe.forms.flat_shell import moduli, stiffness
from modalprep.fe.forms.mass import Mass
from modalprep.fe.forms.terms import Term


# --8<-- [start:forms]
@AllTrials
def geometric_stiffness(x, t, r, y, s, q, w):
    """Second variation of (7.11) and (7.12): x and y are the nodes', t and s the directors', r and q the rotations."""

    def half(x, t, r, y, s, q):
        tied = np.einsum("ij...,ia...,ja...->...", w.xx, x, y) + np.einsum("ij...,ia...,ja...->...", w.xt, x, s)
        turning = np.einsum("ia...,ia...->...", w.pull, twice(r, q, w.t)) / 2
        return tied + turning + drilling(w, x, r, q)

    return half(x, t, r, y, s, q) + half(y, s, q, x, t, r)


def drilling(w, x, r, q):
    """Half of the second variation of ``(x,1 . N_i R_i e2 - x,2 . N_i R_i e1) / 2``, for the moment on it."""
    work = np.zeros(())
    for slope, p, e, sign in ((w.slope[0], w.p[0], w.e[1], 1), (w.slope[1], w.p[1], w.e[0], -1)):
        moved = np.einsum("i...,ia...,a...->...", slope, x, cross(np.einsum("i...,ia...->a...", w.N, q), e))
        turned = np.einsum("a...,i...,ia...->...", p, w.N, twice(r, q, np.array([e] * len(w.N)))) / 2
        work = work + sign * w.moment / 2 * (moved + turned)
    return work


def twice(r, q, t):
    """``r x (q x t)`` at every node."""
    return np.moveaxis(cross(np.moveaxis(r, 1, 0), cross(np.moveaxis(q, 1, 0), np.moveaxis(t, 1, 0))), 0, 1)


# --8<-- [end:forms]


class TiedStrains(FieldElement):
    """Membrane strain, curvature, transverse shear and drilling along the axes at the points of the surface.

    Internal: two rotations of the director inside the element, where its strains know them.
    """

    def __init__(self, block: CurvedShellBlock) -> None:
        self.internal = 2 if block.forms(block.degree)[0].turned.any() else 0
        super().__init__(block.kind)
        self.block = block

    def fields(self, X: np.ndarray) -> tuple[Field, ...]:
        """Return the strains of the nodes' motions, and of the internal rotations."""
        block = self.block
        x, t, _ = nodal_vectors(block)
        tied = block.along_axes(block.points, *(self._covariant(forms, x, t) for forms in block.forms(block.degree)))
        drill = self._drilling(x)
        if self.internal:
            own = (forms.of_tau(block.x, block.frame[:, :2]) for forms in block.forms(block.degree))
            tied = np.concatenate([tied, block.along_axes(block.points, *own)], axis=3)
            drill = np.concatenate([drill, np.zeros((*drill.shape[:2], 1, 2))], axis=3)
        tied[:, :, CURVATURE] *= growth(block)[..., None, None]
        return tuple((rows, None) for rows in (tied[:, :, MEMBRANE], tied[:, :, CURVATURE], tied[:, :, SHEAR], drill))

    def _covariant(self, forms: Forms, x: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return the first variation of ``xx_ij x_i . x_j + xt_ij x_i . t_j``, ``(ne, nq, 8, 6n)``."""
        by_x, by_t = forms.slopes(self.block.x, self.block.normal)
        rule = f"{forms.subscripts}cia,eiaj->{forms.subscripts}cj"
        return np.einsum(rule, by_x, x, optimize=True) + np.einsum(rule, by_t, t, optimize=True)

    def _drilling(self, x: np.ndarray) -> np.ndarray:
        """Return the first variation of (7.12), ``(ne, nq, 1, 6n)``."""
        block = self.block
        (e1, e2), (p1, p2) = block.plane(block.points)
        slope = block.points.gradient
        moved = [np.einsum("eqi,eiaj,eqa->eqj", slope[:, :, k], x, e, optimize=True) for k, e in ((0, e2), (1, e1))]
        t = rotation(block)
        turned = np.einsum("eqa,eqaj->eqj", np.cross(e2, p1) - np.cross(e1, p2), t)  # p . (t x e) = t . (e x p)
        return ((moved[0] - moved[1] + turned) / 2)[:, :, None]


class NodalVectors(FieldElement):
    """Variations of the mid-surface and of the directors at the nodes of a cell, and their rotations, ``(n, 3)``."""

    def __init__(self, block: CurvedShellBlock) -> None:
        super().__init__(block.kind)
        self.block = block

    def fields(self, X: np.ndarray) -> tuple[Field, ...]:
        """Return the three fields, the same at all points."""
        return tuple((vectors[:, None], None) for vectors in nodal_vectors(self.block))


class DirectorMotion(FieldElement):
    """Displacement ``N_i (u_i + h t_i x n_i)`` of a surface at the height h over the nodes, and the rotation."""

    def __init__(self, block: CurvedShellBlock, height: np.ndarray, unit: float = 1.0, *, alone: bool = False) -> None:
        super().__init__(block.kind)
        self.block, self.height, self.unit, self.alone = block, height, unit, alone

    def fields(self, X: np.ndarray) -> tuple[Field, ...]:
        """Return displacement and rotation with their gradients along the surface, or the displacement `alone`."""
        _, t, r = nodal_vectors(self.block)
        n = t.shape[1]
        u = np.zeros_like(t)
        for i in range(n):
            u[:, i, range(3), range(6 * i, 6 * i + 3)] = self.unit
        fields = [self._interpolated(u + self.height[:, None, None, None] * t), self._interpolated(r)]
        return tuple(fields[: 1 if self.alone else 2])

    def _interpolated(self, vectors: np.ndarray) -> Field:
        at = self.block.points
        slope = np.einsum("eqkb,eqki,eiaj->eqabj", at.axes[:, :, :2], at.gradient, vectors, optimize=True)
        return np.einsum("qi,eiaj->eqaj", self.block.shapes, vectors), slope


def nodal_vectors(block: CurvedShellBlock) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return variations of mid-surface, directors and rotations at the nodes, ``(ne, n, 3, 6n)`` per nodal DOF."""
    ne, n = block.nodes.shape
    u, r = np.zeros((2, ne, n, 3, n, 6))
    for i in range(n):
        u[:, i, :, i, :3] = r[:, i, :, i, 3:] = np.eye(3)
    u, r = (vectors.reshape(ne, n, 3, 6 * n) for vectors in (u, r))
    t = np.cross(r, block.normal[..., None], axis=2)
    return u + block.offset[:, None, None, None] * t, t, r


def rotation(block: CurvedShellBlock) -> np.ndarray:
    """Return the rotation ``N_i t_i (ne, nq, 3, 6n)``."""
    return np.einsum("qi,eiaj->eqaj", block.shapes, nodal_vectors(block)[2])


def growth(block: CurvedShellBlock) -> np.ndarray:
    """Return the thickness over that of the section, ``(ne, nq)`` or ``(1, 1)``."""
    return np.ones((1, 1)) if block.ratio is None else block.ratio @ block.shapes.T


class PlainCurvedShell:
    """The terms of curved shells of one kind and property."""

    def __init__(self, block: CurvedShellBlock, dofmap: DofMap) -> None:
        self.block, self.dofmap = block, dofmap

    def motions(self) -> list[ModelBasis]:
        """Return the basis of displacement u and rotation t of the mid-surface, ``(3, ne, nq)`` each."""
        return [self._basis(DirectorMotion(self.block, self.block.offset))]

    def stiffness(self) -> list[Term]:
        """Return the stiffness of membrane, bending, shear and drilling."""
        return [Term(stiffness, self._basis(TiedStrains(self.block)), self._moduli())]

    def geometric_stiffness(self, d: np.ndarray) -> list[Term]:
        """Return the stiffness of the stress of the displacements ``d (n_dof,)``."""
        block = self.block
        force = self._forces(d)
        covariant = np.einsum("eqa,eqac->eqc", force[..., :8], block.points.cartesian)
        xx = xt = pull = np.zeros(())
        for forms, work in zip(block.forms(block.degree), (covariant, force[..., :8]), strict=False):
            by_x, by_t = forms.slopes(block.x, block.normal)
            rule = f"eqc,{forms.lead}cij->ijeq"
            xx, xt = xx + np.einsum(rule, work, forms.xx), xt + np.einsum(rule, work, forms.xt)
            by_t = by_t + block.offset.reshape(-1, *[1] * (by_t.ndim - 1)) * by_x
            pull = pull + np.einsum(f"eqc,{forms.subscripts}cia->iaeq", work, by_t)
        (e, p), slope = block.plane(block.points), block.points.gradient
        moment = force[..., 8]
        bent = np.einsum("eq,eqi,eqa->iaeq", moment / 2, slope[:, :, 0], e[1]) - np.einsum(
            "eq,eqi,eqa->iaeq", moment / 2, slope[:, :, 1], e[0]
        )
        given = {
            "xx": xx,
            "xt": xt,
            "pull": pull + block.offset[:, None] * bent,
            "t": np.moveaxis(block.normal, 0, 2)[..., None],
            "moment": moment,
            "slope": np.moveaxis(slope, (2, 3), (0, 1)),
            "e": np.moveaxis(e, 3, 1),
            "p": np.moveaxis(p, 3, 1),
            "N": block.shapes.T[:, None],
        }
        return [Term(geometric_stiffness, self._basis(NodalVectors(block)), given)]

    def masses(self) -> list[Mass]:
        """Return the mass of the surface at its height, and of the thickness about it."""
        block = self.block
        s, nsm = shell_section(block.section), block.section.nsm
        lift = s.lift
        ratio, N = growth(block), block.shapes
        found = []
        for height, unit, rho, at in (
            (block.offset + lift, 1.0, nsm + (s.mass - nsm) * ratio, block.x + lift * block.normal),
            (np.ones(len(block.x)), 0.0, (s.second - s.first * lift) * ratio**3, block.normal),
        ):
            basis = self._basis(DirectorMotion(block, height, unit, alone=True))
            found.append(Mass(basis, rho, np.einsum("qi,eia->aeq", N, at), unit))
        return found

    def _forces(self, d: np.ndarray) -> np.ndarray:
        """Return forces on the strains ``(ne, nq, 9)`` per area of the surface, of displacements ``d (n_dof,)``."""
        [term] = self.stiffness()
        x = stiffness.with_internal(term.basis, d, **term.given)
        e, k, g, h = (interpolated(term.basis, x, field) for field in range(4))
        A, B, D, S, H = (term.given[name] for name in "ABDSH")
        membrane = mul(A, e) + mul(B, k)
        moment = growth(self.block) * (mul(B, e) + mul(D, k))
        return np.moveaxis(np.concatenate([membrane, moment, mul(S, g), mul(H, h)]), 0, 2)

    def _moduli(self) -> dict[str, np.ndarray]:
        C = self.block.row_moduli
        own = moduli(C[:, :6, :6], C[:, 6:8, 6:8], C[:, 8:, 8:])
        return {name: part * growth(self.block) for name, part in own.items()}

    def _basis(self, element: FieldElement) -> ModelBasis:
        block = self.block
        return cell_basis(block.kind, block.nodes, self.dofmap, element, degree=block.degree, x=block.x)
