"""From the tables of a pipeline file to functions of time, hinge elements and loads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.evaluation.feedback import feedback
from modalprep.multibody.model.deployment import Deployment
from modalprep.multibody.model.environment import EARTH_RADIUS, CentralGravity, Dipole, Orbit
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.joint_types import JOINT_TYPES, SCALARS
from modalprep.multibody.model.loads import Load
from modalprep.multibody.model.time_function import FOREVER, TimeFunction
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.changing import DeploymentTable
from modalprep.pipeline.schema.environment import CentralTable, ControlTable, FmuTable, OrbitTable
from modalprep.pipeline.schema.force_elements import Scope
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.system import JointTable, LimitsTable
from modalprep.pipeline.schema.time import has_several_values, time_function
from modalprep.runtime.fmu_load import fmu_load


def read_deployment(name: str, table: DeploymentTable, folder: Path) -> Deployment:
    """Return the deployment of a table; files of its functions of time are relative to `folder`.

    Examples
    --------
    >>> boom = DeploymentTable(length=10.0, segments=5, mass_per_length=1.2, deployed_length="5 + t/2")
    >>> read_deployment("boom", boom, Path()).start
    (5.0, 0.5)
    """
    with naming(f"deployment {name!r}"):
        given = {key: value for key, value in table if key not in ("deployed_length", "tension", "stop_time")}
        given |= {key: np.array(given[key]) for key in ("axis", "normal", "position")}
        functions = {key: time_function(key, getattr(table, key), folder) for key in ("deployed_length", "tension")}
        stop_time = FOREVER if table.stop_time is None else table.stop_time
        return Deployment(name=name, stop_time=stop_time, **functions, **given)


def hinge_elements(table: JointTable, folder: Path) -> tuple[HingeElement, ...]:
    """Return one hinge element for each speed of a joint; none where it has neither force nor drive.

    Raises
    ------
    InputError
        When a list does not have one value for each speed.
    """
    translations = JOINT_TYPES[table.type].translations
    rotations = JOINT_TYPES[table.type].speeds - translations
    _refuse_wrong_drive(table, translations, rotations)
    drives = _list("force", table.force, translations) + _list("torque", table.torque, rotations)
    names = ["force"] * translations + ["torque"] * rotations
    keys = ("stiffness", "free_position", "damping", "friction", "limits")
    if not any(getattr(table, key) for key in keys) and drives == [None] * len(drives):
        return ()
    columns = [_list(key, getattr(table, key), translations + rotations) for key in keys]
    return tuple(
        HingeElement(
            stiffness=stiffness or 0.0,
            free_position=free_position or 0.0,
            damping=damping or 0.0,
            drive=time_function(key, drive, folder),
            **_friction(friction),
            **_limits(limits),
        )
        for stiffness, free_position, damping, friction, limits, drive, key in zip(*columns, drives, names, strict=True)
    )


def _refuse_wrong_drive(table: JointTable, translations: int, rotations: int) -> None:
    """Refuse a force on a joint without translations, and a torque on one without rotations."""
    for key, other, count, others in (
        ("force", "torque", translations, rotations),
        ("torque", "force", rotations, translations),
    ):
        if getattr(table, key) is not None and not count:
            motion = "turn" if key == "torque" else "slide"
            advice = f"give {other}" if others else "leave it out"
            raise InputError(f"{key}: a joint of type {table.type!r} does not {motion}; {advice}")


def prescribed_motion(table: JointTable, folder: Path) -> TimeFunction | tuple[TimeFunction, ...] | None:
    """Return the prescribed motion of a joint, one function for each of its coordinates."""
    if table.motion is None:
        return None
    count = max(1, SCALARS[table.type])  # a joint without coordinates reports the error
    functions = [time_function("motion", value, folder) for value in _list("motion", table.motion, count)]
    return functions[0] if len(functions) == 1 else tuple(functions)


def _list(key: str, value: Any, count: int) -> list:
    """Return one value for each of `count` coordinates; pieces of a function of time are one value."""
    if value is None or value == 0.0:
        return [value] * count
    values = value if has_several_values(value) else [value]
    if len(values) != count:
        raise InputError(f"{key} has {len(values)} value(s), but the joint has {count} coordinate(s)")
    return values


def _friction(value: Any) -> dict[str, float]:
    if not value or isinstance(value, float):
        return {"friction": value or 0.0}
    return {"friction": value.coulomb, "transition_velocity": value.transition_velocity}


def _limits(table: LimitsTable | None) -> dict[str, float]:
    if table is None:
        return {}
    given = {key: value for key, value in (("lower", table.lower), ("upper", table.upper)) if value is not None}
    return {**given, "limit_stiffness": table.stiffness, "limit_damping": table.damping}


def read_loads(pipeline: Pipeline, bodies: dict[str, FlexibleBody], folder: Path) -> tuple[Load, ...]:
    """Return all loads of a pipeline file except jets."""
    loads = list(pipeline.force_elements(Scope(bodies, folder, pipeline.environment.water)))
    loads += [_control(name, table) for name, table in pipeline.controls.items()]
    loads += [_fmu(name, table, folder) for name, table in pipeline.fmu.items()]
    gravity = pipeline.environment.gravity
    if isinstance(gravity, CentralTable):
        loads.append(CentralGravity(mu=gravity.mu, centre=np.array(gravity.centre)))
    return tuple(loads)


def read_orbit(table: OrbitTable | None) -> Orbit | None:
    """Return the orbit of a pipeline file.

    Examples
    --------
    >>> round(read_orbit(OrbitTable(altitude=400e3)).radius)
    6778137
    """
    if table is None:
        return None
    with naming("orbit"):
        others = {key: getattr(table, key) for key in ("inclination", "argument_of_latitude", "planet_spin")}
        others["dipole"] = Dipole(**table.dipole.model_dump()) if table.dipole else None
        if table.rate is not None:
            return Orbit(rate=table.rate, **others)
        if table.radius is not None:
            return Orbit.circular(table.radius, table.mu, **others)
        assert table.altitude is not None  # by the check of the table
        return Orbit.circular(EARTH_RADIUS + table.altitude, table.mu, **others)


def _fmu(name: str, table: FmuTable, folder: Path) -> Load:
    own = {"inputs": table.inputs, "step": table.step, "start": table.start, "axes": table.axes}
    return fmu_load(name, folder / table.file, table.at, table.outputs, **own)


def _control(name: str, table: ControlTable) -> Load:
    if table.values is not None:
        return feedback(name, table.at, table.values)
    zero = [0.0, 0.0, 0.0]
    return feedback(name, table.at, [*(table.force or zero), *(table.torque or zero)], table.axes)
