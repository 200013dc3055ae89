"""Joints: types, coordinates and initial values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

from modalprep.applies import Rule, refuse_idle
from modalprep.errors import InputError
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.joint_types import (
    AT_INTERFACE,
    JOINT_TYPES,
    KINDS,
    ROTATIONS,
    SCALARS,
    SPEEDS,
    TRANSLATIONS,
    WITH_QUATERNION,
    JointType,
)
from modalprep.multibody.model.time_function import TimeFunction, motions
from modalprep.records import CHANGED, Record, given, optional, start
from modalprep.suggest import refuse_unknown
from modalprep.vectors import as_rotation, vector

STARTS = {
    "angle": ROTATIONS,
    "rate": ROTATIONS,
    "displacement": TRANSLATIONS,
    "speed": TRANSLATIONS,
    "velocity": {name: 3 for name, steps in JOINT_TYPES.items() if KINDS[steps.kind].translations},
    "angular_velocity": {name: 3 for name, steps in JOINT_TYPES.items() if steps.kind in WITH_QUATERNION},
}
CONSTANTS = {
    constant.name: tuple(name for name, other in JOINT_TYPES.items() if constant in other.constants)
    for steps in JOINT_TYPES.values()
    for constant in steps.constants
}  # types of joints by the constants that they need
VECTORS = ("velocity", "angular_velocity")


def _elements(value: HingeElement | Sequence[HingeElement], what: str = "") -> tuple[HingeElement, ...]:
    return (value,) if isinstance(value, HingeElement) else tuple(value)


def _range(value: Sequence[float], what: str = "") -> tuple[float, float]:
    found = tuple(float(each) for each in value)
    if len(found) != 2 or not found[0] < found[1]:
        raise InputError(f"{what}: {list(found)} must be two numbers, the lower one first")
    return found[0], found[1]


@dataclass(frozen=True, eq=False, kw_only=True)
class Joint(Record):
    """The hinge between a parent's interface (or the ground) and the root interface of a child.

    Attributes
    ----------
    name : str
    type : str
        ``weld``, ``revolute``, ``prismatic``, ``spherical``, ``free``, or one of the following. ``screw``: rotation
        about `axis` with a translation of `pitch` along it for each turn. ``cylindrical``: translation along and
        rotation about `axis`. ``universal``: rotation about `axis` (fixed in the parent), then about `second_axis`
        (fixed in the child). ``gimbal``: rotations about `axis`, `second_axis` and the normal of both, for springs in
        three directions; singular where the second angle is 90 degrees. ``planar``: translation along `second_axis` and
        its normal in the plane, rotation about the plane's normal `axis`.
    parent : str
        ``ground`` or ``body.interface``.
    child : str
        ``body`` or ``body.interface``; the interface must be the body's root.
    axis : (3,)
        Hinge axis in the parent's frame.
    second_axis : (3,) or None
        Second axis of a universal joint, of a gimbal or first direction of a planar joint (these made normal to `axis`;
        None: any), in the parent's frame at zero angles.
    pitch : float
        m, of a screw joint: translation for each turn, positive for a right-handed thread.
    position : (3,)
        m: where a joint to the ground sits (inertial), or where the root of a free body starts, in the parent's frame.
    rotation : (3, 3), (4,) or ((3,), float)
        Matrix, quaternion w, x, y, z, or axis and angle (rad), kept as the matrix: child
        frame to parent frame at zero angle; of a spherical or free joint at the start.
    angle, rate : float, or (2,) of a universal joint, (3,) of a gimbal
        Initial rotation of a revolute, screw, cylindrical, universal, gimbal or planar joint, rad and rad/s.
    displacement, speed : float, or (2,) of a planar joint
        Initial translation of a prismatic, cylindrical or planar joint, m and m/s.
    velocity, angular_velocity : (3,)
        Initial values of a free body: velocity of its root and angular velocity, relative to the parent, in its own
        frame; `angular_velocity` also of a spherical joint.
    motion : TimeFunction or what makes one, a sequence of them, or None
        Prescribed angle of a revolute or screw joint, or displacement of a prismatic one; of a cylindrical, universal,
        gimbal or planar joint one for each coordinate, translations before rotations. Value and rate must be
        continuous.
    elements : tuple of HingeElement
        Springs, dampers, friction, limits and drives, one element for each speed (translations before rotations), or
        none; a single element needs no tuple. Spherical and free joints have neither stiffness nor limits: use a
        `Bushing`.
    keep_start : bool
        Keep the start values where closed loops allow it; the other joints move when the loops are closed.
    range : (float, float) or None
        Of a joint with one coordinate, rad or m: nothing keeps it there, but a run says when it leaves it.

    Examples
    --------
    >>> Joint(name="hinge", type="revolute", parent="ground", child="arm", axis=np.array([0, 0, 2.0])).axis
    array([0., 0., 1.])
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("axis",), needs=("type",), among=tuple(ROTATIONS | TRANSLATIONS)),
        Rule(("second_axis",), needs=("type",), among=tuple(name for name, x in JOINT_TYPES.items() if x.second_axis)),
        *(Rule((name,), needs=("type",), among=types) for name, types in CONSTANTS.items()),
        Rule(("position",), needs=("parent", "type"), among=("ground", "free"), advice=AT_INTERFACE),
        Rule(("keep_start",), needs=("type",), among=tuple(name for name, count in SPEEDS.items() if count)),
        Rule(("range",), needs=("type",), among=tuple(name for name, count in SCALARS.items() if count == 1)),
        Rule((*STARTS, "keep_start"), beside=("motion",), advice="the motion says where the joint is at the start"),
    )
    name: str
    type: JointType
    parent: str
    child: str
    axis: np.ndarray = given(converter=vector, default=(0.0, 0.0, 1.0))
    second_axis: np.ndarray | None = given(converter=optional(vector), default=None)
    pitch: float = 0.0
    position: np.ndarray = given(converter=vector, default=(0.0, 0.0, 0.0))
    rotation: np.ndarray = given(converter=as_rotation, default_factory=lambda: np.eye(3))
    angle: float | np.ndarray = given(converter=start, default=0.0)
    rate: float | np.ndarray = given(converter=start, default=0.0)
    displacement: float | np.ndarray = given(converter=start, default=0.0)
    speed: float | np.ndarray = given(converter=start, default=0.0)
    velocity: np.ndarray = given(converter=vector, default=(0.0, 0.0, 0.0))
    angular_velocity: np.ndarray = given(converter=vector, default=(0.0, 0.0, 0.0))
    motion: TimeFunction | tuple[TimeFunction, ...] | None = given(converter=optional(motions), default=None)
    elements: tuple[HingeElement, ...] = given(converter=_elements, default=())
    keep_start: bool = False
    range: tuple[float, float] | None = given(converter=optional(_range), default=None)

    def __post_init__(self) -> None:
        """Normalise the axes and check the values."""
        refuse_unknown(self.type, SCALARS, f"joint {self.name!r}: type")
        self._check_starts()
        self._convert(f"joint {self.name!r}: ")
        axis = self._direction("axis")
        if JOINT_TYPES[self.type].second_axis:
            object.__setattr__(self, "second_axis", self._second(axis))
        object.__setattr__(self, "axis", axis)
        self._check_constants()
        self._check_elements()
        self._check_motion()
        super().__post_init__()

    def with_(self, **changes: Any) -> Joint:
        """Return a copy with the named fields changed; after a change of start values the rest is not checked again.

        Returns
        -------
        Joint
            The copy.
        """
        if not changes.keys() <= STARTS.keys():
            return super().with_(**changes)
        found = self._unchecked(**changes, **{CHANGED: changes})
        found._check_starts()
        Record.__post_init__(found)
        return found

    def moves_like(self, other: Joint) -> bool:
        """Return whether another joint differs in its start values and its elements at most.

        Returns
        -------
        bool
            Whether both have the same axes and places, and connect the same bodies.
        """
        if self is other or not isinstance(other, Joint):
            return self is other
        pairs = ((getattr(self, name), getattr(other, name)) for name in GEOMETRY)
        return all(a is b or np.array_equal(a, b) for a, b in pairs)

    @property
    def motions(self) -> tuple[TimeFunction, ...]:
        """The prescribed motions of its coordinates, translations before rotations; empty for a joint without any."""
        return () if self.motion is None else self.motion if isinstance(self.motion, tuple) else (self.motion,)

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`axis`, `second_axis` (zero where there is none), the normal of both; in the parent's frame at zero."""
        second = np.zeros(3) if self.second_axis is None else self.second_axis
        return self.axis, second, np.cross(self.axis, second)

    def _check_starts(self) -> None:
        refuse_idle(self, f"joint {self.name!r}: ")
        for key, counts in STARTS.items():
            self._refuse_count(key, counts.get(self.type, 0))

    def _check_constants(self) -> None:
        for name, unit in JOINT_TYPES[self.type].constants:
            if getattr(self, name) == 0.0:
                raise InputError(f"joint {self.name!r}: a {self.type} joint needs a {name} ({unit})")

    def _check_motion(self) -> None:
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
        if self.elements and self.motion is not None:
            raise InputError(
                f"joint {self.name!r}: its motion is prescribed, so stiffness, damping, friction, limits and drives "
                "have no effect; leave out either them or the motion"
            )
        if self.elements and len(self.elements) != SPEEDS[self.type]:
            raise InputError(
                f"joint {self.name!r}: {len(self.elements)} hinge elements, but a {self.type} joint needs "
                f"{SPEEDS[self.type]}, one for each speed"
            )
        if not SCALARS[self.type] and any(element.needs_coordinate for element in self.elements):
            raise InputError(
                f"joint {self.name!r}: a {self.type} joint has no coordinate for stiffness or limits; use a bushing"
            )

    def _direction(self, key: str) -> np.ndarray:
        axis = getattr(self, key)
        if axis.shape != (3,):
            raise InputError(f"joint {self.name!r}: {key} {axis.tolist()} is not three numbers")
        length = np.linalg.norm(axis)
        if not length > 0:
            raise InputError(f"joint {self.name!r}: {key} {axis.tolist()} has no direction")
        return axis / length

    def _second(self, axis: np.ndarray) -> np.ndarray:
        if self.second_axis is None and JOINT_TYPES[self.type].second_axis == "needed":
            raise InputError(f"joint {self.name!r}: a {self.type} joint needs a second_axis")
        if self.second_axis is None:
            first = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
            return first / np.linalg.norm(first)
        second = self._direction("second_axis")
        if np.linalg.norm(np.cross(axis, second)) < 1e-6:
            raise InputError(f"joint {self.name!r}: second_axis {second.tolist()} is parallel to axis {axis.tolist()}")
        across = second - (second @ axis) * axis
        return second if JOINT_TYPES[self.type].second_axis == "needed" else across / np.linalg.norm(across)

    def _refuse_count(self, key: str, count: int) -> None:
        value = getattr(self, key)
        if isinstance(value, int | float) and not value:
            return
        value = np.asarray(value, dtype=float)
        if count == 0 and np.any(value):
            own = [name for name, counts in STARTS.items() if self.type in counts]
            has = f"; it starts with {', '.join(own)}" if own else ""
            raise InputError(f"joint {self.name!r}: a {self.type} joint has no {key}{has}")
        if count and value.shape not in ((count,), (count,) if key in VECTORS else ()):
            raise InputError(f"joint {self.name!r}: {key} {value.tolist()} must be {count} number(s)")
        if not np.all(np.isfinite(value)):
            raise InputError(f"joint {self.name!r}: {key} {value.tolist()} must be finite")


GEOMETRY = tuple(
    each.name for each in fields(Joint) if each.name not in (*STARTS, "keep_start", "elements", "range")
)  # fields that are the same of joints that move alike
