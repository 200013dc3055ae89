"""Chains: many equal segments, each hinged to the one before."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag, ValidationError, model_validator

from modalprep.multibody.model.chain import chain_links
from modalprep.pipeline.schema.base import Table, first_message
from modalprep.pipeline.schema.system import BodyTable, HingeTable, JointTable, form

Several = Annotated[list[HingeTable], Field(min_length=1)]
Joints = Annotated[Annotated[HingeTable, Tag("table")] | Annotated[Several, Tag("list")], Discriminator(form)]


class ChainTable(Table):
    """Bodies and joints ``<chain>1``, ``<chain>2``, ... of a beam, cable or tether in segments."""

    segment: BodyTable = Field(description="one segment: a table as under [bodies]")
    count: int = Field(ge=1, le=100_000, description="number of segments")
    parent: str = Field("ground", description="parent of the first segment: 'ground' or 'body.interface'")
    through: str = Field("tip", description="interface of a segment that carries the next one")
    joint: Joints = Field(
        description="between neighbours: a table as under [joints], without parent and child; a list is taken in turn, "
        "as hinges about z and y whose axes then alternate"
    )
    first: dict[str, Any] = Field({}, description="keys that the joint to the parent has instead")

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
        >>> chain = ChainTable(segment=rod, count=3, joint=HingeTable(type="revolute"), first={"stiffness": 2.0})
        >>> [(name, table.parent, table.stiffness) for name, table in chain.joints("cable").items()]
        [('cable1', 'ground', 2.0), ('cable2', 'cable1.tip', 0.0), ('cable3', 'cable2.tip', 0.0)]
        """
        each = self.joint if isinstance(self.joint, list) else [self.joint]
        own = [table.model_dump(exclude_unset=True) for table in each]
        links = chain_links(name, self.count, self.parent, self.through)
        tables = [{**own[i % len(own)], "parent": parent, "child": body} for i, (body, parent) in enumerate(links)]
        tables[0] |= self.first
        return {table["child"]: JointTable.model_validate(table) for table in tables}
