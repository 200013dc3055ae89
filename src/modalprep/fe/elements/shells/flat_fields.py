"""Strain fields of flat three- and four-node shells in their own plane: membrane, bending, shear, drilling.

Local DOFs per node: ``u, v, w, tx, ty, tz``. Bending and shear are DKMT/DKMQ (Katili 1993): the rotation field
``b = (ty, -tx)`` is linear plus one edge function per side, whose size follows from the side's shear strain.
Membrane: OPT, Felippa's optimal triangle with drilling freedoms (2003), or constant strain; QM6 (Wilson, Taylor)
for quads. Constant strain and QM6 tie the drilling rotation to the membrane's (Hughes and Brezzi).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from modalprep.fe.elements.shells.laminate import rotated_moduli, rotated_shear
from modalprep.fe.mesh.reference_cells import shapes

DRILLING = {"quad": 0.05, "triangle": 1e-2}  # much less is too soft, much more stiffens curved shells (theory 7.4)
OPT_ALPHA = 1.5  # of the OPT triangle: drilling rotations bow its sides so many times as cubic shapes would
W, TX, TY, TZ = 2, 3, 4, 5


@dataclass(frozen=True, eq=False)
class FlatCells:
    """Plane cells ``xy (ne, n, 2)`` with shapes and gradients at a quadrature of `degree`."""

    kind: str
    xy: np.ndarray
    degree: int

    @cached_property
    def mapped(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """``grad (ne, nq, n, 2)``, ``dx (ne, nq)`` and the inverse Jacobian ``(ne, nq, 2, 2)``, ``dX/dx``."""
        _, dN, weight = shapes(self.kind, self.degree)
        nq, n, _ = dN.shape
        J = np.swapaxes(self.xy, 1, 2) @ dN.transpose(1, 0, 2).reshape(n, 2 * nq)
        J = J.reshape(-1, 2, nq, 2).transpose(0, 2, 1, 3)
        det = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
        inverse = np.empty_like(J)
        inverse[..., 0, 0], inverse[..., 1, 1] = J[..., 1, 1], J[..., 0, 0]
        inverse[..., 0, 1], inverse[..., 1, 0] = -J[..., 0, 1], -J[..., 1, 0]
        inverse /= det[..., None, None]
        return _pull_back(dN, inverse), weight * det, inverse

    @property
    def N(self) -> np.ndarray:
        """(nq, n) shape functions."""
        return shapes(self.kind, self.degree)[0]

    @cached_property
    def sides(self) -> tuple[np.ndarray, np.ndarray]:
        """Length ``(ne, n)`` and direction ``(ne, n, 2)`` of the side from each node to the next."""
        edge = np.roll(self.xy, -1, axis=1) - self.xy
        length = np.linalg.norm(edge, axis=2)
        return length, edge / length[..., None]

    def bubbles(self) -> tuple[np.ndarray, np.ndarray]:
        """Edge functions ``P (nq, n)``, 1 at the middle of their side, and gradients ``(ne, nq, n, 2)``."""
        N, dN, _ = shapes(self.kind, self.degree)
        if self.kind == "triangle":
            after, dafter = np.roll(N, -1, axis=1), np.roll(dN, -1, axis=1)
            P, dP = 4 * N * after, 4 * (N[..., None] * dafter + after[..., None] * dN)
        else:
            X, Y = N[:, 1] + N[:, 2], N[:, 2] + N[:, 3]
            along, across = [X, Y, X, Y], [1 - Y, X, Y, 1 - X]
            slope = [-1.0, 1.0, 1.0, -1.0]
            P = np.stack([4 * s * (1 - s) * c for s, c in zip(along, across, strict=True)], axis=1)
            dP = np.zeros((*P.shape, 2))
            for k in range(4):
                dP[:, k, k % 2] = 4 * (1 - 2 * along[k]) * across[k]
                dP[:, k, 1 - k % 2] = 4 * along[k] * (1 - along[k]) * slope[k]
        return P, _pull_back(dP, self.mapped[2])


def _pull_back(slope: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """Gradients ``(ne, nq, k, 2)`` in x, y of functions with reference gradients ``(nq, k, 2)``."""
    along, across = (slope[None, :, :, b, None] * inverse[:, :, None, b] for b in range(2))
    return along + across


def mean_rotation(cells: FlatCells) -> np.ndarray:
    """Rotation ``(ne, 3, 6n)`` of the cell's axes: of the linear displacements at its centre."""
    ne, n, _ = cells.xy.shape
    centre = FlatCells(cells.kind, cells.xy, 1).mapped[0].mean(axis=1)
    w = np.zeros((ne, 3, n, 6))
    w[:, 0, :, W], w[:, 1, :, W] = centre[..., 1], -centre[..., 0]
    w[:, 2, :, 0], w[:, 2, :, 1] = -centre[..., 1] / 2, centre[..., 0] / 2
    return w.reshape(ne, 3, 6 * n)


def side_rotation(cells: FlatCells) -> np.ndarray:
    """Rows ``(ne, n, 2, 6n)``: rotation ``b . t`` along each side at its two ends, per local DOF."""
    n = cells.xy.shape[1]
    _, t = cells.sides
    rows = np.zeros((*t.shape[:2], 2, n, 6))
    for k in range(n):
        for end, node in enumerate((k, (k + 1) % n)):
            rows[:, k, end, node, TY], rows[:, k, end, node, TX] = t[:, k, 0], -t[:, k, 1]
    return rows.reshape(*t.shape[:2], 2, 6 * n)


def linked(cells: FlatCells) -> np.ndarray:
    """Rows ``(ne, n, 6n)``: height of the deflection's edge functions, ``(L/8)(bs_j - bs_i)``."""
    ends = side_rotation(cells)
    return cells.sides[0][..., None] / 8 * (ends[:, :, 1] - ends[:, :, 0])


def slopes(cells: FlatCells) -> np.ndarray:
    """``u_i,a (ne, nq, 2, 3, 6n)`` of the mid-surface, w with its edge functions."""
    grad, dx, _ = cells.mapped
    n = cells.xy.shape[1]
    Z = np.zeros((*dx.shape, 2, 3, n, 6))
    for i in range(3):
        Z[:, :, :, i, :, i] = np.swapaxes(grad, 2, 3)
    Z = Z.reshape(*dx.shape, 2, 3, 6 * n)
    Z[:, :, :, 2] += np.swapaxes(cells.bubbles()[1], 2, 3) @ linked(cells)[:, None]
    return Z


def nodal_rotations(cells: FlatCells) -> tuple[np.ndarray, np.ndarray]:
    """Linear rotations t of the nodes ``(ne, nq, 3, 6n)`` and slopes ``t_c,a (ne, nq, 2, 3, 6n)``, per local DOF."""
    grad, dx, _ = cells.mapped
    n = cells.xy.shape[1]
    t, slope = np.zeros((*dx.shape, 3, n, 6)), np.zeros((*dx.shape, 2, 3, n, 6))
    for c in range(3):
        t[:, :, c, :, TX + c], slope[:, :, :, c, :, TX + c] = cells.N, np.swapaxes(grad, 2, 3)
    return t.reshape(*dx.shape, 3, 6 * n), slope.reshape(*dx.shape, 2, 3, 6 * n)


def side_fields(cells: FlatCells) -> np.ndarray:
    """Rows ``(ne, 5n, 6n)`` of the sides: height of the edge function; mean, then change of tx, ty along each."""
    ne, n, _ = cells.xy.shape
    rows = np.zeros((2, ne, n, 2, n, 6))
    for k in range(n):
        for end, sign in ((k, -1.0), ((k + 1) % n, 1.0)):
            for a, t in enumerate((TX, TY)):
                rows[0, :, k, a, end, t], rows[1, :, k, a, end, t] = 0.5, sign
    mean, change = rows.reshape(2, ne, 2 * n, 6 * n)
    return np.concatenate([linked(cells), mean, change], axis=1)


def side_weights(cells: FlatCells, pull: np.ndarray, bow: float) -> np.ndarray:
    """Work ``(ne, 5n, 5n)`` of forces `pull (ne, n, 2)` on the second-order motion of the middles of the sides.

    A side bends along the normal that rotates with its nodes, ``w t x e3`` with their rotations t relative to the
    element, so that neighbours stay together. Where drilling rotations bow it in the plane, `bow` times as cubic shapes
    would, their second-order part does so too, half of ``t`` times the element's rotation, which is subtracted:
    ``bow L/16 (t_s dt_n - t_n dt_s)`` with t_s along and t_n across the side, for the force across it.
    """
    length, along = cells.sides
    n = cells.xy.shape[1]
    W = np.zeros((len(length), 5 * n, 5 * n))
    size = bow / 16 * length * (pull[..., 1] * along[..., 0] - pull[..., 0] * along[..., 1])
    for k in range(n):
        mean, change = n + 2 * k, 3 * n + 2 * k
        W[:, k, mean + 1], W[:, k, mean] = pull[:, k, 0], -pull[:, k, 1]
        W[:, mean, change + 1], W[:, mean + 1, change] = size[:, k], -size[:, k]
    return W + W.transpose(0, 2, 1)


def edge_rotation(cells: FlatCells, D: np.ndarray, S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows ``(ne, n, 6n)``: size of each edge function, and shear strain along each side.

    ``(2/3) L (1 + phi) db = w_i - w_j - (L/2)(bs_i + bs_j)``, ``g = -(2/3) phi db``,
    ``phi = 12 D_s / (S_s L^2)`` with the bending and shear stiffness along the side.
    """
    n = cells.xy.shape[1]
    length, t = cells.sides
    angle = np.arctan2(t[..., 1], t[..., 0])
    D_s = rotated_moduli(D[:, None], -angle)[..., 0, 0]
    S_s = rotated_shear(S[:, None], -angle)[..., 0, 0]
    phi = 12 * D_s / (S_s * length**2)
    rows = -length[..., None] / 2 * side_rotation(cells).sum(axis=2)
    for k in range(n):
        rows[:, k, 6 * k + W] += 1
        rows[:, k, 6 * ((k + 1) % n) + W] -= 1
    size = rows / (2 / 3 * length * (1 + phi))[..., None]
    return size, -(2 / 3 * phi)[..., None] * size


def bending(cells: FlatCells, size: np.ndarray) -> np.ndarray:
    """Curvatures ``bx,x by,y bx,y+by,x`` ``(ne, nq, 3, 6n)``."""
    grad, dx, _ = cells.mapped
    n = cells.xy.shape[1]
    _, dP = cells.bubbles()
    _, t = cells.sides
    x, y = dP[..., 0], dP[..., 1]
    c, s = t[:, None, :, 0], t[:, None, :, 1]
    B = np.stack([x * c, y * s, y * c + x * s], axis=2) @ size[:, None]
    B = B.reshape(*dx.shape, 3, n, 6)
    B[..., 0, :, TY] += grad[..., 0]
    B[..., 1, :, TX] -= grad[..., 1]
    B[..., 2, :, TY] += grad[..., 1]
    B[..., 2, :, TX] -= grad[..., 0]
    return B.reshape(*dx.shape, 3, 6 * n)


def shear(cells: FlatCells, side: np.ndarray) -> np.ndarray:
    """Transverse shear ``xz, yz`` ``(ne, nq, 2, 6n)`` from the strains along the sides ``(ne, n, 6n)``."""
    N = cells.N
    length, t = cells.sides
    if cells.kind == "triangle":  # two sides meet at each node
        pair = np.stack([t, np.roll(t, 1, axis=1)], axis=2)
        nodal = np.linalg.solve(pair, np.stack([side, np.roll(side, 1, axis=1)], axis=2))
        return np.einsum("qi,eiaj->eqaj", N, nodal, optimize=True)
    X, Y = N[:, 1] + N[:, 2], N[:, 2] + N[:, 3]
    covariant = length[..., None] * side
    zero = 0 * X
    along = np.stack([np.stack([1 - Y, zero, -Y, zero], 1), np.stack([zero, X, zero, X - 1], 1)], axis=1)
    inverse = cells.mapped[2]
    return np.swapaxes(inverse, 2, 3) @ (along[None] @ covariant[:, None])


def membrane(cells: FlatCells) -> np.ndarray:
    """Strains ``xx, yy, xy`` and drilling ``(v,x - u,y)/2 - tz`` ``(ne, nq, 4, 6n)`` of linear displacements."""
    grad, dx, _ = cells.mapped
    n = cells.xy.shape[1]
    B = np.zeros((*dx.shape, 4, n, 6))
    B[..., 0, :, 0] = B[..., 2, :, 1] = grad[..., 0]
    B[..., 1, :, 1] = B[..., 2, :, 0] = grad[..., 1]
    B[..., 3, :, 1], B[..., 3, :, 0] = grad[..., 0] / 2, -grad[..., 1] / 2
    B[..., 3, :, TZ] = -cells.N
    return B.reshape(*dx.shape, 4, 6 * n)


def incompatible_membrane(cells: FlatCells) -> np.ndarray:
    """Strains ``(ne, nq, 3, 4)`` of QM6's internal displacements, gradients mapped from the centre."""
    X = np.stack([cells.N[:, 1] + cells.N[:, 2], cells.N[:, 2] + cells.N[:, 3]])
    dx = cells.mapped[1]
    weight = shapes(cells.kind, cells.degree)[2]
    J = np.einsum("eia,ib->eab", cells.xy, np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]))
    scale = np.linalg.det(J)[:, None] / (dx / weight)
    slope = np.einsum("kq,eka->eqka", 4 - 8 * X, np.linalg.inv(J)) * scale[..., None, None]
    B = np.zeros((*dx.shape, 3, 4))
    for k in range(2):
        B[..., 0, 2 * k] = B[..., 2, 2 * k + 1] = slope[..., k, 0]
        B[..., 1, 2 * k + 1] = B[..., 2, 2 * k] = slope[..., k, 1]
    return B


def optimal_membrane(cells: FlatCells) -> tuple[np.ndarray, np.ndarray]:
    """Basic strains ``(ne, 3, 18)`` and higher-order strains ``(ne, nq, 3, 18)`` of the OPT triangle."""
    x, y = cells.xy[..., 0], cells.xy[..., 1]
    dx = x[:, [2, 0, 1]] - x[:, [1, 2, 0]]  # x32, x13, x21: opposite side of each node
    dy = y[:, [1, 2, 0]] - y[:, [2, 0, 1]]  # y23, y31, y12
    area = cells.mapped[1].sum(axis=1)
    return _basic(dx, dy, area), _higher(cells, dx, dy, area)


def _basic(dx: np.ndarray, dy: np.ndarray, area: np.ndarray, alpha: float = OPT_ALPHA) -> np.ndarray:
    B = np.zeros((len(dx), 3, 3, 6))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        B[:, 0, i, 0] = B[:, 2, i, 1] = dy[:, i]
        B[:, 1, i, 1] = B[:, 2, i, 0] = dx[:, i]
        B[:, 0, i, TZ] = alpha / 6 * dy[:, i] * (dy[:, k] - dy[:, j])
        B[:, 1, i, TZ] = alpha / 6 * dx[:, i] * (dx[:, k] - dx[:, j])
        B[:, 2, i, TZ] = alpha / 3 * (dx[:, j] * dy[:, j] - dx[:, k] * dy[:, k])
    return (B / (2 * area[:, None, None, None])).reshape(-1, 3, 18)


def _higher(cells: FlatCells, dx: np.ndarray, dy: np.ndarray, area: np.ndarray) -> np.ndarray:
    side = np.stack([dx[:, [2, 0, 1]], -dy[:, [2, 0, 1]]], axis=2)  # from node 1 to 2, 2 to 3, 3 to 1
    square = np.einsum("eka,eka->ek", side, side)
    natural = np.stack([side[..., 0] ** 2, side[..., 1] ** 2, side[..., 0] * side[..., 1]], axis=2)
    to_cartesian = np.linalg.inv(natural / square[..., None])
    beta = np.array([[1, 2, 1], [0, 1, -1], [-1, -1, -2]]) * 2 / 3
    Q = np.empty((len(dx), 3, 3, 3))
    for m in range(3):
        Q[:, m] = np.roll(beta, (m, m), axis=(0, 1)) * area[:, None, None] / square[..., None]
    hierarchical = np.zeros((len(dx), 3, 3, 6))
    opposite_x, opposite_y = dx, -dy  # x32, y32
    hierarchical[..., 0] = opposite_x[:, None] / (4 * area)[:, None, None]
    hierarchical[..., 1] = opposite_y[:, None] / (4 * area)[:, None, None]
    hierarchical[:, range(3), range(3), TZ] = 1.0
    field = np.einsum("qm,emab->eqab", cells.N, Q)
    return to_cartesian[:, None] @ (field @ hierarchical.reshape(-1, 1, 3, 18))
