"""Schema of a pipeline file: every key, its default and its meaning (`modalprep schema`)."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from modalprep.applies import Rule
from modalprep.formats.export import EXPORTS
from modalprep.pipeline.schema.analysis import AnalysisTable, CollectTable, EnsembleTable, SensitivitiesTable
from modalprep.pipeline.schema.base import OneOf, ReferenceTable, Table
from modalprep.pipeline.schema.chain import BeamTable, ChainTable, with_chains
from modalprep.pipeline.schema.changing import DepletionTable, DeploymentTable, EventTable, JetTable
from modalprep.pipeline.schema.derivatives import RunSensitivitiesTable
from modalprep.pipeline.schema.environment import ControlTable, EnvironmentTable, FmuTable
from modalprep.pipeline.schema.fe import (
    AddedMassTable,
    ConnectionTable,
    CyclicTable,
    FoundationTable,
    InterfaceTable,
    MatricesTable,
    MeshTable,
    RecoveryTable,
    StressTable,
    SupportTable,
)
from modalprep.pipeline.schema.film import FilmTable
from modalprep.pipeline.schema.force_elements import NOUNS, ForceElements
from modalprep.pipeline.schema.inverse_kinematics import InverseKinematicsTable
from modalprep.pipeline.schema.properties import AnyMaterial, Section
from modalprep.pipeline.schema.quantities import in_mesh_unit
from modalprep.pipeline.schema.reduction import LoadTable, ReductionTable, SuppliedTable, SynthesisTable, WeldTable
from modalprep.pipeline.schema.responses.require import RequireTable
from modalprep.pipeline.schema.responses.response import Response
from modalprep.pipeline.schema.responses.strength import FatigueTable, ShockTable
from modalprep.pipeline.schema.robot import RobotTable
from modalprep.pipeline.schema.system import (
    BodyTable,
    ClosureTable,
    CouplerTable,
    JointTable,
    SimulationTable,
)
from modalprep.reduction.selection import recoveries_named
from modalprep.suggest import refuse_name, suggestion

NAMED = {  # tables whose keys are names that channels, references and files carry
    "interfaces": "interface",
    "stress": "stress at a point",
    "recovery": "recovery",
    "response": "response",
    "srs": "shock spectrum",
    "fatigue": "fatigue",
    "bodies": "body",
    "joints": "joint",
    "chains": "chain",
    "beams": "beam",
    "deployments": "deployment",
    "depletions": "depletion",
    "jets": "jet",
    "controls": "control",
    "fmu": "FMU",
    "connections": "connection",
    "supports": "support",
    "foundations": "foundation",
    "added_masses": "added mass",
    "loads": "load",
    **{field: noun for field, noun in NOUNS.items()},
    "closures": "closure",
    "couplers": "coupler",
    "events": "event",
}
IN_MESH_UNIT = ("mesh", "cyclic", "interfaces", "connections", "supports", "stress", "recovery", "loads")
BODIES = ("bodies", "chains", "beams", "deployments")  # a dot ends the name of a body
BUILT_IN = ("interfaces", "inertia")  # loads that every model has
OF_A_BODY = (
    "materials",
    "properties",
    "connections",
    "interfaces",
    "supports",
    "foundations",
    "added_masses",
    "loads",
    "reduction",
    "require",
    "output.export",
)
OF_A_SYSTEM = (
    "robot",
    "joints",
    "chains",
    "beams",
    "deployments",
    "controls",
    "fmu",
    "closures",
    "couplers",
    "depletions",
    "jets",
    "environment",
    "inverse_kinematics",
    *ForceElements.model_fields,
)


class OutputTable(Table):
    """Outputs besides the modal file and the report."""

    pictures: Literal["kept", "none"] | Annotated[int, Field(ge=0)] = Field(
        default="kept", description="mode pictures: kept, none, or a number"
    )
    film: Literal["none", "gif", "webp", "mp4"] = Field(default="none", description="animation of the simulated system")
    export: list[Annotated[str, OneOf(EXPORTS)]] = Field(
        default=[], description="formats of other programs, written beside the modal file"
    )


class PlotTable(Table):
    """One plot of channels over time."""

    y: str | list[str]
    title: str = ""
    ylabel: str = ""
    relative_to: str | None = Field(None, description="body in whose frame positions are drawn; default inertial")
    reference: list[ReferenceTable] = Field([])

    @property
    def channels(self) -> list[str]:
        """The channels as a list."""
        return [self.y] if isinstance(self.y, str) else self.y


class Pipeline(ForceElements):
    """A pipeline file: from a mesh to a modal file, a simulation, or both.

    Examples
    --------
    >>> Pipeline.model_validate({"mesh": {"file": "a.msh"}}).reduction.modes
    20
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(OF_A_BODY, needs=("mesh", "matrices", "body"), advice="add the [mesh], or leave it out"),
        Rule(("cyclic",), needs=("mesh",), advice="add the [mesh] of one sector"),
        Rule(OF_A_SYSTEM, needs=("simulation", "analysis"), advice="add one of them, or leave it out"),
        Rule(("bodies",), needs=("simulation", "analysis", "synthesis"), advice="add one of them, or leave it out"),
        Rule(("plots", "collect", "film", "output.film"), needs=("simulation",)),
        Rule(("environment.water",), needs=("immersed",), advice="list the bodies in the water under [immersed]"),
        Rule(("environment.orbit.dipole",), needs=("conductors",)),
    )
    name: str | None = Field(None, description="name of the body; default the file's name")
    mesh: MeshTable | None = None
    cyclic: CyclicTable | None = Field(
        None, description="the mesh is one sector of a ring, whose body is built; its modes by nodal diameter"
    )
    matrices: MatricesTable | None = Field(None, description="instead of [mesh] and its properties")
    body: SuppliedTable | None = Field(None, description="instead of [mesh], its properties, interfaces and reduction")
    materials: dict[str, AnyMaterial] = Field({})
    properties: dict[str, Section] = Field(
        {}, description="one table per mesh group or connection; those of an input deck need not be repeated"
    )
    connections: dict[str, ConnectionTable] = Field({}, description="new nodes tied to node sets")
    interfaces: dict[str, InterfaceTable] = Field({})
    supports: dict[str, SupportTable] = Field({}, description="what holds the model at its root, by component")
    foundations: dict[str, FoundationTable] = Field({}, description="springs under faces and along lines")
    added_masses: dict[str, AddedMassTable] = Field({}, description="mass and fluid on faces and lines")
    stress: dict[str, StressTable] = Field(
        {}, description="points whose stress modes the body has, for histories of a run"
    )
    recovery: dict[str, RecoveryTable] = Field(
        {}, description="forces, moments, stress and accelerations that the body recovers, for runs and envelopes"
    )
    response: dict[str, Response] = Field(
        {}, description="of the body to motion of its root and forces on its other interfaces, over frequency or time"
    )
    srs: dict[str, ShockTable] = Field({}, description="shock response spectra of channels of a transient or a run")
    fatigue: dict[str, FatigueTable] = Field(
        {}, description="damage by channels of a transient, a random response or a run"
    )
    loads: dict[str, LoadTable] = Field({}, description="loads that truncation_vectors may name")
    reduction: ReductionTable = Field(ReductionTable())
    require: RequireTable = Field(
        RequireTable(), description="of the body: limits, each with its verdict in the report"
    )
    sensitivities: SensitivitiesTable | None = Field(
        None, description="how the frequencies change with thicknesses, moduli, densities and sections"
    )
    output: OutputTable = Field(OutputTable())
    bodies: dict[str, BodyTable] = Field({}, description="of the system that is simulated, analysed or synthesised")
    welds: dict[str, WeldTable] = Field({}, description="how [synthesis] joins the bodies")
    synthesis: SynthesisTable | None = None
    joints: dict[str, JointTable] = Field({})
    robot: RobotTable | None = None
    chains: dict[str, ChainTable] = Field({}, description="many equal bodies, each hinged to the one before")
    beams: dict[str, BeamTable] = Field({}, description="with large deflection, as rigid segments with springs")
    deployments: dict[str, DeploymentTable] = Field({}, description="beams, cables and tethers that deploy from a body")
    controls: dict[str, ControlTable] = Field({}, description="forces by expressions of the system's motion")
    fmu: dict[str, FmuTable] = Field({}, description="units of other programs (FMI) that exert forces")
    closures: dict[str, ClosureTable] = Field({}, description="joints and conditions that close loops")
    couplers: dict[str, CouplerTable] = Field({}, description="gears and other linear relations of joints")
    depletions: dict[str, DepletionTable] = Field({}, description="bodies that lose mass")
    jets: dict[str, JetTable] = Field({}, description="thrust of the gas that leaves, and jet damping")
    events: dict[str, EventTable] = Field({}, description="zero crossings of channels and their effects")
    environment: EnvironmentTable = Field(EnvironmentTable())
    inverse_kinematics: InverseKinematicsTable | None = None
    simulation: SimulationTable | None = None
    ensemble: EnsembleTable | None = None
    run_sensitivities: RunSensitivitiesTable | None = None
    analysis: AnalysisTable | None = None
    collect: CollectTable | None = Field(None, description="channels of the run that join the table of a batch")
    plots: list[PlotTable] = Field([])
    film: FilmTable = Field(FilmTable())
    grid: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(
        {}, description='for modalprep batch: values of keys such as "reduction.modes"; every combination is a job'
    )

    @model_validator(mode="before")
    @classmethod
    def _lengths_of_the_mesh(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        source = data.get("mesh") or data.get("matrices")
        unit = source.get("length_unit", "m") if isinstance(source, dict) else "m"
        return data | {key: in_mesh_unit(data[key], str(unit)) for key in IN_MESH_UNIT if key in data}

    @field_validator(*NAMED, mode="before")
    @classmethod
    def _good_names(cls, tables: Any, info: ValidationInfo) -> Any:
        kind = info.field_name or ""
        for name in tables if isinstance(tables, dict) else ():
            refuse_name(name, NAMED[kind], "./" if kind in BODIES else "/")
        return tables

    @property
    def has_body(self) -> bool:
        """Whether the file builds a modal body."""
        return not (self.mesh is None and self.matrices is None and self.body is None)

    @model_validator(mode="after")
    def _matrices_stand_alone(self) -> Pipeline:
        own = ("mesh", "materials", "properties", "connections", "supports", "foundations", "added_masses")
        for name in own:
            if self.matrices is not None and getattr(self, name):
                raise ValueError(
                    f"[{name}] cannot be combined with [matrices], which have the whole structure; leave one out"
                )
        return self

    @model_validator(mode="after")
    def _terms_have_one_name(self) -> Pipeline:
        for name in set(self.foundations) & set(self.added_masses):
            raise ValueError(f"{name!r} is under both [foundations] and [added_masses]; rename one")
        return self

    @model_validator(mode="after")
    def _supplied_body_stands_alone(self) -> Pipeline:
        made_of = ("mesh", "matrices", "materials", "properties", "connections", "interfaces", "supports", "stress")
        for name in (*made_of, "foundations", "added_masses", "loads", "reduction"):
            if self.body is not None and name in self.model_fields_set:
                raise ValueError(f"[{name}] cannot be combined with [body], which is reduced already; leave one out")
        return self

    @model_validator(mode="after")
    def _response_has_a_body(self) -> Pipeline:
        if self.response and not self.has_body:
            raise ValueError(
                "[response] is that of the body of a [mesh], [matrices] or [body]; add one, or leave it out"
            )
        return self

    @model_validator(mode="after")
    def _strength_has_channels(self) -> Pipeline:
        for kind, tables in (("srs", self.srs), ("fatigue", self.fatigue)):
            for name, table in tables.items():
                if problem := table.unmet({key: found.kind for key, found in self.response.items()}, self.simulation):
                    raise ValueError(f"[{kind}.{name}] {problem}")
        return self

    @model_validator(mode="after")
    def _stress_has_elements(self) -> Pipeline:
        for name in ("stress", "sensitivities"):
            if getattr(self, name) and self.mesh is None:
                raise ValueError(f"[{name}] needs the elements of a [mesh]; add it, or leave out [{name}]")
        if self.recovery and self.mesh is None and self.matrices is None:
            found = "[body] has the recoveries of its file" if self.body else "[beams] and [chains] have the forces"
            found += " of their joints as channels" if self.body is None else ""
            raise ValueError(f"[recovery] needs a [mesh] or [matrices]: {found}; leave out [recovery]")
        for name, table in self.recovery.items():
            if self.matrices and table.kind not in ("reaction", "acceleration", "displacement"):
                raise ValueError(
                    f"[recovery.{name}] of kind {table.kind!r} needs the elements of a [mesh]; [matrices] recover "
                    "reaction, acceleration and displacement"
                )
        return self

    @model_validator(mode="after")
    def _recoveries_are_there(self) -> Pipeline:
        asked = recoveries_named(self.reduction.keep)[0] or bool(self.reduction.recoveries["target_error"])
        if asked and not self.recovery:
            raise ValueError("[reduction] chooses modes by recoveries, but there is no [recovery.NAME] table; add one")
        for key, names in self.reduction.recoveries.items():
            for name in (name for name in names if name not in self.recovery):
                raise ValueError(f"[reduction] {key}: {suggestion(name, self.recovery, 'the recoveries are')}")
        return self

    def with_chains(self) -> Pipeline:
        """Return the file with the bodies and joints of its chains and beams expanded."""
        bodies, joints = with_chains(self.chains, self.bodies, self.joints)
        bodies, joints = with_chains(self.beams, bodies, joints)
        return self.model_copy(update={"bodies": bodies, "joints": joints, "chains": {}, "beams": {}})

    @model_validator(mode="after")
    def _deployments_stand_alone(self) -> Pipeline:
        others = ("analysis", "inverse_kinematics", "synthesis", "closures", "couplers", "depletions", "events")
        if found := [name for name in others if self.deployments and getattr(self, name)]:
            raise ValueError(f"[{found[0]}] cannot be combined with [deployments]; leave one out")
        s = self.simulation
        if self.deployments and s and (s.variables != "joint" or s.chosen_theory != "consistent"):
            raise ValueError("[deployments] are simulated in joint variables and the consistent theory only")
        if self.deployments and s and s.compare_conventional:
            raise ValueError(
                "[deployments] have no conventional theory to compare with; leave out compare_conventional"
            )
        return self

    @model_validator(mode="after")
    def _has_work(self) -> Pipeline:
        jobs = (self.simulation, self.analysis, self.synthesis)
        if not self.has_body and jobs == (None, None, None):
            raise ValueError(
                "nothing to do: the file needs [mesh], [simulation], [analysis] or [synthesis], or a [body]"
            )
        return self

    @model_validator(mode="after")
    def _welds_are_used(self) -> Pipeline:
        if self.welds and self.synthesis is None:
            raise ValueError("[welds] belong to [synthesis], which is missing; add it, or use [joints]")
        return self

    @model_validator(mode="after")
    def _events_have_a_run(self) -> Pipeline:
        if self.events and (self.simulation is None or self.simulation.variables != "joint"):
            raise ValueError("[events] need a [simulation] in joint variables; add one, or leave them out")
        return self

    @model_validator(mode="after")
    def _derived_has_a_run(self) -> Pipeline:
        if self.ensemble and (self.simulation is None or self.simulation.variables != "joint" or self.deployments):
            raise ValueError("[ensemble] needs a [simulation] in joint variables without [deployments]")
        table, run = self.run_sensitivities, self.simulation
        if table and (run is None or run.variables != "joint" or self.deployments):
            raise ValueError("[run_sensitivities] needs a [simulation] in joint variables without [deployments]")
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
            raise ValueError(f"[loads] are for method = 'craig_bampton'; {table.method!r} does not use them")
        return table
