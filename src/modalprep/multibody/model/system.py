"""A multibody system: modal bodies in a tree of joints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.stations.record import refuse_stations
from modalprep.drawing import Animated
from modalprep.errors import InputError
from modalprep.multibody.model.constraints import Closure, Coupler, check_closures
from modalprep.multibody.model.depletion import Depletion, check_depletions
from modalprep.multibody.model.environment import CentralGravity, Conductor, Orbit
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_types import SCALARS
from modalprep.multibody.model.loads import Callback, Load, PointForce, TwoEnded, check_loads, locate
from modalprep.notebook import html_table
from modalprep.records import Record, by_name, given, several
from modalprep.suggest import refuse_name, refuse_other, refuse_unknown, suggestion
from modalprep.vectors import vector
from modalprep.verdicts.notes import with_warnings

ON_INTERFACES = (PointForce, TwoEnded, Callback)  # loads that act on interfaces alone
LOSES_MASS = "body {0!r} loses mass: the second-order terms of its modal mass (T) are neglected"
WITHOUT_STATIONS = "body {0!r} is without its stations, its modes alone move it: {1} does not know stations yet"


@dataclass(frozen=True, eq=False, kw_only=True)
class System(Record, Animated):
    """Bodies, the joint that carries each of them, and what acts on them.

    Attributes
    ----------
    bodies : {name: FlexibleBody}
    joints : tuple of Joint
        One for each body: the joint that carries it, from the ground or from an interface of another body.
    gravity : (3,)
        m/s^2, inertial.
    loads : tuple of PointForce, Bushing and other loads
    closures : tuple of Closure or Coupler
        Constraints that close loops, and relations between coordinates of joints.
    orbit : Orbit or None
        With an orbit the ground is its local orbital frame: "inertial" axes and positions of joints, loads and results
        then refer to that frame.
    depletions : tuple of Depletion
        Bodies that lose mass.
    notes : tuple of str
        What the model neglects; the result message repeats it.

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

    bodies: dict[str, FlexibleBody] = given(converter=by_name)
    joints: tuple[Joint, ...] = given(converter=several)
    gravity: np.ndarray = given(converter=vector, default=(0.0, 0.0, 0.0))
    loads: tuple[Load, ...] = given(converter=several, default=())
    closures: tuple[Closure | Coupler, ...] = given(converter=several, default=())
    orbit: Orbit | None = None
    depletions: tuple[Depletion, ...] = given(converter=several, default=())
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the tree, its loads and its constraints."""
        self._convert()
        if self.gravity.shape != (3,) or not np.all(np.isfinite(self.gravity)):
            raise InputError(f"gravity {self.gravity.tolist()} is not three numbers in m/s^2")
        super().__post_init__()
        self._refuse_other_types()
        if not self.bodies:
            raise InputError("the system has no bodies; name at least one under [bodies]")
        carried = Counter(self.child(joint) for joint in self.joints)
        for name in self.bodies:
            refuse_name(name, "body", "./")
            if carried[name] != 1:
                raise InputError(f"body {name!r} is the child of {carried[name]} joints; it needs exactly one")
        for joint in self.joints:
            self.parent(joint)
            self._refuse_other_frame(joint)
        _ = self.order
        check_loads(self.bodies, self.loads)
        check_closures(self.bodies, self.coordinate_counts, self.closures)
        check_depletions(self.bodies, self.depletions)
        losing = {each.body: self.bodies[each.body] for each in self.depletions}
        plain = {name: body.with_(T=None) for name, body in losing.items() if body.T is not None}
        if plain:
            object.__setattr__(self, "bodies", self.bodies | plain)
            object.__setattr__(self, "notes", (*self.notes, *(LOSES_MASS.format(name) for name in plain)))
        self._check_orbit()
        self._leave_idle_stations()
        self._refuse_with_stations()

    def __repr__(self) -> str:
        """Numbers of bodies, joints, loads and closures, and the number of modes."""
        bodies = len(self.bodies)
        modes = sum(body.n for body in self.bodies.values())
        parts = [f"{bodies} bod{'y' if bodies == 1 else 'ies'} with {modes} mode{'s' * (modes != 1)}"]
        named = {"joint": self.joints, "load": self.loads, "closure": self.closures, "depletion": self.depletions}
        parts += [f"{len(values)} {name}{'s' * (len(values) != 1)}" for name, values in named.items() if values]
        return with_warnings(f"System({', '.join(parts)}{', in orbit' if self.orbit else ''})", self.notes)

    def _repr_html_(self) -> str:
        """Return the joints with the bodies they carry as an HTML table."""
        carried = [(self.carrier(name), self.bodies[name]) for name in self.order]
        rows = [[a.name, a.type, a.parent, a.child, float(body.m), body.n] for a, body in carried]
        return html_table(repr(self), ["joint", "type", "parent", "child", "mass of the child, kg", "modes"], rows)

    def with_(self, **changes: Any) -> System:
        """Return a copy with the named fields changed; joints that move as before are not checked again.

        Returns
        -------
        System
            The copy.
        """
        given = changes["joints"] if list(changes) == ["joints"] else None
        if type(given) is tuple and len(given) == len(self.joints) and all(map(Joint.moves_like, self.joints, given)):
            return self._unchecked(joints=given, _carriers={self.child(joint): joint for joint in given})
        return super().with_(**changes)

    def _refuse_other_types(self) -> None:
        refuse_other("System: bodies", Mapping, self.bodies)
        for name, body in self.bodies.items():
            refuse_other(f"System: body {name!r}", FlexibleBody, body)
        for key in ("joints", "loads", "closures", "depletions"):
            if not isinstance(getattr(self, key), Sequence):
                raise InputError(f"System: {key} must be a list or tuple, not {type(getattr(self, key)).__name__}")
        for joint in self.joints:
            refuse_other("System: a joint", Joint, joint)

    def _check_orbit(self) -> None:
        conductors = [load.name for load in self.loads if isinstance(load, Conductor)]
        if conductors and (self.orbit is None or self.orbit.dipole is None):
            raise InputError(f"conductor {conductors[0]!r} needs a magnetic field: an orbit with a dipole")
        if self.orbit and (self.gravity.any() or any(isinstance(load, CentralGravity) for load in self.loads)):
            raise InputError("a system in orbit has the gravity of its orbit; leave out any other")

    def _leave_idle_stations(self) -> None:
        """Take the stations that bodies have for large deflections only from those whose loads do not know them."""
        for name, body in self.bodies.items():
            if body.stations is None or not body.stations.idle_below:
                continue
            unknown = self._without_stations(name)
            if unknown:
                plain = self.bodies | {name: body.with_(stations=None)}
                object.__setattr__(self, "bodies", plain)
                object.__setattr__(self, "notes", (*self.notes, WITHOUT_STATIONS.format(name, unknown)))

    def _without_stations(self, name: str) -> str:
        """Return what acts on a body and does not know stations; empty where nothing does."""
        if self.orbit:
            return f"the orbit of body {name!r}"
        if any(each.body == name for each in self.depletions):
            return f"a depletion of body {name!r}"
        for load in self.loads:
            if not isinstance(load, ON_INTERFACES) and getattr(load, "body", name) == name:
                return f"load {getattr(load, 'name', 'central gravity')!r} on body {name!r}"
        return ""

    def _refuse_with_stations(self) -> None:
        """Refuse what does not know bodies of large deflection."""
        for name, body in self.bodies.items():
            unknown = self._without_stations(name) if body.stations is not None else ""
            if unknown:
                refuse_stations(unknown, body.stations)

    def _refuse_other_frame(self, joint: Joint) -> None:
        body = self.bodies[self.child(joint)]
        if joint.type != "free" and not body.at_root:
            raise InputError(
                f"joint {joint.name!r} must hold body {body.name!r} at its root, but the body's frame has its "
                f"{body.frame}; bring it there with reroot(body, interface), or carry it by a free joint"
            )

    def child(self, joint: Joint) -> str:
        """Return the name of the joint's child body.

        Returns
        -------
        str
            Name of a body.
        """
        name, _, interface = joint.child.partition(".")
        refuse_unknown(name, self.bodies, f"joint {joint.name!r}: child body")
        root = self.bodies[name].interface_name[0]
        if interface and interface not in (known := self.bodies[name].interface_name):
            raise InputError(
                f"joint {joint.name!r}: child {name!r} has no interface {interface!r}; "
                + suggestion(interface, known, "it has")
            )
        if interface and interface != root:
            raise InputError(
                f"joint {joint.name!r}: child {joint.child!r} is not the root interface of {name!r}; "
                f"use {name}.{root}, or reduce the body with root = {interface!r}"
            )
        return name

    def parent(self, joint: Joint) -> tuple[str, int] | None:
        """Return the joint's parent body and interface number; None for the ground.

        Returns
        -------
        (str, int) or None
            Name of the body and number of its interface, from 0.
        """
        return locate(self.bodies, joint.parent, f"joint {joint.name!r}, its parent")

    def carrier(self, body: str) -> Joint:
        """Return the joint that carries a body.

        Returns
        -------
        Joint
            The one whose child is the body.
        """
        return self._carriers[body]

    @cached_property
    def _carriers(self) -> dict[str, Joint]:
        return {self.child(joint): joint for joint in self.joints}

    @cached_property
    def order(self) -> tuple[str, ...]:
        """Bodies with every parent before its children."""
        number = {name: i for i, name in enumerate(self.bodies)}
        children = {}
        for name, joint in self._carriers.items():
            children.setdefault((self.parent(joint) or (None,))[0], []).append(name)
        placed = {}
        level = children.get(None, [])
        while level:
            level = sorted(level, key=number.__getitem__)
            placed |= dict.fromkeys(level)
            level = [child for name in level for child in children.get(name, ())]
        if len(placed) < len(self.bodies):
            left = ", ".join(name for name in self.bodies if name not in placed)
            raise InputError(f"bodies {left} form a closed chain of parents; one of them needs a joint to the ground")
        return tuple(placed)

    @cached_property
    def coordinate_counts(self) -> dict[str, int]:
        """Number of translations and rotations of each joint: the coordinates that a coupler can use."""
        return {joint.name: SCALARS[joint.type] for joint in self.joints}

    def with_masses_at(self, t: float) -> System:
        """Return the system with the masses of time t (s) for ever; its gas goes on to leave.

        Returns
        -------
        System
            Without depletions.
        """
        changed = {each.body: each.body_at(self.bodies[each.body], t) for each in self.depletions}
        return self.with_(bodies=self.bodies | changed, depletions=()) if changed else self

    def conventional(self) -> System:
        """Return the system without geometric stiffness: the prematurely linearised theory.

        Returns
        -------
        System
            Of the same joints, loads and closures.

        References
        ----------
        Theory 4.5.
        """
        return self._with_bodies(FlexibleBody.conventional)

    def ruthless(self) -> System:
        """Return the system with ruthlessly linearised bodies: see `FlexibleBody.ruthless`.

        Returns
        -------
        System
            Of the same joints, loads and closures.

        References
        ----------
        A. K. Banerjee, Flexible Multibody Dynamics, Wiley 2016, section 6.7; theory 4.5.
        """
        return self._with_bodies(FlexibleBody.ruthless)

    def _with_bodies(self, change: Callable[[FlexibleBody], FlexibleBody]) -> System:
        bodies = {name: change(body) for name, body in self.bodies.items()}
        depletions = tuple(each.with_(levels=tuple(map(change, each.levels))) for each in self.depletions)
        return self.with_(bodies=bodies, depletions=depletions)
