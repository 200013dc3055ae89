"""Fields of flat three- and four-node shells in their own plane, on which their stress does work when they rotate.

Local DOFs per node: ``u, v, w, tx, ty, tz``. The rotation field ``b = (ty, -tx)`` is linear plus one edge function per
side (`flat_strains`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from modalprep.fe.elements.shells.flat_strains import Rule
from modalprep.fe.mesh.reference_cells import shapes

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

    @cached_property
    def bubbles(self) -> tuple[np.ndarray, np.ndarray]:
        """Edge functions ``P (nq, n)``, 1 at the middle of their side, and gradients ``(ne, nq, n, 2)``."""
        own = rule(self.kind, self.degree)
        return own.P, _pull_back(own.dP, self.mapped[2])


@cache
def rule(kind: str, degree: int) -> Rule:
    """Return shapes and edge functions of a cell at a quadrature of `degree`, or at its nodes.

    Examples
    --------
    >>> rule("triangle", 1).P.sum(axis=0)
    array([1., 1., 1.])
    """
    N, dN, weight = shapes(kind, degree)
    if kind == "triangle":
        after, dafter = np.roll(N, -1, axis=1), np.roll(dN, -1, axis=1)
        P = 4 * N * after
        dP = 4 * (N[..., None] * dafter + after[..., None] * dN)
    else:
        X, Y = N[:, 1] + N[:, 2], N[:, 2] + N[:, 3]
        along = [X, Y, X, Y]
        across = [1 - Y, X, Y, 1 - X]
        slope = [-1.0, 1.0, 1.0, -1.0]
        P = np.stack([4 * s * (1 - s) * c for s, c in zip(along, across, strict=True)], axis=1)
        dP = np.zeros((*P.shape, 2))
        for k in range(4):
            dP[:, k, k % 2] = 4 * (1 - 2 * along[k]) * across[k]
            dP[:, k, 1 - k % 2] = 4 * along[k] * (1 - along[k]) * slope[k]
    return Rule(*(np.ascontiguousarray(x) for x in (N, dN, P, dP, weight)))


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
    Z[:, :, :, 2] += np.swapaxes(cells.bubbles[1], 2, 3) @ linked(cells)[:, None]
    return Z


def nodal_rotations(cells: FlatCells) -> tuple[np.ndarray, np.ndarray]:
    """Linear rotations t of the nodes ``(ne, nq, 3, 6n)`` and slopes ``t_c,a (ne, nq, 2, 3, 6n)``, per local DOF."""
    grad, dx, _ = cells.mapped
    n = cells.xy.shape[1]
    t = np.zeros((*dx.shape, 3, n, 6))
    slope = np.zeros((*dx.shape, 2, 3, n, 6))
    for c in range(3):
        t[:, :, c, :, TX + c] = cells.N
        slope[:, :, :, c, :, TX + c] = np.swapaxes(grad, 2, 3)
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
        mean = n + 2 * k
        change = 3 * n + 2 * k
        for a, b, work in (
            (k, mean + 1, pull[:, k, 0]),
            (k, mean, -pull[:, k, 1]),
            (mean, change + 1, size[:, k]),
            (mean + 1, change, -size[:, k]),
        ):
            W[:, a, b] = W[:, b, a] = work
    return W
