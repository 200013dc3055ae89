"""Event indicators of an FMU: what events look at, and where forces have kinks, as codes that C evaluates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from modalprep.errors import InputError
from modalprep.multibody.evaluation.expressions import CHANNEL
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.functions.safe_expression import read_expression
from modalprep.multibody.model.loads import AxialSpring
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed

# events.c
OPERATIONS = ("number", "time", "coordinate", "column", "add", "multiply", "power")
FUNCTIONS = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "log")
DEEPEST = 64
LONGEST_NAME = 63  # bytes
NUMBER, TIME, COORDINATE, COLUMN, ADD, MULTIPLY, POWER = range(len(OPERATIONS))
AXES = {"x": 1, "y": 2, "z": 3}

Code = tuple[int, float]  # operation, number: operands first


class Indicator(NamedTuple):
    """An expression whose zeros are events.

    Attributes
    ----------
    name, about : str
    codes : list of Code
    direction : {0, 1, -1}
        Of the crossing that ends a run.
    terminal : bool
    """

    name: str
    about: str
    codes: list[Code]
    direction: int = 0
    terminal: bool = False


class Unknown(InputError):
    """An FMU does not have what an event asks for."""


def of_event(event: Event, places: Mapping[str, Code]) -> Indicator:
    """Return the indicator of an event whose `when` is an expression.

    Parameters
    ----------
    places : {label: Code}
        Where the numbers of the channels are.

    Raises
    ------
    Unknown
        When the FMU has no such channel, or `when` is a Python function.

    Examples
    --------
    >>> of_event(Event(name="down", when="hinge.angle + 0.5"), {"hinge.angle": (COORDINATE, 0)}).codes
    [(0, 0.5), (2, 0), (4, 0.0)]
    """
    what = f"event {event.name!r}"
    if callable(event.when):
        raise Unknown(f"{what} is a Python function, which an FMU does not hold; give an expression of channels")
    symbols = {name: f"channel_{k}" for k, name in enumerate(dict.fromkeys(CHANNEL.findall(event.when)))}
    text = CHANNEL.sub(lambda match: symbols[match[0]], event.when)
    leaves = {symbol: _place(name, places, what) for name, symbol in symbols.items()} | {"t": (TIME, 0.0)}
    codes = [*_codes(read_expression(text, what, tuple(leaves)), leaves)]
    if _depth(codes) > DEEPEST:
        raise Unknown(f"{what} is too long for an FMU; give a shorter expression")
    if len(event.name.encode()) > LONGEST_NAME:
        raise Unknown(f"{what} has a name of more than {LONGEST_NAME} bytes, too long for an FMU")
    return Indicator(f"event.{event.name}", f"event: {event.when}", codes, event.direction, event.terminal)


def kinks(system: System, packed: Packed, places: Mapping[str, Code]) -> Iterator[Indicator]:
    """Yield what is zero where a joint comes to its limit, and where a strap becomes slack."""
    for joint in system.joints:
        limited = any(element.limited for element in joint.elements)
        coordinates = packed.coordinates_of(joint.name) if limited else []
        for k, (element, x) in enumerate(zip(joint.elements, coordinates, strict=False)):
            for side in ("lower", "upper"):
                limit = getattr(element, side)
                if abs(limit) < float("inf"):
                    index = f"[{k + 1}]" if len(joint.elements) > 1 else ""
                    codes = [(COORDINATE, x), (NUMBER, -limit), (ADD, 0.0)]
                    name = f"{joint.name}.{side}_limit{index}"
                    yield Indicator(name, f"zero at the {side} limit of joint {joint.name}", codes)
    for load in system.loads:
        if isinstance(load, AxialSpring) and load.tension_only:
            codes = [places[f"{load.name}.length"], (NUMBER, -load.free_length), (ADD, 0.0)]
            yield Indicator(f"{load.name}.stretch", f"length of {load.name} beyond that at which it is slack", codes)


def _place(name: str, places: Mapping[str, Code], what: str) -> Code:
    """Return where the number of a channel is, as events name it: ``arm.tip.position.x``, ``arm.modal.2``."""
    base, _, last = name.rpartition(".")
    number = AXES.get(last, last)
    for label in (name, f"{base}[{number}]", base if number in (1, "1") else name):
        if label in places:
            return places[label]
    raise Unknown(f"{what} asks for {name!r}, which is no channel that an FMU has")


def _codes(value: Any, leaves: Mapping[str, Code]) -> Iterator[Code]:
    """Yield the codes of symengine's expression."""
    if not value.free_symbols:
        yield NUMBER, float(value)
    elif value.is_Symbol:
        yield leaves[str(value)]
    elif value.is_Add or value.is_Mul or value.is_Pow:
        operation = ADD if value.is_Add else MULTIPLY if value.is_Mul else POWER
        first, *others = value.args
        yield from _codes(first, leaves)
        for other in others:
            yield from _codes(other, leaves)
            yield operation, 0.0
    else:
        name = type(value).__name__.lower()
        if name not in FUNCTIONS:
            raise Unknown(f"an FMU does not have the function {name!r} of an event")
        yield from _codes(value.args[0], leaves)
        yield len(OPERATIONS) + FUNCTIONS.index(name), 0.0


def _depth(codes: Sequence[Code]) -> int:
    """Return how many numbers wait at most."""
    now = most = 0
    for operation, _ in codes:
        now += 1 if operation <= COLUMN else -1 if operation <= POWER else 0
        most = max(most, now)
    return most
