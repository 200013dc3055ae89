"""A multibody system: modal bodies in a tree of joints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.closures import Closure, Coupler, check_closures
from modalprep.multibody.depletion import Depletion, check_depletions
from modalprep.multibody.hinge import HingeElement
from modalprep.multibody.loads import Load, check_loads
from modalprep.multibody.orbit import CentralGravity, Conductor, Orbit
from modalprep.multibody.timefunction import TimeFunction
from modalprep.records import Record
from modalprep.suggest import suggestion

GROUND = "ground"
JointType = Literal[
    "weld", "revolute", "prismatic", "cylindrical", "universal", "gimbal", "spherical", "planar", "free"
]
TURNS = {"revolute": 1, "cylindrical": 1, "universal": 2, "gimbal": 3, "planar": 1}  # angles of a joint
TRAVELS = {"prismatic": 1, "cylindrical": 1, "planar": 2}  # displacements
SCALARS = {kind: TRAVELS.get(kind, 0) + TURNS.get(kind, 0) for kind in get_args(JointType)}  # both
SPEEDS = SCALARS | {"spherical": 3, "free": 6}


@dataclass(frozen=True, eq=False, kw_only=True)
class Joint(Record):
    """The hinge between a parent's interface (or the ground) and the root interface of a child.

    Attributes
    ----------
    name : str
    type : {"weld", "revolute", "prismatic", "cylindrical", "universal", "gimbal", "spherical", "planar", "free"}
        Cylindrical: travel along and turn about `axis`. Universal: turn about `axis` (fixed in the parent), then about
        `second_axis` (fixed in the child). Gimbal: turn about `axis`, `second_axis` and the normal of both, for springs
        in three directions; it locks where the second turn is a right angle. Planar: travel along `second_axis` and
        its normal in the plane, turn about the plane's normal `axis`.
    parent : str
        ``ground`` or ``body.interface``.
    child : str
        ``body`` or ``body.interface``; the interface must be the body's root.
    axis : (3,)
        Hinge axis in the parent's frame.
    second_axis : (3,) or None
        Second axis of a universal joint, of a gimbal or first direction of a planar joint (these made normal to `axis`;
        None: any), in the parent's frame at zero angles.
    position : (3,)
        m: where a joint to the ground sits (inertial), or where the root of a free body starts, in the parent's frame.
    rotation : (3, 3)
        Child frame to parent frame at zero angle; of a spherical or free joint at the start.
    angle, rate : float, or (2,) of a universal joint, (3,) of a gimbal
        Start of the turn of a revolute, cylindrical, universal, gimbal or planar joint, rad and rad/s.
    displacement, speed : float, or (2,) of a planar joint
        Start of the travel of a prismatic, cylindrical or planar joint, m and m/s.
    velocity, spin : (3,)
        Start of a free body: velocity of its root and angular velocity, relative to the parent, in its own frame;
        `spin` also of a spherical joint.
    motion : TimeFunction, a sequence of them, or None
        Prescribed angle of a revolute joint, or displacement of a prismatic one; of a cylindrical, universal, gimbal or
        planar joint one for each coordinate, travels before turns. Value and rate without jumps.
    elements : tuple of HingeElement
        Springs, dampers, friction, limits and drives, one element for each speed (travels before turns), or
        none; a single one needs no tuple. A spherical or free joint has no stiffness and limits: use a `Bushing`.
    hold : bool
        Keep the start values where closed loops allow it: other joints move when the loops are closed.

    Examples
    --------
    >>> Joint(name="hinge", type="revolute", parent="ground", child="arm", axis=np.array([0, 0, 2.0])).axis
    array([0., 0., 1.])
    """

    name: str
    type: JointType
    parent: str
    child: str
    axis: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    second_axis: np.ndarray | None = None
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    angle: float | np.ndarray = 0.0
    rate: float | np.ndarray = 0.0
    displacement: float | np.ndarray = 0.0
    speed: float | np.ndarray = 0.0
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    spin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    motion: TimeFunction | tuple[TimeFunction, ...] | None = None
    elements: tuple[HingeElement, ...] = ()
    hold: bool = False

    def __post_init__(self) -> None:
        """Normalise the axes and refuse what cannot be."""
        axis = self._direction("axis")
        if self.type in ("universal", "gimbal", "planar"):
            object.__setattr__(self, "second_axis", self._second(axis))
        for key, counts in (("angle", TURNS), ("rate", TURNS), ("displacement", TRAVELS), ("speed", TRAVELS)):
            self._refuse_count(key, counts.get(self.type, 0))
        object.__setattr__(self, "axis", axis)
        self._check_elements()
        self._check_motion()
        super().__post_init__()

    @property
    def motions(self) -> tuple[TimeFunction, ...]:
        """The prescribed motions of its coordinates, travels before turns; none of a joint that moves freely."""
        return () if self.motion is None else self.motion if isinstance(self.motion, tuple) else (self.motion,)

    def _check_motion(self) -> None:
        if isinstance(self.motion, list):
            object.__setattr__(self, "motion", tuple(self.motion))
        count = SCALARS[self.type]
        if self.motion is not None and count == 0:
            raise InputError(f"joint {self.name!r}: a {self.type} joint cannot have a prescribed motion")
        if self.motion is not None and len(self.motions) != count:
            raise InputError(
                f"joint {self.name!r}: {len(self.motions)} prescribed motions, but a {self.type} joint has {count} "
                "coordinates; give one for each"
            )
        for law in self.motions:
            law.refuse_jumps(f"joint {self.name!r}: the prescribed motion")

    def _check_elements(self) -> None:
        if isinstance(self.elements, HingeElement):
            object.__setattr__(self, "elements", (self.elements,))
        if self.elements and self.motion is not None:
            raise InputError(
                f"joint {self.name!r}: its motion is prescribed, so stiffness, damping, friction, limits and drives "
                "have no effect; leave them or the motion out"
            )
        if self.elements and len(self.elements) != SPEEDS[self.type]:
            raise InputError(
                f"joint {self.name!r}: {len(self.elements)} hinge elements, but a {self.type} joint moves in "
                f"{SPEEDS[self.type]} ways; give one for each"
            )
        if self.type in ("spherical", "free") and any(element.by_place for element in self.elements):
            raise InputError(
                f"joint {self.name!r}: a {self.type} joint has no coordinate for stiffness or limits; use a bushing"
            )

    def _direction(self, key: str) -> np.ndarray:
        axis = np.asarray(getattr(self, key), dtype=float)
        if not np.linalg.norm(axis) > 0:
            raise InputError(f"joint {self.name!r}: {key} {axis.tolist()} has no direction")
        return axis / np.linalg.norm(axis)

    def _second(self, axis: np.ndarray) -> np.ndarray:
        if self.second_axis is None and self.type == "universal":
            raise InputError(f"joint {self.name!r}: a universal joint needs a second_axis")
        if self.second_axis is None:
            first = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
            return first / np.linalg.norm(first)
        second = self._direction("second_axis")
        if np.linalg.norm(np.cross(axis, second)) < 1e-6:
            raise InputError(f"joint {self.name!r}: second_axis {second.tolist()} is parallel to axis {axis.tolist()}")
        across = second - (second @ axis) * axis
        return second if self.type == "universal" else across / np.linalg.norm(across)

    def _refuse_count(self, key: str, count: int) -> None:
        value = np.asarray(getattr(self, key), dtype=float)
        if np.any(value) and count == 0:
            raise InputError(f"joint {self.name!r}: a {self.type} joint has no {key}")
        if value.shape not in ((), (count,)):
            raise InputError(f"joint {self.name!r}: {key} {value.tolist()} must be {count} number(s)")


@dataclass(frozen=True, eq=False, kw_only=True)
class System(Record):
    """Bodies, the joint that carries each of them, gravity (m/s^2, inertial), loads, closed loops, depletions.

    With an `orbit` the ground is its local orbital frame: "inertial" axes and places of joints, loads and results are
    then those of that frame.

    Raises
    ------
    InputError
        When a name is unknown, a body has no joint or two, or the joints close a loop.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, gravity=np.array([0, -9.81, 0]),
    ...              joints=(Joint(name="hinge", type="revolute", parent="ground", child="arm.root"),))
    >>> arm.order
    ('arm',)
    """

    bodies: dict[str, FlexibleBody]
    joints: tuple[Joint, ...]
    gravity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    loads: tuple[Load, ...] = ()
    closures: tuple[Closure | Coupler, ...] = ()
    orbit: Orbit | None = None
    depletions: tuple[Depletion, ...] = ()

    def __post_init__(self) -> None:
        """Check the tree and what loads it."""
        gravity = np.asarray(self.gravity, dtype=float)
        if gravity.shape != (3,) or not np.all(np.isfinite(gravity)):
            raise InputError(f"gravity {self.gravity!r} is not three numbers in m/s^2")
        object.__setattr__(self, "gravity", gravity)
        super().__post_init__()
        if not self.bodies:
            raise InputError("the system has no bodies; name at least one under [bodies]")
        carried = Counter(self.child(joint) for joint in self.joints)
        for name in self.bodies:
            if carried[name] != 1:
                raise InputError(f"body {name!r} is the child of {carried[name]} joints; it needs exactly one")
        for joint in self.joints:
            self.parent(joint)
            self._refuse_other_frame(joint)
        _ = self.order
        check_loads(self.bodies, self.loads)
        check_closures(self.bodies, self.coordinate_counts, self.closures)
        check_depletions(self.bodies, self.depletions)
        self._check_orbit()

    def _check_orbit(self) -> None:
        conductors = [load.name for load in self.loads if isinstance(load, Conductor)]
        if conductors and (self.orbit is None or self.orbit.dipole is None):
            raise InputError(f"conductor {conductors[0]!r} needs a magnetic field: an orbit with a dipole")
        if self.orbit and (self.gravity.any() or any(isinstance(load, CentralGravity) for load in self.loads)):
            raise InputError("a system in orbit has the gravity of its orbit; leave out any other")

    def _refuse_other_frame(self, joint: Joint) -> None:
        body = self.bodies[self.child(joint)]
        if joint.type != "free" and not body.at_root:
            raise InputError(
                f"joint {joint.name!r} must hold body {body.name!r} at its root, but the body's frame has its "
                f"{body.frame}; bring it there with reroot(body, interface), or carry it by a free joint"
            )

    def child(self, joint: Joint) -> str:
        """Return the name of the joint's child body."""
        name, _, interface = joint.child.partition(".")
        body = self._body(name, joint, "child")
        if interface and interface != body.interface_name[0]:
            raise InputError(
                f"joint {joint.name!r}: child {joint.child!r} is not the root interface of {name!r}; "
                f"use {name}.{body.interface_name[0]}, or reduce the body with root = {interface!r}"
            )
        return name

    def parent(self, joint: Joint) -> tuple[str, int] | None:
        """Return the joint's parent body and interface number; None for the ground."""
        if joint.parent == GROUND:
            return None
        name, _, interface = joint.parent.partition(".")
        body = self._body(name, joint, "parent")
        if interface not in body.interface_name:
            known = suggestion(interface, body.interface_name, f"{name} has")
            raise InputError(f"joint {joint.name!r}: parent {joint.parent!r} names no interface; {known}")
        return name, body.interface_name.index(interface)

    def _body(self, name: str, joint: Joint, role: str) -> FlexibleBody:
        if name not in self.bodies:
            known = suggestion(name, self.bodies, "known are")
            raise InputError(f"joint {joint.name!r}: {role} body {name!r} does not exist; {known}")
        return self.bodies[name]

    def carrier(self, body: str) -> Joint:
        """Return the joint that carries a body."""
        return self._carriers[body]

    @cached_property
    def _carriers(self) -> dict[str, Joint]:
        return {self.child(joint): joint for joint in self.joints}

    @cached_property
    def order(self) -> tuple[str, ...]:
        """Bodies with every parent before its children."""
        number, children = {name: i for i, name in enumerate(self.bodies)}, {}
        for name, joint in self._carriers.items():
            children.setdefault((self.parent(joint) or (None,))[0], []).append(name)
        placed, level = {}, children.get(None, [])
        while level:
            level = sorted(level, key=number.__getitem__)
            placed |= dict.fromkeys(level)
            level = [child for name in level for child in children.get(name, ())]
        if len(placed) < len(self.bodies):
            left = ", ".join(name for name in self.bodies if name not in placed)
            raise InputError(f"bodies {left} hang on each other in a loop; one of them needs a joint to the ground")
        return tuple(placed)

    @property
    def coordinate_counts(self) -> dict[str, int]:
        """Number of travels and turns of each joint: the coordinates that a coupler can take."""
        return {joint.name: SCALARS[joint.type] for joint in self.joints}

    def at(self, t: float) -> System:
        """Return the system with the masses of time t (s) for ever; its gas goes on to leave."""
        changed = {each.body: each.at(self.bodies[each.body], t) for each in self.depletions}
        return self.with_(bodies=self.bodies | changed, depletions=()) if changed else self

    def conventional(self) -> System:
        """Return the system without geometric stiffness: the prematurely linearised theory."""
        return self._with_bodies(FlexibleBody.conventional)

    def ruthless(self) -> System:
        """Return the system with ruthlessly linearised bodies: see `FlexibleBody.ruthless`."""
        return self._with_bodies(FlexibleBody.ruthless)

    def _with_bodies(self, change: Callable[[FlexibleBody], FlexibleBody]) -> System:
        bodies = {name: change(body) for name, body in self.bodies.items()}
        depletions = tuple(each.with_(levels=tuple(map(change, each.levels))) for each in self.depletions)
        return self.with_(bodies=bodies, depletions=depletions)
