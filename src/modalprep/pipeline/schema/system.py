"""Multibody systems in pipeline files: bodies, joints, forces, simulation."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from modalprep.multibody.model.joint_types import JointType
from modalprep.pipeline.schema.base import Angle, Table, Vector
from modalprep.pipeline.schema.reduction import RotationTable

INERTIA_ROUNDING = 1e-6
Six = Annotated[list[Annotated[float, Field(ge=0)]], Field(min_length=6, max_length=6)]
Ends = Annotated[list[str], Field(min_length=2, max_length=2)]
ENDS = "'body.interface' twice, or one and 'ground'"
EACH = "; a list for a joint with several coordinates, translations before rotations"


def _three_or_six(inertia: list[float]) -> list[float]:
    if len(inertia) not in (3, 6):
        raise ValueError(f"inertia has {len(inertia)} numbers; give xx, yy, zz, or also xy, xz, yz")
    return inertia


Inertia = Annotated[list[float], AfterValidator(_three_or_six)]


class BodyTable(Table):
    """A body of the system: a modal file, the pipeline that builds it, or a rigid body."""

    file: str | None = Field(None, description="modal file")
    pipeline: str | None = Field(None, description="pipeline file, run if its modal file is missing or outdated")
    mass: float | None = Field(None, gt=0, description="of a rigid body, kg")
    centre: Vector = Field([0.0, 0.0, 0.0], description="of mass of a rigid body, m")
    inertia: Inertia = Field(
        [0.0, 0.0, 0.0], description="of a rigid body about its centre of mass: xx, yy, zz (, xy, xz, yz), kg m^2"
    )
    interfaces: Annotated[dict[str, Vector], Field(min_length=1)] = Field(
        {"root": [0.0, 0.0, 0.0]}, description="of a rigid body, m; the first is its root"
    )

    @model_validator(mode="after")
    def _one_source(self) -> BodyTable:
        if sum(source is not None for source in (self.file, self.pipeline, self.mass)) != 1:
            raise ValueError("a body needs either 'file', 'pipeline' or, if it is rigid, 'mass'")
        if self.mass is None and self.model_fields_set & {"centre", "inertia", "interfaces"}:
            raise ValueError("centre, inertia and interfaces are those of a rigid body, which has a 'mass'")
        return self

    @model_validator(mode="after")
    def _possible_inertia(self) -> BodyTable:
        size = np.linalg.eigvalsh(inertia_tensor(self.inertia))
        if 2 * size.max() > size.sum() * (1 + INERTIA_ROUNDING):
            raise ValueError(
                f"inertia {self.inertia} is physically impossible: of its principal moments {size.round(6).tolist()} "
                "the largest exceeds the sum of the others"
            )
        return self


def inertia_tensor(inertia: list[float]) -> np.ndarray:
    """Return the tensor (3, 3) of ``xx, yy, zz (, xy, xz, yz)``.

    Examples
    --------
    >>> inertia_tensor([1.0, 2.0, 3.0])
    array([[1., 0., 0.],
           [0., 2., 0.],
           [0., 0., 3.]])
    """
    xx, yy, zz, xy, xz, yz = [*inertia, 0.0, 0.0, 0.0][:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


class PieceTable(Table):
    """A piece of a function of time."""

    value: str | float = Field(description="number, or expression of t (s)")
    until: float | None = Field(None, description="s; the last piece has none")


class PointsTable(Table):
    """A function of time as a smooth curve through points; a time named twice is a jump."""

    t: list[float] | None = Field(None, description="s")
    values: list[float] | None = None
    file: str | None = Field(None, description="CSV file with a row 't, value' for each point, instead")

    @model_validator(mode="after")
    def _points_or_file(self) -> PointsTable:
        given = [key for key in ("t", "values") if getattr(self, key) is not None]
        if given != ([] if self.file else ["t", "values"]):
            raise ValueError("a table of time needs both 't' and 'values', or 'file'")
        return self


def form(value: Any) -> str:
    """Return the form of a value, so that an error message refers to the intended one."""
    forms = {str: "text", list: "list"}
    return "table" if isinstance(value, (dict, Table)) else forms.get(type(value), "number")


Time = Annotated[
    Annotated[str, Tag("text")]
    | Annotated[float, Tag("number")]
    | Annotated[list[PieceTable], Tag("list")]
    | Annotated[PointsTable, Tag("table")],
    Discriminator(form),
]
TIME = "number, expression of t (s), pieces [{ value, until }, ...], or points { t, values } or { file }"


class StartTable(Table):
    """Initial values of a joint; lists for a joint with several rotations or translations."""

    angle: Angle | Annotated[list[Angle], Field(min_length=2, max_length=3)] = Field(
        0.0, description="initial rotation"
    )
    rate: float | Annotated[list[float], Field(min_length=2, max_length=3)] = Field(0.0, description="rad/s")
    displacement: float | Annotated[list[float], Field(min_length=2, max_length=2)] = Field(
        0.0, description="initial translation, m"
    )
    speed: float | Annotated[list[float], Field(min_length=2, max_length=2)] = Field(0.0, description="m/s")
    velocity: Vector = Field([0.0, 0.0, 0.0], description="of a free body's root, body frame, m/s")
    angular_velocity: Vector = Field(
        [0.0, 0.0, 0.0], description="of a free body or spherical joint, body frame, rad/s"
    )


class FrictionTable(Table):
    """Regularised Coulomb friction ``-coulomb tanh(rate / transition_velocity)``."""

    coulomb: float = Field(ge=0, description="Coulomb force or torque, N or N m")
    transition_velocity: float = Field(1e-3, gt=0, description="from sticking to sliding, m/s or rad/s")


class LimitsTable(Table):
    """One-sided springs that keep a coordinate within limits."""

    lower: Angle | None = Field(None, description="m or rad")
    upper: Angle | None = Field(None, description="m or rad")
    stiffness: float = Field(gt=0, description="N/m or N m/rad")
    damping: float = Field(
        0.0, ge=0, description="s/m or s/rad: an impact at v rebounds at about v / (1 + 2/3 damping v)"
    )


Constant = Annotated[float, Field(ge=0)]
Friction = Annotated[Annotated[Constant, Tag("number")] | Annotated[FrictionTable, Tag("table")], Discriminator(form)]


class HingeTable(Table):
    """Type, geometry, motion and forces of a joint."""

    type: JointType
    axis: Vector = Field([0.0, 0.0, 1.0], description="hinge axis in the parent's frame; normal of a planar joint")
    second_axis: Vector | None = Field(
        None, description="of a universal joint or gimbal; first direction of translation of a planar one"
    )
    pitch: float = Field(0.0, description="of a screw joint: travel along the axis for each turn, m; right-handed")
    position: Vector = Field([0.0, 0.0, 0.0], description="of a joint to the ground, or start of a free body, m")
    rotation: RotationTable | None = None
    start: StartTable = StartTable()
    keep_start: bool = Field(False, description="keep the start values where closed loops allow it")
    motion: Time | list[Time] | None = Field(
        None, description="prescribed angle (rad) or displacement (m), " + TIME + EACH
    )
    stiffness: Constant | list[Constant] = Field(0.0, description="N/m or N m/rad" + EACH)
    free_position: Angle | list[Angle] = Field(
        0.0, description="free length (m) or free angle (rad) of the spring" + EACH
    )
    damping: Constant | list[Constant] = Field(0.0, description="N s/m or N m s/rad" + EACH)
    friction: Friction | list[Friction] = Field(0.0, description="Coulomb force or torque, or a table" + EACH)
    limits: LimitsTable | list[LimitsTable | None] | None = Field(None, description="of the coordinate" + EACH)
    force: Time | list[Time] | None = Field(None, description="of an actuator in the translations, N: " + TIME)
    torque: Time | list[Time] | None = Field(None, description="of an actuator in the rotations, N m: " + TIME)


class JointTable(HingeTable):
    """A joint of the tree."""

    parent: str = Field("ground", description="'ground' or 'body.interface'")
    child: str = Field(description="'body.interface'")


class ForceTable(Table):
    """A force on an interface, or distributed over the points of a body."""

    at: str | None = Field(None, description="'body.interface'")
    body: str | None = Field(None, description="instead: body over whose mesh points the force is distributed equally")
    box: Annotated[list[Vector], Field(min_length=2, max_length=2)] | None = Field(
        None, description="of `body`: only points between two opposite corners, body frame, m; default all"
    )
    force: Annotated[list[Time], Field(min_length=3, max_length=3)] = Field(
        [0.0, 0.0, 0.0], description="N, each component: " + TIME
    )
    torque: Annotated[list[Time], Field(min_length=3, max_length=3)] = Field(
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


class AxialSpringTable(Table):
    """An axial spring and damper between two points."""

    between: Ends = Field(description=ENDS)
    stiffness: Constant = Field(0.0, description="N/m")
    damping: Constant = Field(0.0, description="N s/m")
    free_length: Constant = Field(0.0, description="m")
    position: Vector = Field([0.0, 0.0, 0.0], description="of the end on the ground, m")
    actuator_force: Time | None = Field(None, description="N, of an actuator that draws the ends together: " + TIME)
    tension_only: bool = Field(False, description="it goes slack below its free length: a tether or a strap")


class BushingTable(Table):
    """Six springs and dampers between two frames, in the axes of the first."""

    between: Ends = Field(description=ENDS)
    stiffness: Six = Field([0.0] * 6, description="x, y, z (N/m) and about them (N m/rad)")
    damping: Six = Field([0.0] * 6, description="N s/m and N m s/rad")
    free_position: Vector = Field([0.0, 0.0, 0.0], description="second frame in the first without spring force, m")
    free_rotation: RotationTable | None = Field(
        None, description="from its axes to those of the first, without spring torque"
    )
    position: Vector = Field([0.0, 0.0, 0.0], description="of the frame on the ground, m")
    rotation: RotationTable | None = Field(None, description="of the frame on the ground")


class ImmersedTable(Table):
    """Slender rods in the water: drag, added mass, buoyancy of rigid bodies."""

    bodies: str = Field(description="name, or pattern as 'cable*' for all segments of a chain")
    ends: Ends = Field(["root", "tip"], description="interfaces at the ends of the rod")
    diameter: Constant = Field(description="m")
    normal_drag: Constant = Field(1.2, description="coefficient, on the diameter")
    tangential_drag: Constant = Field(0.01, description="coefficient, on the circumference")
    added_mass: Constant = Field(1.0, description="coefficient, on the volume, across the rod")


Theory = Literal["consistent", "no_geometric_stiffness", "ruthless"]
THEORY = (
    "no_geometric_stiffness: the conventional theory, which rotation softens; ruthless: linearised in the modes, also "
    'in the inertia ("ruthless" in book section 6.7)'
)


class SimulationTable(Table):
    """Time integration of the system."""

    t_end: float = Field(gt=0, description="s")
    output_step: float = Field(0.01, gt=0, description="s")
    rtol: float = Field(1e-5, ge=1e-13, le=1e-2, description="relative tolerance")
    atol: float = Field(1e-10, gt=0, description="absolute tolerance of coordinates and speeds")
    method: Literal["auto", "explicit", "generalised_alpha", "rosenbrock"] = Field(
        "auto", description="auto: implicit for stiff modes"
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
    def _one_theory(self) -> SimulationTable:
        if not self.geometric_stiffness and self.theory == "consistent":
            raise ValueError("geometric_stiffness = false contradicts theory = 'consistent'; leave one of them out")
        return self

    @model_validator(mode="after")
    def _one_way(self) -> SimulationTable:
        if self.variables != "joint" and self.method != "auto":
            raise ValueError(f"variables = {self.variables!r} are integrated explicitly; leave out method")
        return self

    @property
    def chosen_theory(self) -> Theory:
        """The theory chosen by `theory` and `geometric_stiffness`."""
        return self.theory or ("consistent" if self.geometric_stiffness else "no_geometric_stiffness")
