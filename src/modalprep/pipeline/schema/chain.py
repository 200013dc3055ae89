"""Chains: many equal segments, each hinged to the one before."""

from __future__ import annotations

from typing import Any

from pydantic import Field, ValidationError, model_validator

from modalprep.pipeline.schema.base import Table, first_message
from modalprep.pipeline.schema.system import BodyTable, HingeTable, JointTable


class ChainTable(Table):
    """Bodies and joints ``<chain>1``, ``<chain>2``, ... of a beam, cable or tether in segments."""

    segment: BodyTable = Field(description="one segment: a table as under [bodies]")
    count: int = Field(ge=1, le=100_000, description="number of segments")
    parent: str = Field("ground", description="parent of the first segment: 'ground' or 'body.interface'")
    through: str = Field("tip", description="interface of a segment that carries the next one")
    joint: HingeTable = Field(description="between neighbours: a table as under [joints], without parent and child")
    first: dict[str, Any] = Field({}, description="keys that differ in the joint to the parent")

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
        own = self.joint.model_dump(exclude_unset=True)
        parents = [self.parent, *(f"{name}{i}.{self.through}" for i in range(1, self.count))]
        tables = [{**own, "parent": parent, "child": f"{name}{i}"} for i, parent in enumerate(parents, 1)]
        tables[0] |= self.first
        return {f"{name}{i}": JointTable.model_validate(table) for i, table in enumerate(tables, 1)}
