"""The joints of one body of an MJCF file as one joint of a system."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.formats.robots.mjcf_file import MjcfFile, one
from modalprep.formats.robots.xml import number, numbers, plain

ALIKE = 1e-9  # how far axes may be from parallel or square
FORCES = {"damping": "damping", "frictionloss": "friction", "stiffness": "stiffness"}
SPEEDS = {"free": 6, "spherical": 3}


@dataclass(frozen=True)
class BodyJoint:
    """What the joints of a body are together.

    Attributes
    ----------
    anchor : (3,)
        In the body's axes.
    coordinates : {joint of the file: its coordinate here, or None where there is one only}
    armature : {joint of the file: kg m^2 or kg}
    dropped : list of str
    """

    name: str
    kind: str
    anchor: np.ndarray = field(default_factory=lambda: np.zeros(3))
    axes: dict[str, np.ndarray] = field(default_factory=dict)
    extra: dict[str, Any] = field(default_factory=dict)
    limits: tuple[float, float] | None = None
    coordinates: dict[str, int | None] = field(default_factory=dict)
    armature: dict[str, float] = field(default_factory=dict)
    dropped: list[str] = field(default_factory=list)

    def coordinate(self, joint: str) -> str:
        """Return the name of the coordinate of a joint of the file."""
        k = self.coordinates[joint]
        return self.name if k is None else f"{self.name}.{k + 1}"


def body_joint(file: MjcfFile, body: str, joints: list[ET.Element]) -> BodyJoint:
    """Return the one joint of a body; its elements are complete.

    Raises
    ------
    InputError
        When there is no such joint.
    """
    if not joints:
        return BodyJoint(f"{body}_joint", "weld")
    names = [plain(joint.get("name", "")) or f"{body}_joint{k or ''}" for k, joint in enumerate(joints)]
    kinds = [joint.get("type", "hinge") for joint in joints]
    name = names[0] if len(joints) == 1 else f"{body}_joint"
    if kinds in (["free"], ["ball"]):
        return _turning(name, body, kinds[0], joints[0])
    axes = [_axis(joint, body) for joint in joints]
    order, kind, named = _kind(body, kinds, axes)
    joints, names = [joints[k] for k in order], [names[k] for k in order]
    found = BodyJoint(name, kind, _anchor(body, joints), named)
    found.coordinates.update({each: k if len(joints) > 1 else None for k, each in enumerate(names)})
    found.armature.update({each: a for each, joint in zip(names, joints, strict=True) if (a := one(joint, "armature"))})
    _add_forces(file, found, joints)
    return _limited(file, found, joints)


def _turning(name: str, body: str, kind: str, joint: ET.Element) -> BodyJoint:
    """Return a ball or free joint, which has dampers and friction only."""
    here = "free" if kind == "free" else "spherical"
    anchor = np.zeros(3) if kind == "free" else numbers(joint, "pos", 3)
    extra: dict[str, Any] = {}
    for key in ("damping", "frictionloss"):
        if value := one(joint, key):
            extra[FORCES[key]] = [value] * SPEEDS[here]
    lost = [key for key in ("stiffness", "armature") if one(joint, key)] + ["range"] * (joint.get("range") is not None)
    said = [f"{' and '.join(lost)} of the {kind} joint of body {body!r} are left out"] if lost else []
    return BodyJoint(name, here, anchor, extra=extra, dropped=said)


def _axis(joint: ET.Element, body: str) -> np.ndarray:
    axis = numbers(joint, "axis", 3) if joint.get("axis") else np.array([0.0, 0.0, 1.0])
    length = np.linalg.norm(axis)
    if not length > 0:
        raise InputError(f"a joint of body {body!r} has an axis of length 0")
    return axis / length


def _kind(body: str, kinds: list[str], axes: list[np.ndarray]) -> tuple[list[int], str, dict[str, np.ndarray]]:
    """Return the order of the joints, what they are together, and the axes of that."""
    first, last = axes[0], axes[-1]
    alike = all(np.allclose(a, first, atol=ALIKE) for a in axes)
    square = len(axes) == 3 and np.allclose(np.cross(axes[0], axes[1]), axes[2], atol=ALIKE)
    if kinds in (["hinge"], ["slide"]):
        return [0], "revolute" if kinds == ["hinge"] else "prismatic", {"axis": first}
    if sorted(kinds) == ["hinge", "slide"] and alike:
        return [kinds.index("slide"), kinds.index("hinge")], "cylindrical", {"axis": first}
    if kinds == ["hinge", "hinge"] and np.linalg.norm(np.cross(first, last)) > 1e-6:
        return [0, 1], "universal", {"axis": first, "second_axis": last}
    if kinds == ["hinge"] * 3 and square:
        return [0, 1, 2], "gimbal", {"axis": first, "second_axis": axes[1]}
    if kinds == ["slide", "slide", "hinge"] and square:
        return [0, 1, 2], "planar", {"axis": last, "second_axis": first}
    raise InputError(
        f"body {body!r} has the joints {', '.join(kinds)}, which together are no joint that a system has (a universal "
        "joint, a gimbal or slides that are square and right-handed, a slide along its hinge); put bodies with a mass "
        "between them"
    )


def _anchor(body: str, joints: list[ET.Element]) -> np.ndarray:
    places = [numbers(joint, "pos", 3) for joint in joints if joint.get("type", "hinge") == "hinge"]
    places = places or [numbers(joints[0], "pos", 3)]
    if not all(np.allclose(place, places[0], rtol=0, atol=ALIKE) for place in places):
        raise InputError(f"the hinges of body {body!r} do not meet in a point; put a body with a mass between them")
    return places[0]


def _add_forces(file: MjcfFile, found: BodyJoint, joints: list[ET.Element]) -> None:
    values = {here: [one(joint, key) for joint in joints] for key, here in FORCES.items()}
    values["free_position"] = [_from_start(file, joint, number(joint, "springref", 0.0)) for joint in joints]
    if not any(values["stiffness"]):
        del values["free_position"]
    for key, each in values.items():
        if any(each):
            found.extra[key] = each if len(each) > 1 else each[0]


def _from_start(file: MjcfFile, joint: ET.Element, value: float) -> float:
    """Return a coordinate of the file as one of the system, which counts from the configuration of the file."""
    value -= number(joint, "ref", 0.0)
    return file.angle(value) if joint.get("type", "hinge") == "hinge" else value


def _limited(file: MjcfFile, found: BodyJoint, joints: list[ET.Element]) -> BodyJoint:
    """Return a joint with its limits; of one with several coordinates they are left out."""
    limited = [joint for joint in joints if _has_limits(file, joint)]
    if len(joints) > 1 or not limited:
        said = [f"the ranges of joint {found.name!r}, which has several coordinates, are left out"] if limited else []
        found.dropped.extend(said)
        return found
    low, high = (_from_start(file, joints[0], value) for value in numbers(joints[0], "range", 2))
    return replace(found, limits=(low, high))


def _has_limits(file: MjcfFile, joint: ET.Element) -> bool:
    limited = joint.get("limited", "auto")
    given = joint.get("range") is not None and file.settings.get("autolimits", "true") == "true"
    return limited == "true" or (limited == "auto" and given)
