"""How the mass of the elements is distributed: consistent, lumped, or as MSC Nastran does (theory 1.6)."""

from __future__ import annotations

from typing import Literal, NamedTuple, Protocol

import numpy as np

from modalprep.fe.elements.arms import RotatingArms
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.lumped import LumpedMass
from modalprep.fe.elements.mass import Form, MassObjects
from modalprep.fe.elements.nastran_mass import NastranMass
from modalprep.fe.elements.point import MassBlock
from modalprep.fe.elements.truss import TrussBlock

Distribution = Literal["coupled", "lumped", "nastran"]


class Inertia(Protocol):
    """The mass of some elements, as sums over a model need it."""

    @property
    def nodes(self) -> np.ndarray:
        """(ne, nn) int."""
        ...

    @property
    def components(self) -> int:
        """3 or 6."""
        ...

    def mass(self) -> MassObjects | None:
        """Every mass object of theory 1; None without mass."""
        ...

    def rotating_arms(self) -> RotatingArms | None:
        """Mass beside the nodes that turns with them."""
        ...


class MassRule(NamedTuple):
    """The distribution of the mass of a model.

    Attributes
    ----------
    distribution : {"coupled", "lumped", "nastran"}
    coupled : bool
        With "nastran": whether ``PARAM,COUPMASS`` asks for coupled masses.

    Examples
    --------
    >>> MassRule("nastran").tensor(TrussBlock)
    'scalar'
    """

    distribution: Distribution = "coupled"
    coupled: bool = False

    def tensor(self, family: type[Block]) -> Form | None:
        """Return the form of `MassObjects` that the elements of a family have."""
        mixed = self.distribution == "nastran" and self.coupled and issubclass(family, TrussBlock)
        return "pairs" if mixed else family.tensor

    def inertia(self, block: Block, points: np.ndarray) -> Inertia:
        """Return the mass of a block; ``points (n, 3)`` in the model's frame."""
        if self.distribution == "coupled" or block.tensor is None or isinstance(block, MassBlock):
            return block
        lumped = LumpedMass.of(block, points)
        if self.distribution == "lumped":
            return lumped
        if isinstance(block, BeamBlock) or (self.coupled and isinstance(block, TrussBlock)):
            return NastranMass(block, lumped, self.coupled)
        return block if self.coupled else lumped
