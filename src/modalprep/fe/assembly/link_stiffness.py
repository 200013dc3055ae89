"""Geometric stiffness of rigid links that carry force (theory 1.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array

from modalprep.fe.links.constraints import Constraints


@dataclass(frozen=True, eq=False)
class LinkStiffness:
    """The work of the forces of links when their arms rotate.

    Attributes
    ----------
    K : (n_dof, n_dof) csr
        Elastic stiffness of the model.
    constraints : Constraints
    """

    K: csr_array
    constraints: Constraints

    def __call__(self, d: np.ndarray, load: np.ndarray) -> csr_array:
        """Return ``Kg (n_dof, n_dof)`` of the links, for displacement d under the nodal load (N)."""
        n = self.K.shape[0]
        total = self.constraints.transferred(self.K @ d - load)  # the force that links exert on each DOF
        rows, cols, values = [], [], []
        for link in self.constraints.links:
            for turn, K, between, others in link.geometric_stiffness(total[:, None]):
                first = np.concatenate([np.repeat(turn, 3), np.repeat(turn, len(others))])
                second = np.concatenate([np.tile(turn, 3), np.tile(others, 3)])
                rows += [first, second[9:]]
                cols += [second, first[9:]]
                values += [K.ravel(), between.ravel(), between.ravel()]
        if not rows:
            return csr_array((n, n))
        return coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(cols))), shape=(n, n)).tocsr()

    def project(self, static: np.ndarray, loads: np.ndarray, Phi: np.ndarray) -> np.ndarray:
        """Return ``Phi^T Kg Phi (k, n, n)`` of the links, of each static response (n_dof, k) under its load."""
        links, step = self.constraints.links, self.constraints.step
        rows = np.concatenate([np.flatnonzero(np.diff(step.indptr)), *(np.append(x.dofs, x.frame) for x in links)])
        rows = np.unique(rows[rows >= 0])
        held = np.zeros_like(loads)
        held[rows] = self.K[rows] @ static - loads[rows]
        total = self.constraints.transferred(held)
        turns = []
        moments = []
        for link in self.constraints.links:
            for turning in link.geometric_stiffness(total):
                turns.append(Phi[turning.rotations])
                moments.append(turning.K @ turns[-1] / 2 + turning.between @ Phi[turning.others])
        half = np.concatenate(turns).T @ np.concatenate(moments, axis=1)
        return half + half.transpose(0, 2, 1)
