"""The base of element blocks: what assembly needs from every family."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from modalprep.fe.elements.arms import RotatingArms
from modalprep.fe.elements.mass import Form, MassObjects

# Stress at the nodes of elements, by point of the section (face of a shell, fibre of a beam; "" where there is only
# one): names of the components along the axes of the elements' `frame (ne, 3, 3)`, and values (ne, nn, c, k) in Pa.
NodalStress = dict[str, tuple[tuple[str, ...], np.ndarray]]


class Block:
    """Elements of one cell type and property, as assembly needs them.

    Element matrices are ``(ne, nl, nl)`` with ``nl = nn * components``, node by node, in mesh axes. The defaults are
    those of a family without stiffness and mass.

    Attributes
    ----------
    nodes : (ne, nn) int
    components : int
        3 or 6.
    tensor : {"scalar", "functions", "pairs"} or None
        The form of `MassObjects` that the family has; None without mass.
    alike : tuple of int
        Families with stress: axes of `frame` that must agree where elements meet, main first.
    """

    nodes: np.ndarray
    components: int
    tensor: Form | None = None
    alike: tuple[int, ...] = ()

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> Block:
        """Take the elements ``nodes (ne, nn)`` at ``points (n, 3)`` (mesh axes); `origin` is the model's origin."""
        raise NotImplementedError

    def stiffness(self) -> np.ndarray | None:
        """Elastic stiffness; None where the family has none."""

    def damping(self) -> np.ndarray | None:
        """Viscous damping; None where the family has none."""

    def mass(self) -> MassObjects | None:
        """Mass objects; None where the family has none."""

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray | None:
        """Geometric stiffness of the prestress due to the nodal displacements ``d (ne, nl)``."""

    def geometric_stiffnesses(self, d: np.ndarray) -> Iterator[np.ndarray]:
        """Yield the geometric stiffness of each of the displacements ``d (ne, nl, k)``, nothing where there is none."""
        found = (self.geometric_stiffness(d[..., k]) for k in range(d.shape[2]))
        return (values for values in found if values is not None)

    def energy(self, d: np.ndarray) -> np.ndarray:
        """Strain energy ``(ne,)`` at finite displacements ``d (ne, nl)``, rotation vectors at the nodes."""
        return np.zeros(len(self.nodes))

    def rotating_arms(self) -> RotatingArms | None:
        """Eccentric mass that rotates with the nodes; None where the family has none."""

    def volume(self) -> np.ndarray:
        """Volume of material ``(ne,)``, m^3; zero where the family has none."""
        return np.zeros(len(self.nodes))

    def piece(self, some: slice | np.ndarray) -> Block:
        """Return the block of `some` of the elements."""
        raise NotImplementedError
