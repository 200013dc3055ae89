"""Beams, cables and tethers that deploy from a body or retract into it, as rigid rods whose number changes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np

from modalprep.applies import Rule, refuse_idle
from modalprep.errors import InputError
from modalprep.multibody.model.joint_types import AT_INTERFACE
from modalprep.multibody.model.time_function import FOREVER, TimeFunction, motion
from modalprep.records import Record, given, optional
from modalprep.vectors import vector

LEAST = 0.25  # of a cable's rod: deployed length from which the innermost rod rotates freely; else its inertia is small
FIRST_BEND = 1.875  # of a beam's rod: bending length of the first hinge outside when the next rod is inserted
STIFF = 1e-3  # of a beam's rod: bending length of a hinge at the exit
EXACT = 1e-9  # of a rod: tolerance of lengths
OUT, IN = "out", "in"


@dataclass(frozen=True, eq=False, kw_only=True)
class Deployment(Record):
    """A uniform beam, cable or tether that slides through an exit of a rigid body or of the ground.

    It is divided into `segments` hinged rigid rods of length l; rod 1 is the outermost. The deployed part is a chain
    of full rods and the innermost rod, of which the length r is outside. The innermost rod of a beam (EI > 0) slides
    along the exit as in a guide, and each hinge has a spring of stiffness ``EI`` over the length that it represents;
    the innermost rod of a cable rotates about the exit. Stowed mass is located at the exit. Rods and the hinges at
    their inner ends are named ``<name>1``, ``<name>2``, ..., the sliding joint `name`; a body at the end has the parent
    ``<name>1.tip``.

    Attributes
    ----------
    name : str
    parent : str
        ``ground`` or ``body.interface``, the exit.
    length : float
        Total length, m.
    segments : int
        Number of rods of equal length.
    mass_per_length : float
        kg/m.
    deployed_length : TimeFunction or None
        Prescribed deployed length (m); its rate may jump.
    tension : TimeFunction or None
        N, tension of a free reel, instead of `deployed_length`; it opposes deployment.
    brake : float
        N s/m, viscous brake of a free reel.
    initial_length, initial_speed : float
        Deployed length (m) and its rate (m/s) of a free reel at the start.
    EI : float
        Bending stiffness, N m^2; zero for a cable.
    damping : float
        s, damping over stiffness of the material.
    axis, normal : (3,)
        Direction of deployment and normal of the bending plane, in the parent's frame.
    position : (3,)
        m, of an exit in the ground.
    spatial : bool
        Whether a cable moves in space, with spherical hinges; otherwise in the plane of `normal`.
    rotary_inertia : float
        Of the cross-section about the axis, per length, kg m; required in space.
    stop_time : float
        s, from which the deployed length is constant.
    deflection : float
        m, initial deflection of a beam's tip, in the shape due to a static tip force, kept while the length changes.

    Raises
    ------
    InputError
        When a constant is out of range, or there is neither a deployed length nor a tension.

    Examples
    --------
    >>> boom = Deployment(name="boom", parent="ground", length=10.0, segments=5, mass_per_length=1.2,
    ...                   deployed_length="5 + t/2")
    >>> boom.rod_length, boom.start
    (2.0, (5.0, 0.5))
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("brake", "initial_length", "initial_speed"), needs=("tension",), advice="it is that of a free reel"),
        Rule(("damping", "deflection"), needs=("EI",)),
        Rule(("position",), needs=("parent",), among=("ground",), advice=AT_INTERFACE),
    )
    name: str
    parent: str
    length: float
    segments: int
    mass_per_length: float
    deployed_length: TimeFunction | None = given(converter=optional(motion), default=None)
    tension: TimeFunction | None = given(converter=optional(TimeFunction.of), default=None)
    brake: float = 0.0
    initial_length: float = 0.0
    initial_speed: float = 0.0
    EI: float = 0.0
    damping: float = 0.0
    axis: np.ndarray = given(converter=vector, default=(1.0, 0.0, 0.0))
    normal: np.ndarray = given(converter=vector, default=(0.0, 0.0, 1.0))
    position: np.ndarray = given(converter=vector, default=(0.0, 0.0, 0.0))
    spatial: bool = False
    rotary_inertia: float = 0.0
    stop_time: float = FOREVER
    deflection: float = 0.0

    def __post_init__(self) -> None:
        """Check the constants."""
        what = f"deployment {self.name!r}: "
        refuse_idle(self, what)
        for name in ("length", "mass_per_length"):
            if not 0 < getattr(self, name) < float("inf"):
                raise InputError(f"{what}{name} = {getattr(self, name):g} must be positive")
        for name in ("EI", "damping", "brake", "rotary_inertia"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise InputError(f"{what}{name} = {getattr(self, name):g} must not be negative")
        if self.segments < 1:
            raise InputError(f"{what}segments = {self.segments} must be 1 or more")
        if (self.deployed_length is None) == (self.tension is None):
            raise InputError(f"{what}give either a 'deployed_length' or the 'tension' of a free reel")
        if self.spatial and (self.EI > 0 or self.rotary_inertia == 0):
            raise InputError(
                f"{what}a spatial cable needs EI = 0 and a rotary_inertia; a beam with EI bends in a plane"
            )
        if self.rotary_inertia and not self.spatial and self.parent == "ground":
            raise InputError(f"{what}'rotary_inertia' has no effect in a plane that is at rest; leave it out")
        self._convert(what)
        if self.deployed_length is None and not 0 < self.initial_length <= self.length:
            raise InputError(
                f"{what}initial_length = {self.initial_length:g} m must be positive and at most {self.length:g} m"
            )
        self._frame(what)
        super().__post_init__()

    def _frame(self, what: str) -> None:
        axis, normal = self.axis, self.normal
        if not np.linalg.norm(np.cross(axis, normal)) > 1e-6 * np.linalg.norm(axis) * np.linalg.norm(normal):
            raise InputError(f"{what}axis {axis.tolist()} and normal {normal.tolist()} must not be parallel")
        axis = axis / np.linalg.norm(axis)
        normal = normal - (normal @ axis) * axis
        object.__setattr__(self, "axis", axis)
        object.__setattr__(self, "normal", normal / np.linalg.norm(normal))

    @property
    def rod_length(self) -> float:
        """Length of a rod, m."""
        return self.length / self.segments

    @property
    def free_rod_length(self) -> float:
        """Length from which the innermost rod rotates freely, m."""
        return 0.0 if self.guided else LEAST * self.rod_length

    @property
    def guided(self) -> bool:
        """Whether the innermost rod is aligned with the exit, as that of a beam."""
        return self.EI > 0

    @property
    def start(self) -> tuple[float, float]:
        """Deployed length at the start, and its rate (m, m/s)."""
        if self.deployed_length is None:
            return self.initial_length, self.initial_speed
        return self.deployed_length(0.0)[:2]

    @property
    def frame(self) -> np.ndarray:
        """Rotation (3, 3) from the frame of the exit, x outwards and z the normal, to the parent's."""
        return np.column_stack([self.axis, np.cross(self.normal, self.axis), self.normal])

    @property
    def exit_body(self) -> str:
        """Name of the massless body between the exit hinge and the sliding joint."""
        return f"{self.name}_exit"


@dataclass(frozen=True, eq=False, kw_only=True)
class Stage(Record):
    """Which rods of a deployment take part in the recursion, and how the innermost rod is constrained.

    Attributes
    ----------
    rods : int
        Number of rods, the innermost included, at least 1.
    locked : bool
        Whether the innermost rod of a cable is too short to rotate freely: it is then welded to the next rod, or to the
        exit when it is the only one.
    rotation : (3, 3)
        Relative rotation fixed by the weld.
    tilt : TimeFunction or None
        Angle (rad) between the innermost rod of a beam and the exit's direction while it aligns.
    vanishing_angle : float
        Free angle (rad) of the first spring, which vanishes while the innermost rod comes out; that of the next spring
        is its opposite.
    length : TimeFunction or None
        Deployed length (m), where it is prescribed or locked.
    stopped : bool
        Whether the reel has stopped for the rest of the run.
    """

    rods: int
    locked: bool
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    tilt: TimeFunction | None = None
    vanishing_angle: float = 0.0
    length: TimeFunction | None = None
    stopped: bool = False

    def inner(self, deployment: Deployment) -> float:
        """Return the length of all rods but the innermost, m."""
        return (self.rods - 1) * deployment.rod_length

    def range(self, deployment: Deployment) -> tuple[float, float]:
        """Return the deployed lengths between which the stage is valid, m; infinite where there is no next stage."""
        inner = self.inner(deployment)
        shortest = deployment.free_rod_length
        if self.locked:
            return (inner if self.rods > 1 else -np.inf), inner + shortest
        low = -np.inf if deployment.guided and self.rods == 1 else inner + shortest
        return low, (self.rods * deployment.rod_length if self.rods < deployment.segments else np.inf)


class Change(NamedTuple):
    """The change that ends a stage of deployment k at time t."""

    t: float
    k: int
    kind: str


NEAR_EXIT = 3  # hinges of a beam whose stiffness depends on what is out of the innermost rod


def bending_lengths(d: Deployment, rods: int) -> np.ndarray:
    """Return the bending lengths of a beam's hinges (3, rods - 1), from rod 1 on, as polynomials of r.

    A hinge is stiff where it leaves the exit, so that stiffness is continuous when the next rod is inserted. The three
    hinges next to the exit together have the length of the beam that they represent and its first moment about the
    exit, so that slope and deflection outside are those of the beam.

    Examples
    --------
    >>> boom = Deployment(name="boom", parent="ground", length=4.0, segments=4, mass_per_length=1.0, EI=3.0,
    ...                   deployed_length="3.2")
    >>> (bending_lengths(boom, 5).T @ [1.0, 0.5, 0.25]).round(3).tolist()  # the sum 3 l, its first moment (3 l)^2 / 2
    [1.0, 0.812, 1.375, 0.813]
    """
    found = np.array([[1.0], [0.0], [0.0]]) * np.ones(max(3, rods - 1))
    found[:, -3:] = [
        [0.625, FIRST_BEND - STIFF, STIFF],
        [0.375, -0.75 + STIFF, FIRST_BEND - 0.5 - STIFF],
        [0.0, -0.5, 0.5],
    ]
    return found[:, -(rods - 1) :] * np.array([[d.rod_length], [1.0], [1 / d.rod_length]]) if rods > 1 else found[:, :0]


def start_angles(d: Deployment, stage: Stage) -> tuple[np.ndarray, np.ndarray]:
    """Return initial angles and rates (rods - 1,) of a beam's hinges, from rod 1 on.

    They carry the moments of a static tip force whose deflection w stays constant when the length changes: the
    curvature at a distance c from the tip is ``3 w c / L^3``.
    """
    out, speed = d.start
    bends = bending_lengths(d, stage.rods)
    r = out - stage.inner(d)
    bend = np.array([1.0, r, r**2]) @ bends
    slope = np.array([0.0, 1.0, 2 * r]) @ bends
    if not d.deflection or not out > 0:
        return 0 * bend, 0 * bend
    curvature = 3 * d.deflection * d.rod_length * np.arange(1, stage.rods) / out**3
    return bend * curvature, speed * curvature * (slope - 3 * bend / out)
