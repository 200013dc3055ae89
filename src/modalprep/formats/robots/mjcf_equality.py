"""Equality constraints of an MJCF file as closures and couplers."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.formats.robots.mjcf_joints import BodyJoint
from modalprep.formats.robots.tree import Robot
from modalprep.formats.robots.xml import numbers, plain, some
from modalprep.suggest import refuse_unknown

WORLD = "world"
At = Mapping[str, tuple[np.ndarray, np.ndarray]]


def add_equalities(
    root: ET.Element, robot: Robot, at: At, anchor: Mapping[str, np.ndarray], joints: Mapping[str, BodyJoint]
) -> None:
    """Add the equalities of a file to a robot, which then holds them exactly.

    Parameters
    ----------
    at : {link: (position, rotation)}
        In the world, in the configuration of the file.
    anchor : {link: (3,)}
        Origin of a link in the axes of its body of the file.
    joints : {joint of the file: BodyJoint}
    """
    for k, each in enumerate(each for equality in root.findall("equality") for each in equality):
        name = plain(each.get("name", "")) or f"{each.tag}{k + 1}"
        if each.get("active") == "false" or not _add(robot, name, each, at, anchor, joints):
            robot.dropped.append(f"equality {name!r} ({each.tag}) is left out")
    if robot.closures:
        robot.dropped.append("equalities hold exactly, where MuJoCo lets them give")


def _add(robot: Robot, name: str, each: ET.Element, at: At, anchor: Any, joints: Mapping[str, BodyJoint]) -> bool:
    """Add one equality; return whether there is such a thing here."""
    if each.tag == "joint":
        return _add_coupler(robot, name, each, joints)
    if each.tag not in ("connect", "weld"):
        return False
    a, b = (_link(each, number, at) for number in (1, 2))
    relative = _relative(each, at[a], at[b])
    point = np.zeros(3)
    if each.tag == "connect" and each.get("anchor"):
        point = numbers(each, "anchor", 3) - anchor[a]
        other = relative[1].T @ (point - relative[0])
    else:
        point, other = relative[0], np.zeros(3)
    ends = [_end(robot, f"{name}_a", a, point), _end(robot, f"{name}_b", b, other)]
    table: dict[str, Any] = {"type": "spherical" if each.tag == "connect" else "weld"}
    table |= {"a": ends[0][0], "b": ends[1][0]}
    grounded = [place for end, place in ends if end == "ground"]
    table |= {"position": grounded[0]} if grounded else {}
    if each.tag == "weld":
        turn = robot.places[a].rotation @ relative[1] @ robot.places[b].rotation.T
        table["rotation"] = {"matrix": turn.tolist()}
    robot.closures[name] = table
    return True


def _link(each: ET.Element, number: int, at: At) -> str:
    key = next((key for key in (f"body{number}", f"site{number}") if each.get(key)), "")
    name = plain(each.get(key, WORLD)) if key else WORLD
    name = f"{name}_site" if key.startswith("site") and f"{name}_site" in at else name
    refuse_unknown(name, at, f"equality {each.get('name')!r}: {key}")
    return name


def _relative(each: ET.Element, a: Any, b: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the place of link b in the axes of link a: of a weld as it says; sites meet; else as in the file."""
    if some(each, "relpose")[3:].any():
        raise InputError(f"equality {each.get('name')!r}: relpose is not read; place the bodies so that they fit")
    if each.get("site1"):
        return np.zeros(3), np.eye(3)
    return a[1].T @ (b[0] - a[0]), a[1].T @ b[1]


def _end(robot: Robot, name: str, link: str, point: np.ndarray) -> tuple[str, list[float]]:
    """Return the end of a closure at a point of a link, to which an interface is added, and its place."""
    place = robot.places[link].moved(point, np.eye(3))
    if place.body != "ground":
        robot.bodies[place.body]["interfaces"][name] = place.position.tolist()
    return "ground" if place.body == "ground" else f"{place.body}.{name}", place.position.tolist()


def _add_coupler(robot: Robot, name: str, each: ET.Element, joints: Mapping[str, BodyJoint]) -> bool:
    """Add a linear relation of two joints, or of one with a number."""
    coefficients = [*some(each, "polycoef"), *[0.0] * 5][:5] if each.get("polycoef") else [0.0, 1.0, 0.0, 0.0, 0.0]
    if any(coefficients[2:]):
        return False
    names = [plain(each.get(key, "")) for key in ("joint1", "joint2") if each.get(key)]
    for joint in names:
        refuse_unknown(joint, joints, f"equality {name!r}: joint")
    factors = {joints[joint].coordinate(joint): f for joint, f in zip(names, (1.0, -coefficients[1]), strict=False)}
    robot.couplers[name] = {"factors": {key: f for key, f in factors.items() if f}, "value": float(coefficients[0])}
    return True
