"""Derivative of the strain energy of shells by their moduli, the tied and condensed strains included (theory 1.7).

Internal displacements and rotations bring the energy to its minimum, so that their own derivative does no work. The
edge functions of flat shells do not: their sizes follow from the ratio of bending to shear stiffness along the sides,
and are differentiated.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from modalprep.fe.elements.shells.curved import CurvedShellBlock
from modalprep.fe.elements.shells.flat_fields import FlatCells, rule
from modalprep.fe.elements.shells.flat_shell import STIFFNESS_DEGREE
from modalprep.fe.elements.shells.flat_strains import Moduli
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.properties.properties import Shell

STEP = 1e-30  # of the complex step, far below round-off: the imaginary part is the derivative to the last digits


def shell_rate(block: ShellBlock | CurvedShellBlock, moved: Shell, d: np.ndarray) -> np.ndarray:
    """Return ``d_a^T (dK/ds) d_b (k, k)`` of a section that moves by ``i STEP`` times its derivative by s.

    Parameters
    ----------
    block : ShellBlock or CurvedShellBlock
    moved : Shell
        The complex section.
    d : (ne, nl, k)
        Nodal displacements of the elements.

    References
    ----------
    W. Squire, G. Trapp, Using complex variables to estimate derivatives of real functions, SIAM Review 40 (1998) 110.
    """
    B, _, dx = block.strain
    strain = B @ d[:, None]
    if isinstance(block, CurvedShellBlock):
        return _work(strain, np.imag(replace(block, section=moved).row_moduli) / STEP, strain, dx)
    rate = Moduli(*(np.imag(x) / STEP for x in replace(block, section=moved).row_moduli))
    own = block.row_moduli
    plane = strain[:, :, np.r_[0:3, 8 : strain.shape[2]]]
    bend = strain[:, :, 3:8]
    grown = edge_rate(block, rate.bend, d)
    total = _work(plane, rate.plane, plane, dx) + _work(bend, rate.bend, bend, dx)
    mixed = _work(plane[:, :, :3], rate.coupling, bend[:, :, :3], dx) + _work(bend, own.bend, grown, dx)
    mixed += _work(plane[:, :, :3], own.coupling, grown[:, :, :3], dx)
    return total + mixed + mixed.T


def _work(a: np.ndarray, C: np.ndarray, b: np.ndarray, dx: np.ndarray) -> np.ndarray:
    """``sum dx a^T C b (k, k)`` of strains ``(ne, nq, ns, k)``."""
    stress = (C[:, None] * dx[..., None, None]) @ b
    return a.reshape(-1, a.shape[3]).T @ stress.reshape(-1, b.shape[3])


def edge_rate(block: ShellBlock, bend: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Return the derivative ``(ne, nq, 5, k)`` of curvatures and shear with the moduli `bend` ``(., 5, 5)`` of them.

    With ``phi = 12 D / (S L^2)`` the size ``3 / (2 L (1 + phi))`` of an edge function has the derivative
    ``-3 dphi / (2 L (1 + phi)^2)``, and its shear ``-(2/3) phi`` times the size that of the size times 2/3.
    """
    cells = FlatCells(block.kind, block.xy, STIFFNESS_DEGREE[block.kind])
    length, along = cells.sides
    D, S = _along_sides(block.row_moduli.bend, along)
    dD, dS = _along_sides(bend, along)
    phi = 12 * D / (S * length**2)
    size = -1.5 * phi * (dD / D - dS / S) / (length * (1 + phi) ** 2)
    rows = _edge_rows(cells, along, 2 / 3 * np.ones_like(length))
    return np.einsum("eqsn,enk->eqsk", rows, size[..., None] * _sizes(block, length, along, d), optimize=True)


def _along_sides(bend: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bending and shear stiffness ``(ne, n)`` along the sides."""
    c, s = along[..., 0], along[..., 1]
    strain = np.stack([c * c, s * s, 2 * c * s], axis=2)
    C = np.broadcast_to(bend, (len(along), 5, 5))
    D = np.einsum("ena,eab,enb->en", strain, C[:, :3, :3], strain)
    return D, np.einsum("ena,eab,enb->en", along, C[:, 3:, 3:], along)


def _sizes(block: ShellBlock, length: np.ndarray, along: np.ndarray, d: np.ndarray) -> np.ndarray:
    """``w_i - w_j - (L/2)(bs_i + bs_j)`` of each side ``(ne, n, k)``."""
    ne, n = block.nodes.shape
    u = d.reshape(ne, n, 2, 3, -1)
    local = np.einsum("ecx,enhxk->enhck", block.frame, u)  # displacement and rotation in the element's axes
    w, tx, ty = local[:, :, 0, 2], local[:, :, 1, 0], local[:, :, 1, 1]
    bs, bs_next = (along[..., :1] * y - along[..., 1:] * x for x, y in ((tx, ty), _next(tx, ty)))
    return w - np.roll(w, -1, axis=1) - length[..., None] / 2 * (bs + bs_next)


def _next(*fields: np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(np.roll(field, -1, axis=1) for field in fields)


def _edge_rows(cells: FlatCells, along: np.ndarray, sheared: np.ndarray) -> np.ndarray:
    """Curvatures and shear ``(ne, nq, 5, n)`` of edge functions of size 1, with a shear strain along the sides."""
    x, y = np.moveaxis(cells.bubbles[1], 3, 0)  # (ne, nq, n)
    c, s = along[:, None, :, 0], along[:, None, :, 1]
    shear = _triangle_shear(cells, along) if cells.xy.shape[1] == 3 else _quad_shear(cells)
    return np.stack([x * c, y * s, y * c + x * s, *(sheared[:, None] * part for part in shear)], axis=2)


def _quad_shear(cells: FlatCells) -> tuple[np.ndarray, np.ndarray]:
    """Shear ``xz, yz (ne, nq, n)`` per strain along each side: covariant, linear across."""
    N = rule(cells.kind, cells.degree).N
    inverse = cells.mapped[2]
    length = cells.sides[0]
    X, Y = N[:, 1] + N[:, 2], N[:, 2] + N[:, 3]
    covariant = length[:, None] * np.stack([1 - Y, X, -Y, X - 1], axis=1)
    rows = inverse[:, :, [0, 1, 0, 1]]  # (ne, nq, side, 2)
    return rows[..., 0] * covariant, rows[..., 1] * covariant


def _triangle_shear(cells: FlatCells, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shear ``xz, yz (ne, nq, n)`` per strain along each side: from the nodes, where two sides meet."""
    N = rule(cells.kind, cells.degree).N
    before, after = np.roll(along, 1, axis=1), np.roll(along, -1, axis=1)
    first, second = _of_node(before, along)[1], _of_node(along, after)[0]  # at both ends of each side
    xz, yz = (N * first[:, None, :, a] + np.roll(N, -1, axis=1) * second[:, None, :, a] for a in range(2))
    return xz, yz


def _of_node(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shear ``(ne, n, 2)`` at a node per strain along the first and along the second of its sides."""
    det = (first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])[..., None]
    turned = np.stack([second[..., 1], -second[..., 0]], axis=2), np.stack([-first[..., 1], first[..., 0]], axis=2)
    return turned[0] / det, turned[1] / det
