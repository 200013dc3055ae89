"""URDF files: the tree of their links and joints."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.formats.robots.files import located
from modalprep.formats.robots.tree import SINGLE, Base, Connection, Link, Picture, Robot, assemble
from modalprep.formats.robots.xml import number, numbers, plain
from modalprep.suggest import refuse_unknown
from modalprep.vectors import inertia_tensor

TYPES = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "fixed": "weld",
    "floating": "free",
    "planar": "planar",
}


def urdf_robot(root: ET.Element, folder: Path, base: Base, own: Collection[str]) -> Robot:
    """Return the tables of the root element of a URDF file; links named in `own` are bodies for themselves.

    References
    ----------
    Unified Robot Description Format, ROS (wiki.ros.org/urdf/XML).
    """
    elements = _named(root, "link")
    joints = _named(root, "joint")
    connections = [_connection(name, joint, elements) for name, joint in joints.items()]
    links = {name: _link(element, folder) for name, element in elements.items()}
    robot = assemble(links, connections, base, own, _top(elements, connections))
    for name, joint in joints.items():
        if name in robot.joints:
            _add_mimic(robot, name, joint)
    others = sorted({element.tag for element in root} - {"link", "joint", "material"})
    robot.dropped.extend([f"elements of the robot file that are left out: {', '.join(others)}"] if others else [])
    return robot


def _top(links: Mapping[str, ET.Element], connections: list[Connection]) -> str:
    """Return the link that no joint carries."""
    carried = [each.child for each in connections]
    tops = sorted(links.keys() - set(carried))
    if not links:
        raise InputError("it has no links; expand xacro files first")
    if len(tops) != 1 or len(set(carried)) < len(carried):
        raise InputError(f"its links {', '.join(tops) or 'all'} have no parent, or others two; a robot is one tree")
    return tops[0]


def _named(root: ET.Element, kind: str) -> dict[str, ET.Element]:
    """Return the links or joints by their names, in which a dot or slash becomes an underscore."""
    found: dict[str, ET.Element] = {}
    for element in root.findall(kind):
        name = plain(element.get("name", ""))
        if not name or name in found:
            raise InputError(f"a {kind} has no name of its own ({name!r}); rename it")
        found[name] = element
    return found


def _connection(name: str, joint: ET.Element, links: Mapping[str, ET.Element]) -> Connection:
    parent, child = (_end(name, joint, key, links) for key in ("parent", "child"))
    found = joint.get("type", "")
    refuse_unknown(found, TYPES, f"joint {name!r}: type")
    kind = TYPES[found]
    limit = joint.find("limit") if kind in SINGLE and found != "continuous" else None
    limits = None if limit is None else (number(limit, "lower", 0.0), number(limit, "upper", 0.0))
    extra = _forces(joint) if kind in SINGLE else {}
    return Connection(name, kind, parent, child, *_origin(joint), _axes(joint, kind), extra, limits)


def _end(name: str, joint: ET.Element, key: str, links: Mapping[str, ET.Element]) -> str:
    element = joint.find(key)
    end = plain("" if element is None else element.get("link", ""))
    refuse_unknown(end, links, f"joint {name!r}: {key} link")
    return end


def _axes(joint: ET.Element, kind: str) -> dict[str, np.ndarray]:
    if kind not in (*SINGLE, "planar"):
        return {}
    axis = joint.find("axis")
    return {"axis": np.array([1.0, 0.0, 0.0]) if axis is None else numbers(axis, "xyz", 3)}


def _link(link: ET.Element, folder: Path) -> Link:
    pictures = tuple(each for visual in link.findall("visual") for each in _pictures(visual, folder))
    inertial = link.find("inertial")
    if inertial is None:
        return Link(pictures=pictures)
    centre, turn = _origin(inertial)
    element = inertial.find("inertia")
    six = [number(element, key, 0.0) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
    mass = number(inertial.find("mass"), "value", 0.0)
    return Link(mass, centre, turn @ inertia_tensor(six) @ turn.T, pictures)


def _pictures(visual: ET.Element, folder: Path) -> list[Picture]:
    """Return the mesh of a visual; boxes, cylinders and spheres have none."""
    mesh = visual.find("geometry/mesh")
    if mesh is None:
        return []
    scale = numbers(mesh, "scale", 3) if mesh.get("scale") else np.ones(3)
    return [Picture(located(mesh.get("filename", ""), folder), scale, *_origin(visual))]


def _forces(joint: ET.Element) -> dict[str, Any]:
    dynamics = joint.find("dynamics")
    found = {key: number(dynamics, key, 0.0) for key in ("damping", "friction")}
    return {key: value for key, value in found.items() if value}


def _add_mimic(robot: Robot, name: str, joint: ET.Element) -> None:
    mimic = joint.find("mimic")
    if mimic is not None:
        factors = {name: 1.0, plain(mimic.get("joint", "")): -number(mimic, "multiplier", 1.0)}
        robot.couplers[f"{name}_mimic"] = {"factors": factors, "value": number(mimic, "offset", 0.0)}


def _origin(element: ET.Element) -> tuple[np.ndarray, np.ndarray]:
    """Return position and rotation of the ``origin`` of an element: roll, pitch and yaw about fixed axes."""
    origin = element.find("origin")
    if origin is None:
        return np.zeros(3), np.eye(3)
    from scipy.spatial.transform import Rotation  # not for systems without a robot

    turn = Rotation.from_euler("xyz", numbers(origin, "rpy", 3)).as_matrix()
    return numbers(origin, "xyz", 3), turn
