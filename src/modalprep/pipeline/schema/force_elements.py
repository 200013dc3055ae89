"""Force elements in pipeline files: a table for each kind, and how it becomes loads of a system.

A new kind is a table with `build` and a field of `ForceElements`.
"""

from __future__ import annotations

from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from modalprep.applies import Rule
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.model.environment import Conductor
from modalprep.multibody.model.hydrodynamics import ImmersedRod, Water
from modalprep.multibody.model.loads import AxialSpring, Bushing, DistributedForce, Load, PointForce
from modalprep.multibody.model.rotational_spring import RotationalSpring
from modalprep.pipeline.schema.base import FileName, Table, Vector, naming
from modalprep.pipeline.schema.environment import WaterTable
from modalprep.pipeline.schema.quantities import (
    Angle,
    AngularVelocity,
    AnyDamping,
    AnyStiffness,
    Damping,
    Item,
    Length,
    Moment,
    RotationalDamping,
    RotationalStiffness,
    Stiffness,
    Three,
    or_expression,
)
from modalprep.pipeline.schema.reduction import RotationTable, rotation_matrix
from modalprep.pipeline.schema.system import Constant
from modalprep.pipeline.schema.time import TIME, PointsOrFile, Time, time_function
from modalprep.suggest import refuse_unknown, suggestion

Ends = Annotated[list[str], Field(min_length=2, max_length=2)]
ENDS = "'body.interface' twice, or one and 'ground'"


Six = Annotated[list[Annotated[Item, Field(ge=0)]], Field(min_length=6, max_length=6)]  # none of them negative


class Scope(NamedTuple):
    """What a table is read in: the bodies, the folder of its files, the water."""

    bodies: dict[str, FlexibleBody]
    folder: Path
    water: WaterTable | None


class ForceTable(Table):
    """A force on an interface, or distributed over the points of a body."""

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("axes",), needs=("force", "torque")),
        Rule(("torque",), beside=("body",), advice="a torque acts on an interface: give 'at' instead of 'body'"),
        Rule(("factor",), beside=("at",), advice="each component of a force 'at' a place may depend on time"),
        Rule(("box",), beside=("at",), advice="name the body over whose points the force is distributed by 'body'"),
    )

    at: str | None = Field(None, description="'body.interface'")
    body: str | None = Field(None, description="instead: body over whose mesh points the force is distributed equally")
    box: Annotated[list[Three[Length]], Field(min_length=2, max_length=2)] | None = Field(
        None, description="of `body`: only points between two opposite corners, body frame, m; default all"
    )
    force: Annotated[list[Time], Field(min_length=3, max_length=3), or_expression("N")] = Field(
        [0.0, 0.0, 0.0], description="N, each component: " + TIME
    )
    torque: Annotated[list[Time], Field(min_length=3, max_length=3), or_expression("N m")] = Field(
        [0.0, 0.0, 0.0], description="of `at`, N m, each component as those of the force"
    )
    factor: Time = Field(1.0, description="of `body`: factor of its force over time, " + TIME)
    axes: Literal["inertial", "body"] = Field("inertial", description="body: follows the interface, or the body")

    @model_validator(mode="after")
    def _one_place(self) -> ForceTable:
        if (self.at is None) == (self.body is None):
            raise ValueError("a force needs either 'at' or 'body'")
        if self.body is not None and not all(isinstance(value, float) for value in self.force):
            raise ValueError("the force on the points of a body is three numbers; give its time dependence by 'factor'")
        return self

    def build(self, name: str, scope: Scope) -> list[Load]:
        """Return a force on an interface, or on the points of a body."""
        if self.body is not None:
            return [self._distributed(name, self.body, scope)]
        force, torque = (
            [time_function(key, value, scope.folder) for value in getattr(self, key)] for key in ("force", "torque")
        )
        return [PointForce(name=name, at=self.at or "", axes=self.axes, force=force, torque=torque)]

    def _distributed(self, name: str, body: str, scope: Scope) -> DistributedForce:
        refuse_unknown(body, scope.bodies, "body")
        points = scope.bodies[body].points
        corners = np.sort(self.box, axis=0) if self.box is not None else np.array([[-np.inf] * 3, [np.inf] * 3])
        inside = np.all((points >= corners[0]) & (points <= corners[1]), axis=1)
        if not np.any(inside):
            low = points.min(axis=0)
            high = points.max(axis=0)
            raise InputError(f"no point of body {body!r} lies in the box; they lie between {low} and {high} m")
        shared = np.where(inside[:, None], np.array(self.force) / inside.sum(), 0.0)
        factor = time_function("factor", self.factor, scope.folder)
        return DistributedForce(name=name, body=body, force=shared, factor=factor, axes=self.axes)


class AxialSpringTable(Table):
    """An axial spring and damper between two points."""

    between: Ends = Field(description=ENDS)
    stiffness: Stiffness = Field(0.0, ge=0, description="N/m")
    damping: Damping = Field(0.0, ge=0, description="N s/m")
    free_length: Length = Field(0.0, ge=0, description="m")
    position: Three[Length] = Field([0.0, 0.0, 0.0], description="of the end on the ground, m")
    actuator_force: Annotated[Time | None, or_expression("N")] = Field(
        None, description="N, of an actuator that draws the ends together: " + TIME
    )
    tension_only: bool = Field(False, description="it goes slack below its free length: a tether or a strap")

    def build(self, name: str, scope: Scope) -> list[Load]:
        """Return the spring."""
        return [AxialSpring(name=name, **arrays_of(self, scope, functions=("actuator_force",)))]


class BushingTable(Table):
    """Six springs and dampers between two frames, in the axes of the first."""

    between: Ends = Field(description=ENDS)
    stiffness: Six[AnyStiffness] = Field([0.0] * 6, description="x, y, z (N/m) and about them (N m/rad)")
    damping: Six[AnyDamping] = Field([0.0] * 6, description="N s/m and N m s/rad")
    free_position: Three[Length] = Field(
        [0.0, 0.0, 0.0], description="second frame in the first without spring force, m"
    )
    free_rotation: RotationTable | None = Field(
        None, description="from its axes to those of the first, without spring torque"
    )
    position: Three[Length] = Field([0.0, 0.0, 0.0], description="of the frame on the ground, m")
    rotation: RotationTable | None = Field(None, description="of the frame on the ground")

    def build(self, name: str, scope: Scope) -> list[Load]:
        """Return the bushing."""
        return [Bushing(name=name, **arrays_of(self, scope))]


class CharacteristicTable(PointsOrFile):
    """Torques at angles, by which a monotone cubic goes; straight on beyond the last ones."""

    what = "a characteristic"
    units = (("rad",), ("N m",))
    angle: list[Angle] | None = Field(None, description="rad, increasing")
    torque: list[Moment] | None = Field(None, description="N m, against the angle")
    file: FileName | None = Field(None, description="CSV file with a row 'angle, torque' for each point, instead")


class DampingTable(PointsOrFile):
    """Torques at rates, likewise."""

    what = "a damping characteristic"
    units = (("rad/s",), ("N m",))
    rate: list[AngularVelocity] | None = Field(None, description="rad/s, increasing")
    torque: list[Moment] | None = Field(None, description="N m, against the rate")
    file: FileName | None = Field(None, description="CSV file with a row 'rate, torque' for each point, instead")


class RotationalSpringTable(Table):
    """A rotational spring and damper about an axis of the first of two interfaces."""

    between: Ends = Field(description=ENDS)
    axis: Vector = Field([0.0, 0.0, 1.0], description="in the axes of the first")
    stiffness: RotationalStiffness = Field(0.0, ge=0, description="N m/rad")
    damping: RotationalDamping = Field(0.0, ge=0, description="N m s/rad")
    characteristic: CharacteristicTable | None = Field(None, description="instead of the stiffness")
    damping_characteristic: DampingTable | None = Field(None, description="instead of the damping")
    free_angle: Angle = Field(0.0, description="from which the angles of the spring count")
    rotation: RotationTable | None = Field(None, description="of the frame on the ground")

    def build(self, name: str, scope: Scope) -> list[Load]:
        """Return the spring."""
        given = arrays_of(self, scope)
        for key in given.keys() & {"characteristic", "damping_characteristic"}:
            given[key] = given[key].columns(scope.folder)
        return [RotationalSpring(name=name, **given)]


class ConductorTable(Table):
    """A current through the magnetic field of the orbit's planet."""

    through: Annotated[list[str], Field(min_length=2)] = Field(
        description="'body.interface' of each point along it, in the direction of the current"
    )
    current: Time = Field(description="A: " + TIME)

    def build(self, name: str, scope: Scope) -> list[Load]:
        """Return the conductor."""
        return [Conductor(name=name, **arrays_of(self, scope, functions=("current",)))]


class ImmersedTable(Table):
    """Slender rods in the water: drag, added mass, buoyancy of rigid bodies."""

    bodies: str = Field(description="name, or pattern as 'cable*' for all segments of a chain")
    ends: Ends = Field(["root", "tip"], description="interfaces at the ends of the rod")
    diameter: Length = Field(ge=0, description="m")
    normal_drag: Constant = Field(1.2, description="coefficient, on the diameter")
    tangential_drag: Constant = Field(0.01, description="coefficient, on the circumference")
    added_mass: Constant = Field(1.0, description="coefficient, on the volume, across the rod")

    def build(self, name: str, scope: Scope) -> list[Load]:
        """Return a rod for each body whose name matches the pattern."""
        if scope.water is None:
            raise InputError("there is no water; add [environment.water] with density and current")
        found = [body for body in scope.bodies if fnmatchcase(body, self.bodies)]
        if not found:
            raise InputError(f"no body is called {self.bodies!r}; {suggestion(self.bodies, scope.bodies, 'known are')}")
        water = Water(**arrays_of(scope.water, scope))
        own = self.model_dump(exclude={"bodies"})
        return [ImmersedRod(name=f"{name}.{body}", body=body, water=water, **own) for body in found]


class ForceElements(Table):
    """The tables of force elements in a pipeline file."""

    forces: dict[str, ForceTable] = Field({})
    springs: dict[str, AxialSpringTable] = Field({}, description="axial springs and dampers")
    bushings: dict[str, BushingTable] = Field({}, description="springs and dampers in six directions")
    rotational_springs: dict[str, RotationalSpringTable] = Field(
        {}, description="rotational springs and dampers, linear or by a table"
    )
    conductors: dict[str, ConductorTable] = Field({}, description="currents in the magnetic field of an orbit")
    immersed: dict[str, ImmersedTable] = Field({}, description="slender bodies in the water of [environment]")

    def force_elements(self, scope: Scope) -> Iterator[Load]:
        """Yield the loads of all tables."""
        for field in ForceElements.model_fields:
            for name, table in getattr(self, field).items():
                with naming(f"{NOUNS[field]} {name!r}"):
                    yield from table.build(name, scope)


NOUNS = {field: field.removesuffix("s").replace("_", " ") for field in ForceElements.model_fields}


def arrays_of(table: Table, scope: Scope, functions: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the values of a table as its record takes them: arrays, rotations, functions of time."""
    values = {}
    for key, value in table:
        if key in functions:
            values[key] = time_function(key, value, scope.folder)
        elif isinstance(value, RotationTable):
            values[key] = rotation_matrix(value)
        elif value is not None:
            numbers = isinstance(value, list) and not any(isinstance(each, str) for each in value)
            values[key] = np.array(value) if numbers else value
    return values
