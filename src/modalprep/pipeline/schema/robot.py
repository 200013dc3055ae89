"""A robot file in a pipeline file: its links and joints join the tables of the system."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field

from modalprep.formats.urdf import Base, Robot, read_robot
from modalprep.pipeline.schema.base import FileName, Table

TABLES = ("bodies", "joints", "couplers")


class RobotTable(Table):
    """Links and joints of a URDF file; the tables of the pipeline file replace or complete them by their names."""

    file: FileName = Field(description="URDF file")
    base: Base = Field("fixed", description="whether its root link is fixed to the ground, or free")


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
    found = {"bodies": robot.bodies, "joints": robot.joints, "couplers": robot.couplers}
    return data | {key: found[key] | (own | {"joints": joints})[key] for key in TABLES}


def _are_tables(own: Mapping[str, Any]) -> bool:
    if not all(isinstance(each, dict) for each in own.values()):
        return False
    return all(isinstance(table, dict) for each in own.values() for table in each.values())


def _joint(robot: Robot, name: str, own: dict[str, Any]) -> dict[str, Any]:
    """Return the table of a joint, whose limits are those of the robot where the file's own do not give them."""
    table = robot.joints.get(name, {}) | own
    stops = table.get("limits")
    if not isinstance(stops, dict) or name not in robot.limits:
        return table
    return table | {"limits": robot.limits[name] | stops}
