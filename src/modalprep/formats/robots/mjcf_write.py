"""The tree of a system as an MJCF file of MuJoCo, with rigid bodies."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.formats.refusals import with_suffix
from modalprep.formats.robots.mjcf import WORLD
from modalprep.formats.robots.tree import SINGLE
from modalprep.formats.robots.write import GROUND, lost_in_robot, rigid_mass, text_of, write_xml
from modalprep.multibody.model.constraints import Closure, Coupler
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_types import JOINT_TYPES, TRAVEL
from modalprep.multibody.model.system import System
from modalprep.suggest import refuse_other

WHOLE = {"free": "free", "spherical": "ball"}  # joints that are no sequence of slides and hinges
TYPES = ("weld", "revolute", "prismatic", "cylindrical", "universal", "gimbal", "planar", *WHOLE)
LOOPS = {"spherical": "connect", "weld": "weld"}


def write_mjcf(system: System, path: str | Path) -> Path:
    """Write the tree of a system as an MJCF file of MuJoCo, with rigid bodies; it is written whole or not at all.

    Bodies, joints with springs, dampers, friction and ranges, gravity. Interfaces are sites, ``body_interface``.
    Couplers of one or two coordinates, and closures that are balls or welds of unturned interfaces, are equalities,
    which MuJoCo lets give. Coordinates of joints with several are joints ``joint_1``, ``joint_2``. `lost_in_mjcf` says
    what the file does not hold.

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
    MuJoCo documentation, XML reference (mujoco.readthedocs.io/en/stable/XMLreference.html).

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> system = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))
    >>> file = write_mjcf(system, Path(tempfile.mkdtemp()) / "arm.xml")
    >>> [(each.tag, each.get("name")) for each in ET.parse(file).getroot().iterfind("worldbody/body/*")]
    [('joint', 'hinge'), ('inertial', None), ('site', 'arm_tip')]
    >>> lost_in_mjcf(system)
    ['body arm is a rigid link in the MJCF file: its 2 modes are left out']
    """
    refuse_other("write_mjcf: the system", System, system)
    path = with_suffix(path, "an MJCF file", ".xml")
    root = ET.Element("mujoco", model="robot")
    ET.SubElement(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    ET.SubElement(root, "option", gravity=text_of(system.gravity))
    world = ET.SubElement(root, "worldbody")
    _add_bodies(system, world, GROUND)
    _add_equalities(system, root, world)
    return write_xml(root, path)


def lost_in_mjcf(system: System) -> list[str]:
    """Return notes on what of a system an MJCF file does not hold.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> free = Joint(name="free", type="free", parent="ground", child="arm", angular_velocity=(0, 0, 1))
    >>> lost_in_mjcf(System(bodies={"arm": uniform_beam(modes=0, truncation=())}, joints=(free,)))
    ['start values of joints free have no place in an MJCF file']
    """
    closures = [each.name for each in system.closures if not _is_equality(system, each)]
    given = {
        "the orbit": system.orbit is not None,
        "loads": len(system.loads) > 0,
        "depletions": len(system.depletions) > 0,
    }
    return lost_in_robot(system, "an MJCF file", _lost_of, closures, given)


def _lost_of(joint: Joint) -> Iterator[str]:
    if any(each.limited or each.drive is not None for each in joint.elements):
        yield "stops and drives"
    if joint.type in WHOLE and any(each.stiffness for each in joint.elements):
        yield "springs"
    if any(each.damping != joint.elements[0].damping for each in joint.elements) and joint.type in WHOLE:
        yield "dampers that differ by axis, which MuJoCo has one number for,"


def _add_bodies(system: System, at: ET.Element, parent: str) -> None:
    """Add the bodies whose joints stand on a body, each with those on it."""
    for joint in system.joints:
        above, _, interface = joint.parent.partition(".")
        if above == parent:
            name = joint.child.partition(".")[0]
            place = joint.position
            if above != GROUND:
                body = system.bodies[above]
                place = place + body.interface_position[body.interface_name.index(interface)]
            element = ET.SubElement(at, "body", name=name, pos=text_of(place), quat=text_of(_quaternion(joint)))
            element.extend(list(_joints(joint)))
            element.append(_inertial(system, name))
            element.extend(list(_sites(system, name)))
            _add_bodies(system, element, name)


def _quaternion(joint: Joint) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(joint.rotation).as_quat(scalar_first=True)


def _inertial(system: System, name: str) -> ET.Element:
    mass, centre, J = rigid_mass(system.bodies[name], name)
    six = [J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]]
    return ET.Element("inertial", pos=text_of(centre), mass=repr(mass), fullinertia=text_of(six))


def _sites(system: System, name: str) -> Iterator[ET.Element]:
    body = system.bodies[name]
    for interface, position in list(zip(body.interface_name, body.interface_position, strict=True))[1:]:
        yield ET.Element("site", name=f"{name}_{interface}", pos=text_of(position))


def _joints(joint: Joint) -> Iterator[ET.Element]:
    """Yield the joints of MuJoCo that a joint is, in its order."""
    if joint.type not in TYPES:
        raise InputError(f"joint {joint.name!r}: an MJCF file has no {joint.type} joint; it has {', '.join(TYPES)}")
    if joint.type in WHOLE:
        forces = _forces(joint, 0, springs=False) if joint.elements else {}
        yield ET.Element("joint", {"name": joint.name, "type": WHOLE[joint.type]} | forces)
    axes = _axes(joint)
    for k, motion in enumerate(JOINT_TYPES[joint.type].motions):
        kind = "slide" if motion.kind == TRAVEL else "hinge"
        own = {"name": _coordinate(joint, k), "type": kind, "axis": text_of(axes[motion.axis])}
        if joint.range is not None:
            own["range"] = text_of(joint.range)
        yield ET.Element("joint", own | (_forces(joint, k) if joint.elements else {}))


def _axes(joint: Joint) -> Sequence[np.ndarray]:
    """Return the first and second axis and their normal, in axes of the body."""
    second = np.zeros(3) if joint.second_axis is None else joint.second_axis
    return [joint.rotation.T @ axis for axis in (joint.axis, second, np.cross(joint.axis, second))]


def _coordinate(joint: Joint, k: int) -> str:
    return joint.name if joint.type in (*SINGLE, *WHOLE) else f"{joint.name}_{k + 1}"


def _forces(joint: Joint, k: int, springs: bool = True) -> dict[str, str]:
    each = joint.elements[k]
    found = {"damping": each.damping, "frictionloss": each.friction}
    if springs and each.stiffness:
        found |= {"stiffness": each.stiffness, "springref": each.free_position}
    return {name: repr(float(value)) for name, value in found.items() if value}


def _is_equality(system: System, each: Closure | Coupler) -> bool:
    if not each.active:
        return False
    if isinstance(each, Coupler):
        return len(each.factors) <= 2 and each.value is not None and isinstance(each.value.source, int | float)
    return each.type in LOOPS and np.array_equal(each.rotation, np.eye(3))


def _add_equalities(system: System, root: ET.Element, world: ET.Element) -> None:
    kept = [each for each in system.closures if _is_equality(system, each)]
    equality = ET.SubElement(root, "equality") if kept else root
    for each in kept:
        if isinstance(each, Coupler):
            equality.append(_coupled(system, each))
        else:
            ends = [_site(each, end, world) for end in (each.a, each.b)]
            ET.SubElement(equality, LOOPS[each.type], name=each.name, site1=ends[0], site2=ends[1])


def _site(closure: Closure, end: str, world: ET.Element) -> str:
    if end != GROUND:
        return end.replace(".", "_")
    ET.SubElement(world, "site", name=f"{WORLD}_{closure.name}", pos=text_of(closure.position))
    return f"{WORLD}_{closure.name}"


def _coupled(system: System, each: Coupler) -> ET.Element:
    """Return a linear relation: the first coordinate by the second one."""
    joints = {_name_of(joint, k): _coordinate(joint, k) for joint in system.joints for k in range(len(_axes(joint)))}
    (first, own), *others = each.factors.items()
    assert each.value is not None  # by `_is_equality`
    coefficients = [each.value(0.0)[0] / own, *(-factor / own for _, factor in others)]
    named = {f"joint{k}": joints[name] for k, (name, _) in enumerate([(first, own), *others], 1)}
    return ET.Element("joint", {"name": each.name, **named, "polycoef": text_of(([*coefficients, 0, 0, 0, 0])[:5])})


def _name_of(joint: Joint, k: int) -> str:
    return joint.name if joint.type in (*SINGLE, *WHOLE) else f"{joint.name}.{k + 1}"
