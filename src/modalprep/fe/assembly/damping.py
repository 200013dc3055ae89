"""Viscous damping of the dampers of a mesh (theory 4.11)."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array

from modalprep.fe.assembly.structure import Structure
from modalprep.fe.elements.block import Block


def damping_matrix(structure: Structure) -> csr_array | None:
    """Return the damping (n_dof, n_dof), N s/m, N s, N m s; None where no element has any."""
    dof = structure.dofmap.dof
    parts = [_spread(block, own, dof) for block in structure.blocks if (own := block.damping()) is not None]
    return sum(parts[1:], parts[0]).tocsr() if parts else None


def _spread(block: Block, own: np.ndarray, dof: np.ndarray) -> csr_array:
    """Return the sum of element matrices (ne, nl, nl) over the DOFs of the model."""
    n = int(dof.max()) + 1
    at = dof[block.nodes][..., : block.components].reshape(len(own), -1)
    rows, columns = np.broadcast_arrays(at[:, :, None], at[:, None, :])
    return coo_array((own.ravel(), (rows.ravel(), columns.ravel())), shape=(n, n)).tocsr()
