"""The types of joints, and the kinds of links that the solver makes of them. Everything else asks here.

A type whose motion is a sequence of steps about or along single axes is a line in `JOINT_TYPES` and its name in
`JointType`; the solver makes a link for each step, with massless links between. Only a type that no such sequence can
be is a kind of its own: a line in `KINDS`, and a file of `multibody/kernels/joints` with its equations.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

JointType = Literal[
    "weld", "revolute", "prismatic", "screw", "cylindrical", "universal", "gimbal", "spherical", "planar", "free"
]
ClosingJoint = Literal["weld", "revolute", "prismatic", "cylindrical", "universal", "spherical", "planar"]
AT_INTERFACE = "the interface of the parent is its place, so leave it out"


class JointKind(NamedTuple):
    """How one link moves.

    Attributes
    ----------
    file : str
        Of `multibody/kernels/joints`, with its equations.
    coordinates, speeds : int
        A coordinate for each speed, or a quaternion for three rotations.
    translations : int
        The first of its speeds (of a single axis about which it does not turn too); the others are rotations.
    quaternion : int
        Its place among the coordinates, after those of translations; -1: none.
    """

    file: str
    coordinates: int = 0
    speeds: int = 0
    translations: int = 0
    quaternion: int = -1

    @property
    def named(self) -> bool:
        """Whether it has one coordinate, with a name, whose rate is its speed."""
        return self.coordinates == self.speeds == 1


# SLIDING moves along its axis, PRESCRIBED along or about it, by the link's `along` and `about`.
WELD, REVOLUTE, SLIDING, SPHERICAL, FREE, PRESCRIBED = range(6)
KINDS = (
    JointKind("weld"),
    JointKind("single_axis", 1, 1),
    JointKind("single_axis", 1, 1, translations=1),
    JointKind("spherical", 4, 3, quaternion=0),
    JointKind("free", 7, 6, translations=3, quaternion=3),
    JointKind("prescribed"),
)
TRANSLATIONAL = tuple(kind.translations for kind in KINDS)
NAMED = tuple(code for code, kind in enumerate(KINDS) if kind.named)
WITH_QUATERNION = tuple(code for code, kind in enumerate(KINDS) if kind.quaternion >= 0)

TRAVEL, TURN = "travel", "turn"
FIRST, SECOND, NORMAL = range(3)  # `axis`, `second_axis`, the normal of both


class Motion(NamedTuple):
    """One step of a joint: along or about one of its axes.

    Attributes
    ----------
    kind : str
        TRAVEL or TURN.
    axis : int
        FIRST, SECOND or NORMAL.
    pitch : str
        The constant of the joint that is its travel for each turn; "": it does not travel.
    offset : tuple of (str, int) or None
        The constant that is its distance from the step before, and the axis of the distance; None: at the same point.
    """

    kind: str
    axis: int
    pitch: str = ""
    offset: tuple[str, int] | None = None


class Constant(NamedTuple):
    """A number of a type of joint that is not zero: an attribute of `Joint` and a key of a pipeline file."""

    name: str
    unit: str


class Steps(NamedTuple):
    """A type of joint as a sequence of motions, inboard first.

    Attributes
    ----------
    motions : tuple of Motion
    kind : int
        Of `KINDS`, the link's where there are no motions.
    second_axis : str
        "" where there is none, "needed", or "normal": made normal to `axis`, any one by default.
    constants : tuple of Constant
        Numbers that it needs beside its axes.
    constrained : tuple of (str, str) or None
        Displacements and rotations that it constrains where it closes a loop, in the frame whose z is the axis; beside
        them the angle between two axes that are "needed". None: it cannot close a loop.
    """

    motions: tuple[Motion, ...] = ()
    kind: int = WELD
    second_axis: str = ""
    constants: tuple[Constant, ...] = ()
    constrained: tuple[str, str] | None = None

    @property
    def translations(self) -> int:
        """Number of its speeds that are translations, which come before the rotations."""
        return KINDS[self.kind].translations + sum(motion.kind == TRAVEL for motion in self.motions)

    @property
    def speeds(self) -> int:
        """Number of its speeds."""
        return KINDS[self.kind].speeds + len(self.motions)

    @property
    def has_closing_axis(self) -> bool:
        """Whether `axis` matters to what it constrains."""
        return self.constrained is not None and (self.second_axis == "needed" or not {*self.constrained} <= {"xyz", ""})


JOINT_TYPES: dict[str, Steps] = {
    "weld": Steps(constrained=("xyz", "xyz")),
    "revolute": Steps((Motion(TURN, FIRST),), constrained=("xyz", "xy")),
    "prismatic": Steps((Motion(TRAVEL, FIRST),), constrained=("xy", "xyz")),
    "screw": Steps((Motion(TURN, FIRST, pitch="pitch"),), constants=(Constant("pitch", "m for each turn"),)),
    "cylindrical": Steps((Motion(TRAVEL, FIRST), Motion(TURN, FIRST)), constrained=("xy", "xy")),
    "universal": Steps((Motion(TURN, FIRST), Motion(TURN, SECOND)), second_axis="needed", constrained=("xyz", "")),
    "gimbal": Steps((Motion(TURN, FIRST), Motion(TURN, SECOND), Motion(TURN, NORMAL)), second_axis="normal"),
    "spherical": Steps(kind=SPHERICAL, constrained=("xyz", "")),
    "planar": Steps(
        (Motion(TRAVEL, SECOND), Motion(TRAVEL, NORMAL), Motion(TURN, FIRST)),
        second_axis="normal",
        constrained=("z", "xy"),
    ),
    "free": Steps(kind=FREE),
}
SCALARS = {name: len(steps.motions) for name, steps in JOINT_TYPES.items()}
TRANSLATIONS = {name: count for name, steps in JOINT_TYPES.items() if steps.motions and (count := steps.translations)}
ROTATIONS = {name: n for name, steps in JOINT_TYPES.items() if (n := SCALARS[name] - TRANSLATIONS.get(name, 0))}
SPEEDS = {name: steps.speeds for name, steps in JOINT_TYPES.items()}
