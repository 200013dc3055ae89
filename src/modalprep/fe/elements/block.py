"""The protocol of element blocks: what assembly needs from every family."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from modalprep.fe.elements.arms import RotatingArms
from modalprep.fe.elements.mass import MassObjects

# Stress at the nodes of elements, by point of the section (face of a shell, fibre of a beam; "" where there is only
# one): names of the components along the axes of the elements' `frame (ne, 3, 3)`, and values (ne, nn, c, k) in Pa.
NodalStress = dict[str, tuple[tuple[str, ...], np.ndarray]]


class Block(Protocol):
    """Elements of one cell type and property, as assembly needs them.

    Element matrices are ``(ne, nl, nl)`` with ``nl = nn * components``, node by node, in mesh axes.
    """

    nodes: np.ndarray  # (ne, nn)
    components: int  # 3 or 6
    tensor: str | None  # which form of `MassObjects` the family has: "scalar", "functions" or "pairs"
    alike: tuple[int, ...]  # families with stress: axes of `frame` that must agree where elements meet, main first

    def stiffness(self) -> np.ndarray | None:
        """Elastic stiffness; None where the family has none."""

    def mass(self) -> MassObjects | None:
        """Mass objects; None where the family has none."""

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray | None:
        """Geometric stiffness of the prestress due to the nodal displacements ``d (ne, nl)``."""

    def energy(self, d: np.ndarray) -> np.ndarray:
        """Strain energy ``(ne,)`` at finite displacements ``d (ne, nl)``, rotation vectors at the nodes."""

    def rotating_arms(self) -> RotatingArms | None:
        """Eccentric mass that rotates with the nodes; None where the family has none."""

    def volume(self) -> np.ndarray:
        """Volume of material ``(ne,)``, m^3; zero where the family has none."""

    def piece(self, some: slice | np.ndarray) -> Block:
        """Return the block of `some` of the elements."""
