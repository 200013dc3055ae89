"""Flat shells as scikit-fem: bending, membranes, drilling and geometric stiffness (theory 7.3, 7.4)."""

from __future__ import annotations

import numpy as np
from skfem.helpers import dot, grad, mul, transpose

from modalprep.fe.elements.arms import node_transformation
from modalprep.fe.elements.shells.flat_fields import FlatCells, linked, nodal_rotations, side_fields, slopes
from modalprep.fe.elements.shells.flat_shell import MASS_DEGREE, STIFFNESS_DEGREE
from modalprep.fe.elements.shells.flat_strains import OPT_ALPHA
from modalprep.fe.elements.shells.laminate import shell_section
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.elements.shells.yielding import yielding_map
from modalprep.fe.forms.basis import DofMap, ModelBasis, cell_basis
from modalprep.fe.forms.bilinear import AllTrials
from modalprep.fe.forms.condensed import Condensed
from modalprep.fe.forms.corotation import cell_forces, rotating_terms, spin
from modalprep.fe.forms.elements import Field, FieldElement, Levered, interpolated
from modalprep.fe.forms.flat_strains import incompatible, strains
from modalprep.fe.forms.mass import Mass
from modalprep.fe.forms.terms import Term


# --8<-- [start:forms]
@Condensed
def stiffness(e, k, g, h, f, m, s, r, w):
    """``int (A f + B m) . e + (B f + D m) . k + S s . g + H r . h``.

    Membrane strain e, curvature k and transverse shear g; h is drilling, or the higher-order membrane strain of OPT.
    """
    force = mul(w.A, f) + mul(w.B, m)
    moment = mul(w.B, f) + mul(w.D, m)
    return dot(force, e) + dot(moment, k) + dot(mul(w.S, s), g) + dot(mul(w.H, r), h)


@AllTrials
def geometric_stiffness(u, t, o, p, v, s, q, r, w):
    """(7.5) of slopes and rotations against the axes, which rotate by o and q; p and r are of the sides."""
    x = against(w, u, t, o, p)
    y = against(w, v, s, q, r)
    return half_work(w, *x, *y) + half_work(w, *y, *x)


def half_work(w, U, t, T, p, V, s, S, r):
    """Half of (7.5) where it is bilinear: ``U_ia = u_i,a``, ``T_ca = t_c,a``; V, s and S as they."""
    b, B, k, e = turned(s), turned(S), turned(T), np.einsum
    inside = e("ab...,ia...,ib...->...", w.N, U, V) / 2 + e("ab...,ia...,ib...->...", w.M, U[:2], B)
    inside = inside + e("ab...,a...,b...->...", w.M, t[:2], S[2]) / 2 + e("ab...,...,ab...->...", w.M, t[2], S[:2]) / 2
    across = e("a...,ia...,i...->...", w.Q, U[:2], b) + e("a...,...,a...->...", w.Q, t[2], s[:2]) / 2
    return inside + across + e("ab...,ia...,ib...->...", w.L, k, B) / 2 + sides_work(w, p, r)


def sides_work(w, p, r):
    """``N_ab P_k,b v_k,a`` of the second-order motion v of the middle of side k, which turns with its nodes."""
    bowed, (tx, ty) = p[0], r[1:3]
    turning = p[1] * r[4] - p[2] * r[3]
    v = bowed * np.array([ty, -tx]) + w.bow * turning * w.across
    return np.einsum("ab...,kb...,ak...->...", w.N, w.slope, v)


def against(w, u, t, o, p):
    """Slopes ``u_i,a``, rotations and their slopes in the axes of the element, and those of its sides, less o."""
    axes = w.axes
    o = mul(axes, o)
    U = mul(mul(axes, grad(u)), transpose(axes[:2]))
    U = U - np.array([[0 * o[2], -o[2]], [o[2], 0 * o[2]], [-o[1], o[0]]])  # o x e_a
    T = mul(mul(axes, grad(t)), transpose(axes[:2]))
    p = np.array(p)
    p[1:3] -= o[:2, None]
    return U, mul(axes, t) - o, T, p


def turned(t):
    """``b = (ty, -tx)``."""
    return np.array([t[1], -t[0]])


# --8<-- [end:forms]


class ShellStrains(FieldElement):
    """Membrane strain, curvature, transverse shear, and drilling or OPT's higher-order strains, element axes."""

    def __init__(self, block: ShellBlock) -> None:
        self.internal = 4 if block.kind == "quad" else 0
        super().__init__(block.kind)
        self.block = block

    def fields(self, X: np.ndarray) -> tuple[Field, ...]:
        """Return the strains of the nodes' motions, and of the incompatible displacements of quads."""
        block = self.block
        cells = cells_of(block)
        C, S = block.moduli
        own = strains(cells, C[:, 3:, 3:], S, optimal=optimal(block))
        felt = nodal_map(block, felt=True)[:, None]
        rows = [rows @ felt for rows in own]
        if self.internal:
            inner = [np.zeros((*row.shape[:3], 4)) for row in rows]
            inner[0] = incompatible(cells)
            rows = [np.concatenate(both, axis=3) for both in zip(rows, inner, strict=True)]
        return tuple((row, None) for row in rows)


class ShellMotion(FieldElement):
    """Displacement u of the mid-surface and rotation t; with `rotating` the rotation o of the axes and the sides'.

    The deflection is linked to the rotations, ``w = sum N_i w_i + sum P_k (L_k/8) (bs_j - bs_i)``.
    """

    def __init__(self, block: ShellBlock, degree: int, *, rotating: bool = False) -> None:
        super().__init__(block.kind)
        self.block, self.degree, self.rotating = block, degree, rotating

    def fields(self, X: np.ndarray) -> tuple[Field, ...]:
        """Return the fields in mesh axes; those of the sides ``(5, n)`` in the axes of the element."""
        block = self.block
        cells = cells_of(block, self.degree)
        felt = nodal_map(block, felt=self.rotating)
        u = displacement(cells)
        t, slope = nodal_rotations(cells)
        both = [self._in_mesh(u, slopes(cells), felt), self._in_mesh(t, slope, felt)]
        if self.rotating:
            ne, n = block.nodes.shape
            sides = (side_fields(cells) @ felt).reshape(ne, 5 * n, -1)
            bowed, mean, change = np.split(sides, [n, 3 * n], axis=1)
            mean, change = (x.reshape(ne, n, 2, -1).swapaxes(1, 2) for x in (mean, change))
            p = np.concatenate([bowed[:, None], mean, change], axis=1)
            both += [(spin(block)[:, None], None), (p[:, None], None)]
        return tuple(both)

    def _in_mesh(self, value: np.ndarray, slope: np.ndarray, felt: np.ndarray) -> Field:
        frame = self.block.frame
        value, slope = value @ felt[:, None], slope @ felt[:, None, None]
        return (
            np.einsum("eca,eqcj->eqaj", frame, value, optimize=True),
            np.einsum("eca,edb,eqdcj->eqabj", frame, frame[:, :2], slope, optimize=True),
        )


def displacement(cells: FlatCells) -> np.ndarray:
    """Return ``u, v, w (ne, nq, 3, 6n)`` of the mid-surface per local DOF."""
    n = cells.xy.shape[1]
    u = np.zeros((len(cells.xy), len(cells.N), 3, n, 6))
    for a in range(3):
        u[:, :, a, :, a] = cells.N
    u = u.reshape(*u.shape[:3], 6 * n)
    u[:, :, 2] += cells.bubbles[0] @ linked(cells)
    return u


def cells_of(block: ShellBlock, degree: int | None = None) -> FlatCells:
    """Return the plane cells at a rule, by default that of the stiffness."""
    return FlatCells(block.kind, block.xy, STIFFNESS_DEGREE[block.kind] if degree is None else degree)


def optimal(block: ShellBlock) -> bool:
    """Whether the membrane is the optimal triangle."""
    return block.kind == "triangle" and block.section.membrane == "opt"


def nodal_map(block: ShellBlock, *, felt: bool) -> np.ndarray:
    """Return local DOFs ``(ne, 6n, 6n)`` per nodal DOF; where beams are, with drilling rotations that yield (7.4)."""
    T = node_transformation(block.frame, block.arm)
    if felt and block.yields is not None:
        return yielding_map(block.kind, block.xy, block.yields) @ T
    return T


def moduli(C: np.ndarray, S: np.ndarray, H: np.ndarray) -> dict[str, np.ndarray]:
    """Return A, B, D, S and H ``(., ., ne or 1, 1)`` of `stiffness` from ``[[A, B], [B, D]]``, S and H of elements."""
    parts = {"A": C[:, :3, :3], "B": C[:, :3, 3:], "D": C[:, 3:, 3:], "S": S, "H": H}
    return {name: np.moveaxis(part, 0, -1)[..., None] for name, part in parts.items()}


class PlainFlatShell:
    """The terms of flat shells of one kind and property."""

    def __init__(self, block: ShellBlock, dofmap: DofMap) -> None:
        self.block, self.dofmap = block, dofmap
        normal = block.frame[:, None, 2]
        self.x = (block.centre + block.offset[:, None] * block.frame[:, 2])[:, None] + block.xy @ block.frame[:, :2]
        self.normal = normal

    def motions(self) -> list[ModelBasis]:
        """Return the basis of displacement u and rotation t of the mid-surface, ``(3, ne, nq)`` each."""
        degree = MASS_DEGREE[self.block.kind][0]
        return [self._basis(ShellMotion(self.block, degree), degree)]

    def stiffness(self) -> list[Term]:
        """Return the stiffness of membrane, bending, shear and drilling."""
        basis = self._basis(ShellStrains(self.block), STIFFNESS_DEGREE[self.block.kind])
        return [Term(stiffness, basis, self._moduli())]

    def geometric_stiffness(self, d: np.ndarray) -> list[Term]:
        """Return the stiffness of the stress of the displacements ``d (n_dof,)``."""
        block = self.block
        terms = self.stiffness()
        forces = cell_forces(terms, block.nodes, self.dofmap, d)
        degree = STIFFNESS_DEGREE[block.kind]
        basis = self._basis(ShellMotion(block, degree, rotating=True), degree)
        cells = cells_of(block)
        length, along = cells.sides
        across = np.array([-along[..., 1], along[..., 0]])
        given = {
            "axes": np.moveaxis(block.frame, 0, -1)[..., None],
            "slope": np.moveaxis(cells.bubbles[1], (0, 1), (2, 3)),
            "across": (length / 16 * across).swapaxes(1, 2)[..., None],
            "bow": OPT_ALPHA if optimal(block) else 0.0,
        }
        inside = Term(geometric_stiffness, basis, given | self._resultants(terms[0], d))
        return [inside, *rotating_terms(block, self.dofmap, forces)]

    def masses(self) -> list[Mass]:
        """Return the mass of the surface at its height, and of the thickness about it."""
        block, s = self.block, shell_section(self.block.section)
        nsm = block.section.nsm
        lift = s.lift
        found = []
        for degree, r, unit in zip(MASS_DEGREE[block.kind], (lift, 1.0), (1.0, 0.0), strict=True):
            basis = self._basis(Levered(ShellMotion(block, degree), r * self.normal, unit), degree)
            e3 = np.moveaxis(self.normal, 2, 0)
            ratio = 1.0 if block.ratio is None else block.ratio @ cells_of(block, degree).N.T
            if unit:
                rho = nsm + (s.mass - nsm) * ratio
                at = np.asarray(basis.global_coordinates()) + lift * e3
            else:
                rho = (s.second - s.mass * lift**2) * ratio**3
                at = np.broadcast_to(e3, (3, *basis.dx.shape))
            found.append(Mass(basis, np.array(rho), at, unit))
        return found

    def _basis(self, element: FieldElement, degree: int) -> ModelBasis:
        return cell_basis(self.block.kind, self.block.nodes, self.dofmap, element, degree=degree, x=self.x)

    def _moduli(self) -> dict[str, np.ndarray]:
        return moduli(*self.block.moduli, self.block.row_moduli.plane[:, 3:, 3:])

    def _resultants(self, term: Term, d: np.ndarray) -> dict[str, np.ndarray]:
        """Return N, M and L ``(2, 2, ne, nq)`` and Q ``(2, ne, nq)`` of displacements ``d (n_dof,)``."""
        x = stiffness.with_internal(term.basis, d, **term.given)
        e, k, g = (interpolated(term.basis, x, field) for field in range(3))
        own = self._moduli()
        N, M = (mul(own[a], e) + mul(own[b], k) for a, b in (("A", "B"), ("B", "D")))
        L = np.zeros_like(N)
        third = self.block.unsymmetric_moduli
        if third is not None:
            L = np.einsum("eab,aeq->beq", np.broadcast_to(third, (len(e[0]), 6, 3)), np.concatenate([e, k]))
        square = [[0, 2], [2, 1]]
        return {"N": N[square], "M": M[square], "L": L[square], "Q": mul(own["S"], g)}
