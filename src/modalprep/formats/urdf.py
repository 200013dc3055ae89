"""Robots in URDF files: their links as rigid bodies, and their joints."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.rigid import rigid_body
from modalprep.errors import InputError
from modalprep.multibody.model.constraints import Coupler
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.system import System
from modalprep.suggest import refuse_missing, refuse_unknown
from modalprep.vectors import impossible_inertia, inertia_tensor, skew

Base = Literal["fixed", "free"]
TYPES = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "fixed": "weld",
    "floating": "free",
    "planar": "planar",
}
ROOT = "root"  # interface of each link, at its origin
MOVED = 1e-6  # of the size of a robot: how far an interface of another body may be from the robot's


@dataclass(frozen=True)
class Robot:
    """The links and joints of a file as tables, with the keys of a pipeline file.

    Attributes
    ----------
    links : tuple of str
        All of the file.
    bodies, joints, couplers : {name: table}
        Numbers in SI units. An interface of a link has the name of the joint that it carries, or of a link that is
        fixed to it.
    limits : {joint: {"lower": .., "upper": ..}}
    dropped : list of str
        What of the file is not in the tables, beside the limits.
    """

    links: tuple[str, ...] = ()
    bodies: dict[str, dict[str, Any]] = field(default_factory=dict)
    joints: dict[str, dict[str, Any]] = field(default_factory=dict)
    couplers: dict[str, dict[str, Any]] = field(default_factory=dict)
    limits: dict[str, dict[str, float]] = field(default_factory=dict)
    dropped: list[str] = field(default_factory=list)

    def notes(self, stopped: Collection[str] = ()) -> tuple[str, ...]:
        """Return what of the file is not in the system, in which the joints `stopped` have their limits."""
        free = [name for name in self.limits if name not in stopped]
        said = (
            f"the limits of {len(free)} joints are no stops, as the robot file has no stiffness for them: give limits "
            "with a stiffness where a joint may reach them"
        )
        return (*([said] if free else []), *self.dropped)


class Place(NamedTuple):
    """Where a link is: in a body, or in the ground, at a position and with a rotation in that body's axes."""

    body: str
    position: np.ndarray
    rotation: np.ndarray

    def moved(self, element: ET.Element) -> Place:
        """Return the place after the ``origin`` of an element."""
        position, rotation = _origin(element)
        return Place(self.body, self.position + self.rotation @ position, self.rotation @ rotation)


class Connection(NamedTuple):
    """A joint with the link that it carries."""

    name: str
    joint: ET.Element
    parent: str
    child: str
    link: ET.Element

    @property
    def kind(self) -> str:
        """Type of the joint, as in a pipeline file."""
        found = self.joint.get("type", "")
        refuse_unknown(found, TYPES, f"joint {self.name!r}: type")
        return TYPES[found]


def read_urdf(path: str | Path, *, bodies: Mapping[str, FlexibleBody] | None = None, base: Base = "fixed") -> System:
    """Return the multibody system of a URDF file; links that are named may be flexible bodies.

    Each link that moves against its parent becomes a body of its name, with its root at the origin of the link, in
    whose axes it is, and an interface for each joint that it carries. Links that are fixed to it add their mass, and
    become interfaces of their names; where one of both is among `bodies`, a weld joins them. Damping and friction of
    the joints, and joints that follow others (``mimic``, a `Coupler`), are kept. The limits of the joints are no stops,
    because the file has no stiffness for them; a note of the system says so.

    Parameters
    ----------
    path : str or Path
    bodies : {link: FlexibleBody}, optional
        In place of rigid links, with the same interfaces at the same places.
    base : {"fixed", "free"}
        Whether the root link is fixed to the ground, or free.

    Returns
    -------
    System
        Without gravity, which the file does not have.

    Raises
    ------
    InputError
        When the file is missing or damaged, a moving link has no mass, an inertia is physically impossible, or a body
        replaces no link or has its interfaces elsewhere.

    References
    ----------
    Unified Robot Description Format, ROS (wiki.ros.org/urdf/XML).

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "arm.urdf"
    >>> _ = file.write_text('''<robot name="arm"><link name="base"/><link name="arm"><inertial><origin xyz="0.5 0 0"/>
    ... <mass value="2"/><inertia ixx="0" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    ... <joint name="shoulder" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
    ... </robot>''')
    >>> read_urdf(file)
    System(1 body with 0 modes, 1 joint)
    """
    own = dict(bodies or {})
    robot = read_robot(Path(path), base, own)
    for name in own:
        refuse_unknown(name, robot.links, f"{path}: link")
    refuse_moved(robot, own, str(path))
    return System(
        bodies={name: own.get(name) or _link(name, table) for name, table in robot.bodies.items()},
        joints=tuple(_joint(name, table) for name, table in robot.joints.items()),
        closures=tuple(Coupler(name=name, **table) for name, table in robot.couplers.items()),
        notes=robot.notes(),
    )


def _link(name: str, table: dict[str, Any]) -> FlexibleBody:
    values: dict[str, Any] = table | {"inertia": inertia_tensor(table["inertia"])}
    return rigid_body(name, **values)


def _joint(name: str, table: dict[str, Any]) -> Joint:
    forces = {key: table[key] for key in ("damping", "friction") if key in table}
    others = {key: value for key, value in table.items() if key not in forces}
    rotation = others.pop("rotation", {"matrix": np.eye(3)})["matrix"]
    return Joint(name=name, rotation=rotation, elements=HingeElement(**forces) if forces else (), **others)


def refuse_moved(robot: Robot, bodies: Mapping[str, FlexibleBody], where: str) -> None:
    """Refuse a body that lacks an interface of the link that it replaces, or has it at another place."""
    places = [place for table in robot.bodies.values() for place in table["interfaces"].values()]
    size = float(np.max(np.linalg.norm(places, axis=1)))
    for name, body in bodies.items():
        for interface, place in list(robot.bodies.get(name, {}).get("interfaces", {}).items())[1:]:
            refuse_unknown(interface, body.interface_name, f"{where}: body {name!r} as a link: interface")
            found = body.interface_position[body.interface_name.index(interface)]
            if np.linalg.norm(found - place) > MOVED * size:
                raise InputError(
                    f"{where}: interface {interface!r} of link {name!r} is at {place} from the link's origin, that of "
                    f"its body at {found.round(9).tolist()} from its root; the root must be the origin of the link, "
                    "with its axes"
                )


def read_robot(path: Path, base: Base = "fixed", own: Collection[str] = ()) -> Robot:
    """Return the links and joints of a URDF file as tables; links named in `own` are bodies for themselves.

    Raises
    ------
    InputError
        As `read_urdf`.
    """
    refuse_unknown(base, get_args(Base), "base of a robot")
    with _reading(path) as root:
        return _tables(root, base, own)


@contextmanager
def _reading(path: Path) -> Iterator[ET.Element]:
    """Give the root element of a file; what is wrong in it is said with its path."""
    refuse_missing(path, "robot file")
    try:
        root = ET.parse(path).getroot()
        if root.tag != "robot":
            raise InputError(f"{path} has the element {root.tag!r} and no robot; expand xacro files first")
        yield root
    except InputError as error:
        said = str(error)
        raise InputError(said if str(path) in said else f"{path}: {said}") from None
    except ET.ParseError as error:
        raise InputError(f"{path} is no XML file: {error}") from None


def _tables(root: ET.Element, base: Base, own: Collection[str]) -> Robot:
    links = _named(root, "link")
    robot = Robot(links=tuple(links))
    connections = [_connection(name, joint, links) for name, joint in _named(root, "joint").items()]
    carried = [each.child for each in connections]
    tops = sorted(links.keys() - set(carried))
    if not links:
        raise InputError("it has no links; expand xacro files first")
    if len(tops) != 1 or len(set(carried)) < len(carried):
        raise InputError(f"its links {', '.join(tops) or 'all'} have no parent, or others two; a robot is one tree")
    parents = {each.parent for each in connections}
    todo = [(_root(robot, tops[0], links[tops[0]], base, own), tops[0])]
    while todo:
        place, link = todo.pop(0)
        for each in (each for each in connections if each.parent == link):
            found = _attach(robot, place, each, own, each.child not in parents)
            todo += [] if found is None else [(found, each.child)]
    if not robot.bodies:
        raise InputError("all its links are fixed to the ground; a robot that flies has base = 'free'")
    for name, table in robot.bodies.items():
        if why := impossible_inertia(inertia_tensor(table["inertia"])):
            raise InputError(f"the inertia of link {name!r} is physically impossible: {why}; correct it")
    others = sorted({element.tag for element in root} - {"link", "joint", "material"})
    robot.dropped.extend([f"elements of the robot file that are left out: {', '.join(others)}"] if others else [])
    return robot


def _named(root: ET.Element, kind: str) -> dict[str, ET.Element]:
    """Return the links or joints by their names, in which a dot or slash becomes an underscore."""
    found: dict[str, ET.Element] = {}
    for element in root.findall(kind):
        name = _plain(element.get("name", ""))
        if not name or name in found:
            raise InputError(f"a {kind} has no name of its own ({name!r}); rename it")
        found[name] = element
    return found


def _plain(name: str) -> str:
    return name.strip().replace(".", "_").replace("/", "_")


def _connection(name: str, joint: ET.Element, links: Mapping[str, ET.Element]) -> Connection:
    ends = []
    for key in ("parent", "child"):
        element = joint.find(key)
        ends.append(_plain("" if element is None else element.get("link", "")))
        refuse_unknown(ends[-1], links, f"joint {name!r}: {key} link")
    parent, child = ends
    return Connection(name, joint, parent, child, links[child])


def _root(robot: Robot, name: str, link: ET.Element, base: Base, own: Collection[str]) -> Place:
    """Add the root link where it moves or is a body of the caller's; return its place."""
    if base == "fixed" and name not in own:
        return Place("ground", np.zeros(3), np.eye(3))
    if _mass(link) == 0 and name not in own:
        raise InputError(f"root link {name!r} has no mass, so that it cannot be free; give it an <inertial>")
    robot.bodies[name] = _body(link)
    kind = "weld" if base == "fixed" else "free"
    robot.joints["base"] = {"type": kind, "parent": "ground", "child": f"{name}.{ROOT}"}
    return Place(name, np.zeros(3), np.eye(3))


def _attach(robot: Robot, parent: Place, new: Connection, own: Collection[str], leaf: bool) -> Place | None:
    """Add a joint and the link that it carries; return the place of the link, None where it is left out."""
    place = parent.moved(new.joint)
    apart = new.child in own or (place.body in own and _mass(new.link) > 0)
    if new.kind == "weld" and not apart:
        _fix(robot, place, new)
        return place
    if _mass(new.link) == 0 and new.child not in own:
        if leaf:
            robot.dropped.append(f"link {new.child!r} moves and has no mass: it is left out, with joint {new.name!r}")
            return None
        raise InputError(
            f"link {new.child!r} moves and has no mass; give it an <inertial>, or make joint {new.name!r} fixed"
        )
    robot.joints[new.name] = _table(robot, place, new)
    robot.bodies[new.child] = _body(new.link)
    return Place(new.child, np.zeros(3), np.eye(3))


def _fix(robot: Robot, place: Place, new: Connection) -> None:
    """Add a fixed link to the body that it is part of: its mass, and an interface at its origin."""
    if place.body == "ground":
        return
    table = robot.bodies[place.body]
    table["interfaces"][new.child] = place.position.tolist()
    parts = [(table["mass"], np.array(table["centre"]), inertia_tensor(table["inertia"])), _part(new.link, place)]
    mass = sum(m for m, _, _ in parts)
    if mass > 0:
        centre = sum((m * c for m, c, _ in parts), np.zeros(3)) / mass
        J = sum((J - m * skew(c - centre) @ skew(c - centre) for m, c, J in parts), np.zeros((3, 3)))
        table |= _mass_table(mass, centre, J)


def _part(link: ET.Element, place: Place) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre of mass and inertia about it of a link, in the axes of its place."""
    inertial = link.find("inertial")
    if inertial is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    at = place.moved(inertial)
    element = inertial.find("inertia")
    six = [_number(element, key, 0.0) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
    return _mass(link), at.position, at.rotation @ inertia_tensor(six) @ at.rotation.T


def _body(link: ET.Element) -> dict[str, Any]:
    table = _mass_table(*_part(link, Place("", np.zeros(3), np.eye(3))))
    return table | {"interfaces": {ROOT: [0.0, 0.0, 0.0]}}


def _mass_table(mass: float, centre: np.ndarray, J: np.ndarray) -> dict[str, Any]:
    six = (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
    return {"mass": float(mass), "centre": centre.tolist(), "inertia": [float(value) for value in six]}


def _table(robot: Robot, place: Place, new: Connection) -> dict[str, Any]:
    """Return the table of a joint, and add what belongs to it: interface of the parent, limits and coupler."""
    table: dict[str, Any] = {"type": new.kind, "child": f"{new.child}.{ROOT}"}
    table["rotation"] = {"matrix": place.rotation.tolist()}
    if place.body == "ground":
        table |= {"parent": "ground", "position": place.position.tolist()}
    else:
        robot.bodies[place.body]["interfaces"][new.name] = place.position.tolist()
        table["parent"] = f"{place.body}.{new.name}"
    if new.kind in ("revolute", "prismatic", "planar"):
        axis = new.joint.find("axis")
        own = np.array([1.0, 0.0, 0.0]) if axis is None else _numbers(axis, "xyz", 3)
        table["axis"] = (place.rotation @ own).tolist()
    if new.kind in ("revolute", "prismatic"):
        table |= _forces(new.joint)
        _add_limits(robot, new)
        _add_mimic(robot, new)
    return table


def _forces(joint: ET.Element) -> dict[str, float]:
    dynamics = joint.find("dynamics")
    found = {key: _number(dynamics, key, 0.0) for key in ("damping", "friction")}
    return {key: value for key, value in found.items() if value}


def _add_limits(robot: Robot, new: Connection) -> None:
    limit = new.joint.find("limit")
    if limit is not None and new.joint.get("type") != "continuous":
        robot.limits[new.name] = {key: _number(limit, key, 0.0) for key in ("lower", "upper")}


def _add_mimic(robot: Robot, new: Connection) -> None:
    mimic = new.joint.find("mimic")
    if mimic is not None:
        factors = {new.name: 1.0, _plain(mimic.get("joint", "")): -_number(mimic, "multiplier", 1.0)}
        robot.couplers[f"{new.name}_mimic"] = {"factors": factors, "value": _number(mimic, "offset", 0.0)}


def _mass(link: ET.Element) -> float:
    mass = link.find("inertial/mass")
    return 0.0 if mass is None else _number(mass, "value", 0.0)


def _origin(element: ET.Element) -> tuple[np.ndarray, np.ndarray]:
    """Return position and rotation of the ``origin`` of an element: roll, pitch and yaw about fixed axes."""
    origin = element.find("origin")
    if origin is None:
        return np.zeros(3), np.eye(3)
    from scipy.spatial.transform import Rotation  # not for systems without a robot

    turn = Rotation.from_euler("xyz", _numbers(origin, "rpy", 3)).as_matrix()
    return _numbers(origin, "xyz", 3), turn


def _numbers(element: ET.Element, key: str, count: int) -> np.ndarray:
    words = element.get(key, " ".join(["0"] * count)).split()
    try:
        found = np.array([float(word) for word in words])
    except ValueError:
        found = np.zeros(0)
    if len(found) != count or not np.all(np.isfinite(found)):
        raise InputError(f"<{element.tag} {key}={element.get(key)!r}> needs {count} numbers; correct it")
    return found


def _number(element: ET.Element | None, key: str, default: float) -> float:
    return default if element is None or element.get(key) is None else float(_numbers(element, key, 1)[0])
