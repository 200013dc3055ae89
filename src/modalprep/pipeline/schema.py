"""What a pipeline file may say: every key, its default and its meaning (`modalprep schema`)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from modalprep.formats.export import EXPORTS
from modalprep.pipeline.fe_schema import (
    AnyMaterial,
    ConnectionTable,
    InterfaceTable,
    MatricesTable,
    MeshTable,
    Section,
)
from modalprep.pipeline.reduction_schema import (
    LoadTable,
    ReductionTable,
    RotationTable,
    SynthesisTable,
    WeldTable,
)
from modalprep.pipeline.tables import Angle, Table, Vector
from modalprep.suggest import suggestion

BUILT_IN = ("interfaces", "inertia")  # loads that every model has


class OutputTable(Table):
    """What is written besides the modal file and the report."""

    pictures: Literal["kept", "none"] | Annotated[int, Field(ge=0)] = Field(
        "kept", description="mode pictures: kept, none, or how many"
    )
    export: list[Literal[*EXPORTS]] = Field([], description="formats of other programs, written beside the modal file")


class BodyTable(Table):
    """A body of the system: a modal file, or the pipeline that makes it."""

    file: str | None = Field(None, description="modal file")
    pipeline: str | None = Field(None, description="pipeline file, run when its modal file is missing or out of date")

    @model_validator(mode="after")
    def _one_source(self) -> BodyTable:
        if (self.file is None) == (self.pipeline is None):
            raise ValueError("a body needs either 'file' or 'pipeline'")
        return self


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

    gravity: Vector = Field([0.0, 0.0, 0.0])


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
    reference: list[ReferenceTable] = Field([])

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
    matrices: MatricesTable | None = Field(None, description="instead of [mesh] and what it is made of")
    materials: dict[str, AnyMaterial] = Field({})
    properties: dict[str, Section] = Field(
        {}, description="one table per mesh group or connection; a deck's own need no repeating"
    )
    connections: dict[str, ConnectionTable] = Field({}, description="new nodes tied to node sets")
    interfaces: dict[str, InterfaceTable] = Field({})
    loads: dict[str, LoadTable] = Field({}, description="loads that truncation_vectors may name")
    reduction: ReductionTable = Field(ReductionTable())
    output: OutputTable = Field(OutputTable())
    bodies: dict[str, BodyTable] = Field({}, description="of the system that is simulated or synthesised")
    welds: dict[str, WeldTable] = Field({}, description="how [synthesis] joins the bodies")
    synthesis: SynthesisTable | None = None
    joints: dict[str, JointTable] = Field({})
    environment: EnvironmentTable = Field(EnvironmentTable())
    simulation: SimulationTable | None = None
    plots: list[PlotTable] = Field([])

    @property
    def has_body(self) -> bool:
        """Whether the file makes a modal body."""
        return self.mesh is not None or self.matrices is not None

    @model_validator(mode="after")
    def _matrices_stand_alone(self) -> Pipeline:
        for name in ("mesh", "materials", "properties", "connections"):
            if self.matrices is not None and getattr(self, name):
                raise ValueError(f"[{name}] does not go with [matrices], which hold the whole structure; leave one out")
        return self

    @model_validator(mode="after")
    def _has_work(self) -> Pipeline:
        if not self.has_body and self.simulation is None and self.synthesis is None:
            raise ValueError("nothing to do: the file needs [mesh], [simulation] or [synthesis]")
        return self

    @model_validator(mode="after")
    def _welds_are_used(self) -> Pipeline:
        if self.welds and self.synthesis is None:
            raise ValueError("[welds] join the bodies of [synthesis], which is missing; add it, or use [joints]")
        return self

    @field_validator("loads")
    @classmethod
    def _own_names(cls, loads: dict[str, LoadTable]) -> dict[str, LoadTable]:
        for name in set(BUILT_IN) & set(loads):
            raise ValueError(f"load {name!r} has the name of built-in loads; choose another")
        return loads

    @field_validator("reduction")
    @classmethod
    def _known_loads(cls, table: ReductionTable, info: ValidationInfo) -> ReductionTable:
        loads = info.data.get("loads", {})
        known = (*BUILT_IN, *loads)
        for name in table.truncation_vectors:
            if name not in known:
                raise ValueError(f"truncation_vectors names load {name!r}; {suggestion(name, known, 'known are')}")
        if loads and table.method != "craig_bampton":
            raise ValueError(f"[loads] are for method = 'craig_bampton'; {table.method!r} has no use for them")
        return table
