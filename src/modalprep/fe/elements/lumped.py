"""Lumped mass: each element's mass in points at its nodes (theory 1.6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.fe.elements.arms import RotatingArms, mass_arms
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.mass import (
    Form,
    MassObjects,
    MassSamples,
    NodalFunctions,
    mass_from_samples,
    rigid_from_samples,
)
from modalprep.vectors import skew


@dataclass(frozen=True, eq=False)
class LumpedMass:
    """The mass of a block of elements as points at their nodes, or at the ends of the arms of eccentric elements.

    Attributes
    ----------
    tensor : {"scalar", "functions", "pairs"}
        The form of `MassObjects` that the family has.
    nodes : (ne, nn) int
    components : int
        3 or 6.
    weight : (ne, nn)
        kg.
    at, arm : (ne, nn, 3)
        Nodes in the model's frame, and the arms from them to the points, m.
    """

    tensor: Form
    nodes: np.ndarray
    components: int
    weight: np.ndarray
    at: np.ndarray
    arm: np.ndarray

    @classmethod
    def of(cls, block: Block, points: np.ndarray) -> LumpedMass:
        """Lump the mass of a block; ``points (n, 3)`` in the model's frame."""
        assert block.tensor is not None  # blocks without mass are not lumped
        at = points[block.nodes]
        arm = getattr(block, "arm", np.zeros_like(at))
        return cls(block.tensor, block.nodes, block.components, nodal_masses(block), at, arm)

    def mass(self) -> MassObjects:
        """Every mass object of theory 1, of the points."""
        if self.tensor == "functions":
            return self._functions().mass()
        if self.tensor == "pairs":
            return mass_from_samples(self.samples())
        return self._scalar()

    def samples(self) -> MassSamples:
        """Return the points as samples of the mass."""
        f = self._functions()
        return MassSamples(f.weight, f.unit, f.position, f.shape()[..., _of(self.components, self.nodes.shape[1])])

    def rotating_arms(self) -> RotatingArms | None:
        """Points on arms, which turn with their nodes."""
        if not np.any(self.arm):
            return None
        return mass_arms(self.weight, self.at + self.arm, self.samples().shape, self.arm, self.rotations())

    def rotations(self) -> np.ndarray:
        """Rotation ``(ne, nn, 3, 6 nn)`` of each node per nodal DOF."""
        ne, nn = self.nodes.shape
        rotation = np.zeros((ne, nn, 3, nn, 6))
        for k in range(nn):
            rotation[:, k, :, k, 3:] = np.eye(3)
        return rotation.reshape(ne, nn, 3, 6 * nn)

    def _functions(self) -> NodalFunctions:
        ne, nn = self.nodes.shape
        values = np.zeros((ne, nn, nn, 10))
        for k in range(nn):
            values[:, k, k, :9] = -skew(self.arm[:, k]).reshape(ne, 9)
            values[:, k, k, 9] = 1.0
        return NodalFunctions(self.weight, np.ones(nn), self.at + self.arm, values)

    def _scalar(self) -> MassObjects:
        (ne, nn), c = self.nodes.shape, self.components
        g = np.zeros((ne, nn, c, 3))
        h = np.zeros((ne, nn, c, 3, 3))
        for a in range(3):
            g[:, :, a, a] = self.weight
            h[:, :, a, a] = self.weight[..., None] * self.at
        scalar = self.weight[:, :, None] * np.eye(nn)
        rigid = rigid_from_samples(self.weight, np.ones(nn), self.at)
        return MassObjects(g.reshape(ne, -1, 3), h.reshape(ne, -1, 3, 3), rigid, "scalar", scalar)


def nodal_masses(block: Block) -> np.ndarray:
    """Return the mass ``(ne, nn)`` of each node, kg: the row sums of the consistent mass, or its scaled diagonal.

    Row sums keep the centre of mass of every element. Where one is not positive, as at the corners of second-order
    elements, the diagonal is scaled to the mass of the element.

    References
    ----------
    E. Hinton, T. Rock, O. C. Zienkiewicz, A note on mass lumping and related processes in the finite element method,
    Earthquake Engineering and Structural Dynamics 4 (1976) 245.
    """
    if isinstance(block, BeamBlock):
        return block.nodal_masses()
    mass = block.mass()
    assert mass is not None  # blocks without mass are not lumped
    ne, nn = block.nodes.shape
    rows = mass.g.reshape(ne, nn, block.components, 3)[:, :, 0, 0]
    total = rows.sum(axis=1, keepdims=True)
    if np.all(rows >= 1e-9 * total):
        return rows
    diagonal = _diagonal(mass, ne, nn)
    return diagonal * total / diagonal.sum(axis=1, keepdims=True)


def _diagonal(mass: MassObjects, ne: int, nn: int) -> np.ndarray:
    if mass.form == "scalar":
        return np.einsum("eii->ei", mass.tensor)
    translations = mass.of_translations().reshape(ne, nn, 3, nn, 6)
    return np.einsum("eiaia->ei", translations[..., :3])


def _of(components: int, nn: int) -> np.ndarray:
    return np.flatnonzero(np.tile(np.arange(6) < components, nn))
