"""A multibody system: modal bodies in a tree of joints."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.motion import Motion
from modalprep.records import Record
from modalprep.suggest import suggestion

GROUND = "ground"


@dataclass(frozen=True, eq=False, kw_only=True)
class Joint(Record):
    """The hinge between a parent's interface (or the ground) and the root interface of a child.

    Attributes
    ----------
    name : str
    type : {"weld", "revolute", "free"}
        A free joint has the ground as its parent.
    parent : str
        ``ground`` or ``body.interface``.
    child : str
        ``body`` or ``body.interface``; the interface must be the body's root.
    axis : (3,)
        Hinge axis of a revolute joint, in the parent's frame.
    position : (3,)
        m, inertial: where a joint to the ground sits, or where a free body starts.
    rotation : (3, 3)
        Child frame to parent frame at zero angle.
    angle, rate : float
        Start of a revolute joint, rad and rad/s.
    velocity, spin : (3,)
        Start of a free body: velocity of its root and angular velocity, in its own frame.
    motion : Motion or None
        Prescribed angle of a revolute joint.

    Examples
    --------
    >>> Joint(name="hinge", type="revolute", parent="ground", child="arm", axis=np.array([0, 0, 2.0])).axis
    array([0., 0., 1.])
    """

    name: str
    type: Literal["weld", "revolute", "free"]
    parent: str
    child: str
    axis: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    angle: float = 0.0
    rate: float = 0.0
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    spin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    motion: Motion | None = None

    def __post_init__(self) -> None:
        """Normalise the axis and refuse what cannot be."""
        axis = np.asarray(self.axis, dtype=float)
        if not np.linalg.norm(axis) > 0:
            raise InputError(f"joint {self.name!r}: axis {axis.tolist()} has no direction")
        if self.type == "free" and self.parent != GROUND:
            raise InputError(f"joint {self.name!r}: a free joint starts at the ground, not at {self.parent!r}")
        if self.motion is not None and self.type != "revolute":
            raise InputError(f"joint {self.name!r}: only a revolute joint can have a prescribed motion")
        object.__setattr__(self, "axis", axis / np.linalg.norm(axis))
        super().__post_init__()


@dataclass(frozen=True, eq=False, kw_only=True)
class System(Record):
    """Bodies, the joint that carries each of them, and gravity (m/s^2, inertial).

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

    def __post_init__(self) -> None:
        """Check the tree."""
        super().__post_init__()
        if not self.bodies:
            raise InputError("the system has no bodies; name at least one under [bodies]")
        carried = [self.child(joint) for joint in self.joints]
        for name in self.bodies:
            if carried.count(name) != 1:
                raise InputError(f"body {name!r} is the child of {carried.count(name)} joints; it needs exactly one")
        for joint in self.joints:
            self.parent(joint)
            self._refuse_other_frame(joint)
        _ = self.order

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
        return next(joint for joint in self.joints if self.child(joint) == body)

    @property
    def order(self) -> tuple[str, ...]:
        """Bodies with every parent before its children."""
        placed: list[str] = []
        while len(placed) < len(self.bodies):
            ready = [b for b in self.bodies if b not in placed and self._parent_name(b) in (None, *placed)]
            if not ready:
                left = ", ".join(b for b in self.bodies if b not in placed)
                raise InputError(f"bodies {left} hang on each other in a loop; one of them needs a joint to the ground")
            placed += ready
        return tuple(placed)

    def _parent_name(self, body: str) -> str | None:
        parent = self.parent(self.carrier(body))
        return parent[0] if parent else None

    def conventional(self) -> System:
        """Return the system without geometric stiffness: the prematurely linearised theory."""
        return self.with_(bodies={name: body.conventional() for name, body in self.bodies.items()})
