"""What a pipeline file may say: every key, its default and its meaning (`modalprep schema`)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from modalprep.pipeline.fe_schema import AnyMaterial, ConnectionTable, InterfaceTable, MeshTable, Section
from modalprep.pipeline.tables import Angle, Table, Vector


class ReductionTable(Table):
    """How the body is reduced."""

    method: Literal["craig_bampton", "guyan", "irs", "free_interface"] = Field(
        "craig_bampton",
        description="irs: Guyan with the interior's inertia; free_interface: modes of the floating body and residual "
        "attachment modes",
    )
    modes: int = Field(20, ge=0, description="modes to compute as candidates; with target_error to start with")
    keep: str | list[int] = Field(
        "all",
        description="which to keep, e.g. 'effective_mass > 0.1% or frequency < 500 Hz', or a list of mode numbers; "
        "values are frequency, effective_mass, cumulative, static, mode",
    )
    up_to: float | None = Field(None, gt=0, description="Hz; the error against the full model is measured below it")
    target_error: float | None = Field(
        None, gt=0, description="take as many modes as this relative error needs, below up_to"
    )
    truncation_vectors: list[Literal["interfaces", "inertia"]] = Field(
        ["interfaces", "inertia"], description="loads whose static answer is kept exact"
    )
    damping: float = Field(0.0, ge=0, description="modal damping, fraction of critical")
    root: str | None = Field(None, description="the interface that carries the body frame")

    @model_validator(mode="after")
    def _target_has_a_band(self) -> ReductionTable:
        if self.target_error is not None and self.up_to is None:
            raise ValueError("target_error needs up_to, the frequency in Hz below which it holds")
        return self


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
    materials: dict[str, AnyMaterial] = Field({})
    properties: dict[str, Section] = Field(
        {}, description="one table per mesh group or connection; a deck's own need no repeating"
    )
    connections: dict[str, ConnectionTable] = Field({}, description="new nodes tied to node sets")
    interfaces: dict[str, InterfaceTable] = Field({})
    reduction: ReductionTable = Field(ReductionTable())
    output: OutputTable = Field(OutputTable())
    bodies: dict[str, BodyTable] = Field({})
    joints: dict[str, JointTable] = Field({})
    environment: EnvironmentTable = Field(EnvironmentTable())
    simulation: SimulationTable | None = None
    plots: list[PlotTable] = Field([])

    @model_validator(mode="after")
    def _has_work(self) -> Pipeline:
        if self.mesh is None and self.simulation is None:
            raise ValueError("nothing to do: the file needs [mesh], [simulation] or both")
        return self
