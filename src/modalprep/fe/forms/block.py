"""Elements that are weak forms alone: what a new family needs before anybody compiles its loops."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Self

import numpy as np
from skfem.assembly.form.coo_data import COOData

from modalprep.fe.elements.block import Block
from modalprep.fe.elements.mass import PAIRS, MassObjects
from modalprep.fe.forms.basis import DofMap
from modalprep.fe.forms.mass import mass_of_pair, mass_vectors, rigid_inertia
from modalprep.fe.forms.plain import Plain


class FormBlock(Block):
    """Elements of one cell type and property, a frozen dataclass with its nodes' positions, that gives its weak forms.

    Attributes
    ----------
    x : (ne, nn, 3)
        Nodes in the model's frame, m.
    """

    tensor = "pairs"
    x: np.ndarray

    def forms(self, dofmap: DofMap) -> Plain:
        """Return the weak forms of the elements."""
        raise NotImplementedError

    def stiffness(self) -> np.ndarray:
        """Elastic stiffness ``(ne, nl, nl)``."""
        own = self._alone()
        return self._of_cells(term.coo() for term in own.stiffness())

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray:
        """Geometric stiffness of the displacements ``d (ne, nl)``."""
        own = self._alone()
        return self._of_cells(term.coo() for term in own.geometric_stiffness(d.ravel()))

    def mass(self) -> MassObjects:
        """Mass objects of theory 1."""
        masses = self._alone().masses()
        ne, nl = len(self.nodes), self._width
        g, h = mass_vectors(masses, ne * nl)
        pairs = [self._of_cells(own.cells(mass_of_pair, a=a, b=b) for own in masses) for a, b in PAIRS]
        linear = g.reshape(ne, nl, 3), h.reshape(ne, nl, 3, 3)
        return MassObjects(*linear, rigid_inertia(masses), "pairs", np.stack(pairs, axis=1))

    def piece(self, some: slice | np.ndarray) -> Self:
        """Return the block of `some` of the elements."""
        own: Any = self  # a dataclass
        return replace(own, nodes=self.nodes[some], x=self.x[some])

    @property
    def _width(self) -> int:
        return self.nodes.shape[1] * self.components

    def _alone(self) -> Plain:
        """Return the weak forms of the elements with nodes and DOFs of their own each."""
        nodes = np.arange(self.nodes.size).reshape(self.nodes.shape)
        dof = np.full((nodes.size, 6), -1)
        dof[:, : self.components] = np.arange(nodes.size * self.components).reshape(nodes.size, -1)
        dofmap = DofMap(self.x.reshape(-1, 3), dof, nodes.size * self.components)
        own: Any = self
        return replace(own, nodes=nodes).forms(dofmap)

    def _of_cells(self, parts: Iterable[COOData]) -> np.ndarray:
        nl = self._width
        K = np.zeros((len(self.nodes), nl, nl))
        for part in parts:
            rows, columns = part.indices
            np.add.at(K, (rows // nl, rows % nl, columns % nl), part.data)
        return K
