"""The multibody system of a pipeline file, and its bodies."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any, overload

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.formats.robots.read import read_robot, refuse_moved
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.system import System
from modalprep.pipeline.building.build import current_body, read_bodies
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.reduction import rotation_matrix
from modalprep.pipeline.schema.system import JointTable, Theory
from modalprep.pipeline.systems.angles import implausible_angles
from modalprep.pipeline.systems.constraints import read_closures
from modalprep.pipeline.systems.depletions import read_depletions
from modalprep.pipeline.systems.loads import hinge_elements, prescribed_motion, read_deployment, read_loads, read_orbit


def read_system(source: Loaded, output: Path | None, reporter: Reporter) -> System | DeployingSystem:
    """Return the system a pipeline file describes, its bodies read or built, its joints where targets want them."""
    system = system_of(source, read_bodies(source, lambda each: current_body(each, output, reporter)))
    table = source.pipeline.inverse_kinematics
    if table is None or isinstance(system, DeployingSystem):
        return system
    from modalprep.pipeline.systems.inverse_kinematics import started_at_targets  # which takes long to import

    with naming(source.path):
        return started_at_targets(system, table, reporter)


@overload
def in_theory(system: System, theory: Theory) -> System: ...
@overload
def in_theory(system: DeployingSystem, theory: Theory) -> DeployingSystem: ...
def in_theory(system: System | DeployingSystem, theory: Theory) -> System | DeployingSystem:
    """Return the system with its bodies by a theory of deformation.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> in_theory(arm, "no_geometric_stiffness").bodies["arm"].has_geometric_stiffness
    False
    """
    if theory == "consistent":
        return system
    if isinstance(system, DeployingSystem):
        raise InputError("[deployments] are of rigid rods, which have no geometric stiffness to leave out")
    return system.ruthless() if theory == "ruthless" else system.conventional()


def system_of(source: Loaded, bodies: dict[str, FlexibleBody]) -> System | DeployingSystem:
    """Return the system a pipeline file describes, of these bodies.

    Raises
    ------
    InputError
        When a table names something unknown.
    """
    pipeline, folder = source.pipeline, source.folder
    with naming(source.path):
        joints = tuple(_joint(name, table, folder) for name, table in pipeline.joints.items())
        bodies = _shared(bodies)
        loads = read_loads(pipeline, bodies, folder)
        gravity = pipeline.environment.gravity
        uniform = np.array(gravity if isinstance(gravity, list) else [0.0, 0.0, 0.0])
        closures = read_closures(pipeline.closures, pipeline.couplers, folder)
        depletions, jets = read_depletions(pipeline, bodies, folder)
        parts: dict[str, Any] = {"bodies": bodies, "joints": joints, "gravity": uniform, "loads": (*loads, *jets)}
        parts["orbit"] = read_orbit(pipeline.environment.orbit)
        if pipeline.deployments:
            deployments = tuple(read_deployment(name, table, folder) for name, table in pipeline.deployments.items())
            return DeployingSystem(**parts, deployments=deployments)
        notes = (*implausible_angles(pipeline), *_robot_notes(pipeline, bodies, folder))
        return System(**parts, closures=closures, depletions=depletions, notes=notes)


def _robot_notes(pipeline: Pipeline, bodies: dict[str, FlexibleBody], folder: Path) -> tuple[str, ...]:
    """Return what of the robot file is left out; refuse bodies whose interfaces are not those of their links."""
    if pipeline.robot is None:
        return ()
    path = folder / pipeline.robot.file
    own = {name: bodies[name] for name, table in pipeline.bodies.items() if table.mass is None}
    robot = read_robot(path, pipeline.robot.base, own)
    refuse_moved(robot, own, str(path))
    return tuple(robot.dropped)


def _shared(bodies: dict[str, FlexibleBody]) -> dict[str, FlexibleBody]:
    """Use one record for equal bodies, so that the kernel stores their arrays once."""
    first: dict[tuple, FlexibleBody] = {}
    return {
        name: first.setdefault((body.name, *sorted(body.provenance.items())), body) if body.provenance else body
        for name, body in bodies.items()
    }


def _joint(name: str, table: JointTable, folder: Path) -> Joint:
    with naming(f"joint {name!r}"):
        known = {field.name for field in fields(Joint)}
        given: dict[str, Any] = {key: value for key, value in [*table, *table.start] if key in known}
        given["rotation"] = rotation_matrix(table.rotation)
        given["motion"] = prescribed_motion(table, folder)
        return Joint(name=name, elements=hinge_elements(table, folder), **given)
