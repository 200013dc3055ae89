"""The mass of bars, beams and rods as MSC Nastran distributes it (theory 1.6).

With ``PARAM,COUPMASS,1`` the axial mass is the mean of lumped and consistent, and a rod's mass across its axis is
lumped; bending has no rotary inertia. Without it all mass is lumped. CBEAM has an inertia about its own axis, CBAR and
CROD have none. Each of these is a set of samples of the mass, some with negative weight, so that all objects of
theory 1 belong to the same mass.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from modalprep.fe.elements.arms import RotatingArms, nodal_arms, section_arms
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.lumped import LumpedMass
from modalprep.fe.elements.mass import MassObjects, MassSamples, mass_from_samples, rigid_from_samples
from modalprep.fe.elements.truss import TrussBlock
from modalprep.vectors import skew

ABOUT_AXIS = np.array([-0.5, 0.5, 0.5])  # second moments along e1, e2, e3 of a unit inertia about e1 alone


@dataclass(frozen=True, eq=False)
class NastranMass:
    """Mass of a block of beams or bars.

    Attributes
    ----------
    block : BeamBlock or TrussBlock
    lumped : LumpedMass
        Of the block.
    coupled : bool
        What ``PARAM,COUPMASS`` of the deck asks for.
    """

    tensor = "pairs"
    block: BeamBlock | TrussBlock
    lumped: LumpedMass
    coupled: bool

    @property
    def nodes(self) -> np.ndarray:
        """(ne, nn) int."""
        return self.block.nodes

    @property
    def components(self) -> int:
        """3 or 6."""
        return self.block.components

    def mass(self) -> MassObjects:
        """Every mass object of theory 1."""
        ends = self.lumped.samples()
        if not self.coupled:
            parts = whole = [ends]
        elif isinstance(self.block, TrussBlock):
            whole = [ends]
            parts = [ends, *self._mean(ends, self._along())]
        else:
            line = _line(self.block)
            whole = [line]
            parts = [line, *(_scaled(part, -1.0) for part in self._mean(ends, line))]
        turning = self._about_axis()
        rigid = _joined([*whole, *turning])
        inertia = rigid_from_samples(rigid.weight, rigid.unit, rigid.position)
        return mass_from_samples(_joined([*parts, *turning]))._replace(rigid=inertia)

    def _mean(self, ends: MassSamples, line: MassSamples) -> list[MassSamples]:
        """Return what makes the axial mass of `ends` the mean of both."""
        axis = self.block.frame[:, 0]
        return [_scaled(_axial(line, axis), 0.5), _scaled(_axial(ends, axis), -0.5)]

    def rotating_arms(self) -> RotatingArms | None:
        """Mass on the arms of eccentric beams, and the inertia about the axis."""
        parts = []
        for inertia, rotation in self._axis_inertia():
            parts.append(section_arms(inertia * ABOUT_AXIS, self.block.frame, np.repeat(rotation, 3, axis=1)))
        if np.any(self.lumped.arm):
            parts.append(nodal_arms(self.mass(), self.lumped.arm) if self.coupled else self.lumped.rotating_arms())
        return RotatingArms.joined(parts) if parts else None

    def _along(self) -> MassSamples:
        """The mass of a rod at two Gauss points of its line."""
        at = np.array([0.5 - 3**-0.5 / 2, 0.5 + 3**-0.5 / 2])
        ends = self.lumped.samples()
        N = np.stack([1 - at, at])
        position, shape = (np.einsum("is,ei...->es...", N, x) for x in (ends.position, ends.shape))
        total = self.lumped.weight.sum(axis=1, keepdims=True)
        return MassSamples(np.repeat(total / 2, 2, axis=1), np.ones(2), position, shape)

    def _about_axis(self) -> list[MassSamples]:
        """Inertia about the axis of the beams only, one set of samples for each place."""
        frame = self.block.frame
        return [
            MassSamples(inertia * ABOUT_AXIS, np.zeros(3), frame, -skew(frame) @ rotation)
            for inertia, rotation in self._axis_inertia()
        ]

    def _axis_inertia(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield inertia about the axis ``(ne, 1)``, kg m^2, and rotation ``(ne, 1, 3, 12)``, mesh axes, of each place.

        Nothing of bars and rods.
        """
        b = self.block
        if not isinstance(b, BeamBlock) or b.section.bar:
            return
        inertia = b.section.material.rho * (b.inside.Iy + b.inside.Iz) * b.inside.dx
        rotation = np.swapaxes(b.frame, 1, 2)[:, None] @ b.at_nodes.value[:, :, 3:]
        if not self.coupled:
            inertia = np.repeat(inertia.sum(axis=1, keepdims=True) / 2, 2, axis=1)
            rotation = self.lumped.rotations()
        for q in range(inertia.shape[1]):
            yield inertia[:, q, None], rotation[:, q, None]


def _line(b: BeamBlock) -> MassSamples:
    """Return the mass of beams on their centroid line."""
    shape = np.einsum("eca,eqcj->eqaj", b.frame, b.at_nodes.value[:, :, :3])
    return MassSamples(b.line_mass, np.ones(b.dx.shape[1]), b.centre, shape)


def _axial(samples: MassSamples, axis: np.ndarray) -> MassSamples:
    """Keep the displacement along ``axis (ne, 3)`` only."""
    along = np.einsum("ea,eb->eab", axis, axis)[:, None]
    return samples._replace(shape=along @ samples.shape)


def _scaled(samples: MassSamples, factor: float) -> MassSamples:
    return samples._replace(weight=factor * samples.weight)


def _joined(parts: list[MassSamples]) -> MassSamples:
    weight, position, shape = (
        np.concatenate([getattr(p, k) for p in parts], axis=1) for k in ("weight", "position", "shape")
    )
    return MassSamples(weight, np.concatenate([p.unit for p in parts]), position, shape)
