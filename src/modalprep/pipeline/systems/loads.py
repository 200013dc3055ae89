"""From the tables of a pipeline file to functions of time, hinge elements and loads."""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.multibody.evaluation.feedback import feedback
from modalprep.multibody.model.deployment import Deployment
from modalprep.multibody.model.environment import EARTH_RADIUS, CentralGravity, Conductor, Dipole, Orbit
from modalprep.multibody.model.hydrodynamics import ImmersedRod, Water
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.joint_types import ROTATIONS, SCALARS, TRANSLATIONS
from modalprep.multibody.model.loads import AxialSpring, Bushing, DistributedForce, Load, PointForce
from modalprep.multibody.model.time_function import FOREVER, TimeFunction
from modalprep.pipeline.build.build import rotation_matrix
from modalprep.pipeline.schema.deployment import DeploymentTable
from modalprep.pipeline.schema.environment import CentralTable, ControlTable, OrbitTable, WaterTable
from modalprep.pipeline.schema.load import naming
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.system import (
    AxialSpringTable,
    BushingTable,
    ForceTable,
    ImmersedTable,
    JointTable,
    LimitsTable,
    PieceTable,
    PointsTable,
    Time,
)
from modalprep.suggest import refuse_unknown, suggestion

TRANSLATIONS_AND_ROTATIONS = {"spherical": (0, 3), "free": (3, 3)}


def time_function(key: str, value: Time | None, folder: Path) -> TimeFunction | None:
    """Return the function of time that a key of a pipeline file has; its files are relative to `folder`.

    Examples
    --------
    >>> time_function("torque", "2*t", Path())(3.0)
    (6.0, 2.0, 0.0)
    """
    with naming(key):
        if value is None:
            return None
        if isinstance(value, PointsTable):
            t, values = (value.t, value.values) if value.file is None else _points(folder / value.file)
            return TimeFunction.table(t, values)
        if isinstance(value, list):
            return TimeFunction(pieces(value))
        return TimeFunction(value)


def pieces(tables: list[PieceTable]) -> list[tuple[float, Any]]:
    """Return pieces of a function of time as ``(until, value)``, the last without end.

    Examples
    --------
    >>> pieces([PieceTable(value=1.0, until=2.0), PieceTable(value="t")])
    [(2.0, 1.0), (inf, 't')]
    """
    return [(FOREVER if piece.until is None else piece.until, piece.value) for piece in tables]


def has_several_values(value: Any) -> bool:
    """Whether a key has a value for each coordinate, not a single one in pieces."""
    return isinstance(value, list) and not (value and isinstance(value[0], PieceTable))


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


def _points(path: Path) -> tuple[np.ndarray, np.ndarray]:
    if not path.is_file():
        raise InputError(f"table of time {path} does not exist")
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    try:
        rows = [[float(word) for word in line.split(",")] for line in lines[_header(lines) :] if line.strip()]
        t, values = np.array(rows, dtype=float).reshape(len(rows), 2).T
    except ValueError:
        raise InputError(f"table of time {path}: needs rows of two numbers, 't, value'") from None
    return t, values


def _header(lines: list[str]) -> int:
    """Return 1 when the first line is a header."""
    first = lines[0].split(",")[0].strip() if lines else ""
    return int(bool(first) and not first.lstrip("+-.")[:1].isdigit())


def hinge_elements(table: JointTable, folder: Path) -> tuple[HingeElement, ...]:
    """Return one hinge element for each speed of a joint, or none without any force.

    Raises
    ------
    InputError
        When a list has not one value for each speed.
    """
    translations, rotations = TRANSLATIONS_AND_ROTATIONS.get(
        table.type, (TRANSLATIONS.get(table.type, 0), ROTATIONS.get(table.type, 0))
    )
    drives = _list("force", table.force, translations) + _list("torque", table.torque, rotations)
    keys = ("stiffness", "free_position", "damping", "friction", "limits")
    if not any(getattr(table, key) for key in keys) and drives == [None] * len(drives):
        return ()
    columns = [_list(key, getattr(table, key), translations + rotations) for key in keys]
    return tuple(
        HingeElement(
            stiffness=stiffness or 0.0,
            free_position=free_position or 0.0,
            damping=damping or 0.0,
            drive=time_function("drive", drive, folder),
            **_friction(friction),
            **_limits(limits),
        )
        for stiffness, free_position, damping, friction, limits, drive in zip(*columns, drives, strict=True)
    )


def prescribed_motion(table: JointTable, folder: Path) -> TimeFunction | tuple[TimeFunction, ...] | None:
    """Return the prescribed motion of a joint, one function for each of its coordinates."""
    if table.motion is None:
        return None
    count = max(1, SCALARS[table.type])  # a joint without coordinates reports the error
    laws = [time_function("motion", value, folder) for value in _list("motion", table.motion, count)]
    return laws[0] if len(laws) == 1 else tuple(laws)


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
    loads: list[Load] = []
    for name, table in pipeline.forces.items():
        with naming(f"force {name!r}"):
            loads.append(_force(name, table, bodies, folder))
    for name, table in pipeline.springs.items():
        with naming(f"spring {name!r}"):
            loads.append(_spring(name, table, folder))
    for name, table in pipeline.bushings.items():
        with naming(f"bushing {name!r}"):
            loads.append(_bushing(name, table))
    for name, table in pipeline.conductors.items():
        with naming(f"conductor {name!r}"):
            current = time_function("current", table.current, folder)
            loads.append(Conductor(name=name, through=tuple(table.through), current=current))
    for name, table in pipeline.immersed.items():
        with naming(f"immersed {name!r}"):
            loads += _rods(name, table, pipeline.environment.water, bodies)
    loads += [_control(name, table) for name, table in pipeline.controls.items()]
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
        radius = table.radius if table.radius is not None else EARTH_RADIUS + table.altitude
        return Orbit.circular(radius, table.mu, **others)


def _force(name: str, table: ForceTable, bodies: dict[str, FlexibleBody], folder: Path) -> Load:
    if table.at is not None:
        three = {key: tuple(time_function(key, v, folder) for v in getattr(table, key)) for key in ("force", "torque")}
        return PointForce(name=name, at=table.at, axes=table.axes, **three)
    refuse_unknown(table.body, bodies, "body")
    points = bodies[table.body].points
    corners = np.sort(table.box, axis=0) if table.box is not None else np.array([[-np.inf] * 3, [np.inf] * 3])
    inside = np.all((points >= corners[0]) & (points <= corners[1]), axis=1)
    if not np.any(inside):
        low, high = points.min(axis=0), points.max(axis=0)
        raise InputError(f"no point of body {table.body!r} lies in the box; they lie between {low} and {high} m")
    shared = np.where(inside[:, None], np.array(table.force) / inside.sum(), 0.0)
    factor = time_function("factor", table.factor, folder)
    return DistributedForce(name=name, body=table.body, force=shared, factor=factor, axes=table.axes)


def _spring(name: str, table: AxialSpringTable, folder: Path) -> AxialSpring:
    return AxialSpring(
        name=name,
        between=tuple(table.between),
        stiffness=table.stiffness,
        damping=table.damping,
        free_length=table.free_length,
        position=np.array(table.position),
        actuator_force=time_function("actuator_force", table.actuator_force, folder),
        tension_only=table.tension_only,
    )


def _control(name: str, table: ControlTable) -> Load:
    if table.values is not None:
        return feedback(name, table.at, table.values)
    none = [0.0, 0.0, 0.0]
    return feedback(name, table.at, [*(table.force or none), *(table.torque or none)], table.axes)


def _bushing(name: str, table: BushingTable) -> Bushing:
    return Bushing(
        name=name,
        between=tuple(table.between),
        stiffness=np.array(table.stiffness),
        damping=np.array(table.damping),
        free_position=np.array(table.free_position),
        free_rotation=rotation_matrix(table.free_rotation),
        position=np.array(table.position),
        rotation=rotation_matrix(table.rotation),
    )


def _rods(name: str, table: ImmersedTable, water: WaterTable | None, bodies: dict[str, FlexibleBody]) -> list[Load]:
    """Return a rod for each body whose name matches the pattern."""
    if water is None:
        raise InputError("there is no water; add [environment.water] with density and current")
    found = [body for body in bodies if fnmatchcase(body, table.bodies)]
    if not found:
        raise InputError(f"no body is called {table.bodies!r}; {suggestion(table.bodies, bodies, 'known are')}")
    around = Water(
        density=water.density,
        current=np.array(water.current),
        depths=np.array(water.depths),
        up=np.array(water.up),
        surface=water.surface,
    )
    own = table.model_dump(exclude={"bodies"})
    return [ImmersedRod(name=f"{name}.{body}", body=body, water=around, **own) for body in found]
