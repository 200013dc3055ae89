"""What a pipeline file may say: every key, its default and its meaning (`modalprep schema`)."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from modalprep.suggest import suggestion

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]


def _radians(value: Any) -> Any:
    """Read ``1.5``, ``"1.5 rad"`` or ``"90 deg"``."""
    if isinstance(value, str):
        match = re.fullmatch(r"\s*([-+.\deE]+)\s*(deg|rad)\s*", value)
        if not match:
            raise ValueError(f"{value!r} is not an angle; write for example '90 deg' or 1.57")
        return float(match[1]) * (math.pi / 180 if match[2] == "deg" else 1.0)
    return value


Angle = Annotated[float, BeforeValidator(_radians)]


class Table(BaseModel):
    """A TOML table that refuses keys it does not know."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: Any) -> Any:
        for key in data if isinstance(data, dict) else ():
            if key not in cls.model_fields:
                raise ValueError(f"unknown key {key!r}; {suggestion(key, cls.model_fields, 'known are')}")
        return data


class MeshTable(Table):
    """The mesh file."""

    file: str = Field(description="mesh file, relative to this file; .msh 4.1 is best")
    length_unit: str = Field("m", description="unit of its coordinates: m, mm, cm, in, ft")


class MaterialTable(Table):
    """An isotropic material, SI."""

    E: float = Field(description="Young's modulus, Pa")
    nu: float = Field(description="Poisson's ratio")
    rho: float = Field(description="density, kg/m^3")


class BeamTable(Table):
    """Section of a group of line cells, SI."""

    type: Literal["beam"]
    material: str
    A: float = Field(description="area, m^2")
    Iy: float = Field(description="second moment of area about e2 (bending towards 'up'), m^4")
    Iz: float = Field(description="second moment of area about e3, m^4")
    J: float = Field(description="torsion constant, m^4")
    ky: float = Field(5 / 6, description="shear factor along e2")
    kz: float = Field(5 / 6, description="shear factor along e3")
    up: Vector = Field([0.0, 0.0, 1.0], description="direction that e3 points to")
    theory: Literal["timoshenko", "euler-bernoulli"] = "timoshenko"


class SolidTable(Table):
    """Material of a group of second-order tetrahedra."""

    type: Literal["solid"]
    material: str


Section = Annotated[BeamTable | SolidTable, Field(discriminator="type")]


class InterfaceTable(Table):
    """A 6-DOF frame; the first in the file is the root unless [reduction] says otherwise."""

    group: str = Field(description="mesh group of its nodes")
    kind: Literal["node", "rbe2"] = Field("rbe2", description="one node, or a frame tied rigidly to all nodes")
    boundary: Literal["fixed", "free"] = Field(
        "fixed", description="fixed: constraint modes; free: moves with the modes"
    )
    position: Vector | None = Field(None, description="of an rbe2 frame, in mesh coordinates; default the centroid")


class ReductionTable(Table):
    """How the body is reduced."""

    method: Literal["craig_bampton", "guyan"] = "craig_bampton"
    modes: int = Field(20, ge=0, description="fixed-interface modes to compute as candidates")
    keep: str = Field("all", description="which to keep, e.g. 'effective_mass > 0.1% or frequency < 500 Hz'")
    truncation_vectors: list[Literal["interfaces", "inertia"]] = Field(
        ["interfaces", "inertia"], description="loads whose static answer is kept exact"
    )
    damping: float = Field(0.0, ge=0, description="modal damping, fraction of critical")
    root: str | None = Field(None, description="the interface that carries the body frame")


class OutputTable(Table):
    """What is written besides the modal file and the report."""

    pictures: Literal["kept", "none"] | Annotated[int, Field(ge=0)] = Field(
        "kept", description="mode pictures: kept, none, or how many"
    )


class BodyTable(Table):
    """A body of the system: a modal file, or the pipeline that makes it."""

    file: str | None = Field(None, description="modal file")
    pipeline: str | None = Field(None, description="pipeline file, run when its modal file is missing or out of date")

    @model_validator(mode="after")
    def _one_source(self) -> BodyTable:
        if (self.file is None) == (self.pipeline is None):
            raise ValueError("a body needs either 'file' or 'pipeline'")
        return self


class RotationTable(Table):
    """A fixed rotation from the child's to the parent's frame."""

    axis: Vector
    angle: Angle


class StartTable(Table):
    """Start values of a joint."""

    angle: Angle = 0.0
    rate: float = Field(0.0, description="rad/s")
    velocity: Vector = Field([0.0, 0.0, 0.0], description="of a free body's root, body frame, m/s")
    spin: Vector = Field([0.0, 0.0, 0.0], description="of a free body, body frame, rad/s")


class PieceTable(Table):
    """A piece of a prescribed motion."""

    angle: str = Field(description="expression of t (s) in rad")
    until: float | None = Field(None, description="s; the last piece has none")


class JointTable(Table):
    """A joint of the tree."""

    type: Literal["weld", "revolute", "free"]
    parent: str = Field("ground", description="'ground' or 'body.interface'")
    child: str = Field(description="'body.interface'")
    axis: Vector = Field([0.0, 0.0, 1.0], description="hinge axis in the parent's frame")
    position: Vector = Field([0.0, 0.0, 0.0], description="of a joint to the ground, or start of a free body, m")
    rotation: RotationTable | None = None
    start: StartTable = StartTable()
    motion: str | list[PieceTable] | None = Field(None, description="prescribed angle, an expression of t or pieces")


class EnvironmentTable(Table):
    """What acts on every body."""

    gravity: Vector = [0.0, 0.0, 0.0]


class SimulationTable(Table):
    """How the system is integrated."""

    t_end: float = Field(gt=0, description="s")
    output_step: float = Field(0.01, gt=0, description="s")
    rtol: float = Field(1e-7, ge=1e-13, le=1e-2, description="relative tolerance")
    atol: float = Field(1e-10, gt=0, description="absolute tolerance of coordinates and speeds")
    method: Literal["auto", "explicit", "implicit"] = Field("auto", description="auto: implicit for stiff modes")
    geometric_stiffness: bool = True
    compare_conventional: bool = Field(False, description="run also without geometric stiffness, plot both")
    output: list[str] = Field([], description="channels for the CSV file; default all")


class ReferenceTable(Table):
    """Known points to draw into a plot."""

    label: str
    t: list[float]
    y: list[float]

    @model_validator(mode="after")
    def _pairs(self) -> ReferenceTable:
        if len(self.t) != len(self.y):
            raise ValueError(f"t has {len(self.t)} values and y {len(self.y)}; give as many of each")
        return self


class PlotTable(Table):
    """One picture of channels over time."""

    y: str | list[str]
    title: str = ""
    ylabel: str = ""
    reference: list[ReferenceTable] = []

    @property
    def channels(self) -> list[str]:
        """The channels as a list."""
        return [self.y] if isinstance(self.y, str) else self.y


class Pipeline(Table):
    """A pipeline file: from a mesh to a modal file, a simulation, or both.

    Examples
    --------
    >>> Pipeline.model_validate({"mesh": {"file": "a.msh"}}).reduction.modes
    20
    """

    name: str | None = Field(None, description="name of the body; default the file's name")
    mesh: MeshTable | None = None
    materials: dict[str, MaterialTable] = {}
    properties: dict[str, Section] = Field({}, description="one table per mesh group")
    interfaces: dict[str, InterfaceTable] = {}
    reduction: ReductionTable = ReductionTable()
    output: OutputTable = OutputTable()
    bodies: dict[str, BodyTable] = {}
    joints: dict[str, JointTable] = {}
    environment: EnvironmentTable = EnvironmentTable()
    simulation: SimulationTable | None = None
    plots: list[PlotTable] = []

    @model_validator(mode="after")
    def _has_work(self) -> Pipeline:
        if self.mesh is None and self.simulation is None:
            raise ValueError("nothing to do: the file needs [mesh], [simulation] or both")
        return self
