"""Mass integrals of a model from its assembled mass matrix alone (theory 8).

The twelve linear vectors and the mass tensor of theory 1 need the displacement field, which an
assembled M no longer shows. Exact whatever the elements are: m, s0, E0, g, the antisymmetric part of h (all from
M times a rigid motion), the sum ``M_11 + M_22 + M_33``; with them the mass matrix of the undeformed body. The rest
follows from one assumption on the field,

    u(x) = sum_i n_i(x) u_i + theta_i x r_i(x),

a scalar shape for a node's translation, an arm for its rotation. It holds for every solid (which is then exact), for
lumped masses with an offset, and for the thickness of shells and the section of beams. It fails where the deflection
follows the rotations within an element: the symmetric part of H is then wrong by up to (element / body length)^2
(measured: 2e-5 of its largest entry for a beam of 5 elements, 6e-3 for a curved shell of 12 quads along its side, 2e-3
for a stiffened panel of 24), P of unit modal mass by 1e-3; in modes of pure torsion of a line the split of P between
the two directions across it stays open.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import bsr_array, coo_array, csr_array

from modalprep.fe.assembly.totals import MassTensor
from modalprep.fe.elements.mass import PAIRS, RigidInertia

EPS = np.zeros((3, 3, 3))  # permutation symbol
EPS[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
EPS[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0


def rigid_inertia(M: csr_array, R: np.ndarray) -> RigidInertia:
    """Return m, s0, E0 from ``M (n, n)`` and the unit rigid motions ``R (n, 6)`` about the origin.

    Examples
    --------
    >>> R = np.array([[1.0, 0, 0, 0, 0, -2], [0, 1, 0, 0, 0, 1], [0, 0, 1, 2, -1, 0]])  # a point at (1, 2, 0)
    >>> rigid_inertia(csr_array(3 * np.eye(3)), R).s0
    array([3., 6., 0.])
    """
    G = R.T @ (M @ R)
    J = (G[3:, 3:] + G[3:, 3:].T) / 2
    s0 = np.einsum("ace,ac->e", EPS, G[:3, 3:]) / 2
    return RigidInertia(m=float(np.trace(G[:3, :3]) / 3), s0=s0, E0=np.trace(J) / 2 * np.eye(3) - J)


def linear_vectors(M: csr_array, dof: np.ndarray, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``g (n, 3)`` and ``h (n, 3, 3)`` from M times the unit rigid motions.

    With ``w_c = M R_c`` (rotation c), ``h_ab - h_ba = eps_acb w_c`` is exact. Its symmetric part comes from
    ``int rho n_i x`` at translations and ``int rho r_i x^T`` at rotations, which w determines under the assumption.
    """
    w = M @ R
    at = np.zeros((len(dof), 6, 3))
    at[dof >= 0] = w[dof[dof >= 0], 3:]
    f = np.einsum("ace,iac->ie", EPS, at[:, :3]) / 2
    turn = at[:, 3:]
    F = np.trace(turn, axis1=1, axis2=2)[:, None, None] / 2 * np.eye(3) - turn.transpose(0, 2, 1)
    nodal = np.zeros((len(dof), 6, 3, 3))
    nodal[:, :3] = np.einsum("ca,ib->icab", np.eye(3), f)
    nodal[:, 3:] = np.einsum("ace,ieb->icab", EPS, F)
    h = np.zeros((M.shape[0], 3, 3))
    h[dof[dof >= 0]] = nodal[dof >= 0]
    return w[:, :3], (h + h.transpose(0, 2, 1) + np.einsum("acb,nc->nab", EPS, w[:, 3:])) / 2


def mass_tensor(M: csr_array, dof: np.ndarray) -> MassTensor:
    """Return ``M_ab`` with the exact sum ``M_11 + M_22 + M_33 = M``.

    A row of M at a translation along b, moved to translation a, is ``int rho n_i N_b``. Between two translations
    each side is moved by half, which keeps the first order of differences between the shapes of the directions.
    """
    n = M.shape[0]
    at = [_selection(dof[:, c : c + 1], n) for c in range(3)]
    half = np.ones(n)
    half[dof[:, :3][dof[:, :3] >= 0]] = 0.5
    right = (M * half).tocsr()
    moved = {(a, b): at[a] @ (at[b].T @ right) for a in range(3) for b in range(3)}
    turned = _between_rotations(M, dof)
    pairs = {(a, b): (moved[a, b] + moved[b, a].T + turned[a, b]).tocsr() for a, b in PAIRS}
    return MassTensor(dof, None, None, pairs, n, exact=turned[0, 0].nnz == 0)


def _between_rotations(M: csr_array, dof: np.ndarray) -> dict[tuple[int, int], csr_array]:
    """``int rho (e_c x r_i)_a (e_d x r_j)_b`` from M's blocks ``B_cd``: ``int rho r_i r_j^T = tr(B)/2 - B^T``."""
    n = M.shape[0]
    pick = _selection(dof[:, 3:], n)
    blocks = bsr_array(pick.T @ M @ pick, blocksize=(3, 3))
    B = blocks.data
    E = np.trace(B, axis1=1, axis2=2)[:, None, None] / 2 * np.eye(3) - B.transpose(0, 2, 1)
    found = {}
    for a, b in PAIRS:
        values = np.einsum("ce,df,kef->kcd", EPS[a], EPS[b], E)
        turned = bsr_array((values, blocks.indices, blocks.indptr), shape=blocks.shape)
        found[a, b] = pick @ turned.tocsr() @ pick.T
    return found


def _selection(dof: np.ndarray, n: int) -> csr_array:
    """Matrix (n, dof.size) that maps the entries of a table of DOFs, row by row, to the DOFs."""
    columns = np.flatnonzero(dof.ravel() >= 0)
    place = (dof.ravel()[columns], columns)
    return coo_array((np.ones(len(columns)), place), shape=(n, dof.size)).tocsr()
