"""Joints: what kinds there are, how they move, where they start."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.records import Record
from modalprep.suggest import refuse_unknown
from modalprep.vectors import as_rotation

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
    rotation : (3, 3), (4,) or ((3,), float)
        Matrix, quaternion w, x, y, z, or axis and angle (rad), kept as the matrix: child
        frame to parent frame at zero angle; of a spherical or free joint at the start.
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
        refuse_unknown(self.type, SCALARS, f"joint {self.name!r}: type")
        axis = self._direction("axis")
        if self.type in ("universal", "gimbal", "planar"):
            object.__setattr__(self, "second_axis", self._second(axis))
        for key, counts in (("angle", TURNS), ("rate", TURNS), ("displacement", TRAVELS), ("speed", TRAVELS)):
            self._refuse_count(key, counts.get(self.type, 0))
        object.__setattr__(self, "axis", axis)
        object.__setattr__(self, "rotation", as_rotation(self.rotation, f"joint {self.name!r}: rotation"))
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
