"""The numbers of a system that a case may change: start values, parameters of joints, loads and closures, gravity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from modalprep.applies import idle_allowed
from modalprep.errors import InputError
from modalprep.multibody.model.joint import STARTS, Joint
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.joint_types import SPEEDS
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.suggest import suggestion
from modalprep.vectors import rotation_matrix

TABLES = ("joints", "loads", "closures")
AMPLITUDE, ROTATION = "amplitude", "rotation"  # changes that no field has
ELEMENT = tuple(field.name for field in fields(HingeElement))


class Place(NamedTuple):
    """Where a number of a system is: table and row of its record, field, component; -1 where there is none."""

    table: str
    row: int
    field: str
    component: int


class Parameters:
    """Named numbers of a system, such as ``hinge.angle``, ``stay.stiffness`` and ``gravity.y``.

    Parameters
    ----------
    system : System
    names : sequence of str
        ``<joint, load or closure>.<field>``, with a trailing ``.x``, ``.y``, ``.z`` or ``.<number>`` for one of several
        numbers. The fields of a joint are its own and those of its `HingeElement`. A function of time becomes the
        number; ``amplitude`` multiplies all of a record's functions of time, and ``rotation.x`` to ``.z`` turn a joint
        further by a rotation vector, rad, in the axes of its parent.

    Raises
    ------
    InputError
        When a name is unknown.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> case = Parameters(arm, ["hinge.angle", "hinge.stiffness", "gravity.y"]).change([0.5, 20.0, -9.81])
    >>> case.joints[0].angle, case.joints[0].elements[0].stiffness, case.gravity.tolist()
    (0.5, 20.0, [0.0, -9.81, 0.0])
    """

    def __init__(self, system: System, names: Sequence[str]) -> None:
        self.system = system
        self.places = [_place(system, name) for name in names]

    def change(self, values: Sequence[float]) -> System:
        """Return the system with these values, one for each name.

        Raises
        ------
        InputError
            When the system cannot have such a value.
        """
        by_record: dict[tuple[str, int], list[tuple[Place, float]]] = {}
        for place, value in zip(self.places, values, strict=True):
            by_record.setdefault((place.table, place.row), []).append((place, float(value)))
        given: dict[str, Any] = {table: list(getattr(self.system, table)) for table, row in by_record if row >= 0}
        for (table, row), changes in by_record.items():
            if row < 0:
                given["gravity"] = _vector(self.system.gravity, changes)
            else:
                with idle_allowed(any(value == 0.0 for _, value in changes)):
                    given[table][row] = _changed(given[table][row], changes)
        return self.system.with_(**{key: tuple(v) if isinstance(v, list) else v for key, v in given.items()})


def _place(system: System, name: str) -> Place:
    """Return where the number of a name is."""
    if name.split(".")[0] == "gravity":
        return Place("gravity", -1, "gravity", _component(name, 3, name[len("gravity.") :]))
    table, row, record = _record(system, name)
    field, _, component = name.removeprefix(f"{record.name}.").partition(".")
    sizes = _sizes(record)
    if field not in sizes:
        raise InputError(f"parameter {name!r}: {suggestion(field, sizes, f'{record.name!r} has')}")
    size = sizes[field]
    if size == 0 and component:
        raise InputError(f"parameter {name!r}: {field} of {record.name!r} is one number; leave out {component!r}")
    return Place(table, row, field, -1 if size == 0 else _component(name, size, component))


def _record(system: System, name: str) -> tuple[str, int, Any]:
    """Return table, row and record of a name; names of records may have dots."""
    listed = [(table, row, r) for table in TABLES for row, r in enumerate(getattr(system, table))]
    records = [each for each in listed if hasattr(each[2], "name")]  # the field of a planet has none
    found = [each for each in records if name.startswith(f"{each[2].name}.")]
    longest = max((len(record.name) for _, _, record in found), default=0)
    found = [each for each in found if len(each[2].name) == longest]
    if not found:
        known = [*dict.fromkeys(record.name for _, _, record in records), "gravity"]
        raise InputError(
            f"parameter {name!r} names no joint, load or closure; {suggestion(name.split('.')[0], known, 'known are')}"
        )
    if len(found) > 1:
        raise InputError(f"parameter {name!r} names several records of {found[0][2].name!r}; give them other names")
    return found[0]


def _sizes(record: Any) -> dict[str, int]:
    """Return the fields of a record that are numbers, and how many each has; 0 for a single one."""
    sizes = {field.name: _size(record, field) for field in fields(record)}
    found = {name: size for name, size in sizes.items() if size is not None}
    if isinstance(record, Joint):
        for name, counts in STARTS.items():
            count = counts.get(record.type, 0)
            found |= {name: 0 if count == 1 else count}
            if count == 0:
                del found[name]
        elements = {name: 0 if SPEEDS[record.type] == 1 else SPEEDS[record.type] for name in ELEMENT}
        found |= elements if SPEEDS[record.type] and record.motion is None else {}
        found[ROTATION] = 3
    functions = [name for each in (record, *getattr(record, "elements", ())) for name in _functions(each)]
    return found | ({AMPLITUDE: 0} if functions else {})


def _size(record: Any, field: Any) -> int | None:
    value = getattr(record, field.name)
    if isinstance(value, np.ndarray):
        return len(value) if value.ndim == 1 and value.dtype.kind == "f" else None
    if isinstance(value, tuple) and value and all(isinstance(each, TimeFunction) for each in value):
        return len(value)
    number = isinstance(value, float | int | TimeFunction) and not isinstance(value, bool)
    return 0 if number or field.name == "actuator_force" else None


def _component(name: str, size: int, component: str) -> int:
    known = list("xyz") if size == 3 else [str(k + 1) for k in range(size)]
    numbers = [str(k + 1) for k in range(size)]
    if component in known or component in numbers:
        return (known if component in known else numbers).index(component)
    whole = name.removesuffix(f".{component}") if component else name
    raise InputError(f"parameter {name!r}: {whole!r} has {size} numbers; name one of them by .{', .'.join(known)}")


def _functions(record: Any) -> list[str]:
    """Return the fields of a record that are functions of time; the source of a jet is that of its body's mass."""
    values = {field.name: getattr(record, field.name) for field in fields(record) if field.name != "source"}
    several = {name: value if isinstance(value, tuple) and value else (value,) for name, value in values.items()}
    return [name for name, value in several.items() if all(isinstance(each, TimeFunction) for each in value)]


def _changed(record: Any, changes: list[tuple[Place, float]]) -> Any:
    """Return a record with other numbers."""
    own = {}
    elements = {}
    turn = np.zeros(3)
    for place, value in changes:
        if place.field == ROTATION:
            turn[place.component] = value
        elif isinstance(record, Joint) and place.field in ELEMENT:
            elements.setdefault(max(place.component, 0), {})[place.field] = value
        elif place.field != AMPLITUDE:
            own[place.field] = _value(own.get(place.field, getattr(record, place.field)), record, place, value)
    if elements:
        before = record.elements or (HingeElement(),) * SPEEDS[record.type]
        own["elements"] = tuple(e.with_(**elements[k]) if k in elements else e for k, e in enumerate(before))
    if turn.any():
        own[ROTATION] = rotation_matrix(turn) @ record.rotation
    record = record.with_(**own)
    for place, value in changes:
        if place.field == AMPLITUDE:
            record = _amplified(record, value)
    return record


def _value(before: Any, record: Any, place: Place, value: float) -> Any:
    """Return a field with one number changed."""
    if place.component < 0:
        return value
    if isinstance(before, tuple):
        return tuple(value if k == place.component else each for k, each in enumerate(before))
    size = STARTS[place.field][record.type] if place.field in STARTS and isinstance(record, Joint) else np.size(before)
    return _vector(np.resize(before, size), [(place, value)])


def _vector(before: np.ndarray, changes: list[tuple[Place, float]]) -> np.ndarray:
    found = np.array(before, dtype=float)
    for place, value in changes:
        found[place.component] = value
    return found


def _amplified(record: Any, factor: float) -> Any:
    """Return a record with its functions of time multiplied, those of a joint's elements too."""
    changes = _scaled(record, factor)
    if isinstance(record, Joint):
        changes["elements"] = tuple(each.with_(**_scaled(each, factor)) for each in record.elements)
    return record.with_(**changes)


def _scaled(record: Any, factor: float) -> dict[str, Any]:
    values = {name: getattr(record, name) for name in _functions(record)}
    return {
        name: tuple(each.scaled(factor) for each in value) if isinstance(value, tuple) else value.scaled(factor)
        for name, value in values.items()
    }
