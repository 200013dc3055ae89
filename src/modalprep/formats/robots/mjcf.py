"""MJCF files of MuJoCo: the tree of their bodies and joints."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.formats.robots.mjcf_equality import add_equalities
from modalprep.formats.robots.mjcf_file import MjcfFile
from modalprep.formats.robots.mjcf_inertia import body_mass
from modalprep.formats.robots.mjcf_joints import BodyJoint, body_joint
from modalprep.formats.robots.tree import ROOT, Connection, Link, Picture, Robot, assemble
from modalprep.formats.robots.xml import number, numbers, plain

WORLD = "world"
REFUSED = ("composite", "flexcomp", "attach", "replicate", "plugin")  # elements that make bodies
OTHERS = ("actuator", "tendon", "sensor", "contact", "deformable", "skin", "extension", "keyframe")
At = tuple[np.ndarray, np.ndarray]  # position and rotation of axes in others
Shape = tuple[ET.Element, np.ndarray, np.ndarray]


@dataclass
class Tree:
    """The links and connections of a file while it is read.

    Attributes
    ----------
    at : {link: (position, rotation)}
        In the world, in the configuration of the file.
    anchor : {link: (3,)}
        Origin of the link, at its joint, in the axes of the body of the file.
    joints : list of BodyJoint
    """

    file: MjcfFile
    own: Collection[str]
    links: dict[str, Link] = field(default_factory=lambda: {WORLD: Link()})
    connections: list[Connection] = field(default_factory=list)
    at: dict[str, At] = field(default_factory=lambda: {WORLD: (np.zeros(3), np.eye(3))})
    anchor: dict[str, np.ndarray] = field(default_factory=lambda: {WORLD: np.zeros(3)})
    joints: list[BodyJoint] = field(default_factory=list)
    dropped: list[str] = field(default_factory=list)

    def walk(self, element: ET.Element, parent: str, at: At, among: str, moves: bool) -> None:
        """Add the bodies and sites in an element whose axes have a place in those of a link."""
        for child in element:
            if child.tag in REFUSED:
                raise InputError(
                    f"<{child.tag}> is not read; write the compiled model by mujoco.mj_saveLastXML, and take that"
                )
            if child.tag == "frame":
                inside = _after(at, self.file.pose(child))
                self.walk(child, parent, inside, child.get("childclass", among), moves)
            elif child.tag == "site" and child.get("name"):
                self._add_site(child, parent, at, among)
            elif child.tag == "body":
                self._add_body(child, parent, at, child.get("childclass", among), moves)

    def _add_site(self, site: ET.Element, parent: str, at: At, among: str) -> None:
        name = plain(site.get("name", ""))
        name = f"{name}_site" if name in self.links else name
        place = _after(at, self.file.pose(self.file.complete(site, among)))
        self._connect(Connection(f"{name}_joint", "weld", parent, name, *place), Link())

    def _add_body(self, body: ET.Element, parent: str, at: At, among: str, moves: bool) -> None:
        name = plain(body.get("name", "")) or f"body{len(self.links)}"
        if name in self.links:
            raise InputError(f"two bodies or sites are called {name!r}; rename one")
        if number(body, "gravcomp", 0.0):
            self.dropped.append(f"the compensation of gravity (gravcomp) of body {name!r} is left out")
        joints = [self._joint(each, among) for each in body if each.tag in ("joint", "freejoint")]
        joint = body_joint(self.file, name, joints)
        moves = moves or bool(joints)
        position, rotation = _after(at, self.file.pose(body))
        place = (position + rotation @ joint.anchor, rotation)
        shapes = list(self._shapes(body, (np.zeros(3), np.eye(3)), among))
        self.joints.append(joint)
        link = self._link(body, name, shapes, joint.anchor) if moves else Link()
        new = Connection(joint.name, joint.kind, parent, name, *place, joint.axes, joint.extra, joint.limits)
        self._connect(new, link)
        self.anchor[name] = joint.anchor
        self.walk(body, name, (-joint.anchor, np.eye(3)), among, moves)

    def _connect(self, new: Connection, link: Link) -> None:
        self.links[new.child] = link
        self.anchor[new.child] = np.zeros(3)
        self.connections.append(new)
        self.at[new.child] = _after(self.at[new.parent], (new.position, new.rotation))

    def _joint(self, joint: ET.Element, among: str) -> ET.Element:
        if joint.tag == "freejoint":
            return ET.Element("joint", {"type": "free", "name": joint.get("name", "")})
        return self.file.complete(joint, among)

    def _shapes(self, element: ET.Element, at: At, among: str) -> Iterator[Shape]:
        """Yield the geoms of a body with the places of their frames in the body's axes."""
        for child in element:
            if child.tag == "geom":
                yield self.file.complete(child, among), *at
            elif child.tag == "frame":
                inside = _after(at, self.file.pose(child))
                yield from self._shapes(child, inside, child.get("childclass", among))

    def _link(self, body: ET.Element, name: str, shapes: list[Shape], anchor: np.ndarray) -> Link:
        mass = Link() if name in self.own else body_mass(self.file, body, shapes)
        return replace(mass, centre=mass.centre - anchor, pictures=tuple(self._pictures(shapes, anchor)))

    def _pictures(self, shapes: list[Shape], anchor: np.ndarray) -> Iterator[Picture]:
        """Yield the meshes that are there to be seen; where there are none of these, those of the contacts."""
        meshes = [shape for shape in shapes if shape[0].get("type") == "mesh" and shape[0].get("mesh")]
        seen = [shape for shape in meshes if not touches(shape[0])]
        for geom, *at in seen or meshes:
            position, rotation = _after((at[0], at[1]), self.file.pose(geom))
            yield self._mesh(geom.get("mesh", ""))._replace(position=position - anchor, rotation=rotation)

    def _mesh(self, name: str) -> Picture:
        for asset in self.file.root.iterfind("asset/mesh"):
            mesh = self.file.complete(asset, "")
            file = mesh.get("file", "")
            if mesh.get("name", Path(file).stem) == name:
                scale = numbers(mesh, "scale", 3) if mesh.get("scale") else np.ones(3)
                return Picture(str(self.file.asset_folder().absolute() / file), scale, np.zeros(3), np.eye(3))
        raise InputError(f"a geom names the mesh {name!r}, which the file does not have")


def mjcf_robot(root: ET.Element, folder: Path, own: Collection[str]) -> Robot:
    """Return the tables of the root element of an MJCF file; bodies named in `own` are bodies for themselves.

    References
    ----------
    MuJoCo documentation, XML reference (mujoco.readthedocs.io/en/stable/XMLreference.html).
    """
    file = MjcfFile.of(root, folder)
    tree = Tree(file, own)
    for worldbody in root.findall("worldbody"):
        tree.walk(worldbody, WORLD, (np.zeros(3), np.eye(3)), worldbody.get("childclass", ""), moves=False)
    robot = assemble(tree.links, tree.connections, "fixed", own, WORLD)
    robot.dropped.extend([*tree.dropped, *(said for joint in tree.joints for said in joint.dropped)])
    for joint in tree.joints:
        _add_rotors(robot, joint)
    add_equalities(root, robot, tree.at, tree.anchor, {name: j for j in tree.joints for name in j.coordinates})
    _add_option(root, robot)
    robot.dropped.extend(_left_out(root))
    return robot


def _after(at: At, then: At) -> At:
    """Return the place of axes that are placed in other axes."""
    return at[0] + at[1] @ then[0], at[1] @ then[1]


def touches(geom: ET.Element) -> bool:
    """Return whether a shape, with its defaults, can touch another."""
    return number(geom, "contype", 1.0) != 0 or number(geom, "conaffinity", 1.0) != 0


def _add_rotors(robot: Robot, joint: BodyJoint) -> None:
    """Add the inertia of rotors: a disc for each coordinate, which turns on the ground as far as the joint moves."""
    if joint.name not in robot.joints:
        return
    for name, inertia in joint.armature.items():
        rotor = f"{name}_rotor"
        disc = [inertia / 2, inertia / 2, inertia]
        robot.bodies[rotor] = {"mass": inertia, "centre": [0.0] * 3, "inertia": disc, "interfaces": {ROOT: [0.0] * 3}}
        robot.joints[rotor] = {"type": "revolute", "parent": "ground", "child": f"{rotor}.{ROOT}", "axis": [0, 0, 1.0]}
        robot.couplers[f"{name}_armature"] = {"factors": {joint.coordinate(name): 1.0, rotor: -1.0}}
        robot.joints[joint.name]["keep_start"] = True


def _add_option(root: ET.Element, robot: Robot) -> None:
    options = ET.Element("option")
    for each in root.findall("option"):
        options.attrib.update(each.attrib)
    gravity = numbers(options, "gravity", 3) if options.get("gravity") else np.array([0.0, 0.0, -9.81])
    off = any(flag.get("gravity") == "disable" for flag in root.iterfind("option/flag"))
    robot.gravity.extend([0.0] * 3 if off else gravity.tolist())
    if any(number(options, key, 0.0) for key in ("density", "viscosity")):
        robot.dropped.append("the resistance of the medium (density, viscosity) is left out")


def _left_out(root: ET.Element) -> Iterator[str]:
    """Yield notes on what of the file has no place in a system."""
    others = [tag for tag in OTHERS if any(len(each) for each in root.findall(tag))]
    if others:
        yield f"elements of the robot file that are left out: {', '.join(others)}"
    if any(True for _ in root.iter("geom")):
        yield "contacts between the shapes of the robot file are left out"
