"""Strain energy of every element in every mode."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.fe.elements.block import Block
from modalprep.fe.elements.kernels import ahead

AT_ONCE = 100_000  # numbers of element displacements held in memory: 0.8 MB, which caches keep


@dataclass(frozen=True, eq=False)
class StrainEnergy:
    """Strain energy of the cells of a model.

    Attributes
    ----------
    kinds, blocks : list of str, list of Block
        The cell type of each block; the blocks of one type in the order of the model's cells.
    dof : (n_nodes, 6) int
    """

    kinds: list[str]
    blocks: list[Block]
    dof: np.ndarray

    def __call__(self, Phi: np.ndarray) -> dict[str, np.ndarray]:
        """Return ``phi_e^T K_e phi_e / 2`` of each cell for each column of ``Phi (n_dof, n)``.

        The element matrices are evaluated again, block by block, so that none is kept.

        Returns
        -------
        {type: (n_cells, n) float32}
            J; float64 where they are beyond the range of float32. The sum over all cells of a mass-normalised mode is
            ``(2 pi f)^2 / 2``.

        Examples
        --------
        >>> from modalprep.examples import cantilever_model
        >>> model = cantilever_model(elements=2)
        >>> pull = np.zeros((model.n_dof, 1))
        >>> pull[model.dof[:, 0], 0] = 0.0, 1e-3, 2e-3  # strain 2e-4 on EA = 2.8e7 N
        >>> model.strain_energy(pull)["line"].ravel()
        array([2.8, 2.8], dtype=float32)
        """
        return self._by_kind(list(ahead(lambda block: self._of_block(block, Phi), self.blocks)))

    def volume(self) -> dict[str, np.ndarray]:
        """Return the volume ``{type: (n_cells,)}`` of each cell, m^3; zero for springs and point masses."""
        return self._by_kind([block.volume() for block in self.blocks])

    def _of_block(self, block: Block, Phi: np.ndarray) -> np.ndarray:
        K = block.stiffness()
        shape = len(block.nodes), Phi.shape[1]
        if K is None:
            return np.zeros(shape, dtype=np.float32)
        energy = np.zeros(shape, dtype=_precision(K, Phi))
        dofs = self.dof[block.nodes, : block.components].reshape(len(K), -1)
        step = max(1, AT_ONCE // max(1, K.shape[1] * Phi.shape[1]))
        for start in range(0, len(K), step):
            piece = slice(start, start + step)
            own = Phi[dofs[piece]]
            energy[piece] = np.maximum(np.einsum("ein,ein->en", own, K[piece] @ own) / 2, 0.0)  # -0 is round-off
        return energy

    def _by_kind(self, values: list[np.ndarray]) -> dict[str, np.ndarray]:
        found: dict[str, list[np.ndarray]] = {}
        for kind, value in zip(self.kinds, values, strict=True):
            found.setdefault(kind, []).append(value)
        return {kind: np.concatenate(parts) for kind, parts in found.items()}


def _precision(K: np.ndarray, Phi: np.ndarray) -> type:
    """Return float32 for energies that it can hold, else float64."""
    bound = np.abs(K).max(initial=0.0) * (K.shape[-1] * np.abs(Phi).max(initial=0.0)) ** 2
    return np.float32 if bound < np.finfo(np.float32).max else np.float64
