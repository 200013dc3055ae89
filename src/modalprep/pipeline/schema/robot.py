"""A robot file in a pipeline file: its links and joints join the tables of the system."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field

from modalprep.formats.robots.read import read_robot
from modalprep.formats.robots.tree import Base, Picture, Robot
from modalprep.pipeline.schema.base import FileName, Table

TABLES = ("bodies", "joints", "closures", "couplers")


class RobotTable(Table):
    """Links and joints of a robot file; the tables of the pipeline file replace or complete them by their names."""

    file: FileName = Field(description="URDF or MJCF (MuJoCo) file")
    base: Base = Field("fixed", description="of a URDF file: whether its root link is fixed to the ground, or free")
    pictures: bool = Field(True, description="whether rigid links are drawn with the surfaces that the file names")


def with_robot(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return what a pipeline file says, with the tables of its robot.

    A table under [bodies] replaces the link of its name; the keys of a table under [joints] replace those of the joint
    of its name.

    Raises
    ------
    InputError
        When the robot file cannot be read, or a joint has neither a limit of its own nor of the robot.
    """
    table = data.get("robot")
    own = {key: data.get(key, {}) for key in TABLES}
    if not isinstance(table, dict) or not isinstance(table.get("file"), str) or not _are_tables(own):
        return data  # the schema says what is wrong
    robot = read_robot(folder / table["file"], table.get("base", "fixed"), own["bodies"])
    joints = {name: _joint(robot, name, each) for name, each in own["joints"].items()}
    bodies = {name: _body(robot, name, table) for name in robot.bodies}
    found = {"bodies": bodies, "joints": robot.joints, "closures": robot.closures, "couplers": robot.couplers}
    tables = {key: found[key] | (own | {"joints": joints})[key] for key in TABLES}
    return data | tables | _environment(data, robot)


def _body(robot: Robot, name: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table of a rigid link, with its surfaces."""
    pictures = robot.pictures.get(name, []) if table.get("pictures", True) else []
    return robot.bodies[name] | ({"surfaces": [_surface(each) for each in pictures]} if pictures else {})


def _surface(picture: Picture) -> dict[str, Any]:
    place = {"position": picture.position.tolist(), "rotation": {"matrix": picture.rotation.tolist()}}
    return {"file": picture.file, "scale": picture.scale.tolist()} | place


def _environment(data: Mapping[str, Any], robot: Robot) -> dict[str, Any]:
    """Return the environment with the gravity of the robot file, where neither says otherwise."""
    own = data.get("environment", {})
    if not robot.gravity or not isinstance(own, dict) or "gravity" in own or "orbit" in own:
        return {}
    return {"environment": {"gravity": robot.gravity} | own}


def _are_tables(own: Mapping[str, Any]) -> bool:
    if not all(isinstance(each, dict) for each in own.values()):
        return False
    return all(isinstance(table, dict) for each in own.values() for table in each.values())


def _joint(robot: Robot, name: str, own: dict[str, Any]) -> dict[str, Any]:
    """Return the table of a joint; keys of the robot that do not go with those of the file itself are left out.

    Limits are those of the robot where the file's own do not give them, and then stand for its range.
    """
    idle = {"motion": ("damping", "friction", "stiffness", "free_position", "keep_start"), "limits": ("range",)}
    out = [key for given, keys in idle.items() if given in own for key in keys]
    table = {key: value for key, value in robot.joints.get(name, {}).items() if key not in out} | own
    stops = table.get("limits")
    if not isinstance(stops, dict) or name not in robot.limits:
        return table
    return table | {"limits": robot.limits[name] | stops}
