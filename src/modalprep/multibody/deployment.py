"""Beams, cables and tethers that come out of a body, or go back into it, cut into rods whose number changes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.rigid import rigid_body
from modalprep.errors import InputError
from modalprep.multibody.hinge import HingeElement
from modalprep.multibody.loads import Load
from modalprep.multibody.orbit import Orbit
from modalprep.multibody.system import Joint, System
from modalprep.multibody.timefunction import FOREVER, TimeFunction
from modalprep.records import Record

LEAST = 0.25  # of a cable's rod: what must be out before the innermost turns by itself; below, its inertia is too small
FIRST_BEND = 1.875  # of a beam's rod: length that bends in the first hinge outside when the next one follows
STIFF = 1e-3  # of a beam's rod: length that bends in a hinge where it leaves the exit
EXACT = 1e-9  # of a rod: how well a length is known
Z = np.array([0.0, 0.0, 1.0])
EYE = np.eye(3)


@dataclass(frozen=True, eq=False, kw_only=True)
class Deployment(Record):
    """A uniform beam, cable or tether that slides through an exit of a rigid body or of the ground.

    It is cut into `segments` rods of length l, hinged where they meet; rod 1 is the outermost. What is out is a chain
    of full rods and the innermost one, of length r outside. That of a beam (EI > 0) slides along the exit as in a
    guide, and springs bend as the beam does, ``EI`` over the length around each hinge; that of a cable turns about the
    exit. Stowed mass sits at the exit. Rods and the hinges on their inner ends are named ``<name>1``, ``<name>2``, ...,
    the sliding joint `name`; what hangs on the end is a body with the parent ``<name>1.tip``.

    Attributes
    ----------
    name : str
    parent : str
        ``ground`` or ``body.interface``, the exit.
    length : float
        All of it, m.
    segments : int
        Rods that it is cut into.
    mass_per_length : float
        kg/m.
    law : TimeFunction or None
        Length that is out (m) at each time; its rate may jump, as when it jams.
    tension : TimeFunction or None
        N, of a reel that moves by itself, beside `law`; it holds what is out back.
    brake : float
        N s/m, of such a reel.
    out, speed : float
        Where such a reel starts: length that is out (m), its rate (m/s).
    EI : float
        Bending stiffness, N m^2; zero for a cable.
    damping : float
        Of the material: damping over stiffness, s.
    axis, normal : (3,)
        Direction of exit, and normal of the plane of bending, in the parent's frame.
    position : (3,)
        m, of an exit in the ground.
    spatial : bool
        A cable that moves in space, its hinges spherical; else it bends in the plane of `normal`.
    rotary_inertia : float
        Of the cross-section about the axis, per length, kg m; needed in space.
    jam : float
        s: from then on the length does not change.
    deflection : float
        m, of the tip at the start, in the shape of a static force there, which it keeps while the length changes.

    Raises
    ------
    InputError
        When a number cannot be, or there is neither a law nor a tension.

    Examples
    --------
    >>> boom = Deployment(name="boom", parent="ground", length=10.0, segments=5, mass_per_length=1.2, law="5 + t/2")
    >>> boom.rod, boom.start
    (2.0, (5.0, 0.5))
    """

    name: str
    parent: str
    length: float
    segments: int
    mass_per_length: float
    law: TimeFunction | None = None
    tension: TimeFunction | None = None
    brake: float = 0.0
    out: float = 0.0
    speed: float = 0.0
    EI: float = 0.0
    damping: float = 0.0
    axis: np.ndarray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    normal: np.ndarray = field(default_factory=lambda: Z)
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    spatial: bool = False
    rotary_inertia: float = 0.0
    jam: float = FOREVER
    deflection: float = 0.0

    def __post_init__(self) -> None:
        """Check the constants."""
        what = f"deployment {self.name!r}: "
        for name in ("length", "mass_per_length"):
            if not 0 < getattr(self, name) < float("inf"):
                raise InputError(f"{what}{name} = {getattr(self, name):g} must be positive")
        for name in ("EI", "damping", "brake", "rotary_inertia"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise InputError(f"{what}{name} = {getattr(self, name):g} must not be negative")
        if self.segments < 1:
            raise InputError(f"{what}segments = {self.segments} must be 1 or more")
        if (self.law is None) == (self.tension is None):
            raise InputError(f"{what}give either a 'law' of the length or the 'tension' of a reel that moves by itself")
        if self.spatial and (self.EI > 0 or self.rotary_inertia == 0):
            raise InputError(f"{what}in space it has EI = 0 and a rotary_inertia; a beam with EI bends in a plane")
        if self.deflection and not self.EI > 0:
            raise InputError(f"{what}a deflection at the start needs EI")
        for name in ("law", "tension"):
            value = getattr(self, name)
            object.__setattr__(self, name, None if value is None else TimeFunction.of(value))
        if self.law is None and not 0 < self.out <= self.length:
            raise InputError(f"{what}out = {self.out:g} m must be positive and not above length = {self.length:g} m")
        self._frame(what)
        super().__post_init__()

    def _frame(self, what: str) -> None:
        axis, normal = np.asarray(self.axis, dtype=float), np.asarray(self.normal, dtype=float)
        if not np.linalg.norm(np.cross(axis, normal)) > 1e-6 * np.linalg.norm(axis) * np.linalg.norm(normal):
            raise InputError(f"{what}axis {axis.tolist()} and normal {normal.tolist()} must not be parallel")
        axis = axis / np.linalg.norm(axis)
        normal = normal - (normal @ axis) * axis
        object.__setattr__(self, "axis", axis)
        object.__setattr__(self, "normal", normal / np.linalg.norm(normal))
        object.__setattr__(self, "position", np.asarray(self.position, dtype=float))

    @property
    def rod(self) -> float:
        """Length of a rod, m."""
        return self.length / self.segments

    @property
    def least(self) -> float:
        """Length from which the innermost rod turns by itself, m."""
        return 0.0 if self.guided else LEAST * self.rod

    @property
    def guided(self) -> bool:
        """Whether the innermost rod is aligned with the exit: a beam, no cable."""
        return self.EI > 0

    @property
    def start(self) -> tuple[float, float]:
        """Length that is out at the start, and its rate (m, m/s)."""
        return (self.out, self.speed) if self.law is None else self.law(0.0)[:2]

    @property
    def frame(self) -> np.ndarray:
        """Rotation (3, 3) from the frame of the exit, x outwards and z the normal, to the parent's."""
        return np.column_stack([self.axis, np.cross(self.normal, self.axis), self.normal])

    @property
    def leads(self) -> str:
        """Name of the massless body between exit hinge and sliding joint."""
        return f"{self.name}_exit"


@dataclass(frozen=True, eq=False, kw_only=True)
class Stage(Record):
    """Which rods of a deployment are in the recursion, and how the innermost is held.

    Attributes
    ----------
    rods : int
        The innermost included, at least 1.
    locked : bool
        The innermost of a cable is too short to turn by itself: it is welded to the next, or the only one to the exit.
    turn : (3, 3)
        Rotation that the weld holds.
    tilt : TimeFunction or None
        Angle (rad) by which the innermost of a beam still differs from the exit's direction.
    fading : float
        Rest angle of the first spring that fades while the innermost rod comes out, the next one's is its opposite.
    law : TimeFunction or None
        Length that is out, where it is driven or held.
    held : bool
        The reel is stopped for good.
    """

    rods: int
    locked: bool
    turn: np.ndarray = field(default_factory=lambda: np.eye(3))
    tilt: TimeFunction | None = None
    fading: float = 0.0
    law: TimeFunction | None = None
    held: bool = False

    def inner(self, deployment: Deployment) -> float:
        """Return the length of all rods but the innermost, m."""
        return (self.rods - 1) * deployment.rod

    def range(self, deployment: Deployment) -> tuple[float, float]:
        """Return the lengths between which the stage holds, m; without end where there is no next stage."""
        inner, least = self.inner(deployment), deployment.least
        if self.locked:
            return (inner if self.rods > 1 else -np.inf), inner + least
        low = -np.inf if deployment.guided and self.rods == 1 else inner + least
        return low, (self.rods * deployment.rod if self.rods < deployment.segments else np.inf)


@dataclass(frozen=True, eq=False, kw_only=True)
class DeployingSystem(Record):
    """A system of which beams, cables or tethers come out; see `System` and `Deployment`.

    Examples
    --------
    >>> boom = Deployment(name="boom", parent="ground", length=10.0, segments=5, mass_per_length=1.2, law="5 + t/2")
    >>> system = DeployingSystem(bodies={}, joints=(), deployments=(boom,))
    >>> system.at([first_stage(boom)]).order
    ('boom_exit', 'boom3', 'boom2', 'boom1')
    """

    bodies: dict[str, FlexibleBody]
    joints: tuple[Joint, ...]
    deployments: tuple[Deployment, ...]
    gravity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    loads: tuple[Load, ...] = ()
    orbit: Orbit | None = None

    def __post_init__(self) -> None:
        """Check names, and that exits are in rigid bodies."""
        for d in self.deployments:
            name = d.parent.partition(".")[0]
            if name in self.bodies and self.bodies[name].n:
                raise InputError(
                    f"deployment {d.name!r}: body {name!r} has modes, but stowed mass needs a rigid body; give it a "
                    "'mass' in place of a file, or put a rigid body between"
                )
        super().__post_init__()
        self.full()

    def at(self, stages: list[Stage], places: dict[str, dict] | None = None) -> System:
        """Return the system with the rods of these stages; `places` are start values of joints by name."""
        bodies, joints = dict(self.bodies), list(self.joints)
        for d, stage in zip(self.deployments, stages, strict=True):
            new = _bodies(d, stage)
            for twice in new.keys() & bodies.keys():
                raise InputError(f"deployment {d.name!r} makes body {twice!r}, which is already there; rename one")
            bodies |= new
            joints += [joint.with_(**(places or {}).get(joint.name, {})) for joint in _joints(d, stage)]
        return System(bodies=bodies, joints=tuple(joints), gravity=self.gravity, loads=self.loads, orbit=self.orbit)

    def without_exit(
        self, stages: list[Stage], d: Deployment, turn: np.ndarray, velocity: np.ndarray, spin: np.ndarray
    ) -> System:
        """Return the system with the innermost rod gone and the next one free of the exit.

        turn : (3, 3) of that rod in the exit's frame; velocity, spin : (3,) of its root, relative to the exit, in its
        own frame.
        """
        full, stage = self.at(stages), stages[self.deployments.index(d)]
        gone = {d.leads, f"{d.name}{stage.rods}"}
        rod = f"{d.name}{stage.rods - 1}"
        loose = Joint(
            name=rod, type="free", parent=d.parent, child=rod, position=d.position, rotation=d.frame @ turn,
            velocity=velocity, spin=spin,
        )  # fmt: skip
        kept = tuple(joint for joint in full.joints if full.child(joint) not in {*gone, rod})
        bodies = {name: body for name, body in full.bodies.items() if name not in gone}
        return full.with_(bodies=bodies, joints=(*kept, loose))

    def full(self) -> System:
        """Return the system with everything out."""
        return self.at([Stage(rods=d.segments, locked=False, law=TimeFunction(d.length)) for d in self.deployments])


def _bodies(d: Deployment, stage: Stage) -> dict[str, FlexibleBody]:
    mass, ends = d.mass_per_length * d.rod, {"root": np.zeros(3), "tip": np.array([d.rod, 0, 0])}
    across = mass * d.rod**2 / 12
    inertia = np.diag([d.rotary_inertia * d.rod, across, across])
    rod = rigid_body(d.name, mass=mass, centre=ends["tip"] / 2, inertia=inertia, interfaces=ends)
    behind = {"root": np.zeros(3), "sleeve": np.array([-stage.rods * d.rod, 0, 0])}
    leads = rigid_body(d.leads, mass=1.0, centre=np.zeros(3), inertia=np.zeros((3, 3)), interfaces=behind)
    leads = leads.with_(m=0.0, points=np.zeros((1, 3)), shape=np.zeros((1, 3, 0)))
    return {d.leads: leads} | {f"{d.name}{k}": rod for k in range(stage.rods, 0, -1)}


def _joints(d: Deployment, stage: Stage) -> Iterator[Joint]:
    """Yield exit hinge, sliding joint, then the hinges outwards."""
    n, welded = stage.rods, max(1, stage.rods - 1) if stage.locked else 0
    outside = {"parent": d.parent, "child": d.leads, "position": d.position, "rotation": d.frame}
    yield _guide(d, stage, **outside) if d.guided else _hinge(d, n, stage, welded=n == welded, **outside)
    yield _slider(d, stage)
    for k in range(n - 1, 0, -1):
        yield _hinge(d, k, stage, welded=k == welded, parent=f"{d.name}{k + 1}.tip", child=f"{d.name}{k}")


def _guide(d: Deployment, stage: Stage, **ends) -> Joint:
    name = f"{d.name}{stage.rods}"
    if stage.tilt is None:
        return Joint(name=name, type="weld", **ends)
    return Joint(name=name, type="revolute", axis=d.frame @ Z, motion=stage.tilt, **ends)


def _hinge(d: Deployment, k: int, stage: Stage, *, welded: bool, rotation: np.ndarray = EYE, **ends) -> Joint:
    name = f"{d.name}{k}"
    if welded:
        return Joint(name=name, type="weld", rotation=rotation @ stage.turn, **ends)
    if d.spatial:
        return Joint(name=name, type="spherical", rotation=rotation, **ends)
    stiffness = d.EI / d.rod
    elements = (HingeElement(stiffness=stiffness, damping=d.damping * stiffness),) if d.EI > 0 else ()
    return Joint(name=name, type="revolute", axis=rotation @ Z, rotation=rotation, elements=elements, **ends)


def _slider(d: Deployment, stage: Stage) -> Joint:
    out, speed = d.start
    moves = {"displacement": out, "speed": speed} if stage.law is None else {"motion": stage.law}
    if stage.law is None and d.law is None:
        moves["elements"] = (HingeElement(damping=d.brake, drive=-d.tension),)
    ends = {"parent": f"{d.leads}.sleeve", "child": f"{d.name}{stage.rods}"}
    return Joint(name=d.name, type="prismatic", axis=EYE[0], **ends, **moves)


def aligning(t: float, angle: float, rate: float, within: float) -> TimeFunction | None:
    """Return an angle that goes from a value and rate at time t smoothly to zero, or None when it is there.

    Examples
    --------
    >>> tilt = aligning(2.0, 0.1, -0.3, 0.5)
    >>> [round(x, 9) for x in tilt(2.0)[:2]], tilt(2.5)[:2]
    ([0.1, -0.3], (0.0, 0.0))
    """
    if angle == 0.0 and rate == 0.0:
        return None
    s = f"((t - {t!r})/{within!r})"
    path = f"(1 - {s})**2*({angle!r} + {2 * angle + rate * within!r}*{s})"
    return TimeFunction([(t, f"{angle!r} + {rate!r}*(t - {t!r})"), (t + within, path), (FOREVER, 0.0)])


def stretches(d: Deployment) -> list[tuple[float, TimeFunction]]:
    """Return the smooth stretches of a law, ``(until, law)``: its rate jumps where they meet.

    Raises
    ------
    InputError
        When the length itself jumps.

    Examples
    --------
    >>> law = [(2.0, "t"), (3.0, "2"), (float("inf"), "2")]
    >>> boom = Deployment(name="boom", parent="ground", length=9.0, segments=9, mass_per_length=1.0, law=law)
    >>> [until for until, _ in stretches(boom)]
    [2.0, inf]
    """
    found, pieces = [], []
    for k, (until, what) in enumerate(d.law.given):
        pieces.append((until, what))
        if until == FOREVER or k == len(d.law.pieces) - 1:
            found.append((FOREVER, TimeFunction(pieces)))
        elif _kinks(d, until, *d.law.pieces[k : k + 2]):
            found.append((until, TimeFunction([*pieces[:-1], (FOREVER, what)])))
            pieces = []
    return found


def _kinks(d: Deployment, t: float, left, right) -> bool:
    a, b = (piece.evaluate(np.array([t]))[:, 0] for piece in (left, right))
    if abs(b[0] - a[0]) > EXACT * d.rod:
        raise InputError(
            f"deployment {d.name!r}: the law jumps from {a[0]:g} to {b[0]:g} m at t = {t:g} s; a length cannot jump"
        )
    return abs(b[1] - a[1]) > 1e-9 * max(abs(a[1]), abs(b[1]))


def first_stage(d: Deployment) -> Stage:
    """Return the stage of a deployment at the start.

    Raises
    ------
    InputError
        When the length is not between zero and all of it.
    """
    out, speed = d.start
    if not -EXACT * d.rod <= out <= d.length + EXACT * d.rod:
        raise InputError(f"deployment {d.name!r}: {out:g} m are out at the start; there are only {d.length:g} m")
    rods = int(np.floor(out / d.rod + EXACT)) + 1
    if abs(out / d.rod - (rods - 1)) < EXACT and speed <= 0:
        rods -= 1
    rods = min(max(rods, 1), d.segments)
    locked = out - (rods - 1) * d.rod < d.least
    return Stage(rods=rods, locked=locked, law=stretches(d)[0][1] if d.law is not None else None)


def bending(d: Deployment, rods: int) -> np.ndarray:
    """Return what bends in a beam's hinges (3, rods - 1), that of rod 1 first: lengths as polynomials of r.

    Where a hinge leaves the exit it is stiff, and nothing jumps when the next one follows. The three next to the exit
    have together the length of the beam around them, and its first moment about the exit: the slope and deflection
    outside are those of the beam.

    Examples
    --------
    >>> boom = Deployment(name="boom", parent="ground", length=4.0, segments=4, mass_per_length=1.0, EI=3.0, law="3.2")
    >>> (bending(boom, 5).T @ [1.0, 0.5, 0.25]).round(3).tolist()  # the sum 3 l, its first moment (3 l)^2 / 2
    [1.0, 0.812, 1.375, 0.813]
    """
    found = np.array([[1.0], [0.0], [0.0]]) * np.ones(max(3, rods - 1))
    found[:, -3:] = [
        [0.625, FIRST_BEND - STIFF, STIFF], [0.375, -0.75 + STIFF, FIRST_BEND - 0.5 - STIFF], [0.0, -0.5, 0.5]
    ]  # fmt: skip
    return found[:, -(rods - 1) :] * np.array([[d.rod], [1.0], [1 / d.rod]]) if rods > 1 else found[:, :0]


def start_angles(d: Deployment, stage: Stage) -> tuple[np.ndarray, np.ndarray]:
    """Return angles and rates (rods - 1,) of a beam's hinges at the start, those of rod 1 first.

    They carry the moments of a static force at the tip, which keeps its deflection when the length changes: the
    curvature at a distance c from the tip is ``3 w c / L^3``.
    """
    (out, speed), bends = d.start, bending(d, stage.rods)
    r = out - stage.inner(d)
    bend, slope = np.array([1.0, r, r**2]) @ bends, np.array([0.0, 1.0, 2 * r]) @ bends
    if not d.deflection or not out > 0:
        return 0 * bend, 0 * bend
    curvature = 3 * d.deflection * d.rod * np.arange(1, stage.rods) / out**3
    return bend * curvature, speed * curvature * (slope - 3 * bend / out)
