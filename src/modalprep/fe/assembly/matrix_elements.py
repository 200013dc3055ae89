"""Matrices that a mesh carries as numbers, in stiffness, mass and mass integrals of a model (theory 1.10)."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import orth
from scipy.sparse import coo_array, csr_array

from modalprep.errors import InputError
from modalprep.fe.assembly.matrix_checks import (
    COMPONENTS,
    real_square,
    refuse_strain,
    refuse_unequal_mass,
    strain_of_motion,
    symmetric,
)
from modalprep.fe.assembly.matrix_mass import linear_vectors, mass_tensor, rigid_inertia
from modalprep.fe.assembly.model import AddedTerm, rigid_motions
from modalprep.fe.assembly.totals import MassTensor
from modalprep.fe.elements.mass import RigidInertia
from modalprep.fe.mesh.mesh import MatrixElement, Mesh

TERM = "matrices of the mesh"  # as a row of tables, beside the groups
ROUGH = 1e-4  # force of a rigid motion over that of its absolute terms, where numbers have five digits
MOST = 2000  # rows of a matrix that is made free of it: its projection is full


class MatrixSum(NamedTuple):
    """What the matrices of a mesh add to a model.

    Attributes
    ----------
    K, M : (n_dof, n_dof) csr
    g : (n_dof, 3)
    h : (n_dof, 3, 3)
    M_ab : MassTensor
    rigid : RigidInertia
    notes : tuple of str
    """

    K: csr_array
    M: csr_array
    g: np.ndarray
    h: np.ndarray
    M_ab: MassTensor
    rigid: RigidInertia
    notes: tuple[str, ...]

    @property
    def term(self) -> dict[str, AddedTerm]:
        """The matrices as a term of the model's tables."""
        return {TERM: AddedTerm(self.K, self.M)}


def sum_matrices(mesh: Mesh, dof: np.ndarray, origin: np.ndarray) -> MatrixSum | None:
    """Return the sum of the matrices of a mesh; None where it has none.

    ``dof (n_nodes, 6)`` are the DOFs of the model, `origin` its frame in the mesh. Of the mass integrals those of a
    rigid motion are exact, the others follow from a scalar shape for each node (matrix_mass.py).

    Raises
    ------
    InputError
        When a matrix is not symmetric, not positive, resists a rigid motion, or has unlike masses by direction.
    """
    if not mesh.matrices:
        return None
    n = dof.max() + 1
    checked = [_checked(own, mesh) for own in mesh.matrices]
    K, M = (sum((_spread(own, A[which], dof, n) for own, *A in checked), csr_array((n, n))) for which in (0, 1))
    R = rigid_motions(mesh.points - origin, dof[: len(mesh.points)], n)
    g, h = linear_vectors(M, dof, R)
    return MatrixSum(K, M, g, h, mass_tensor(M, dof), rigid_inertia(M, R), tuple(_notes(checked)))


def matrix_nodes(mesh: Mesh) -> np.ndarray:
    """Return the sorted nodes (k,) of all matrices of a mesh."""
    return np.unique(np.concatenate([np.zeros(0, dtype=int), *(own.nodes for own in mesh.matrices)]))


def _checked(own: MatrixElement, mesh: Mesh) -> tuple[MatrixElement, csr_array, csr_array, float]:
    """Return stiffness and mass, symmetric and free of rigid motions, and what of these was taken out."""
    labels = mesh.labels if len(mesh.labels) else np.arange(1, len(mesh.points) + 1)

    def where(row: int) -> str:
        node, component = own.rows[row].tolist()
        return f"{COMPONENTS[component]} of node {labels[node]}"

    try:
        K, M = (symmetric(real_square(A, name), name, where) for A, name in ((own.K, "stiffness"), (own.M, "mass")))
        R, size = _motions(own, mesh.points)
        if M.nnz:
            r = rigid_inertia(M, R)
            refuse_unequal_mass(R.T @ (M @ R), r.m, r.s0, size)
        K, share = _free_of_motions(K, R, np.where(own.rows[:, 1] < 3, 1.0, size), where)
    except InputError as error:
        raise InputError(f"{own.name}: {error}") from None
    return own, K, M, share


def _motions(own: MatrixElement, points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the rigid motions (n, 6) of the rows about the middle of the nodes, and a length of the element."""
    nodes, at = np.unique(own.rows[:, 0], return_inverse=True)
    table = np.full((len(nodes), 6), -1)
    table[at, own.rows[:, 1]] = np.arange(len(own.rows))
    x = points[nodes] - points[nodes].mean(axis=0)
    size = float(np.ptp(x, axis=0).max())
    return rigid_motions(x, table, len(own.rows)), size or float(np.ptp(points, axis=0).max()) or 1.0


def _free_of_motions(
    K: csr_array, R: np.ndarray, weight: np.ndarray, where: Callable[[int], str]
) -> tuple[csr_array, float]:
    """Return the stiffness without the forces of rigid motions that few digits leave, and their share."""
    share = float(strain_of_motion(K, R).max(initial=0.0))
    if share > ROUGH or len(R) > MOST:
        refuse_strain(K, R, where)
    if share <= np.finfo(float).eps * len(R) or len(R) > MOST:
        return K, 0.0
    Q = orth(weight[:, None] * R)
    P = (np.eye(len(R)) - Q @ Q.T) * (weight / weight[:, None]).T
    freed = P @ K.toarray() @ P.T
    return csr_array((freed + freed.T) / 2), share


def _spread(own: MatrixElement, A: csr_array, dof: np.ndarray, n: int) -> csr_array:
    """Return a matrix over the DOFs of the model."""
    place = dof[own.rows[:, 0], own.rows[:, 1]]
    at = A.tocoo()
    return coo_array((at.data, (place[at.row], place[at.col])), shape=(n, n)).tocsr()


def _notes(checked: list[tuple[MatrixElement, csr_array, csr_array, float]]) -> list[str]:
    first, count = checked[0][0].name, len(checked)
    which = first if count == 1 else f"{count} of them, the first {first}"
    found = [
        f"matrices of the mesh ({which}) have stiffness and mass alone: they carry no geometric stiffness and no "
        "stress; exact are their stiffness, mass, centre and inertia, while what spin and acceleration do to their "
        "deformation assumes that each node carries the mass around it"
    ]
    found += [
        f"{own.name}: its stiffness resisted rigid motions by {share:.1e} of its terms, as numbers of few digits do; "
        "that is taken out"
        for own, _, _, share in checked
        if share > 1e-8  # as checks.py of a model asks
    ]
    return found
