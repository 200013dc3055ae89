"""Three-node beam: two beams of two nodes that meet at the middle node (theory 7.1).

Each half is exact in statics, so that on a straight line the element is more accurate than one with quadratic shapes
and needs no reduced integration. A curved line is followed by two chords.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from modalprep.fe.elements.arms import RotatingArms
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.block import Block, NodalStress
from modalprep.fe.elements.mass import MassObjects
from modalprep.fe.properties.properties import Beam

HALVES = ((0, 2), (2, 1))  # nodes of the cell: both ends, then the middle
DOFS = [np.concatenate([np.arange(6 * i, 6 * i + 6) for i in half]) for half in HALVES]


@dataclass(frozen=True, eq=False)
class ThreeNodeBeamBlock(Block):
    """Beams of three nodes of one property.

    Attributes
    ----------
    nodes : (ne, 3) int
        Ends, then the middle.
    halves : tuple of two BeamBlock
    """

    alike = (0, 1, 2)
    components = 6
    tensor = "pairs"
    section: Beam
    nodes: np.ndarray
    halves: tuple[BeamBlock, BeamBlock]

    @classmethod
    def build(cls, kind, points, nodes, section, data, origin) -> ThreeNodeBeamBlock:
        """Evaluate the shapes of the elements ``nodes (ne, 3)`` at ``points (n, 3)`` (mesh axes).

        `data` is that of a beam of two nodes; an offset of the ends goes over linearly.

        Raises
        ------
        InputError
            As of beams of two nodes.
        """
        first, second = (
            BeamBlock.build(kind, points, nodes[:, half], _half(section, k), _half_data(data, k), origin)
            for k, half in enumerate(HALVES)
        )
        return cls(section, nodes, (first, second))

    @property
    def frame(self) -> np.ndarray:
        """(ne, 3, 3) axes of the first half."""
        return self.halves[0].frame

    @property
    def arm(self) -> np.ndarray:
        """(ne, 3, 3) from the nodes to the centroid line, m."""
        first, second = (block.arm for block in self.halves)
        return np.stack([first[:, 0], second[:, 1], (first[:, 1] + second[:, 0]) / 2], axis=1)

    def stiffness(self) -> np.ndarray:
        """Of both halves ``(ne, 18, 18)``."""
        return self._summed([block.stiffness() for block in self.halves])

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray:
        """Of both halves, for displacements ``d (ne, 18)``."""
        return self._summed([b.geometric_stiffness(d[:, dofs]) for b, dofs in zip(self.halves, DOFS, strict=True)])

    def energy(self, d: np.ndarray) -> np.ndarray:
        """Strain energy ``(ne,)`` at finite displacements ``d (ne, 18)``."""
        first, second = (block.energy(d[:, dofs]) for block, dofs in zip(self.halves, DOFS, strict=True))
        return first + second

    def volume(self) -> np.ndarray:
        """Area times length ``(ne,)``, m^3."""
        first, second = self.halves
        return first.volume() + second.volume()

    def mass(self) -> MassObjects:
        """Every mass object of theory 1."""
        ne = len(self.nodes)
        parts = [block.mass() for block in self.halves]
        shapes = (ne, 18, 3), (ne, 18, 3, 3), (ne, 6, 18, 18)
        g, h, pairs = (np.zeros(shape, dtype=parts[0].g.dtype) for shape in shapes)
        for part, dofs in zip(parts, DOFS, strict=True):
            g[:, dofs] += part.g
            h[:, dofs] += part.h
            pairs[:, :, dofs[:, None], dofs] += part.tensor
        return MassObjects(g, h, parts[0].rigid + parts[1].rigid, "pairs", pairs)

    def rotating_arms(self) -> RotatingArms:
        """Mass off the line of the nodes."""
        parts = []
        for block, dofs in zip(self.halves, DOFS, strict=True):
            arms = block.rotating_arms()
            wide = {name: np.zeros((*arms.arm.shape, 18)) for name in ("rotation", "inertia")}
            for name, values in wide.items():
                values[..., dofs] = getattr(arms, name)
            parts.append(arms._replace(**wide))
        return RotatingArms.joined(parts)

    def nodal_stress(self, d: np.ndarray) -> NodalStress:
        """Stress in each fibre at the three nodes, for displacements ``d (ne, 18, k)``; in the middle the mean."""
        own = (replace(b, section=replace(b.section, fibres=self.section.fibres)) for b in self.halves)
        first, second = (block.nodal_stress(d[:, dofs]) for block, dofs in zip(own, DOFS, strict=True))
        found = {}
        for place, (names, start) in first.items():
            end = second[place][1]
            found[place] = names, np.stack([start[:, 0], end[:, 1], (start[:, 1] + end[:, 0]) / 2], axis=1)
        return found

    def piece(self, some: slice | np.ndarray) -> ThreeNodeBeamBlock:
        """Return the block of `some` of the elements."""
        first, second = self.halves
        return replace(self, nodes=self.nodes[some], halves=(first.piece(some), second.piece(some)))

    def _summed(self, parts: list[np.ndarray]) -> np.ndarray:
        K = np.zeros((len(self.nodes), 18, 18), dtype=parts[0].dtype)
        for part, dofs in zip(parts, DOFS, strict=True):
            K[:, dofs[:, None], dofs] += part
        return K


def _half(section: Beam, k: int) -> Beam:
    """Return the first or second half of a tapered beam."""
    if not section.taper:
        return section
    a = k / 2
    b = (k + 1) / 2
    places = [a, *(x for x, *_ in section.taper if a < x < b), b]
    return replace(section, taper=tuple((2 * (x - a), *section.section_at(x)) for x in places))


def _half_data(data: dict[str, np.ndarray], k: int) -> dict[str, np.ndarray]:
    found = dict(data)
    if "arm" in data:
        found["arm"] = data["arm"][:, HALVES[k]]
    if "ends" in data:
        ends = np.nan_to_num(data["ends"])
        found["ends"] = np.stack([ends[:, 0], ends.mean(axis=1), ends[:, 1]], axis=1)[:, k : k + 2]
    if "pins" in data:
        own = np.arange(12) // 6 == k  # the first half is pinned at its first end only
        found["pins"] = np.where(own, np.nan_to_num(data["pins"]), 0.0)
    return found
