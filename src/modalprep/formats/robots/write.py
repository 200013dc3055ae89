"""The tree of a system as a URDF file, with rigid links."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.formats.robots.tree import SINGLE
from modalprep.multibody.model.constraints import Closure, Coupler
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.system import System
from modalprep.suggest import refuse_other

TYPES = {"weld": "fixed", "revolute": "revolute", "prismatic": "prismatic", "free": "floating", "planar": "planar"}
GROUND = "ground"  # name of the root link
ANY = "1e9"  # effort and velocity, which the format asks for and a system does not limit


def write_urdf(system: System, path: str | Path) -> Path:
    """Write the tree of a system as a URDF file, with rigid links; it is written completely or not at all.

    The root link is `ground`. An interface is a fixed link of its name, ``body_interface`` where another link has it.
    `lost_in_urdf` says what the file does not hold.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When a joint is of a type that the format does not have, or the folder cannot be written.

    References
    ----------
    Unified Robot Description Format, ROS (wiki.ros.org/urdf/XML).

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> system = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))
    >>> file = write_urdf(system, Path(tempfile.mkdtemp()) / "arm.urdf")
    >>> [joint.get("type") for joint in ET.parse(file).getroot().findall("joint")]
    ['continuous', 'fixed']
    >>> lost_in_urdf(system)[0]
    'body arm is a rigid link in the URDF file: its 2 modes are left out'
    """
    refuse_other("write_urdf: the system", System, system)
    robot = ET.Element("robot", name="robot")
    ET.SubElement(robot, "link", name=GROUND)
    names = {*system.bodies, GROUND}
    for joint in system.joints:
        name = joint.child.partition(".")[0]
        robot.append(_link(name, system.bodies[name]))
        robot.append(_joint(system, joint, name))
        robot.extend(_interfaces(system, name, names))
    return write_xml(robot, path)


def write_xml(root: ET.Element, path: str | Path) -> Path:
    """Write an XML file, indented; completely or not at all."""
    ET.indent(root)
    with atomic_path(path) as temporary:
        ET.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)
    return Path(path)


def lost_in_urdf(system: System) -> list[str]:
    """Return notes on what of a system a URDF file does not hold.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> free = Joint(name="free", type="free", parent="ground", child="arm", angular_velocity=(0, 0, 1))
    >>> lost_in_urdf(System(bodies={"arm": uniform_beam(modes=0, truncation=())}, joints=(free,)))
    ['start values of joints free have no place in a URDF file']
    """
    closures = [each.name for each in system.closures if not _follows(system, each)]
    given = {
        "gravity": np.any(system.gravity) or system.orbit is not None,
        "loads": len(system.loads) > 0,
        "depletions": len(system.depletions) > 0,
    }
    return lost_in_robot(system, "a URDF file", _lost_of, closures, given)


def lost_in_robot(
    system: System,
    file: str,
    lost_of: Callable[[Joint], Iterable[str]],
    closures: Sequence[str],
    given: Mapping[str, object],
) -> list[str]:
    """Return notes on what of a system a robot file does not hold.

    Parameters
    ----------
    lost_of : callable
        What of a joint, beside its start values and prescribed motion.
    closures : sequence of str
        Which of them.
    given : {what of the system: whether there is such}
    """
    rigid = file.partition(" ")[2]
    said = [
        f"body {name} is a rigid link in the {rigid}: its {body.n} modes are left out"
        for name, body in system.bodies.items()
        if body.n
    ]
    joints: dict[str, list[str]] = {}
    for joint in system.joints:
        for what in (*_lost_start(joint), *lost_of(joint)):
            joints.setdefault(what, []).append(joint.name)
    said += [f"{what} of joints {', '.join(names)} have no place in {file}" for what, names in joints.items()]
    said += [f"closures and couplers have no place in {file}: {', '.join(closures)}"] if closures else []
    return said + [f"{what} of the system has no place in {file}" for what, there in given.items() if there]


def _lost_start(joint: Joint) -> Iterator[str]:
    starts = (joint.angle, joint.rate, joint.displacement, joint.speed, joint.velocity, joint.angular_velocity)
    if any(np.any(each) for each in starts):
        yield "start values"
    if joint.motion is not None:
        yield "prescribed motions"


def _lost_of(joint: Joint) -> Iterator[str]:
    if any(each.stiffness or each.limited or each.drive is not None for each in joint.elements):
        yield "springs, stops and drives"
    if joint.type not in SINGLE and any(each.damping or each.friction for each in joint.elements):
        yield "dampers and friction"


def text_of(values: Iterable[float] | np.ndarray) -> str:
    """Return numbers as an attribute of a robot file."""
    return " ".join(repr(float(value) + 0.0) for value in values)


def rigid_mass(body: FlexibleBody, name: str) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre (3,) and inertia about it (3, 3) of a body as it is at rest, at its joint.

    Raises
    ------
    InputError
        When its frame is not that of its root.
    """
    if not body.at_root:
        raise InputError(f"body {name!r} has its frame at its {body.frame}; a robot's link has it at its joint")
    centre = body.s0 / body.m
    J = np.trace(body.E0) * np.eye(3) - body.E0 - body.m * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return float(body.m), centre, J


def _link(name: str, body: FlexibleBody) -> ET.Element:
    """Return the link of a body, rigid as it is at rest."""
    mass, centre, J = rigid_mass(body, name)
    link = ET.Element("link", name=name)
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=text_of(centre), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=repr(mass))
    six = {f"i{'xyz'[a]}{'xyz'[b]}": repr(float(J[a, b])) for a in range(3) for b in range(a, 3)}
    ET.SubElement(inertial, "inertia", six)
    return link


def _joint(system: System, joint: Joint, child: str) -> ET.Element:
    if joint.type not in TYPES:
        raise InputError(f"joint {joint.name!r}: a URDF file has no {joint.type} joint; it has {', '.join(TYPES)}")
    parent, _, interface = joint.parent.partition(".")
    kind = "continuous" if joint.type == "revolute" and joint.range is None else TYPES[joint.type]
    element = ET.Element("joint", name=joint.name, type=kind)
    place = joint.position if parent == GROUND else _place(system.bodies[parent], interface) + joint.position
    _add_origin(element, place, joint.rotation)
    ET.SubElement(element, "parent", link=parent)
    ET.SubElement(element, "child", link=child)
    if joint.type in (*SINGLE, "planar"):
        ET.SubElement(element, "axis", xyz=text_of(joint.rotation.T @ joint.axis))
    if joint.type in SINGLE:
        _add_forces(element, joint)
        _add_mimic(element, system, joint)
    return element


def _add_origin(element: ET.Element, place: np.ndarray, rotation: np.ndarray) -> None:
    """Add a place; where two of its angles turn about one axis, they are one angle."""
    from scipy.spatial.transform import Rotation

    sine = np.clip(-rotation[2, 0], -1, 1)
    if abs(sine) < 1 - 1e-9:
        angles = Rotation.from_matrix(rotation).as_euler("xyz")
    else:  # pitch of a quarter turn, up to the square root of the rounding
        angles = np.array(
            [0.0, np.arctan2(sine, np.hypot(*rotation[2, 1:])), np.arctan2(-rotation[0, 1], rotation[1, 1])]
        )
    ET.SubElement(element, "origin", xyz=text_of(place), rpy=text_of(angles))


def _place(body: FlexibleBody, interface: str) -> np.ndarray:
    return body.interface_position[body.interface_name.index(interface)]


def _add_forces(element: ET.Element, joint: Joint) -> None:
    if joint.range is not None or joint.type == "prismatic":
        low, high = joint.range or (-1e9, 1e9)
        limits = {"lower": repr(low), "upper": repr(high), "effort": ANY, "velocity": ANY}
        ET.SubElement(element, "limit", limits)
    for each in joint.elements:
        if each.damping or each.friction:
            ET.SubElement(element, "dynamics", damping=repr(each.damping), friction=repr(each.friction))


def _follows(system: System, each: Closure | Coupler) -> bool:
    """Return whether a coupler lets one joint follow another, by constants that are known."""
    if not isinstance(each, Coupler) or each.value is None or not each.active or len(each.factors) != 2:
        return False
    kinds = {joint.name: joint.type for joint in system.joints}
    return isinstance(each.value.source, int | float) and all(kinds.get(name) in SINGLE for name in each.factors)


def _add_mimic(element: ET.Element, system: System, joint: Joint) -> None:
    for each in system.closures:
        if isinstance(each, Coupler) and _follows(system, each) and next(iter(each.factors)) == joint.name:
            (_, own), (other, factor) = each.factors.items()
            assert each.value is not None  # by `_follows`
            numbers = {"multiplier": repr(-factor / own), "offset": repr(each.value(0.0)[0] / own)}
            ET.SubElement(element, "mimic", {"joint": other} | numbers)


def _interfaces(system: System, name: str, names: set[str]) -> Iterator[ET.Element]:
    """Yield fixed links for the interfaces that no joint of the same name makes."""
    body = system.bodies[name]
    made = {joint.name for joint in system.joints if joint.parent == f"{name}.{joint.name}"}
    for interface, position in list(zip(body.interface_name, body.interface_position, strict=True))[1:]:
        if interface in made:
            continue
        own = interface if interface not in names else f"{name}_{interface}"
        if own in names:
            raise InputError(f"two links would be called {own!r} in the URDF file; rename interface {interface!r}")
        names.add(own)
        yield ET.Element("link", name=own)
        joint = ET.Element("joint", name=f"{own}_joint", type="fixed")
        _add_origin(joint, position, np.eye(3))
        ET.SubElement(joint, "parent", link=name)
        ET.SubElement(joint, "child", link=own)
        yield joint
