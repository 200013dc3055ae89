"""A bilinear form whose internal functions follow the nodes statically: incompatible modes, internal rotations."""

from __future__ import annotations

import numpy as np

from modalprep.fe.forms.basis import ModelBasis
from modalprep.fe.forms.bilinear import AllTrials


class Condensed(AllTrials):
    """A bilinear form on a basis with internal functions, ``K_aa - K_ab K_bb^-1 K_ba`` of each cell.

    Where the element has no internal functions it is the form itself.

    Examples
    --------
    >>> from modalprep.fe.forms.solid import stiffness
    >>> type(stiffness).__name__
    'Condensed'
    """

    def _assemble(self, ubasis, vbasis=None, **kwargs):
        K, n, dofs = self._split(ubasis, **kwargs)
        K = K[:, :n, :n] - K[:, :n, n:] @ np.linalg.solve(K[:, n:, n:], K[:, n:, :n])
        rows = np.broadcast_to(dofs[None, :n], (n, n, len(K)))
        total = ubasis.N - (len(dofs) - n) * len(K)
        indices = np.array([rows.ravel(), rows.swapaxes(0, 1).ravel()])
        return indices, K.transpose(2, 1, 0).ravel(), (total, total), (n, n)

    def with_internal(self, basis: ModelBasis, d: np.ndarray, **kwargs) -> np.ndarray:
        """Return displacements ``d (n_dof,)`` with those of the internal functions that follow them."""
        K, n, dofs = self._split(basis, **kwargs)
        own = -np.linalg.solve(K[:, n:, n:], K[:, n:, :n] @ d[dofs[:n].T][..., None])[..., 0]
        found = np.concatenate([d, np.zeros(basis.N - len(d))])
        found[dofs[n:].T] = own
        return found

    def _split(self, basis: ModelBasis, **kwargs) -> tuple[np.ndarray, int, np.ndarray]:
        """Return the matrices ``(ne, nl, nl)``, how many functions have nodes, and the DOFs ``(nl, ne)``."""
        _, data, _, _ = super()._assemble(basis, **kwargs)
        nl = basis.Nbfun
        K = data.reshape(nl, nl, -1).transpose(2, 1, 0)  # scikit-fem runs over trial functions first
        return K, nl - getattr(basis.elem, "internal", 0), basis.element_dofs
