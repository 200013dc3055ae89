"""The mass of bars, beams and rods as MSC Nastran distributes it (theory 1.6).

With ``PARAM,COUPMASS,1`` the axial mass is the mean of lumped and consistent, and a rod's mass across its axis is
lumped; bending has no rotary inertia. Without it all mass is lumped. CBEAM has an inertia about its own axis, CBAR and
CROD have none. Each of these is a set of samples of the mass, some with negative weight, so that all objects of
theory 1 belong to the same mass.
"""

from __future__ import annotations

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
            line = self._line()
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
        for samples, rotation in zip(self._about_axis(), self._rotations(), strict=True):
            parts.append(section_arms(samples.weight, samples.position, np.repeat(rotation, 3, axis=1)))
        if np.any(self.lumped.arm):
            parts.append(nodal_arms(self.mass(), self.lumped.arm) if self.coupled else self.lumped.rotating_arms())
        return RotatingArms.joined(parts) if parts else None

    def _line(self) -> MassSamples:
        """The mass of a beam on its centroid line."""
        b = self.block
        shape = np.einsum("eca,eqcj->eqaj", b.frame, b.at_nodes.value[:, :, :3])
        return MassSamples(b.line_mass, np.ones(b.dx.shape[1]), b.centre, shape)

    def _along(self) -> MassSamples:
        """The mass of a rod at two Gauss points of its line."""
        at = np.array([0.5 - 3**-0.5 / 2, 0.5 + 3**-0.5 / 2])
        ends = self.lumped.samples()
        N = np.stack([1 - at, at])
        position, shape = (np.einsum("is,ei...->es...", N, x) for x in (ends.position, ends.shape))
        total = self.lumped.weight.sum(axis=1, keepdims=True)
        return MassSamples(np.repeat(total / 2, 2, axis=1), np.ones(2), position, shape)

    def _has_axis_inertia(self) -> bool:
        return isinstance(self.block, BeamBlock) and not self.block.section.bar

    def _about_axis(self) -> list[MassSamples]:
        """Inertia about the axis of the beams only, one set of samples for each place."""
        found = []
        if not self._has_axis_inertia():
            return found
        for rotation, inertia in zip(self._rotations(), self._axis_inertia(), strict=True):
            shape = -skew(self.block.frame) @ rotation
            found.append(MassSamples(inertia * ABOUT_AXIS, np.zeros(3), self.block.frame, shape))
        return found

    def _axis_inertia(self) -> list[np.ndarray]:
        """Inertia ``(ne, 1)`` about the axis at each place, kg m^2."""
        own = self.block.inside
        inertia = self.block.section.material.rho * (own.Iy + own.Iz) * own.dx
        return list(inertia.T[..., None]) if self.coupled else [inertia.sum(axis=1, keepdims=True) / 2] * 2

    def _rotations(self) -> list[np.ndarray]:
        """Rotation ``(ne, 1, 3, 12)`` in mesh axes at each place of the inertia about the axis."""
        if not self._has_axis_inertia():
            return []
        if not self.coupled:
            return list(np.moveaxis(self.lumped.rotations(), 1, 0)[:, :, None])
        rotation = np.swapaxes(self.block.frame, 1, 2)[:, None] @ self.block.at_nodes.value[:, :, 3:]
        return list(np.moveaxis(rotation, 1, 0)[:, :, None])


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
