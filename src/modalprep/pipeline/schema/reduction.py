"""Reduction and synthesis in pipeline files: modes, loads, damping, bodies already reduced, welds."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from modalprep.applies import Rule
from modalprep.body.stations.number import stations_for
from modalprep.linalg.solvers import Solver
from modalprep.pipeline.schema.base import BodyName, DeckName, OneOf, Table, Vector
from modalprep.pipeline.schema.fe import NodesTable
from modalprep.pipeline.schema.quantities import (
    Angle,
    Duration,
    Force,
    ForcePerLength,
    Frequency,
    Length,
    Moment,
    PerTime,
    Share,
    Stress,
    Three,
)
from modalprep.reduction.selection import recoveries_named, refuse_unreadable
from modalprep.reduction.table import BODY, DERIVATIVES, DIRECTIONS
from modalprep.vectors import as_rotation

Ratio = Annotated[float, Field(ge=0)]


class RayleighTable(Table):
    """Damping alpha M + beta K."""

    alpha: PerTime = Field(0.0, ge=0, description="1/s")
    beta: Duration = Field(0.0, ge=0, description="s")


def _damping_form(value: Any) -> str:
    if isinstance(value, list):
        return "points" if value and isinstance(value[0], list) else "modes"
    return "rayleigh" if isinstance(value, (dict, RayleighTable)) else "constant"


Damping = Annotated[
    Annotated[Ratio, Tag("constant")]
    | Annotated[list[Annotated[list[Ratio], Field(min_length=2, max_length=2)]], Tag("points")]
    | Annotated[list[Ratio], Tag("modes")]
    | Annotated[RayleighTable, Tag("rayleigh")],
    Discriminator(_damping_form),
]
DAMPING = (
    "fraction of critical: one for all modes; points [[Hz, ratio], ...], linear between and constant beyond; "
    "[ratio, ...], one per mode; or { alpha, beta } of Rayleigh damping"
)


TargetError = Annotated[
    Annotated[Annotated[Share, Field(gt=0)], Tag("body")]
    | Annotated[dict[str, Annotated[Share, Field(gt=0)]], Tag("recoveries")],
    Discriminator(lambda value: "recoveries" if isinstance(value, dict) else "body"),
]


OF_STATIONS = ("reach", "deflection_error", "stations", "derivatives")


class ReductionTable(Table):
    """Reduction of the body."""

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("modes", "keep", "target_error"), needs=("method",), among=("craig_bampton", "free_interface")),
        Rule(("truncation_vectors", "large_deflection"), needs=("method",), among=("craig_bampton",)),
        Rule(OF_STATIONS, needs=("large_deflection",), among=(True, "auto")),
    )

    method: Literal["craig_bampton", "guyan", "irs", "free_interface"] = Field(
        default="craig_bampton",
        description="irs: Guyan with the interior's inertia; free_interface: modes of the floating body and residual "
        "attachment modes",
    )
    modes: int = Field(default=20, ge=0, description="number of candidate modes; with target_error the initial number")
    keep: str | list[int] = Field(
        default="all",
        description="which to keep, e.g. 'effective_mass > 0.1% or 20 < frequency < 500 Hz', or mode numbers; "
        "values are frequency, effective_mass, cumulative, static, controllability, observability, recovery, "
        "recovery.NAME, mode",
    )
    up_to: Frequency | None = Field(
        default=None, gt=0, description="Hz, below which the error against the full model is measured"
    )
    target_error: TargetError | None = Field(
        default=None,
        description="use as many modes as this relative error needs, below up_to; or a table with that of each "
        "recovery named, such as { struts = '1%' }, in which body is the error of the body itself",
    )
    truncation_vectors: list[str] = Field(
        default=["interfaces", "inertia"],
        description="loads whose static response remains exact: interfaces (free ones), inertia, names of [loads]; "
        "derivatives: what the softest shapes change to when they bend, which large_deflection adds",
    )
    large_deflection: bool | Literal["auto"] = Field(
        default=False,
        description="move the body by stations, frames of its parts, which hold for deflections up to its length; "
        "without, the modes alone move it, to about a tenth of its size; auto: runs and equilibria take the stations "
        "only where the modes alone are off by more than deflection_error",
    )
    reach: float = Field(
        default=0.4,
        gt=0,
        le=1,
        description="largest deflection over the length of the body, from which stations follow",
    )
    deflection_error: Share = Field(
        default=1e-4, gt=0, lt=1, description="of the place of its end at that reach, over the length of the body"
    )
    stations: int | None = Field(
        default=None, ge=2, description="parts along each way from the root, instead of reach and deflection_error"
    )
    derivatives: int | None = Field(
        default=None,
        ge=0,
        description="number of vectors that large_deflection adds: the most important derivatives; default 6, or as "
        "many as deflection_error needs",
    )
    second_order_mass: bool | Literal["auto"] = Field(
        default="auto",
        description="T of the modal file, for bodies that bend under a steady load; auto: where it shifts frequencies "
        "by more than 5 % of what geometric stiffness does",
    )
    damping: Damping = Field(default=0.0, description=DAMPING)
    root: str | None = Field(default=None, description="the interface that carries the body frame")
    solver: Solver = Field(
        default="auto",
        description="how the stiffness is factorised: in_memory, in double precision; single, in single precision with "
        "iterations and half the bytes a number; out_of_core, on disk by MUMPS; auto takes the first of these that "
        "fits. superlu does without PARDISO",
    )

    @model_validator(mode="after")
    def _keep_can_be_read(self) -> ReductionTable:
        refuse_unreadable(self.keep)
        return self

    @model_validator(mode="after")
    def _target_has_a_band(self) -> ReductionTable:
        if self.target_error is not None and self.up_to is None:
            raise ValueError("target_error needs up_to, the frequency (Hz) below which it applies")
        return self

    @property
    def truncation(self) -> list[str]:
        """The loads of truncation vectors, with the derivatives that large deflections need."""
        more = [DERIVATIVES] if self.large_deflection and self.derivatives != 0 else []
        return [*self.truncation_vectors, *(name for name in more if name not in self.truncation_vectors)]

    @property
    def parts(self) -> int:
        """The number of stations along each way from the root, 0 without."""
        if not self.large_deflection:
            return 0
        return self.stations or stations_for(self.reach, self.deflection_error)

    @property
    def limits(self) -> dict[str, float]:
        """The target error by the name of each error that is measured (`Built.error_curves`, and static responses)."""
        if self.target_error is None:
            return {}
        targets = self.target_error if isinstance(self.target_error, dict) else {BODY: self.target_error}
        body = dict.fromkeys(("frequencies", "compliance at the interfaces", "static responses"), targets.get(BODY))
        found = body | {f"recovery {name}": limit for name, limit in targets.items() if name != BODY}
        return {name: limit for name, limit in found.items() if limit is not None}

    @property
    def recoveries(self) -> dict[str, tuple[str, ...]]:
        """The recoveries that each key names."""
        targets = self.target_error if isinstance(self.target_error, dict) else {}
        return {
            "keep": recoveries_named(self.keep)[1],
            "target_error": tuple(name for name in targets if name != BODY),
        }


BODY_FILE = "modal file, or a body that another program has reduced: .op4, .bdf/.dat/.pch, .inp, .sid, .fem, .npz"


class SourceTable(Table):
    """How the numbers of a body's file are taken, and which interface carries its frame."""

    length_unit: str = Field(default="m", description="of the file of another program: m, mm, cm, in, ft")
    mass_unit: str | None = Field(default=None, description="of that file, with seconds: kg, g, t, lbm, slug, slinch")
    root: str | None = Field(
        default=None, description="the interface that carries the body frame; default as in the file"
    )


class SuppliedTable(SourceTable):
    """A body that is reduced already, instead of [mesh] or [matrices]."""

    file: BodyName = Field(description=BODY_FILE)
    interfaces: dict[str, Annotated[list[int], Field(min_length=1)]] = Field(
        {}, description="interfaces that the file does not name, by the numbers of their nodes"
    )
    nodes: DeckName | None = Field(
        None, description="file with the places of the nodes of a substructure: a deck, .csv"
    )
    damping: Damping | None = Field(None, description="instead of that in the file; " + DAMPING)


class LoadTable(NodesTable):
    """A load for truncation vectors and static participation, mesh axes; its magnitude does not matter."""

    set: str | None = Field(
        None, description="instead of nodes and forces: a static load that the deck brings, such as load_2"
    )
    force: Three[Force] = Field([0.0, 0.0, 0.0], description="total, distributed over the nodes as by an rbe3, N")
    moment: Three[Moment] = Field([0.0, 0.0, 0.0], description="total, N m")
    pressure: Stress = Field(0.0, description="on the faces of a group, along their right-hand normal, Pa")
    traction: Three[Stress] = Field([0.0, 0.0, 0.0], description="on the faces of a group, N/m^2")
    line_load: Three[ForcePerLength] = Field([0.0, 0.0, 0.0], description="on the lines of a group, N/m")

    @model_validator(mode="after")
    def _not_nothing(self) -> LoadTable:
        spread = self.pressure or any(self.traction) or any(self.line_load)
        if self.set is None and not (any(self.force) or any(self.moment) or spread):
            raise ValueError("the load is zero; give force, moment, pressure, traction or line_load")
        if self.set is not None and (any(self.force) or any(self.moment) or spread or self.position):
            raise ValueError(f"the load {self.set!r} of the deck has its own forces and places; leave others out")
        if spread and self.group is None:
            raise ValueError("pressure, traction and line_load need a mesh group of faces or lines; name it by 'group'")
        return self

    def _instead(self) -> tuple[str, ...]:
        return ("set",)


class WeldTable(Table):
    """Two interfaces that move as one, or one that the ground holds."""

    between: Annotated[list[str], Field(min_length=2, max_length=2)] = Field(
        description="'body.interface' twice, or one and 'ground'"
    )
    free: list[Annotated[str, OneOf(DIRECTIONS)]] = Field(
        [], description="directions left free, in the axes of the first body: ['rz'] is a hinge"
    )

    @model_validator(mode="after")
    def _two_ends(self) -> WeldTable:
        if self.between[0] == self.between[1]:
            raise ValueError(f"joins {self.between[0]!r} with itself; name two ends")
        return self


class RotationTable(Table):
    """A fixed rotation: from the axes of the child or body to those of the parent or system."""

    axis: Vector | None = Field(None, description="about which it turns, with an angle")
    angle: Angle | None = None
    quaternion: Annotated[list[float], Field(min_length=4, max_length=4)] | None = Field(
        None, description="instead: w, x, y, z, of length 1"
    )
    matrix: Annotated[list[Vector], Field(min_length=3, max_length=3)] | None = Field(
        None, description="instead: its three rows; columns are the turned axes"
    )

    @model_validator(mode="after")
    def _one_way(self) -> RotationTable:
        turned = self.axis is not None and self.angle is not None
        half = (self.axis is None) != (self.angle is None)
        if half or turned + (self.quaternion is not None) + (self.matrix is not None) != 1:
            raise ValueError("a rotation needs either 'axis' and 'angle', 'quaternion', or 'matrix'")
        return self


def rotation_matrix(table: RotationTable | None) -> np.ndarray:
    """Return the rotation (3, 3) of a table, the identity without one."""
    if table is None:
        return np.eye(3)
    if table.axis is not None and table.angle is not None:
        return as_rotation((table.axis, table.angle), "rotation")
    return as_rotation(table.matrix or table.quaternion or np.eye(3), "rotation")


class PlacementTable(Table):
    """Position and orientation of a body in the system."""

    position: Three[Length] = Field([0.0, 0.0, 0.0], description="of its frame, m")
    rotation: RotationTable | None = Field(None, description="from its axes to the system's")


class SynthesisTable(Table):
    """Component mode synthesis: modes of the [bodies] that [welds] join."""

    applies: ClassVar[tuple[Rule, ...]] = (Rule(("tolerance",), needs=("project",)),)

    modes: int = Field(10, ge=1, description="number of system modes, rigid-body modes included")
    placement: dict[str, PlacementTable] = Field(
        {}, description="by body; the others follow from the welds, with axes parallel to their neighbour's"
    )
    project: list[str] | str = Field(
        [], description="bodies to project onto these modes by singular value decomposition; name or list"
    )
    tolerance: float = Field(
        1e-6,
        ge=0,
        lt=1,
        description="of project: smallest singular value kept, relative to the largest; interfaces stay complete",
    )
    damping: Damping | None = Field(
        None, description="of the system modes, from which that of the bodies follows; " + DAMPING
    )

    @property
    def projected(self) -> list[str]:
        """The bodies to project, as a list."""
        return [self.project] if isinstance(self.project, str) else self.project
