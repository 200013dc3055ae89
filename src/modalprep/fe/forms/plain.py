"""What a family gives as weak forms."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from modalprep.fe.forms.basis import ModelBasis
from modalprep.fe.forms.mass import Mass
from modalprep.fe.forms.terms import Term


class Plain(Protocol):
    """The weak forms of the elements of a block."""

    def motions(self) -> list[ModelBasis]:
        """Bases of the displacement u and, where nodes have rotations of their own, of the rotation t."""
        ...

    def stiffness(self) -> list[Term]:
        """Terms of K."""
        ...

    def geometric_stiffness(self, d: np.ndarray) -> list[Term]:
        """Terms of Kg of the stress of displacements ``d (n_dof,)``."""
        ...

    def masses(self) -> list[Mass]:
        """What the mass objects of theory 1 are sums over."""
        ...
