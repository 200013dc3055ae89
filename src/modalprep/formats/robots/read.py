"""Multibody systems of robot files, URDF and MJCF."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, get_args

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.rigid import rigid_body
from modalprep.errors import InputError
from modalprep.formats.robots.files import drawable, pictured
from modalprep.formats.robots.mjcf import mjcf_robot
from modalprep.formats.robots.tree import Base, Robot
from modalprep.formats.robots.urdf import urdf_robot
from modalprep.formats.robots.xml import reading
from modalprep.multibody.model.constraints import Closure, Coupler
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.system import System
from modalprep.suggest import refuse_unknown
from modalprep.vectors import inertia_tensor

MOVED = 1e-6  # of the size of a robot: how far an interface of another body may be from the robot's
FORCES = ("stiffness", "free_position", "damping", "friction")


def read_urdf(
    path: str | Path,
    *,
    bodies: Mapping[str, FlexibleBody] | None = None,
    base: Base = "fixed",
    pictures: bool = True,
) -> System:
    """Return the multibody system of a URDF file; links that are named may be flexible bodies.

    Each link that moves against its parent becomes a body of its name, with its root at the origin of the link, in
    whose axes it is, and an interface for each joint that it carries. Links that are fixed to it add their mass, and
    become interfaces of their names; where one of both is among `bodies`, a weld joins them. Damping and friction of
    the joints, and joints that follow others (``mimic``, a `Coupler`), are kept. The limits of the joints are no stops,
    because the file has no stiffness for them: they are the `range` of the joints, and a run says where one is left.

    Parameters
    ----------
    path : str or Path
    bodies : {link: FlexibleBody}, optional
        In place of rigid links, with the same interfaces at the same places.
    base : {"fixed", "free"}
        Whether the root link is fixed to the ground, or free.
    pictures : bool
        Whether rigid links are drawn with the surfaces (STL, OBJ, Collada) that the file names.

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
    return _system(Path(path), base, dict(bodies or {}), pictures)


def read_mjcf(path: str | Path, *, bodies: Mapping[str, FlexibleBody] | None = None, pictures: bool = True) -> System:
    """Return the multibody system of the tree in a MuJoCo file (MJCF); bodies that are named may be flexible.

    Bodies, hinges, slides, balls and free joints, inertias (of the shapes where they are missing), springs, dampers,
    friction, ranges, sites (interfaces) and gravity of the file are kept; `connect`, `weld` and linear `joint`
    equalities close loops exactly. Joint coordinates count from the configuration of the file, in which `ref` is what
    MuJoCo adds. A root interface is at the joint of its body. `armature` is a disc that turns on the ground and is
    coupled to the joint, which has the same inertia. Contacts, actuators, tendons and sensors are left out; a note
    says what.

    Parameters
    ----------
    path : str or Path
    bodies : {name: FlexibleBody}, optional
        In place of rigid bodies, with the same interfaces at the same places.
    pictures : bool
        Whether rigid bodies are drawn with the surfaces (STL, OBJ, Collada) that the file names.

    Returns
    -------
    System
        With the gravity of the file.

    Raises
    ------
    InputError
        When the file is missing or damaged, has what cannot be kept nor left out, or as `read_urdf`.

    References
    ----------
    MuJoCo documentation, XML reference (mujoco.readthedocs.io/en/stable/XMLreference.html).

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "arm.xml"
    >>> _ = file.write_text('''<mujoco><worldbody><body name="arm"><joint name="shoulder" axis="0 1 0"/>
    ... <geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.02"/></body></worldbody></mujoco>''')
    >>> system = read_mjcf(file)
    >>> list(system.bodies), round(system.bodies["arm"].m, 3), system.gravity.tolist()
    (['arm'], 0.662, [0.0, 0.0, -9.81])
    """
    return _system(Path(path), "fixed", dict(bodies or {}), pictures)


def read_robot(path: Path, base: Base = "fixed", own: Collection[str] = ()) -> Robot:
    """Return the links and joints of a URDF or MJCF file as tables; links named in `own` are bodies for themselves.

    Raises
    ------
    InputError
        As `read_urdf` and `read_mjcf`.
    """
    refuse_unknown(base, get_args(Base), "base of a robot")
    with reading(path) as root:
        if root.tag not in ("robot", "mujoco"):
            raise InputError(f"it has the element {root.tag!r}, neither robot nor mujoco; expand xacro files first")
        if root.tag == "mujoco" and base == "free":
            raise InputError("base = 'free' is for URDF files: an MJCF file has a freejoint where its base is free")
        robot = urdf_robot(root, path.parent, base, own) if root.tag == "robot" else mjcf_robot(root, path.parent, own)
    drawable(robot)
    return robot


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


def _system(path: Path, base: Base, own: dict[str, FlexibleBody], pictures: bool) -> System:
    robot = read_robot(path, base, own)
    for name in own:
        refuse_unknown(name, robot.links, f"{path}: link")
    refuse_moved(robot, own, str(path))
    bodies = {name: own.get(name) or _link(robot, name, pictures) for name in robot.bodies}
    couplers = [Coupler(name=name, **table) for name, table in robot.couplers.items()]
    return System(
        bodies=bodies,
        joints=tuple(_joint(name, table) for name, table in robot.joints.items()),
        closures=(*(_closure(name, table) for name, table in robot.closures.items()), *couplers),
        gravity=np.array(robot.gravity or [0.0, 0.0, 0.0]),
        notes=tuple(robot.dropped),
    )


def _link(robot: Robot, name: str, pictures: bool) -> FlexibleBody:
    table = robot.bodies[name]
    values: dict[str, Any] = table | {"inertia": inertia_tensor(table["inertia"])}
    return pictured(rigid_body(name, **values), robot.pictures.get(name, []) if pictures else [])


def _joint(name: str, table: dict[str, Any]) -> Joint:
    values = table | {"rotation": table.get("rotation", {"matrix": np.eye(3)})["matrix"]}
    forces = {key: np.atleast_1d(values.pop(key)) for key in FORCES if key in values}
    count = max((len(each) for each in forces.values()), default=0)
    elements = [{key: float(np.resize(each, count)[k]) for key, each in forces.items()} for k in range(count)]
    return Joint(name=name, elements=tuple(HingeElement(**each) for each in elements), **values)


def _closure(name: str, table: dict[str, Any]) -> Closure:
    rotation = table.get("rotation")
    return Closure(name=name, **(table | ({} if rotation is None else {"rotation": rotation["matrix"]})))
