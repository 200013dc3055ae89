"""Requirements on stiffness and mass matrices of other programs; each violation is one message."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array, issparse, triu

from modalprep.errors import InputError
from modalprep.fe.quality.connectivity import smallest_part

COMPONENTS = ("ux", "uy", "uz", "rx", "ry", "rz")
SYMMETRY = 1e-6  # of the largest entry: matrices in text of seven digits still pass
INDEFINITE = 1e-6  # how far m_ij^2 may exceed m_ii m_jj, relative
MASS = 1e-9  # anisotropy of the mass, as body/checks.py asks of a model
RIGID = 1e-8  # force of a rigid motion over that of its absolute terms, as there
NOISE = 1e-6  # rows below this share of the largest are round-off


class Places:
    """Names of DOFs for messages: component and node, by the file's own number.

    Parameters
    ----------
    dof : (n_nodes, 6) int
    labels : (n_nodes,) int
        Empty counts from 1.
    """

    def __init__(self, dof: np.ndarray, labels: np.ndarray) -> None:
        self.dof, self.labels = dof, labels

    def node(self, row: int) -> str:
        """Return the name of a node."""
        return f"node {self.labels[row] if len(self.labels) else row + 1}"

    def __call__(self, number: int) -> str:
        """Return the name of a DOF.

        Examples
        --------
        >>> Places(np.array([[0, 1, 2, -1, -1, -1]]), np.array([17]))(1)
        'uy of node 17'
        """
        row, component = (int(k[0]) for k in np.nonzero(self.dof == number))
        return f"{COMPONENTS[component]} of {self.node(row)}"


def real_square(A, name: str) -> csr_array:
    """Return a matrix as csr without explicit zeros, refusing what is not real, finite and square."""
    try:
        A = csr_array(A) if issparse(A) else csr_array(np.atleast_2d(np.asarray(A)))
        if A.dtype.kind == "c" and not np.any(A.data.imag):
            A = A.real
        A = A.astype(float) if A.dtype.kind in "fiub" else None
    except (TypeError, ValueError):
        A = None
    if A is None:
        raise InputError(f"the {name} matrix does not hold real numbers; give a real sparse matrix")
    if A.shape[0] != A.shape[1] or not A.shape[0]:
        raise InputError(f"the {name} matrix is {A.shape[0]} x {A.shape[1]}; it must be square, one row per DOF")
    bad = ~np.isfinite(A.data)
    if np.any(bad):
        at = A.tocoo()
        row, column = at.row[bad][0] + 1, at.col[bad][0] + 1
        raise InputError(
            f"the {name} matrix has {bad.sum()} entries that are not numbers, the first in row {row}, column {column}; "
            "export it again"
        )
    A.sum_duplicates()
    A.eliminate_zeros()
    return A


def symmetric(A: csr_array, name: str, where: Callable[[int], str]) -> csr_array:
    """Return the symmetric part of a matrix that is symmetric and may be positive semidefinite."""
    off = abs(A - A.T).tocoo()
    if off.nnz and off.data.max() > SYMMETRY * abs(A).max():
        k = np.argmax(off.data)
        one = " (it holds one triangle only)" if triu(A, 1).nnz == 0 or triu(A.T, 1).nnz == 0 else ""
        raise InputError(
            f"the {name} matrix is not symmetric{one}: {A[off.row[k], off.col[k]]:.6g} for {where(off.row[k])} and "
            f"{where(off.col[k])}, {A[off.col[k], off.row[k]]:.6g} the other way round; export both triangles of a "
            "symmetric matrix"
        )
    A = ((A + A.T) / 2).tocsr()
    diagonal = A.diagonal()
    if np.any(diagonal < 0):
        k = int(np.argmin(diagonal))
        raise InputError(
            f"the {name} matrix has {np.sum(diagonal < 0)} negative diagonal entries, the lowest {diagonal[k]:.6g} for "
            f"{where(k)}; export it again"
        )
    _refuse_indefinite(A.tocoo(), diagonal, name, where)
    return A


def _refuse_indefinite(A, diagonal: np.ndarray, name: str, where: Callable[[int], str]) -> None:
    """``a_ij^2 <= a_ii a_jj`` holds for every entry of a positive semidefinite matrix."""
    allowed = np.sqrt(diagonal[A.row]) * np.sqrt(diagonal[A.col])
    excess = np.abs(A.data) - (1 + INDEFINITE) * allowed - np.finfo(float).eps * diagonal.max(initial=0.0)
    if np.any(excess > 0):
        k = int(np.argmax(excess))
        raise InputError(
            f"the {name} matrix is not positive: {A.data[k]:.6g} couples {where(A.row[k])} and {where(A.col[k])}, "
            f"whose own entries are {diagonal[A.row[k]]:.6g} and {diagonal[A.col[k]]:.6g}; export it again"
        )


def refuse_unequal_mass(G: np.ndarray, m: float, s0: np.ndarray, size: float) -> None:
    """Refuse a rigid mass matrix ``G (6, 6)`` that differs with the direction, or is no mass at all."""
    along = np.diag(G)[:3]
    masses = ", ".join(f"{x:.9g}" for x in along)
    if not m > 0:
        raise InputError(f"the mass matrix carries no mass: {masses} kg along x, y, z; export it again")
    skewed = np.abs(G[:3, 3:] + np.cross(np.eye(3), s0)).max()
    mixed = np.abs(G[:3, :3] - m * np.eye(3)).max()
    if mixed > MASS * m or skewed > MASS * m * size:
        raise InputError(
            f"the mass matrix does not move every direction alike ({masses} kg along x, y, z): it lacks the DOFs of "
            "supports, has fewer than ten digits, or its rows are in another order; export the unsupported structure "
            "in global axes, or say which row is which DOF"
        )


def refuse_strain(K: csr_array, R: np.ndarray, where: Callable[[int], str]) -> None:
    """Refuse a stiffness that resists the rigid motions ``R (n, 6)``."""
    moved = strain_of_motion(K, R)
    if moved.max() > RIGID:
        k, c = (int(x) for x in np.unravel_index(np.argmax(moved), moved.shape))
        what = f"{('translation along', 'rotation about')[c // 3]} {'xyz'[c % 3]}"
        raise InputError(
            f"the stiffness matrix resists a rigid {what} (most at {where(k)}, {moved.max():.1e} of its terms): "
            "it has supports, it or the nodes have fewer than ten digits, its rows are in another order, or the nodes "
            "in another unit; export the unsupported structure in global axes, or say which row is which DOF"
        )


def strain_of_motion(K: csr_array, R: np.ndarray) -> np.ndarray:
    """Return the forces (n, 6) of the rigid motions ``R (n, 6)`` over those of their absolute terms."""
    terms = abs(K) @ np.abs(R)
    return np.abs(K @ R) / np.maximum(terms, max(NOISE * terms.max(initial=0.0), np.finfo(float).tiny))


def refuse_parts(groups: list[np.ndarray], used: np.ndarray, points: np.ndarray, at: Places) -> None:
    """Refuse a structure whose ``used`` nodes are not all joined by the rows of `groups`, stiffness or frames."""
    count, small, where = smallest_part(groups, used, points)
    if count > 1:
        raise InputError(
            f"the stiffness matrix leaves the structure in {count} disconnected parts, the smallest has "
            f"{len(small)} nodes around {where}, with {at.node(small[0])}; export it with its rigid elements, or "
            "tie the parts by an interface"
        )
