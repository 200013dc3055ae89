"""The numbers by which runs are differentiated: those that an ensemble varies, of bodies, and what a user gives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.ensemble.parameters import AMPLITUDE, ELEMENT, ROTATION, Parameters, Place
from modalprep.errors import InputError
from modalprep.multibody.model.joint import STARTS
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.suggest import suggestion

OF_MODES = {"mode_stiffness": "K", "mode_damping": "D"}
# What belongs to the shapes of the modes, which another stiffness leaves as they are.
OF_THE_SHAPES = ("stress", "recovery", "modal_mass", "T", "truncation", "mode_names", "stations")
OF_START = {"modal": "modes_of", "modal_rate": "modal_rates_of"}
MASS = "mass"
LINEAR = ("stiffness", "damping", "friction", "limit_stiffness", "free_length", "free_position")
SCALED = ("m", "s0", "E0")  # in proportion to the mass


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A number on which a system depends, and its value.

    Attributes
    ----------
    name : str
    value : float
        Where derivatives are taken.
    change : callable
        ``change(system, value) -> system``, smooth in the value: knots of a table of torques, or a body that is reduced
        anew for another thickness of its plates.
    size : float or None
        By how much it changes noticeably, for the differences of forces; by default its value, or 1 of a value of zero.
    is_start : bool
        Whether it changes nothing but where the run starts.
    is_linear : bool
        Whether the forces that given accelerations need are linear in it, and loops do not depend on it; of a start
        value whether the state where a tree starts at rest is.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> pull = Parameter(name="pull", value=9.81, change=lambda system, g: system.with_(gravity=(0, -g, 0)))
    >>> changed(arm, [pull], [2.0]).gravity
    array([ 0., -2.,  0.])
    """

    name: str
    value: float
    change: Callable[[System, float], System]
    size: float | None = None
    is_start: bool = False
    is_linear: bool = False

    @property
    def step(self) -> float:
        """The size of a noticeable change."""
        return self.size or abs(self.value) or 1.0


@dataclass(frozen=True, kw_only=True)
class ModalStart(Parameter):
    """The start value of a mode, number `row` of the state: it does not stand in the system."""

    row: int = 0


def changed(system: System, parameters: Sequence[Parameter | str], values: Sequence[float]) -> System:
    """Return a system with other values of parameters.

    Parameters
    ----------
    parameters : sequence of Parameter or str
        As `run_sensitivities` takes them.
    values : sequence of float
        One for each, in its unit.

    Returns
    -------
    System
        With the values; start values of modes, which do not stand in a system, are left out.

    Raises
    ------
    InputError
        When a name is unknown, or the system cannot have such a value.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> changed(arm, ["hinge.stiffness", "arm.mode_stiffness.1"], [5.0, 24.0]).bodies["arm"].K
    array([24.])
    """
    for parameter, value in zip(find(system, parameters), values, strict=True):
        system = parameter.change(system, float(value))
    return system


def moved(system: System, parameters: Sequence[Parameter], values: np.ndarray) -> tuple[System, list[Parameter]]:
    """Return a system with other values of parameters, and the parameters at these values.

    They change the system that was given first, as factors do.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.sensitivity.parameters import find
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> there, (own,) = moved(arm, find(arm, ["hinge.angle"]), np.array([0.5]))
    >>> there.joints[0].angle, own.value, own.change(there, 0.6).joints[0].angle
    (0.5, 0.5, 0.6)
    """

    def along(k: int) -> Callable[[System, float], System]:
        def change(_: System, value: float) -> System:
            beside = [*map(float, values)]
            beside[k] = value
            return changed(system, parameters, beside)

        return change

    own = [replace(each, value=float(values[k]), change=along(k)) for k, each in enumerate(parameters)]
    return changed(system, parameters, values.tolist()), own


def find(system: System, parameters: Sequence[Parameter | str]) -> list[Parameter]:
    """Return the parameters that are named.

    Raises
    ------
    InputError
        When there is none, a name is unknown or comes twice, or has no value.
    """
    if isinstance(parameters, str | Parameter) or not isinstance(parameters, Sequence) or not parameters:
        raise InputError('parameters: give a list of names, such as ["hinge.stiffness", "gravity.y"]')
    found = [each if isinstance(each, Parameter) else _named(system, each) for each in parameters]
    names = [each.name for each in found]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"parameter {name!r} is given {names.count(name)} times; give it once")
    return found


def _named(system: System, name: Any) -> Parameter:
    if not isinstance(name, str):
        raise InputError(f"parameters: {name!r} is neither a name nor a Parameter")
    body, _, rest = name.partition(".")
    kind, _, number = rest.partition(".")
    records = (*system.joints, *system.loads, *system.closures)
    named_otherwise = {getattr(each, "name", "") for each in records}  # the field of a planet has none
    if body in system.bodies and body not in named_otherwise:
        return _of_body(system, name, body, kind, number)
    return _of_record(system, name)


def _of_body(system: System, name: str, body: str, kind: str, number: str) -> Parameter:
    """Return a parameter of a body: its mass, or stiffness, damping and start values of a mode."""
    flexible = system.bodies[body]
    known = (*OF_MODES, *OF_START) if flexible.n else (MASS,)
    if kind not in known:
        advice = "; of a flexible body give a Parameter that makes the body anew" * (kind == MASS)
        raise InputError(f"parameter {name!r}: {suggestion(kind, known, f'body {body!r} has')}{advice}")
    if kind == MASS:
        change = _body_change(body, with_mass)
        return Parameter(name=name, value=float(flexible.m), change=change, is_linear=True)
    if not (number.isdigit() and 1 <= int(number) <= flexible.n):
        raise InputError(f"parameter {name!r}: name one of the {flexible.n} modes, such as {body}.{kind}.1")
    k = int(number) - 1
    if kind in OF_START:
        from modalprep.multibody.packing.tree import pack

        row = getattr(pack(system), OF_START[kind])(body).start + k
        return ModalStart(name=name, value=0.0, change=lambda system, value: system, is_start=True, row=row)
    field = OF_MODES[kind]
    change = _body_change(body, lambda own, value: _with_number(own, field, k, value))
    return Parameter(name=name, value=float(getattr(flexible, field)[k]), change=change, is_linear=True)


def _body_change(name: str, make: Callable[[FlexibleBody, float], FlexibleBody]) -> Callable[[System, float], System]:
    return lambda system, value: system.with_(bodies=system.bodies | {name: make(system.bodies[name], value)})


def _with_number(body: FlexibleBody, field: str, k: int, value: float) -> FlexibleBody:
    numbers = getattr(body, field).copy()
    numbers[k] = value
    changes = {name: getattr(body, name) for name in (*OF_THE_SHAPES, "coupled_damping")} | {field: numbers}
    if field == "D" and body.coupled_damping is not None:
        changes["coupled_damping"] = body.coupled_damping + np.diag(numbers - body.D)
    return body.with_(**changes)


def with_mass(body: FlexibleBody, mass: float) -> FlexibleBody:
    """Return a rigid body of another density: mass, moment of mass and inertia in proportion.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> ball = rigid_body("ball", mass=2.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    >>> float(with_mass(ball, 3.0).E0.trace() / ball.E0.trace())
    1.5
    """
    factor = mass / body.m
    return body.with_(**{name: factor * getattr(body, name) for name in SCALED})


def _of_record(system: System, name: str) -> Parameter:
    """Return a parameter that ensembles have too."""
    one = Parameters(system, [name])
    place = one.places[0]
    value, size = _value_and_size(system, place, name)
    start = place.table == "joints" and place.field in STARTS
    return Parameter(
        name=name,
        value=value,
        change=lambda other, value: (one if other is system else Parameters(other, [name])).change([value]),
        size=size,
        is_start=start,
        is_linear=start or _is_linear(system, place),
    )


def _is_linear(system: System, place: Place) -> bool:
    """Whether forces are linear in a number: gravity, what springs and dampers have that cannot go slack."""
    if place.row < 0 or place.table not in ("joints", "loads") or place.field not in LINEAR:
        return place.row < 0
    return not getattr(getattr(system, place.table)[place.row], "tension_only", False)


def _value_and_size(system: System, place: Place, name: str) -> tuple[float, float | None]:
    """Return the value of a parameter, and the size of its vector where it has one."""
    if place.field == AMPLITUDE:
        return 1.0, None
    if place.field == ROTATION:
        return 0.0, None
    if place.row < 0:
        return float(system.gravity[place.component]), float(np.linalg.norm(system.gravity)) or None
    record = getattr(system, place.table)[place.row]
    if place.table == "joints" and place.field in ELEMENT:
        record = (record.elements or (HingeElement(),) * 6)[max(place.component, 0)]
        return _number(getattr(record, place.field), name), None
    value = getattr(record, place.field)
    if place.component < 0:
        return _number(value, name), None
    if isinstance(value, tuple):
        return _number(value[place.component], name), None
    size = STARTS[place.field][record.type] if place.field in STARTS and place.table == "joints" else np.size(value)
    numbers = np.resize(np.asarray(value, dtype=float), size)
    return float(numbers[place.component]), float(np.linalg.norm(numbers)) or None


def _number(value: Any, name: str) -> float:
    if isinstance(value, TimeFunction):
        raise InputError(
            f"parameter {name!r} is a function of time; differentiate by its amplitude, "
            f"{name.rpartition('.')[0]}.{AMPLITUDE}, or give a Parameter that changes it"
        )
    return 0.0 if value is None else float(value)
