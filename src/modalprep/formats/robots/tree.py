"""The tree of a robot: links with mass, and the joints that carry them, as tables of a system."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.vectors import impossible_inertia, inertia_tensor, skew

Base = Literal["fixed", "free"]
ROOT = "root"  # interface of each link, at its origin
SINGLE = ("revolute", "prismatic")  # joints of one coordinate


@dataclass(frozen=True)
class Robot:
    """The links and joints of a file as tables, with the keys of a pipeline file.

    Attributes
    ----------
    links : tuple of str
        All of the file.
    bodies, joints, couplers, closures : {name: table}
        Numbers in SI units. An interface of a link has the name of the joint that it carries, or of a link that is
        fixed to it.
    limits : {joint: {"lower": .., "upper": ..}}
        Of joints of one coordinate, also the `range` of their tables.
    pictures : {body: list of Picture}
    places : {link: Place}
        Where each link is, in its body or in the ground.
    gravity : list of float
        m/s^2; empty where the file has none.
    dropped : list of str
        What of the file is not in the tables.
    """

    links: tuple[str, ...] = ()
    bodies: dict[str, dict[str, Any]] = field(default_factory=dict)
    joints: dict[str, dict[str, Any]] = field(default_factory=dict)
    couplers: dict[str, dict[str, Any]] = field(default_factory=dict)
    closures: dict[str, dict[str, Any]] = field(default_factory=dict)
    limits: dict[str, dict[str, float]] = field(default_factory=dict)
    pictures: dict[str, list[Picture]] = field(default_factory=dict)
    places: dict[str, Place] = field(default_factory=dict)
    gravity: list[float] = field(default_factory=list)
    dropped: list[str] = field(default_factory=list)


class Picture(NamedTuple):
    """A file with the surface of a link, its scale, and where it is in the link's or body's axes."""

    file: str
    scale: np.ndarray
    position: np.ndarray
    rotation: np.ndarray


class Place(NamedTuple):
    """Where a link is: in a body, or in the ground, at a position and with a rotation in that body's axes."""

    body: str
    position: np.ndarray
    rotation: np.ndarray

    def moved(self, position: np.ndarray, rotation: np.ndarray) -> Place:
        """Return the place after a translation and rotation in its own axes."""
        return Place(self.body, self.position + self.rotation @ position, self.rotation @ rotation)


@dataclass(frozen=True)
class Link:
    """Mass (kg), centre of mass (m) and inertia about it (kg m^2) in the axes of a link, and its pictures."""

    mass: float = 0.0
    centre: np.ndarray = field(default_factory=lambda: np.zeros(3))
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    pictures: tuple[Picture, ...] = ()


@dataclass(frozen=True)
class Connection:
    """A joint: the link that it carries, its place in the axes of the parent link, axes in its own, and the rest.

    Attributes
    ----------
    kind : str
        Type of the joint, as in a pipeline file.
    axes : {key of the joint's table: (3,)}
        In the axes of the child at zero.
    extra : dict
        Further keys of the joint's table.
    limits : (float, float) or None
        Of a joint of one coordinate, m or rad.
    """

    name: str
    kind: str
    parent: str
    child: str
    position: np.ndarray
    rotation: np.ndarray
    axes: Mapping[str, np.ndarray] = field(default_factory=dict)
    extra: Mapping[str, Any] = field(default_factory=dict)
    limits: tuple[float, float] | None = None


def assemble(
    links: Mapping[str, Link], connections: list[Connection], base: Base, own: Collection[str], root: str
) -> Robot:
    """Return the tables of a tree; links named in `own` are bodies for themselves.

    A link that is fixed to another adds its mass to it and becomes an interface, unless one of both is in `own`.

    Raises
    ------
    InputError
        When a moving link has no mass, an inertia is physically impossible, or nothing moves.
    """
    robot = Robot(links=tuple(links))
    robot.places[root] = _root(robot, root, links[root], base, own)
    below: dict[str, list[Connection]] = {}
    for each in connections:
        below.setdefault(each.parent, []).append(each)
    todo = [root]
    while todo:
        for each in below.get(todo.pop(0), []):
            if _attach(robot, each, links[each.child], own, each.child not in below):
                todo.append(each.child)
    if not robot.bodies:
        raise InputError("all its links are fixed to the ground, so that nothing moves")
    for name, table in robot.bodies.items():
        if why := impossible_inertia(inertia_tensor(table["inertia"])):
            raise InputError(f"the inertia of link {name!r} is physically impossible: {why}; correct it")
    return robot


def _root(robot: Robot, name: str, link: Link, base: Base, own: Collection[str]) -> Place:
    """Add the root link where it moves or is a body of the caller's; return its place."""
    if base == "fixed" and name not in own:
        return Place("ground", np.zeros(3), np.eye(3))
    if link.mass == 0 and name not in own:
        raise InputError(f"root link {name!r} has no mass, so that it cannot be free; give it an <inertial>")
    _add_body(robot, name, link)
    kind = "weld" if base == "fixed" else "free"
    robot.joints["base"] = {"type": kind, "parent": "ground", "child": f"{name}.{ROOT}"}
    return Place(name, np.zeros(3), np.eye(3))


def _attach(robot: Robot, new: Connection, link: Link, own: Collection[str], leaf: bool) -> bool:
    """Add a joint and the link that it carries; return whether they are in the system."""
    place = robot.places[new.parent].moved(new.position, new.rotation)
    apart = new.child in own or (place.body in own and link.mass > 0)
    if new.kind == "weld" and not apart:
        robot.places[new.child] = place
        _fix(robot, place, new.child, link)
        return True
    if link.mass == 0 and new.child not in own:
        if leaf:
            robot.dropped.append(f"link {new.child!r} moves and has no mass: it is left out, with joint {new.name!r}")
            return False
        raise InputError(
            f"link {new.child!r} moves and has no mass; give it an <inertial>, or make joint {new.name!r} fixed"
        )
    robot.joints[new.name] = _table(robot, place, new)
    robot.places[new.child] = Place(new.child, np.zeros(3), np.eye(3))
    _add_body(robot, new.child, link)
    return True


def _add_body(robot: Robot, name: str, link: Link) -> None:
    table = _mass_table(link.mass, link.centre, link.inertia)
    robot.bodies[name] = table | {"interfaces": {ROOT: [0.0, 0.0, 0.0]}}
    robot.pictures[name] = list(link.pictures)


def _fix(robot: Robot, place: Place, name: str, link: Link) -> None:
    """Add a fixed link to the body that it is part of: its mass, its pictures, and an interface at its origin."""
    if place.body == "ground":
        return
    table = robot.bodies[place.body]
    _add_interface(robot, place, name)
    for each in link.pictures:
        robot.pictures[place.body].append(each._replace(**_moved(place, each.position, each.rotation)))
    own = _moved(place, link.centre, np.eye(3))
    turned = own["rotation"] @ link.inertia @ own["rotation"].T
    parts = [
        (table["mass"], np.array(table["centre"]), inertia_tensor(table["inertia"])),
        (link.mass, own["position"], turned),
    ]
    mass = sum(m for m, _, _ in parts)
    if mass > 0:
        centre = sum((m * c for m, c, _ in parts), np.zeros(3)) / mass
        J = sum((J - m * skew(c - centre) @ skew(c - centre) for m, c, J in parts), np.zeros((3, 3)))
        table |= _mass_table(mass, centre, J)


def _add_interface(robot: Robot, place: Place, name: str) -> None:
    interfaces = robot.bodies[place.body]["interfaces"]
    if name in interfaces:
        raise InputError(f"link {place.body!r} carries two things called {name!r} (joint, link or site); rename one")
    interfaces[name] = place.position.tolist()


def _moved(place: Place, position: np.ndarray, rotation: np.ndarray) -> dict[str, np.ndarray]:
    _, position, rotation = place.moved(position, rotation)
    return {"position": position, "rotation": rotation}


def _mass_table(mass: float, centre: np.ndarray, J: np.ndarray) -> dict[str, Any]:
    six = (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
    return {"mass": float(mass), "centre": centre.tolist(), "inertia": [float(value) for value in six]}


def _table(robot: Robot, place: Place, new: Connection) -> dict[str, Any]:
    """Return the table of a joint, and add what belongs to it: interface of the parent, and limits."""
    table: dict[str, Any] = {"type": new.kind, "child": f"{new.child}.{ROOT}"}
    table["rotation"] = {"matrix": place.rotation.tolist()}
    if place.body == "ground":
        table |= {"parent": "ground", "position": place.position.tolist()}
    else:
        _add_interface(robot, place, new.name)
        table["parent"] = f"{place.body}.{new.name}"
    table |= {key: (place.rotation @ axis).tolist() for key, axis in new.axes.items()}
    if new.limits is not None:
        robot.limits[new.name] = dict(zip(("lower", "upper"), new.limits, strict=True))
        table["range"] = list(new.limits)
    return table | dict(new.extra)
