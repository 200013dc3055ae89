"""The types of joints: which translations and rotations each is made of. Everything else asks here.

A type whose motion is a sequence of steps about or along single axes needs a line in `JOINT_TYPES` and its name in
`JointType`; the solver makes a link for each step. Only spherical and free joints have equations of their own.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

JointType = Literal[
    "weld", "revolute", "prismatic", "screw", "cylindrical", "universal", "gimbal", "spherical", "planar", "free"
]
AT_INTERFACE = "the interface of the parent is its place, so leave it out"
TRAVEL, TURN, SCREW = "travel", "turn", "screw"
FIRST, SECOND, NORMAL = range(3)  # `axis`, `second_axis`, the normal of both


class Steps(NamedTuple):
    """A type of joint as a sequence of motions, inboard first.

    Attributes
    ----------
    motions : tuple of (str, int)
        TRAVEL, TURN or SCREW, and its axis.
    native_speeds : int
        Of a joint with equations of its own, which has no steps.
    second_axis : str
        "" where there is none, "needed", or "normal": made normal to `axis`, any one by default.
    """

    motions: tuple[tuple[str, int], ...] = ()
    native_speeds: int = 0
    second_axis: str = ""

    def count(self, *kinds: str) -> int:
        """Return the number of motions of some kinds."""
        return sum(motion in kinds for motion, _ in self.motions)


JOINT_TYPES: dict[str, Steps] = {
    "weld": Steps(),
    "revolute": Steps(((TURN, FIRST),)),
    "prismatic": Steps(((TRAVEL, FIRST),)),
    "screw": Steps(((SCREW, FIRST),)),
    "cylindrical": Steps(((TRAVEL, FIRST), (TURN, FIRST))),
    "universal": Steps(((TURN, FIRST), (TURN, SECOND)), second_axis="needed"),
    "gimbal": Steps(((TURN, FIRST), (TURN, SECOND), (TURN, NORMAL)), second_axis="normal"),
    "spherical": Steps(native_speeds=3),
    "planar": Steps(((TRAVEL, SECOND), (TRAVEL, NORMAL), (TURN, FIRST)), second_axis="normal"),
    "free": Steps(native_speeds=6),
}
ROTATIONS = {name: count for name, steps in JOINT_TYPES.items() if (count := steps.count(TURN, SCREW))}
TRANSLATIONS = {name: count for name, steps in JOINT_TYPES.items() if (count := steps.count(TRAVEL))}
SCALARS = {name: len(steps.motions) for name, steps in JOINT_TYPES.items()}
SPEEDS = {name: len(steps.motions) + steps.native_speeds for name, steps in JOINT_TYPES.items()}
