"""Beams with large deflection: rigid segments connected by springs with the beam's stiffness."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, ValidationError, model_validator

from modalprep.errors import InputError
from modalprep.pipeline.schema.base import Table, Vector, first_message
from modalprep.pipeline.schema.chain import ChainTable
from modalprep.pipeline.schema.system import BodyTable, HingeTable, JointTable

Positive = Annotated[float, Field(gt=0)]


class BeamTable(Table):
    """A straight or curved uniform beam along x; a chain of bodies and joints ``<beam>1``, ``<beam>2``, ...

    A joint has the flexibility of one segment of length l: its springs are EI/l, GJ/l, EA/l, GA/l. The clamp has that
    of the half segment next to it, 2 EI/l. Deflections and frequencies then converge with order two in l.

    Source: Banerjee (2016), Flexible Multibody Dynamics, chapter 10.
    """

    length: Positive = Field(description="m")
    segments: int = Field(ge=1, le=100_000, description="number of rigid rods")
    mass_per_length: Positive = Field(description="kg/m")
    rotary_inertia: Vector = Field([0.0, 0.0, 0.0], description="of the cross-section about x, y, z, per length, kg m")
    EI: Positive | Annotated[list[Positive], Field(min_length=2, max_length=2)] = Field(
        description="bending stiffness, N m^2: one number for the plane x y, two (about y and z) for space"
    )
    GJ: Positive | None = Field(None, description="torsional stiffness, N m^2, with two of EI; default rigid")
    EA: Positive | None = Field(None, description="axial stiffness, N, with GA and one EI; default rigid")
    GA: Positive | None = Field(None, description="shear stiffness, shear factor included, N, with EA")
    curvature: float = Field(0.0, description="of the unloaded beam, in the plane x y, 1/m")
    damping: float = Field(0.0, ge=0, description="of the material: damping over stiffness, s")
    parent: str = Field("ground", description="what carries it: 'ground' or 'body.interface'")
    root: dict[str, Any] = Field(
        {},
        description="joint to the parent: keys instead of the clamp's (rotations about z, y, x), or its own 'type'",
    )

    @model_validator(mode="after")
    def _makes_a_chain(self) -> BeamTable:
        if self.GJ is not None and not isinstance(self.EI, list):
            raise ValueError("GJ twists the beam out of its plane: give EI as two numbers, about y and z")
        if (self.EA is None) != (self.GA is None) or (self.EA is not None and isinstance(self.EI, list)):
            raise ValueError("EA and GA need each other and one EI: a beam extends and shears in its plane only")
        try:
            self.chain()
        except ValidationError as error:
            raise ValueError(first_message(error).replace("first:", "root:")) from None
        return self

    def chain(self) -> ChainTable:
        """Return the chain of its segments.

        Examples
        --------
        >>> beam = BeamTable(length=10.0, segments=5, mass_per_length=1.2, EI=140.0)
        >>> chain = beam.chain()
        >>> chain.segment.mass, chain.segment.inertia[2], chain.joint.stiffness, chain.first["stiffness"]
        (2.4, 0.8, [70.0], [140.0])
        """
        clamp = self._joint(0.5 * self.length / self.segments)
        return ChainTable(
            segment=self._segment(),
            count=self.segments,
            parent=self.parent,
            joint=HingeTable.model_validate(self._joint(self.length / self.segments)),
            first=HingeTable.model_validate(self.root).model_dump() if "type" in self.root else clamp | self.root,
        )

    def bodies(self, name: str) -> dict[str, BodyTable]:
        """Return a table for each segment."""
        return self.chain().bodies(name)

    def joints(self, name: str) -> dict[str, JointTable]:
        """Return a table for each joint; every second one has the reverse order of rotations.

        Successive rotations a, b leave a twist of a b/2, an error of order one in l, which the reverse order cancels.
        """
        tables = self.chain().joints(name)
        if isinstance(self.EI, list):
            reverse = self._joint(self.length / self.segments, reverse=True)
            for key in [f"{name}{i}" for i in range(2, self.segments + 1, 2)]:
                ends = {"parent": tables[key].parent, "child": tables[key].child}
                tables[key] = JointTable.model_validate(reverse | ends)
        return tables

    def _segment(self) -> BodyTable:
        step = self.length / self.segments
        mass = self.mass_per_length * step
        about_x, about_y, about_z = (step * inertia for inertia in self.rotary_inertia)
        across = mass * step**2 / 12
        return BodyTable(
            mass=mass,
            centre=[step / 2, 0.0, 0.0],
            inertia=[about_x, about_y + across, about_z + across],
            interfaces={"root": [0.0, 0.0, 0.0], "tip": [step, 0.0, 0.0]},
        )

    def _joint(self, length: float, *, reverse: bool = False) -> dict[str, Any]:
        """Return the joint of a length of beam: translations along x, y, rotations about z, y, x (or reversed)."""
        translations = [c for c in (self.EA, self.GA) if c is not None]
        rotations = [*(self.EI[::-1] if isinstance(self.EI, list) else [self.EI]), *([self.GJ] if self.GJ else [])]
        bend = [self.curvature * length, *[0.0] * (len(rotations) - 1)]
        axes = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]][: max(2, len(rotations))]
        if translations:
            axes[1] = [1.0, 0.0, 0.0]
        if reverse:
            rotations, bend, axes = rotations[::-1], bend[::-1], axes[::-1]
        stiffness = [c / length for c in translations + rotations]
        return {
            "type": "planar" if translations else ("revolute", "universal", "gimbal")[len(rotations) - 1],
            "axis": axes[0],
            "second_axis": axes[1],
            "stiffness": stiffness,
            "damping": [self.damping * k for k in stiffness],
            "free_position": [0.0] * len(translations) + bend,
            "start": {"angle": bend if len(rotations) > 1 else bend[0]},
        }


def with_chains(
    chains: Mapping[str, ChainTable | BeamTable], bodies: dict[str, BodyTable], joints: dict[str, JointTable]
) -> tuple:
    """Return bodies and joints with those of the chains or beams.

    Raises
    ------
    InputError
        When a name occurs twice.
    """
    bodies, joints = dict(bodies), dict(joints)
    for name, chain in chains.items():
        for known, new in ((bodies, chain.bodies(name)), (joints, chain.joints(name))):
            for twice in known.keys() & new.keys():
                raise InputError(f"{name!r} makes {twice!r}, which exists already; rename one")
            known |= new
    return bodies, joints
