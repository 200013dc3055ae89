"""Chains of equal segments; beams with large deflection as rigid segments connected by springs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Discriminator, Field, Tag, ValidationError, model_validator

from modalprep.errors import InputError
from modalprep.multibody.model.chain import SegmentedBeam, chain_links
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_types import JointType
from modalprep.pipeline.schema.base import Table, first_message
from modalprep.pipeline.schema.quantities import (
    BendingStiffness,
    Curvature,
    Duration,
    Force,
    InertiaPerLength,
    Length,
    MassPerLength,
    Three,
)
from modalprep.pipeline.schema.system import BodyTable, HingeTable, JointTable
from modalprep.pipeline.schema.time import form

Several = Annotated[list[HingeTable], Field(min_length=1)]
Joints = Annotated[Annotated[HingeTable, Tag("table")] | Annotated[Several, Tag("list")], Discriminator(form)]
Bending = Annotated[BendingStiffness, Field(gt=0)]
PositiveForce = Annotated[Force, Field(gt=0)]


class FirstTable(HingeTable):
    """Keys that the first joint of a chain has instead of those of the others."""

    applies: ClassVar = ()  # the others may have what a key needs
    type: JointType | None = None  # pyright: ignore[reportIncompatibleVariableOverride]  # of the others by default


class ChainTable(Table):
    """Bodies and joints ``<chain>1``, ``<chain>2``, ... of a beam, cable or tether in segments."""

    segment: BodyTable = Field(description="one segment: a table as under [bodies]")
    count: int = Field(ge=1, le=100_000, description="number of segments")
    parent: str = Field("ground", description="parent of the first segment: 'ground' or 'body.interface'")
    through: str = Field(default="tip", description="interface of a segment that carries the next one")
    joint: Joints = Field(
        description="between neighbours: a table as under [joints], without parent and child; a list is taken in turn, "
        "as hinges about z and y whose axes then alternate"
    )
    first: FirstTable = Field(FirstTable(), description="keys that the joint to the parent has instead")

    @model_validator(mode="after")
    def _first_joint(self) -> ChainTable:
        try:
            self.joints("")
        except ValidationError as error:
            raise ValueError(f"first: {first_message(error)}") from None
        return self

    def bodies(self, name: str) -> dict[str, BodyTable]:
        """Return a table for each segment."""
        return {f"{name}{i}": self.segment for i in range(1, self.count + 1)}

    def joints(self, name: str) -> dict[str, JointTable]:
        """Return a table for each joint.

        Examples
        --------
        >>> rod = BodyTable(mass=1.0)
        >>> chain = ChainTable(segment=rod, count=3, joint=HingeTable(type="revolute"), first=FirstTable(stiffness=2.0))
        >>> [(name, table.parent, table.stiffness) for name, table in chain.joints("cable").items()]
        [('cable1', 'ground', 2.0), ('cable2', 'cable1.tip', 0.0), ('cable3', 'cable2.tip', 0.0)]
        """
        each = self.joint if isinstance(self.joint, list) else [self.joint]
        own = [table.model_dump(exclude_unset=True) for table in each]
        links = chain_links(name, self.count, self.parent, self.through)
        tables = [{**own[i % len(own)], "parent": parent, "child": body} for i, (body, parent) in enumerate(links)]
        tables[0] |= self.first.model_dump(exclude_unset=True)
        return {table["child"]: JointTable.model_validate(table) for table in tables}


class BeamTable(Table):
    """A straight or curved uniform beam along x; a chain of bodies and joints ``<beam>1``, ``<beam>2``, ...

    See `SegmentedBeam`; source: Banerjee (2016), Flexible Multibody Dynamics, chapter 10.
    """

    length: Length = Field(gt=0, description="m")
    segments: int = Field(ge=1, le=100_000, description="number of rigid rods")
    mass_per_length: MassPerLength = Field(gt=0, description="kg/m")
    rotary_inertia: Three[InertiaPerLength] = Field(
        [0.0, 0.0, 0.0], description="of the cross-section about x, y, z, per length, kg m"
    )
    EI: Bending | Annotated[list[Bending], Field(min_length=2, max_length=2)] = Field(
        description="bending stiffness, N m^2: one number for the plane x y, two (about y and z) for space"
    )
    GJ: Bending | None = Field(None, description="torsional stiffness, N m^2, with two of EI; default rigid")
    EA: PositiveForce | None = Field(None, description="axial stiffness, N, with GA and one EI; default rigid")
    GA: PositiveForce | None = Field(None, description="shear stiffness, shear factor included, N, with EA")
    curvature: Curvature = Field(0.0, description="of the unloaded beam, in the plane x y, 1/m")
    damping: Duration = Field(0.0, ge=0, description="of the material: damping over stiffness, s")
    parent: str = Field("ground", description="what carries it: 'ground' or 'body.interface'")
    root: FirstTable = Field(
        FirstTable(),
        description="joint to the parent: keys instead of the clamp's (rotations about z, y, x), or its own 'type'",
    )

    @model_validator(mode="after")
    def _makes_a_chain(self) -> BeamTable:
        try:
            self.chain()
        except ValidationError as error:
            raise ValueError(first_message(error).replace("first:", "root:")) from None
        return self

    def beam(self) -> SegmentedBeam:
        """Return the beam, without the joint to its parent."""
        return SegmentedBeam(name="beam", **self.model_dump(exclude={"root"}))

    def chain(self) -> ChainTable:
        """Return the chain of its segments.

        Examples
        --------
        >>> beam = BeamTable(length=10.0, segments=5, mass_per_length=1.2, EI=140.0)
        >>> chain = beam.chain()
        >>> chain.segment.mass, chain.segment.inertia[2], chain.joint.stiffness, chain.first.stiffness
        (2.4, 0.8, [70.0], [140.0])
        """
        beam = self.beam().chain
        own = self.root.model_dump(exclude_unset=True)
        clamp = _table(beam.first) if beam.first else {}
        between = [HingeTable.model_validate(_table(joint)) for joint in beam.joint]
        return ChainTable(
            segment=_segment(self.beam()),
            count=self.segments,
            parent=self.parent,
            joint=between if len(between) > 1 else between[0],
            first=FirstTable(**(HingeTable.model_validate(own).model_dump() if "type" in own else clamp | own)),
        )

    def bodies(self, name: str) -> dict[str, BodyTable]:
        """Return a table for each segment."""
        return self.chain().bodies(name)

    def joints(self, name: str) -> dict[str, JointTable]:
        """Return a table for each joint."""
        return self.chain().joints(name)


def _segment(beam: SegmentedBeam) -> BodyTable:
    values = beam.segment()
    interfaces = {name: place.tolist() for name, place in values["interfaces"].items()}
    return BodyTable(
        mass=values["mass"],
        centre=values["centre"].tolist(),
        inertia=np.diag(values["inertia"]).tolist(),
        interfaces=interfaces,
    )


def _table(joint: Joint) -> dict[str, Any]:
    """Return what a table says of a joint with springs, its name and ends left out."""
    springs = {
        key: [getattr(element, key) for element in joint.elements] for key in ("stiffness", "damping", "free_position")
    }
    second = None if joint.second_axis is None else joint.second_axis.tolist()
    angle = np.asarray(joint.angle).tolist()
    return {
        "type": joint.type,
        "axis": joint.axis.tolist(),
        "second_axis": second,
        "start": {"angle": angle},
        **springs,
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
