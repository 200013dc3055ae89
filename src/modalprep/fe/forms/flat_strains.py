"""Strains of flat shells in the axes of the element: membranes, bending and transverse shear (theory 7.3, 7.4).

Each is an array ``(ne, nq, components, 6n)`` per local DOF ``u, v, w, tx, ty, tz`` of the nodes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.fe.elements.shells.flat_fields import TX, TY, TZ, FlatCells, W, side_rotation
from modalprep.fe.elements.shells.flat_strains import OPT_ALPHA, OPT_BETA
from modalprep.fe.mesh.reference_cells import shapes_at


class Strains(NamedTuple):
    """Membrane (3), curvature (3), transverse shear (2), and drilling (1) or the higher-order strains of OPT (3)."""

    membrane: np.ndarray
    curvature: np.ndarray
    shear: np.ndarray
    extra: np.ndarray


def strains(cells: FlatCells, D: np.ndarray, S: np.ndarray, *, optimal: bool) -> Strains:
    """Return the strains of cells with bending moduli ``D (ne or 1, 3, 3)`` and shear moduli ``S (ne or 1, 2, 2)``."""
    db, g = edge_rotations(cells, D, S)
    plane = optimal_membrane(cells) if optimal else linear_membrane(cells)
    return Strains(plane[0], curvature(cells, db), transverse_shear(cells, g), plane[1])


def linear_membrane(cells: FlatCells) -> tuple[np.ndarray, np.ndarray]:
    """Return ``u,x v,y u,y+v,x`` of linear displacements, and the drilling strain ``(v,x - u,y)/2 - tz``."""
    (x, y), rows = np.moveaxis(cells.mapped[0], 3, 0), _rows(cells, 4)
    rows[:, :, 0, :, 0] = rows[:, :, 2, :, 1] = x
    rows[:, :, 1, :, 1] = rows[:, :, 2, :, 0] = y
    rows[:, :, 3, :, 0] = -y / 2
    rows[:, :, 3, :, 1] = x / 2
    rows[:, :, 3, :, TZ] = -cells.N
    return _flat(rows[:, :, :3]), _flat(rows[:, :, 3:])


def optimal_membrane(cells: FlatCells) -> tuple[np.ndarray, np.ndarray]:
    """Return the basic and the higher-order strains of the optimal triangle (Felippa 2003)."""
    after, before = (np.roll(cells.xy, -k, axis=1) for k in (1, 2))
    opposite = before - after
    dx, dy = opposite[..., 0], -opposite[..., 1]  # x_kj and y_jk of node i
    area = (dx[:, 2] * dy[:, 1] - dx[:, 1] * dy[:, 2])[:, None] / 2
    x, y = dx / (2 * area), dy / (2 * area)
    j, k = [1, 2, 0], [2, 0, 1]
    basic = _rows(cells, 3)
    basic[:, :, 0, :, 0] = basic[:, :, 2, :, 1] = y[:, None]
    basic[:, :, 1, :, 1] = basic[:, :, 2, :, 0] = x[:, None]
    basic[:, :, 0, :, TZ] = (OPT_ALPHA / 6 * y * (dy[:, k] - dy[:, j]))[:, None]
    basic[:, :, 1, :, TZ] = (OPT_ALPHA / 6 * x * (dx[:, k] - dx[:, j]))[:, None]
    basic[:, :, 2, :, TZ] = (OPT_ALPHA / (6 * area) * (dx[:, j] * dy[:, j] - dx[:, k] * dy[:, k]))[:, None]
    higher = _rows(cells, 3)
    turned = _of_relative_rotations(cells, area)
    mean = turned.sum(axis=3, keepdims=True)  # per rotation of the linear triangle, (v,x - u,y) / 2
    higher[..., 0] = mean * (x / 2)[:, None, None]
    higher[..., 1] = -mean * (y / 2)[:, None, None]
    higher[..., TZ] = turned
    return _flat(basic), _flat(higher)


def _of_relative_rotations(cells: FlatCells, area: np.ndarray) -> np.ndarray:
    """Return ``T_e Q(zeta) (ne, nq, 3, 3)``: strains of nodal rotations less that of the linear triangle."""
    length, along = cells.sides
    c, s = np.moveaxis(along, 2, 0)
    beta = np.array(OPT_BETA)
    turns = [np.roll(beta, (m, m), axis=(0, 1)) for m in range(3)]
    natural = np.einsum("qm,mab->qab", cells.N, turns) * (area / length**2)[:, None, :, None]
    return np.linalg.inv(np.stack([c * c, s * s, c * s], axis=2))[:, None] @ natural


def edge_rotations(cells: FlatCells, D: np.ndarray, S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the amplitudes ``db`` of (7.4) and the shear strain g along each side, rows ``(ne, n, 6n)``."""
    (length, along), n = cells.sides, cells.xy.shape[1]
    c, s = np.moveaxis(along, 2, 0)
    bent = np.stack([c * c, s * s, 2 * c * s], axis=2)
    bending, shear = (np.sum((t @ Q) * t, axis=2) for t, Q in ((bent, D), (along, S)))
    phi = 12 * bending / (shear * length**2)
    right = -length[..., None] / 2 * side_rotation(cells).sum(axis=2)
    right = right.reshape(*length.shape, n, 6)
    for k in range(n):
        right[:, k, k, W] += 1
        right[:, k, (k + 1) % n, W] -= 1
    db = right.reshape(*length.shape, 6 * n) / (2 / 3 * length * (1 + phi))[..., None]
    return db, -2 / 3 * phi[..., None] * db


def curvature(cells: FlatCells, db: np.ndarray) -> np.ndarray:
    """Return ``bx,x by,y bx,y+by,x`` of ``b = sum N_i b_i + sum P_k db_k (c_k, s_k)``, ``b_i = (ty, -tx)``."""
    (x, y), (X, Y) = (np.moveaxis(slope, 3, 0) for slope in (cells.mapped[0], cells.bubbles[1]))
    rows = _rows(cells, 3)
    rows[:, :, 0, :, TY] = rows[:, :, 2, :, TY] = x
    rows[:, :, 2, :, TY] = y
    rows[:, :, 1, :, TX] = -y
    rows[:, :, 2, :, TX] = -x
    c, s = np.moveaxis(cells.sides[1], 2, 0)[:, :, None]
    return _flat(rows) + np.stack([X * c, Y * s, Y * c + X * s], axis=2) @ db[:, None]


def transverse_shear(cells: FlatCells, g: np.ndarray) -> np.ndarray:
    """Return ``xz, yz`` from the strains g along the sides."""
    length, along = cells.sides
    if cells.kind == "triangle":  # at each node of the two sides that meet there, linear between the nodes
        both = np.stack([np.roll(along, 1, axis=1), along], axis=2)
        at_nodes = np.linalg.solve(both, np.stack([np.roll(g, 1, axis=1), g], axis=2))
        return np.einsum("qi,eiaj->eqaj", cells.N, at_nodes)
    X, Y = cells.N[:, 1] + cells.N[:, 2], cells.N[:, 2] + cells.N[:, 3]
    none = np.zeros_like(X)
    covariant = np.array([[1 - Y, none, -Y, none], [none, X, none, X - 1]]).transpose(2, 0, 1)  # (nq, 2, 4)
    return cells.mapped[2].swapaxes(2, 3) @ (covariant[None] @ (length[..., None] * g)[:, None])


def incompatible(cells: FlatCells) -> np.ndarray:
    """Return membrane strains ``(ne, nq, 3, 4)`` of QM6's internal displacements ``4 X (1 - X)``, u and v of each."""
    X = np.stack([cells.N[:, 1] + cells.N[:, 2], cells.N[:, 2] + cells.N[:, 3]])
    dN = shapes_at("quad", np.full((2, 1), 0.5))[1][0]
    centre = np.einsum("eia,ib->eab", cells.xy, dN)
    scale = np.linalg.det(centre)[:, None] * np.linalg.det(cells.mapped[2])
    slope = (4 - 8 * X.T)[None, ..., None] * scale[..., None, None] * np.linalg.inv(centre)[:, None]
    rows = np.zeros((*slope.shape[:2], 3, 2, 2))
    for k in range(2):
        rows[:, :, 0, k, 0] = rows[:, :, 2, k, 1] = slope[:, :, k, 0]
        rows[:, :, 1, k, 1] = rows[:, :, 2, k, 0] = slope[:, :, k, 1]
    return rows.reshape(*slope.shape[:2], 3, 4)


def _rows(cells: FlatCells, count: int) -> np.ndarray:
    return np.zeros((len(cells.xy), len(cells.N), count, cells.xy.shape[1], 6))


def _flat(rows: np.ndarray) -> np.ndarray:
    return rows.reshape(*rows.shape[:3], -1)
