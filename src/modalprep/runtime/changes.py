"""What an importing program may change in a system: inputs, which are forces, and parameters, which are constants."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_types import JOINT_TYPES
from modalprep.multibody.model.loads import AxialSpring, Bushing, DistributedForce, PointForce
from modalprep.multibody.model.rotational_spring import RotationalSpring
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import FOREVER, TimeFunction

CONSTANTS = {"stiffness": ("N/m", "N.m/rad"), "damping": ("N.s/m", "N.m.s/rad"), "friction": ("N", "N.m")}
XYZ = ("x", "y", "z")


@dataclass(frozen=True)
class Change:
    """A number of a system.

    Attributes
    ----------
    name, unit, about : str
        `about` is its description.
    value : float
    make : callable
        ``(system, value) -> system`` with another number.
    is_input : bool
    moves : bool
        Whether it is the value of a prescribed motion, whose rate and acceleration are inputs too.
    """

    name: str
    unit: str
    about: str
    value: float
    make: Callable[[System, float], System]
    is_input: bool = False
    moves: bool = False


def changes(system: System) -> list[Change]:
    """Return the inputs and then the parameters of a system.

    An input is every prescribed motion, drive, actuator force, component of a force or torque, and factor of forces on
    all points, that is given as a number. Parameters are gravity, and the stiffness, damping and friction of joints and
    elements, where they are not zero.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint_element import HingeElement
    >>> motor = HingeElement(damping=2.0, drive=10.0)
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", elements=motor)
    >>> [each.name for each in changes(System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,)))]
    ['hinge.drive_input', 'gravity[1]', 'gravity[2]', 'gravity[3]', 'hinge.damping']
    """
    inputs = [*_motions(system), *_drives(system), *_forces(system)]
    return [*inputs, *_gravity(system), *_of_joints(system), *_of_loads(system)]


def constant(function: TimeFunction | None) -> float | None:
    """Return the number that a function of time is; None of any other."""
    if function is None or len(function.given) != 1 or isinstance(function.given[0][1], str):
        return None
    return float(function.given[0][1]) if isinstance(function.given[0][1], int | float | np.number) else None


def as_input(value: float) -> TimeFunction:
    """Return a constant that has a table of its own, also where it is zero."""
    return TimeFunction([(FOREVER, float(value))])


def with_inputs(system: System) -> System:
    """Return the system with all its inputs as functions of time that have tables of their own."""
    for change in changes(system):
        if change.is_input:
            system = change.make(system, change.value)
    return system


def _motions(system: System) -> Iterator[Change]:
    for joint in system.joints:
        functions = joint.motion if isinstance(joint.motion, tuple) else (joint.motion,)
        for k, function in enumerate(functions):
            value = constant(function)
            if value is not None:
                unit = "m" if k < JOINT_TYPES[joint.type].translations else "rad"
                name = f"{joint.name}.motion_input{_index(k, functions)}"
                about = f"prescribed {'displacement' if unit == 'm' else 'angle'} of joint {joint.name}"
                yield Change(name, unit, about, value, _moved(joint.name, k), is_input=True, moves=True)


def _moved(name: str, k: int) -> Callable[[System, float], System]:
    def make(system: System, value: float) -> System:
        def changed(joint: Joint) -> Joint:
            several = isinstance(joint.motion, tuple)
            return replace(joint, motion=_replaced(joint.motion, k, as_input(value)) if several else as_input(value))

        return replace(system, joints=tuple(changed(j) if j.name == name else j for j in system.joints))

    return make


def _drives(system: System) -> Iterator[Change]:
    for joint in system.joints:
        for k, element in enumerate(joint.elements):
            value = constant(element.drive)
            if value is not None:
                unit = "N" if k < JOINT_TYPES[joint.type].translations else "N.m"
                name = f"{joint.name}.drive_input{_index(k, joint.elements)}"
                about = f"{'force' if unit == 'N' else 'torque'} of the drive of joint {joint.name}"
                yield Change(name, unit, about, value, _in_joint(joint.name, k, "drive", as_input), is_input=True)


def _forces(system: System) -> Iterator[Change]:
    for number, load in enumerate(system.loads):
        if isinstance(load, PointForce):
            for field, unit in (("force", "N"), ("torque", "N.m")):
                for k, function in enumerate(getattr(load, field)):
                    about = f"{XYZ[k]} component ({load.axes} axes) of {field} {load.name} at {load.at}"
                    yield from _input(f"{load.name}.{field}[{k + 1}]", unit, about, function, number, field, k)
        elif isinstance(load, AxialSpring):
            about = f"force by which actuator {load.name} draws its ends together"
            yield from _input(f"{load.name}.actuator_force", "N", about, load.actuator_force, number, "actuator_force")
        elif isinstance(load, DistributedForce):
            about = f"factor of the forces {load.name} on all points of body {load.body}"
            yield from _input(f"{load.name}.factor", "1", about, load.factor, number, "factor")


def _input(
    name: str, unit: str, about: str, function: TimeFunction | None, number: int, field: str, k: int | None = None
) -> Iterator[Change]:
    value = constant(function)
    if value is not None:
        yield Change(name, unit, about, value, _in_load(number, field, k, as_input), is_input=True)


def _gravity(system: System) -> Iterator[Change]:
    for k, value in enumerate(system.gravity.tolist()):
        yield Change(f"gravity[{k + 1}]", "m/s2", f"{XYZ[k]} component of gravity", value, _with_gravity(k))


def _of_joints(system: System) -> Iterator[Change]:
    for joint in system.joints:
        for k, element in enumerate(joint.elements):
            for field, units in CONSTANTS.items():
                unit = units[k >= JOINT_TYPES[joint.type].translations]
                name = f"{joint.name}.{field}{_index(k, joint.elements)}"
                if value := getattr(element, field):
                    yield Change(name, unit, f"{field} of joint {joint.name}", value, _in_joint(joint.name, k, field))


def _of_loads(system: System) -> Iterator[Change]:
    for number, load in enumerate(system.loads):
        for field in ("stiffness", "damping"):
            if isinstance(load, AxialSpring | RotationalSpring) and getattr(load, field):
                unit = CONSTANTS[field][isinstance(load, RotationalSpring)]
                about = f"{field} of {load.noun} {load.name}"
                yield Change(f"{load.name}.{field}", unit, about, getattr(load, field), _in_load(number, field))
            elif isinstance(load, Bushing):
                for k in np.flatnonzero(getattr(load, field)).tolist():
                    about = f"{field} of bushing {load.name} {'along' if k < 3 else 'about'} {XYZ[k % 3]}"
                    value = float(getattr(load, field)[k])
                    name = f"{load.name}.{field}[{k + 1}]"
                    yield Change(name, CONSTANTS[field][k >= 3], about, value, _in_load(number, field, k))


def _index(k: int, several: tuple) -> str:
    return f"[{k + 1}]" if len(several) > 1 else ""


def _with_gravity(k: int) -> Callable[[System, float], System]:
    return lambda system, value: replace(system, gravity=_replaced(system.gravity, k, value))


def _in_joint(
    name: str, k: int, field: str, convert: Callable[[float], Any] = float
) -> Callable[[System, float], System]:
    def make(system: System, value: float) -> System:
        def changed(joint: Joint) -> Joint:
            own = replace(joint.elements[k], **{field: convert(value)})
            return replace(joint, elements=_replaced(joint.elements, k, own))

        return replace(system, joints=tuple(changed(j) if j.name == name else j for j in system.joints))

    return make


def _in_load(
    number: int, field: str, k: int | None = None, convert: Callable[[float], Any] = float
) -> Callable[[System, float], System]:
    def make(system: System, value: float) -> System:
        load: Any = system.loads[number]
        own = convert(value) if k is None else _replaced(getattr(load, field), k, convert(value))
        return replace(system, loads=_replaced(system.loads, number, replace(load, **{field: own})))

    return make


def _replaced(values: Any, k: int, value: Any) -> Any:
    """Return a tuple or an array with another element."""
    if isinstance(values, np.ndarray):
        changed = values.copy()
        changed[k] = value
        return changed
    return (*values[:k], value, *values[k + 1 :])
