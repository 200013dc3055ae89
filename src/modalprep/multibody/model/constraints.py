"""Loop closures and motion constraints of a system: loop-closing joints, couplers, prescribed positions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

import numpy as np

from modalprep.applies import Rule, refuse_idle
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.model.joint_types import JOINT_TYPES, ClosingJoint
from modalprep.multibody.model.loads import GROUND, locate
from modalprep.multibody.model.time_function import TimeFunction, TimeFunctionLike, motion
from modalprep.records import Record, given, optional
from modalprep.suggest import refuse_name, refuse_unknown
from modalprep.vectors import as_rotation, vector

ClosureType = Literal[ClosingJoint, "point_on_line", "point_on_plane", "distance", "position"]
WITH_FRICTION = ("point_on_line", "point_on_plane")
WITH_AXIS = tuple(name for name, steps in JOINT_TYPES.items() if steps.has_closing_axis)
WITH_SECOND_AXIS = tuple(name for name in WITH_AXIS if JOINT_TYPES[name].second_axis == "needed")
WITHOUT_AXIS = tuple(name for name, steps in JOINT_TYPES.items() if steps.constrained and name not in WITH_AXIS)


def _path(values: Sequence[TimeFunctionLike | None], what: str = "") -> tuple[TimeFunction | None, ...]:
    return tuple(map(optional(motion), values))


REACH = 1.6  # rad, and in sizes of the system: about a quarter turn


@dataclass(frozen=True, eq=False, kw_only=True)
class Closure(Record):
    """A joint or condition that closes a loop of the tree, between two interfaces or an interface and the ground.

    Attributes
    ----------
    name : str
    type : str
        A joint as in the tree: ``weld``, ``revolute``, ``prismatic``, ``cylindrical``, ``universal``, ``spherical``,
        ``planar``. ``point_on_line``: b's point on a line through a's along `axis`. ``point_on_plane``: on the plane
        through a's point normal to `axis`. ``distance``: a massless rod with spherical ends. ``position``: b's point
        at `path`, seen from a.
    a, b : str
        ``body.interface``, or one of them ``ground``.
    axis, second_axis : (3,)
        In a's axes; second axis of a universal joint, fixed in b. The conditions of a weld or a spherical closure are
        written along and across `axis`; their results do not depend on it, but a system that moves in one plane is
        evaluated in this plane, which is faster, only where `axis` is its normal.
    position : (3,)
        m, inertial: the end on the ground.
    rotation : (3, 3), (4,) or ((3,), float)
        Matrix, quaternion w, x, y, z, or axis and angle (rad), kept as the matrix: b's
        axes to a's axes at zero angle. Only what the type holds fast counts.
    length : TimeFunction or what makes one, or None
        m, of a distance; None: as at the start.
    path : (3,) of TimeFunction or what makes one, or None
        m, of a position, in a's axes; a component None is free.
    friction_coefficient, transition_velocity : float
        Regularised Coulomb friction of a point on a line or plane: the force ``friction_coefficient N tanh(v /
        transition_velocity)`` (m/s) opposes the sliding of b's point. In an impact the tangential impulse is at most
        ``friction_coefficient`` times the normal one; below that the point sticks.
    active : bool
        Whether it is active from the start; otherwise an `Event` may activate it.
    reach : float
        How far closing the loops at the start may move a joint: rad, or times the size of the system (its largest body
        between interfaces). The largest of all closures and couplers counts for all joints.

    Raises
    ------
    InputError
        When the ends are the same, values do not belong to the type, or `reach` is not positive.

    Examples
    --------
    >>> rod = Closure(name="rod", type="distance", a="rocker.end", b="ground", position=np.array([1.0, 0, 0]), length=2)
    >>> rod.position.tolist()
    [1.0, 0.0, 0.0]
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("axis",), needs=("type",), among=(*WITHOUT_AXIS, *WITH_AXIS, *WITH_FRICTION)),
        Rule(("rotation",), needs=("type",), among=("weld", *WITH_AXIS)),
        Rule(("second_axis",), needs=("type",), among=WITH_SECOND_AXIS),
        Rule(("position",), needs=("a", "b"), among=(GROUND,), advice="it is the place of an end on the ground"),
        Rule(("length",), needs=("type",), among=("distance",)),
        Rule(("path",), needs=("type",), among=("position",)),
        Rule(("friction_coefficient",), needs=("type",), among=WITH_FRICTION),
        Rule(("transition_velocity",), needs=("friction_coefficient",)),
    )
    name: str
    type: ClosureType
    a: str
    b: str
    axis: np.ndarray = given(converter=vector, default=(0.0, 0.0, 1.0))
    second_axis: np.ndarray | None = given(converter=optional(vector), default=None)
    position: np.ndarray = given(converter=vector, default=(0.0, 0.0, 0.0))
    rotation: np.ndarray = given(converter=as_rotation, default_factory=lambda: np.eye(3))
    length: TimeFunction | None = given(converter=optional(motion), default=None)
    path: tuple[TimeFunction | None, ...] | None = given(converter=optional(_path), default=None)
    friction_coefficient: float = 0.0
    transition_velocity: float = 1e-3
    active: bool = True
    reach: float = REACH

    def __post_init__(self) -> None:
        """Read functions of time, normalise axes."""
        refuse_unknown(self.type, get_args(ClosureType), f"{self._what}: type")
        if self.a == self.b:
            raise InputError(f"{self._what} joins {self.a!r} to itself; name two different ends")
        refuse_idle(self, f"{self._what}: ")
        self._convert(f"{self._what}: ")
        for key in ("axis", "second_axis"):
            value = getattr(self, key)
            if value is not None:
                object.__setattr__(self, key, self._direction(key, value))
        if self.type in WITH_SECOND_AXIS and self.second_axis is None:
            raise InputError(f"{self._what}: a {self.type} joint needs a second_axis")
        self._check_functions()
        self._check_friction()
        _check_reach(self._what, self.reach)
        super().__post_init__()

    def _check_friction(self) -> None:
        if not 0 <= self.friction_coefficient < float("inf"):
            raise InputError(f"{self._what}: friction_coefficient = {self.friction_coefficient:g} must not be negative")
        if not 0 < self.transition_velocity < float("inf"):
            raise InputError(f"{self._what}: transition_velocity = {self.transition_velocity:g} must be positive")

    @property
    def _what(self) -> str:
        return f"closure {self.name!r}"

    def _direction(self, key: str, axis: np.ndarray) -> np.ndarray:
        if axis.shape != (3,) or not np.linalg.norm(axis) > 0:
            raise InputError(f"{self._what}: {key} {axis.tolist()} has no direction")
        return axis / np.linalg.norm(axis)

    def _check_functions(self) -> None:
        if self.length is not None:
            self.length.refuse_jumps(f"{self._what}: the length")
            if not self.length(0.0)[0] > 0:
                first = self.length(0.0)[0]
                raise InputError(f"{self._what}: length {first:g} must be positive; use a spherical closure")
        if self.type == "position":
            if self.path is None or len(self.path) != 3 or all(value is None for value in self.path):
                raise InputError(f"{self._what}: a position needs a path of three components, not all of them free")
            for function in self.path:
                if function is not None:
                    function.refuse_jumps(f"{self._what}: the path")


@dataclass(frozen=True, eq=False, kw_only=True)
class Coupler(Record):
    """A linear relation of joint coordinates, ``sum factor x = value``: gears, rack and pinion, screw, a driven joint.

    Attributes
    ----------
    name : str
    factors : dict of str to float
        By ``joint``, or ``joint.k`` for coordinate k = 1, 2, ... of a joint with several, translations before
        rotations.
    value : TimeFunction or what makes one, or None
        m or rad, as the sum; None: as at the start, or at the event that activates it.
    active : bool
        Whether it is active from the start; otherwise an `Event` may activate it.
    reach : float
        How far closing the loops at the start may move a joint: rad, or times the size of the system (its largest body
        between interfaces). The largest of all closures and couplers counts for all joints.

    Raises
    ------
    InputError
        When there is no factor, one is zero or not finite, or `reach` is not positive.

    Examples
    --------
    >>> gear = Coupler(name="gear", factors={"pinion": 3.0, "wheel": 1.0})  # reverse, a third of the speed
    >>> gear.value is None
    True
    """

    name: str
    factors: Mapping[str, float]
    value: TimeFunction | None = given(converter=optional(motion), default=None)
    active: bool = True
    reach: float = REACH

    def __post_init__(self) -> None:
        """Check the factors, read the function of time."""
        what = f"coupler {self.name!r}"
        if not self.factors:
            raise InputError(f"{what} has no factors; name the joints that it couples")
        for joint, factor in self.factors.items():
            if factor == 0 or not np.isfinite(factor):
                raise InputError(f"{what}: factor {factor:g} of joint {joint!r} must be a number other than 0")
        _check_reach(what, self.reach)
        self._convert(f"{what}: ")
        if self.value is not None:
            self.value.refuse_jumps(f"{what}: the value")
        super().__post_init__()


def _check_reach(what: str, reach: float) -> None:
    if not reach > 0:
        raise InputError(f"{what}: reach = {reach:g} must be positive")


def check_closures(
    bodies: Mapping[str, FlexibleBody], counts: Mapping[str, int], closures: tuple[Closure | Coupler, ...]
) -> None:
    """Refuse closures with unknown ends; `counts` is the number of coordinates of each joint that a coupler can use."""
    for what, names in (("joint", counts), ("closure", [closure.name for closure in closures])):
        for name in names:
            refuse_name(name, what)
    for name, count in Counter(closure.name for closure in closures).items():
        if count > 1:
            raise InputError(f"two closures are called {name!r}; give each its own name")
    for closure in closures:
        if isinstance(closure, Coupler):
            for text in closure.factors:
                coordinate_of(text, counts, f"coupler {closure.name!r}")
        elif {locate(bodies, end, f"closure {closure.name!r}") for end in (closure.a, closure.b)} == {None}:
            raise InputError(f"closure {closure.name!r}: both ends are the {GROUND}; name 'body.interface'")


def coordinate_of(text: str, counts: Mapping[str, int], what: str) -> tuple[str, int]:
    """Return joint and coordinate (from 0) of ``joint`` or ``joint.k``.

    Raises
    ------
    InputError
        When there is no such coordinate; `what` starts the message.

    Examples
    --------
    >>> coordinate_of("wrist.2", {"wrist": 2}, "coupler 'c'")
    ('wrist', 1)
    """
    joint, _, number = text.partition(".")
    refuse_unknown(joint, counts, f"{what}: joint")
    count = counts[joint]
    if not number and count == 1:
        return joint, 0
    if number.isdigit() and 1 <= int(number) <= count:
        return joint, int(number) - 1
    if count == 0:
        raise InputError(f"{what}: joint {joint!r} has no coordinate to couple")
    raise InputError(f"{what}: {text!r} is not a coordinate; joint {joint!r} has {count}, name it {joint}.1 and so on")
