"""Beams, cables and tethers that come out of a body, or go back into it, cut into rods whose number changes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.rigid import rigid_body
from modalprep.errors import InputError
from modalprep.multibody.hinge import HingeElement
from modalprep.multibody.loads import Load
from modalprep.multibody.system import Joint, System
from modalprep.multibody.timefunction import FOREVER, TimeFunction
from modalprep.records import Record

LEAST = 0.25  # of a rod: what must be out before the innermost turns by itself; below, its inertia is too small
EXACT = 1e-9  # of a rod: how well a length is known
Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False, kw_only=True)
class Deployment(Record):
    """A uniform beam, cable or tether that slides through an exit of a rigid body or of the ground.

    It is cut into `segments` rods of length l, hinged where they meet; rod 1 is the outermost. What is out is a chain
    of full rods and the innermost one, of length r, hinged at the exit. Springs bend as the beam does, ``EI`` over the
    length around each hinge. Stowed mass sits at the exit. Rods and hinges are named ``<name>1``, ``<name>2``, ...,
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
        m, of the tip at the start, in the shape w(x/L) of a static force there, which only the length changes then.

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
        return LEAST * self.rod

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
        The innermost is too short to turn by itself: it is welded to the next rod, or the only one to the exit.
    turn : (3, 3)
        Rotation that the weld holds.
    fading : float
        Rest angle of the exit's spring that fades while the innermost rod comes out, the next one's is its opposite.
    law : TimeFunction or None
        Length that is out, where it is driven or held.
    held : bool
        The reel is stopped for good.
    """

    rods: int
    locked: bool
    turn: np.ndarray = field(default_factory=lambda: np.eye(3))
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
        return inner + least, (self.rods * deployment.rod if self.rods < deployment.segments else np.inf)

    @property
    def angle(self) -> float:
        """Angle of the weld about z, rad."""
        return float(np.arctan2(self.turn[1, 0], self.turn[0, 0]))


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
        return System(bodies=bodies, joints=tuple(joints), gravity=self.gravity, loads=self.loads)

    def full(self) -> System:
        """Return the system with everything out."""
        return self.at([Stage(rods=d.segments, locked=False) for d in self.deployments])


def _bodies(d: Deployment, stage: Stage) -> dict[str, FlexibleBody]:
    m, l = d.mass_per_length * d.rod, d.rod
    across = m * l**2 / 12
    inertia = np.diag([d.rotary_inertia * l, across, across])
    ends = {"root": np.zeros(3), "tip": np.array([l, 0, 0])}
    rod = rigid_body(d.name, mass=m, centre=ends["tip"] / 2, inertia=inertia, interfaces=ends)
    behind = {"root": np.zeros(3), "sleeve": np.array([-stage.rods * l, 0, 0])}
    leads = rigid_body(d.leads, mass=1.0, centre=np.zeros(3), inertia=np.zeros((3, 3)), interfaces=behind)
    leads = leads.with_(m=0.0, points=np.zeros((1, 3)), shape=np.zeros((1, 3, 0)))
    return {d.leads: leads} | {f"{d.name}{k}": rod for k in range(stage.rods, 0, -1)}


def _joints(d: Deployment, stage: Stage) -> Iterator[Joint]:
    n, welded = stage.rods, stage.rods - 1 if stage.locked else 0
    first = {"parent": d.parent, "child": d.leads, "position": d.position}
    yield _hinge(d, n, stage, rotation=d.frame, welded=stage.locked and n == 1, **first)
    yield _slider(d, stage)
    for k in range(n - 1, 0, -1):
        ends = {"parent": f"{d.name}{k + 1}.tip", "child": f"{d.name}{k}"}
        yield _hinge(d, k, stage, rotation=np.eye(3), welded=k == welded, **ends)


def _hinge(d: Deployment, k: int, stage: Stage, *, rotation: np.ndarray, welded: bool, **ends) -> Joint:
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
        back = TimeFunction([(until, _minus(what)) for until, what in _pieces(d.tension)])
        moves["elements"] = (HingeElement(damping=d.brake, drive=back),)
    ends = {"parent": f"{d.leads}.sleeve", "child": f"{d.name}{stage.rods}"}
    return Joint(name=d.name, type="prismatic", axis=np.array([1.0, 0, 0]), **ends, **moves)


def _pieces(function: TimeFunction) -> list[tuple]:
    source = function.source
    return [(FOREVER, source)] if isinstance(source, (str, int, float, np.number)) else list(source)


def _minus(what):
    if isinstance(what, str):
        return f"-({what})"
    return type(what)(-what.c, what.x) if hasattr(what, "c") else -what


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
    for k, (until, what) in enumerate(_pieces(d.law)):
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
    stage = Stage(rods=rods, locked=locked, law=stretches(d)[0][1] if d.law is not None else None)
    bend = start_angles(d, stage)[0]
    return stage.with_(turn=Rotation.from_euler("z", bend[-2] if rods > 1 else 0.0).as_matrix()) if locked else stage


def start_angles(d: Deployment, stage: Stage) -> np.ndarray:
    """Return angles and rates (2, rods) of the hinges at the start, those of rod 1 first.

    Rods are chords of the static shape ``w(x/L)``; where its length changes, material moves across at
    ``v (1 - x/L) w'(x)``.
    """
    (out, speed), inner = d.start, stage.inner(d)
    x = np.concatenate([[0.0], out - inner + d.rod * np.arange(stage.rods)])
    if not d.deflection or not out > 0:
        return np.zeros((2, stage.rods))
    w = d.deflection * (3 * out * x**2 - x**3) / (2 * out**3)
    across = speed * (1 - x / out) * d.deflection * (6 * out * x - 3 * x**2) / (2 * out**3)
    chord = np.diff(x)
    chord[0] = max(chord[0], EXACT * d.rod)
    across[0] = speed * w[1] / chord[0]  # the innermost rod slides along itself
    turned = np.array([np.arctan2(np.diff(w), chord), np.diff(across) / chord])
    if stage.locked and stage.rods > 1:
        turned[1, 0] = turned[1, 1]
    return np.diff(turned, axis=1, prepend=0.0)[:, ::-1]
