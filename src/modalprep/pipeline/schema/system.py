"""Multibody systems in pipeline files: bodies, joints, closures, couplers, simulation."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from modalprep.applies import Rule
from modalprep.multibody.model.constraints import REACH, WITH_AXIS, WITH_FRICTION, ClosureType
from modalprep.multibody.model.joint_types import JointType
from modalprep.pipeline.schema import quantities
from modalprep.pipeline.schema.base import BodyName, FileName, PipelineName, Table, Vector
from modalprep.pipeline.schema.quantities import (
    Angle,
    AngularVelocity,
    AnyDamping,
    AnyStiffness,
    AnyVelocity,
    Coordinate,
    Duration,
    ForceOrMoment,
    ImpactDamping,
    Length,
    Mass,
    Three,
    Velocity,
    or_expression,
)
from modalprep.pipeline.schema.reduction import BODY_FILE, RotationTable, SourceTable
from modalprep.pipeline.schema.time import TIME, Time, form
from modalprep.vectors import inertia_tensor, refuse_impossible_inertia

END = "'body.interface' or 'ground'"
EACH = "; a list for a joint with several coordinates, translations before rotations"
FAR = "how far closing the loops may move a joint at the start: rad, or sizes of the system; the largest counts"


def _possible(inertia: list[float]) -> list[float]:
    if len(inertia) not in (3, 6):
        raise ValueError(f"inertia has {len(inertia)} numbers; give xx, yy, zz, or also xy, xz, yz")
    refuse_impossible_inertia(inertia_tensor(inertia))
    return inertia


Inertia = Annotated[list[quantities.Inertia], AfterValidator(_possible)]


class SurfaceTable(Table):
    """A surface with which a rigid body is drawn."""

    file: FileName = Field(description="STL, OBJ or DAE (Collada) file")
    scale: Three[float] = Field([1.0, 1.0, 1.0], description="of its coordinates, which then are in m")
    position: Three[Length] = Field([0.0, 0.0, 0.0], description="of its origin from the root, m")
    rotation: RotationTable | None = Field(None, description="its axes to the body's")


class BodyTable(SourceTable):
    """A body of the system: a file, the pipeline that builds it, or a rigid body."""

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("centre", "inertia", "interfaces", "surfaces"), needs=("mass",), advice="it is that of a rigid body"),
        Rule(("length_unit", "mass_unit", "root"), needs=("file",), advice="it is that of a body with a file"),
    )

    file: BodyName | None = Field(default=None, description=BODY_FILE)
    pipeline: PipelineName | None = Field(
        default=None, description="pipeline file, run if its modal file is missing or outdated"
    )
    mass: Mass | None = Field(default=None, gt=0, description="of a rigid body, kg")
    centre: Three[Length] = Field(default=[0.0, 0.0, 0.0], description="of mass of a rigid body, m")
    inertia: Inertia = Field(
        default=[0.0, 0.0, 0.0],
        description="of a rigid body about its centre of mass: xx, yy, zz (, xy, xz, yz), kg m^2",
    )
    interfaces: Annotated[dict[str, Three[Length]], Field(min_length=1)] = Field(
        default={"root": [0.0, 0.0, 0.0]}, description="of a rigid body, m; the first is its root"
    )
    surfaces: list[SurfaceTable] = Field(default=[], description="with which a rigid body is drawn")

    @model_validator(mode="after")
    def _one_source(self) -> BodyTable:
        if sum(source is not None for source in (self.file, self.pipeline, self.mass)) != 1:
            raise ValueError("a body needs either 'file', 'pipeline' or, if it is rigid, 'mass'")
        return self


class StartTable(Table):
    """Initial values of a joint; lists for a joint with several rotations or translations."""

    angle: Angle | Annotated[list[Angle], Field(min_length=2, max_length=3)] = Field(
        default=0.0, description="initial rotation"
    )
    rate: AngularVelocity | Annotated[list[AngularVelocity], Field(min_length=2, max_length=3)] = Field(
        default=0.0, description="rad/s"
    )
    displacement: Length | Annotated[list[Length], Field(min_length=2, max_length=2)] = Field(
        default=0.0, description="initial translation, m"
    )
    speed: Velocity | Annotated[list[Velocity], Field(min_length=2, max_length=2)] = Field(
        default=0.0, description="m/s"
    )
    velocity: Three[Velocity] = Field(default=[0.0, 0.0, 0.0], description="of a free body's root, body frame, m/s")
    angular_velocity: Three[AngularVelocity] = Field(
        default=[0.0, 0.0, 0.0], description="of a free body or spherical joint, body frame, rad/s"
    )


class FrictionTable(Table):
    """Regularised Coulomb friction ``-coulomb tanh(rate / transition_velocity)``."""

    coulomb: ForceOrMoment = Field(ge=0, description="Coulomb force or torque, N or N m")
    transition_velocity: AnyVelocity = Field(1e-3, gt=0, description="from sticking to sliding, m/s or rad/s")


class LimitsTable(Table):
    """One-sided springs that keep a coordinate within limits."""

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("stiffness",), needs=("lower", "upper"), advice="give one of them, or both"),
    )

    lower: Coordinate | None = Field(None, description="m or rad")
    upper: Coordinate | None = Field(None, description="m or rad")
    stiffness: AnyStiffness = Field(gt=0, description="N/m or N m/rad")
    damping: ImpactDamping = Field(
        0.0, ge=0, description="s/m or s/rad: an impact at v rebounds at about v / (1 + 2/3 damping v)"
    )


Constant = Annotated[float, Field(ge=0)]
Springs = Annotated[AnyStiffness, Field(ge=0)]
Dampers = Annotated[AnyDamping, Field(ge=0)]
Friction = Annotated[
    Annotated[Annotated[ForceOrMoment, Field(ge=0)], Tag("number")] | Annotated[FrictionTable, Tag("table")],
    Discriminator(form),
]


class HingeTable(Table):
    """Type, geometry, motion and forces of a joint."""

    applies: ClassVar[tuple[Rule, ...]] = (Rule(("free_position",), needs=("stiffness",)),)

    type: JointType
    axis: Vector = Field(
        default=[0.0, 0.0, 1.0], description="hinge axis in the parent's frame; normal of a planar joint"
    )
    second_axis: Vector | None = Field(
        default=None, description="of a universal joint or gimbal; first direction of translation of a planar one"
    )
    pitch: Length = Field(
        default=0.0, description="of a screw joint: travel along the axis for each turn, m; right-handed"
    )
    position: Three[Length] = Field(
        default=[0.0, 0.0, 0.0], description="of a joint to the ground, or start of a free body, m"
    )
    rotation: RotationTable | None = None
    start: StartTable = StartTable()
    keep_start: bool = Field(default=False, description="keep the start values where closed loops allow it")
    motion: Annotated[Time | list[Time] | None, or_expression("rad", "m")] = Field(
        default=None, description="prescribed angle (rad) or displacement (m), " + TIME + EACH
    )
    stiffness: Springs | list[Springs] = Field(default=0.0, description="N/m or N m/rad" + EACH)
    free_position: Coordinate | list[Coordinate] = Field(
        default=0.0, description="free length (m) or free angle (rad) of the spring" + EACH
    )
    damping: Dampers | list[Dampers] = Field(default=0.0, description="N s/m or N m s/rad" + EACH)
    friction: Friction | list[Friction] = Field(default=0.0, description="Coulomb force or torque, or a table" + EACH)
    limits: LimitsTable | list[LimitsTable | None] | None = Field(default=None, description="of the coordinate" + EACH)
    force: Annotated[Time | list[Time] | None, or_expression("N")] = Field(
        default=None, description="of an actuator in the translations, N: " + TIME
    )
    torque: Annotated[Time | list[Time] | None, or_expression("N m")] = Field(
        default=None, description="of an actuator in the rotations, N m: " + TIME
    )


class JointTable(HingeTable):
    """A joint of the tree."""

    applies: ClassVar[tuple[Rule, ...]] = (
        *HingeTable.applies,
        Rule(("range",), beside=("limits",), advice="the limits keep the joint there"),
    )

    parent: str = Field("ground", description="'ground' or 'body.interface'")
    child: str = Field(description="'body.interface'")
    range: Annotated[list[Coordinate], Field(min_length=2, max_length=2)] | None = Field(
        None, description="of a joint with one coordinate, rad or m: a run says when the joint leaves it"
    )


Start = Literal["rest", "quasi_static", "equilibrium", "steady", "periodic"]
Theory = Literal["consistent", "no_geometric_stiffness", "ruthless"]
THEORY = (
    "no_geometric_stiffness: the conventional theory, which rotation softens; ruthless: linearised in the modes, also "
    'in the inertia ("ruthless" in book section 6.7)'
)


class ClosureTable(Table):
    """A joint or a condition that closes a loop of the tree, or connects a body to the ground."""

    applies: ClassVar[tuple[Rule, ...]] = (Rule(("axis",), needs=("type",), among=(*WITH_AXIS, *WITH_FRICTION)),)

    type: ClosureType = Field(description="a joint, or point_on_line, point_on_plane, distance, position")
    a: str = Field(description=END)
    b: str = Field("ground", description=END)
    axis: Vector = Field([0.0, 0.0, 1.0], description="of the joint, line or plane, in a's axes")
    second_axis: Vector | None = Field(None, description="of a universal joint, fixed in b, in a's axes at zero")
    position: Three[Length] = Field([0.0, 0.0, 0.0], description="of the end on the ground, m")
    rotation: RotationTable | None = Field(None, description="b's axes to a's axes at zero angle")
    length: Time | None = Field(None, description="of a distance, m; default as at the start: " + TIME)
    path: Annotated[list[Time], Field(min_length=3, max_length=3)] | None = Field(
        None, description='of a position: b relative to a, m, each component "free" or ' + TIME
    )
    friction_coefficient: Annotated[float, Field(ge=0)] = Field(0.0, description="of a point on a line or plane")
    transition_velocity: Annotated[AnyVelocity, Field(gt=0)] = Field(
        1e-3, description="of friction, from sticking to sliding, m/s"
    )
    active: bool = Field(True, description="false: inactive until an event activates it")
    reach: Annotated[float, Field(gt=0)] = Field(REACH, description=FAR)


class CouplerTable(Table):
    """A linear relation of joint coordinates: gears, rack and pinion, screw, a driven joint."""

    factors: dict[str, float] = Field(
        description="by joint, or joint.k for its coordinate k, translations before rotations"
    )
    value: Time | None = Field(None, description="of the sum, m or rad; default as at the start: " + TIME)
    active: bool = Field(True, description="false: inactive until an event activates it")
    reach: Annotated[float, Field(gt=0)] = Field(REACH, description=FAR)


class SimulationTable(Table):
    """Time integration of the system."""

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(
            ("atol", "method", "max_step", "shortest_event", "start", "period", "checkpoint"),
            needs=("variables",),
            among=("joint",),
        ),
        Rule(("compare_conventional",), needs=("geometric_stiffness",), among=(True,)),
        Rule(("compare_conventional",), needs=("theory",), among=(None, "consistent", "ruthless")),
    )

    t_end: Duration = Field(gt=0, description="s")
    output_step: Duration = Field(0.01, gt=0, description="s")
    rtol: float = Field(1e-5, ge=1e-13, le=1e-2, description="relative tolerance")
    atol: float = Field(1e-10, gt=0, description="absolute tolerance of coordinates and speeds")
    method: Literal["auto", "explicit", "generalised_alpha", "rosenbrock"] = Field(
        "auto", description="auto: implicit for stiff modes"
    )
    max_step: Duration | None = Field(None, gt=0, description="s, longest step; for what control laws do in between")
    shortest_event: Duration | None = Field(
        None, gt=0, description="s, for which expressions of t are looked through; default 1e-4 of t_end"
    )
    start: Start | FileName | dict[str, list[float]] = Field(
        "rest",
        description="quasi_static: modes deflected by the accelerations at the start; equilibrium: everything at rest; "
        "steady: with the motion at the start; periodic: in the motion that repeats itself after `period`; the file of "
        'a run or state, which goes on; or modal coordinates, { "arm.modal" = [...] }',
    )
    start_time: Duration | None = Field(None, ge=0, description="s, of the run in that file; default its end")
    period: Duration | None = Field(
        None, gt=0, description="s, of a periodic start; default a turn of the slowest joint with a constant rate"
    )
    checkpoint: Duration | None = Field(
        None, gt=0, description="s of real time between checkpoints, from which an interrupted run goes on"
    )
    variables: Literal["joint", "momentum", "efficient"] = Field(
        "joint",
        description="of one body in free flight instead: its momenta, or efficient ones with a constant mass matrix",
    )
    theory: Theory | None = Field(None, description="default consistent; " + THEORY)
    geometric_stiffness: bool = Field(True, description="false: theory = 'no_geometric_stiffness'")
    compare_conventional: bool = Field(False, description="run also without geometric stiffness, plot both")
    output: list[str] = Field([], description="channels for the CSV file; default all")

    @model_validator(mode="after")
    def _known_start(self) -> SimulationTable:
        file = self.start if isinstance(self.start, FileName) else None
        if file is not None and "." not in file:
            raise ValueError(
                f"start = {str(file)!r} is neither 'rest', 'quasi_static', 'equilibrium', 'steady' nor 'periodic', "
                "and no file of a run or a state, such as 'run.h5'"
            )
        if self.start_time is not None and file is None:
            raise ValueError("start_time is the time of a run whose file is the start; leave it out")
        if self.period is not None and self.start != "periodic":
            raise ValueError("period belongs to start = 'periodic'; leave it out")
        return self

    @model_validator(mode="after")
    def _one_theory(self) -> SimulationTable:
        if not self.geometric_stiffness and self.theory == "consistent":
            raise ValueError("geometric_stiffness = false contradicts theory = 'consistent'; leave one of them out")
        return self

    @property
    def steps(self) -> dict[str, Any]:
        """Span, tolerances, method and steps, as the solver takes them."""
        names = {"t_end", "output_step", "rtol", "atol", "method", "max_step", "shortest_event"}
        return self.model_dump(include=names)

    @property
    def chosen_theory(self) -> Theory:
        """The theory chosen by `theory` and `geometric_stiffness`."""
        return self.theory or ("consistent" if self.geometric_stiffness else "no_geometric_stiffness")
