"""Numbers of pipeline files that may be text with a unit, such as ``"210 GPa"``; a number without unit is in SI."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from fractions import Fraction
from typing import Annotated, Any, NamedTuple, TypeVar

from annotated_types import GroupedMetadata
from pydantic import BeforeValidator, Field, WithJsonSchema

GRAVITY, INCH, POUND = 9.80665, 0.0254, 0.45359237
MASS, LENGTH, TIME, ANGLE, CURRENT = range(5)
FORCE, STRESS, WORK = (1, 1, -2, 0, 0), (1, -1, -2, 0, 0), (1, 2, -2, 0, 0)
POWER = (1, 2, -3, 0, 0)
FIELD = (1, 0, -2, 0, -1)
RATE = (0, 0, -1, 1, 0)
_BASE = [tuple(int(i == k) for i in range(5)) for k in range(5)]
GROUPS: list[tuple[tuple[int, ...], dict[str, float]]] = [
    (
        _BASE[MASS],
        {
            "kg": 1.0,
            "g": 1e-3,
            "mg": 1e-6,
            "t": 1e3,
            "lbm": POUND,
            "lb": POUND,
            "slug": POUND * GRAVITY / (12 * INCH),
            "slinch": POUND * GRAVITY / INCH,
        },
    ),
    (_BASE[LENGTH], {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "dm": 0.1, "um": 1e-6, "km": 1e3, "in": INCH, "ft": 12 * INCH}),
    (_BASE[TIME], {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0, "day": 86400.0}),
    (_BASE[ANGLE], {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "rev": 2 * math.pi}),
    (_BASE[CURRENT], {"A": 1.0, "mA": 1e-3, "kA": 1e3}),
    (FORCE, {"N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6, "lbf": POUND * GRAVITY, "kgf": GRAVITY}),
    (
        STRESS,
        {
            "Pa": 1.0,
            "kPa": 1e3,
            "MPa": 1e6,
            "GPa": 1e9,
            "bar": 1e5,
            "psi": POUND * GRAVITY / INCH**2,
            "ksi": 1e3 * POUND * GRAVITY / INCH**2,
        },
    ),
    (WORK, {"J": 1.0, "kJ": 1e3, "Nm": 1.0}),
    (POWER, {"W": 1.0, "kW": 1e3}),
    ((0, 1, -2, 0, 0), {"gee": GRAVITY}),
    (FIELD, {"T": 1.0, "mT": 1e-3, "uT": 1e-6, "nT": 1e-9}),
    (RATE, {"Hz": 2 * math.pi, "kHz": 2e3 * math.pi, "rpm": math.pi / 30}),
]
# Decimal factors are fractions, so that 7.85 g/cm^3 is exactly 7850 kg/m^3.
UNITS: dict[str, tuple[Fraction | float, tuple[int, ...]]] = {
    name: (factor if powers in (_BASE[ANGLE], RATE) else Fraction(str(factor)), powers)
    for powers, names in GROUPS
    for name, factor in names.items()
}
EXAMPLES = {
    "m": "'2 mm' or 0.002",
    "Pa": "'210 GPa' or 2.1e11",
    "kg/m^3": "'7.85 g/cm^3' or 7850",
    "rad": "'90 deg' or 1.57",
    "kg": "'500 g' or 0.5",
    "rad/s": "'5 rpm' or 0.52",
    "Hz": "'2 kHz' or 2000",
    "s": "'20 ms' or 0.02",
    "N": "'2 kN' or 2000",
    "N/m": "'50 N/mm' or 50000",
    "m/s": "'36 km/h' or 10",
    "kg m^2": "'2 kg mm^2' or 2e-6",
}
COORDINATES = (
    "near",
    "box",
    "point",
    "radius",
    "tolerance",
    "position",
    "size",
)  # keys of tables whose lengths are in the mesh's unit
LONGEST = 80  # characters; what is longer is an expression
NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?![*^/])(.*?)\s*", re.DOTALL)
FACTOR = re.compile(r"([A-Za-zµ]+|1)(?:\^|\*\*)?(-?\d)?")
TEXT_TOO = WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string"}]})


class Unit(NamedTuple):
    """A factor to SI, and the exponents of kg, m, s, rad and A."""

    factor: float
    powers: tuple[int, ...]


def parse_unit(text: str) -> Unit | None:
    """Return what a product of units with exponents, such as ``N m/rad`` and ``kg/m^3``, means; None if it is none.

    Examples
    --------
    >>> parse_unit("N/mm2").factor, parse_unit("furlong")
    (1000000.0, None)
    """
    factor = Fraction(1)
    powers = [0] * 5
    sign = 1
    for part in re.split(r"([/*·\s]+)", text.strip().replace("**", "^")):
        if not part or not part.strip(" *·\t"):
            continue
        if part.strip() == "/":
            sign = -1
            continue
        found = FACTOR.fullmatch(part)
        name = found[1].replace("µ", "u") if found else ""
        if found is None or (name not in UNITS and name != "1"):
            return None
        own, dimension = UNITS.get(name, (Fraction(1), (0,) * 5))
        power = sign * int(found[2] or 1)
        sign = 1
        factor *= own**power
        powers = [p + power * d for p, d in zip(powers, dimension, strict=True)]
    return Unit(float(factor), tuple(powers))


def _unit(text: str) -> Unit:
    """Return a unit that is known."""
    unit = parse_unit(text)
    if unit is None:
        raise ValueError(f"{text!r} is no product of units")
    return unit


def in_si(text: str, units: tuple[str, ...]) -> float | None:
    """Return the number that text means in that of `units` whose dimension it has; None if it has no unit.

    Angles count as pure numbers where the text leaves them out: ``"5 N m"`` is also a stiffness in N m/rad.

    Raises
    ------
    ValueError
        When the unit has another dimension.

    Examples
    --------
    >>> in_si("60 rpm", ("Hz",)), in_si("2 mm", ("rad", "m")), in_si("2*t", ("m",))
    (1.0, 0.002, None)
    """
    found = NUMBER.fullmatch(text) if len(text) < LONGEST else None
    unit = parse_unit(found[2]) if found and found[2] else None
    if found is None or unit is None:
        return None
    for wanted in units:
        goal = _unit(wanted)
        silent = unit.powers[ANGLE] == 0 and "Hz" not in wanted
        if all(
            a == b or (k == ANGLE and silent) for k, (a, b) in enumerate(zip(unit.powers, goal.powers, strict=True))
        ):
            return float(found[1]) * unit.factor / goal.factor
    raise ValueError(f"{text!r} has another dimension than {' or '.join(units)}; {_advice(units)}")


def _advice(units: tuple[str, ...]) -> str:
    return f"write for example {EXAMPLES.get(units[0], f'{chr(39)}2 {units[0]}{chr(39)} or 2')}"


class Quantity(GroupedMetadata):
    """What reads a number in SI that may be text with a unit; `units` are the SI units it may have.

    Examples
    --------
    >>> from pydantic import TypeAdapter
    >>> TypeAdapter(Annotated[float, Quantity("N/m")]).validate_python("50 N/mm")
    50000.0
    """

    def __init__(self, *units: str) -> None:
        self.units = units

    def __iter__(self) -> Iterator[object]:
        """Yield what pydantic reads in an annotation."""
        yield BeforeValidator(self._read)
        yield TEXT_TOO

    def _read(self, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        number = in_si(value, self.units)
        if number is None:
            raise ValueError(f"{value!r} is no number with a unit of {' or '.join(self.units)}; {_advice(self.units)}")
        return number


def with_gravity(text: str) -> str:
    """Return a text in which g is the acceleration, not the gram.

    Examples
    --------
    >>> with_gravity("0.5 g^2/Hz")
    '0.5 gee^2/Hz'
    """
    return re.sub(r"(?<![A-Za-z])g(?![A-Za-z])", "gee", text)


def level(value: float | str, unit: str, given: str | None) -> float:
    """Return a number in the SI unit `unit`: of a text, or of a number in the unit `given`; g is the acceleration.

    Raises
    ------
    ValueError
        When the text has no unit, or one of another dimension.

    Examples
    --------
    >>> level("2 g", "m/s^2", None), level(3.0, "N", None), level(0.5, "N", "kN")
    (19.6133, 3.0, 500.0)
    """
    if given is None and not isinstance(value, str):
        return float(value)
    text = value if isinstance(value, str) else f"{float(value)!r} {given}"
    found = in_si(with_gravity(text), (unit,))
    if found is None:
        raise ValueError(f"{text!r} is no number with a unit of {unit}; {_advice((unit,))}")
    return found


def _share(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    text = value.strip()
    try:
        return float(text.removesuffix("%")) * (0.01 if text.endswith("%") else 1.0)
    except ValueError:
        raise ValueError(f"{value!r} is no share; give a number such as 0.01, or '1%'") from None


def or_expression(*units: str) -> BeforeValidator:
    """Return a validator for keys that may be expressions: text of a number and a unit becomes the number."""

    def read(value: Any) -> Any:
        if isinstance(value, list):
            return [read(each) for each in value]
        number = in_si(value, units) if isinstance(value, str) else None
        return value if number is None else number

    return BeforeValidator(read)


def in_mesh_unit(value: Any, unit: str, key: str = "") -> Any:
    """Return tables whose coordinates are in the unit of the mesh where they were text with a unit.

    Raises
    ------
    ValueError
        When the text is no length.

    Examples
    --------
    >>> in_mesh_unit({"near": ["2 cm", 0, 0], "axis": [0, 0, 1]}, "mm")
    {'near': [20.0, 0, 0], 'axis': [0, 0, 1]}
    """
    if isinstance(value, dict):
        return {name: in_mesh_unit(inner, unit, name) for name, inner in value.items()}
    if isinstance(value, list):
        return [in_mesh_unit(inner, unit, key) for inner in value]
    if key not in COORDINATES or not isinstance(value, str) or unit not in UNITS:
        return value
    try:
        metres = in_si(value, ("m",))
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from None
    return value if metres is None else metres / float(UNITS[unit][0])


Item = TypeVar("Item")
Three = Annotated[list[Item], Field(min_length=3, max_length=3)]
Length = Annotated[float, Quantity("m")]
Area = Annotated[float, Quantity("m^2")]
SecondMoment = Annotated[float, Quantity("m^4")]
Mass = Annotated[float, Quantity("kg")]
MassPerLength = Annotated[float, Quantity("kg/m")]
MassPerArea = Annotated[float, Quantity("kg/m^2")]
Inertia = Annotated[float, Quantity("kg m^2")]
InertiaPerLength = Annotated[float, Quantity("kg m")]
Density = Annotated[float, Quantity("kg/m^3")]
Stress = Annotated[float, Quantity("Pa")]
Force = Annotated[float, Quantity("N")]
Moment = Annotated[float, Quantity("N m")]
BendingStiffness = Annotated[float, Quantity("N m^2")]
Stiffness = Annotated[float, Quantity("N/m")]
LineStiffness = Annotated[float, Quantity("N/m^2")]
ForcePerLength = Annotated[float, Quantity("N/m")]
Bedding = Annotated[float, Quantity("N/m^3")]
RotationalStiffness = Annotated[float, Quantity("N m/rad")]
AnyStiffness = Annotated[float, Quantity("N/m", "N m/rad")]
Damping = Annotated[float, Quantity("N s/m")]
RotationalDamping = Annotated[float, Quantity("N m s/rad")]
AnyDamping = Annotated[float, Quantity("N s/m", "N m s/rad")]
Duration = Annotated[float, Quantity("s")]
Share = Annotated[float, BeforeValidator(_share), TEXT_TOO]
Frequency = Annotated[float, Quantity("Hz")]
Angle = Annotated[float, Quantity("rad")]
AngularVelocity = Annotated[float, Quantity("rad/s")]
Velocity = Annotated[float, Quantity("m/s")]
AnyVelocity = Annotated[float, Quantity("m/s", "rad/s")]
Acceleration = Annotated[float, Quantity("m/s^2")]
Coordinate = Annotated[float, Quantity("rad", "m")]
MassFlow = Annotated[float, Quantity("kg/s")]
Curvature = Annotated[float, Quantity("1/m")]
PerTime = Annotated[float, Quantity("1/s")]
PlanetConstant = Annotated[float, Quantity("m^3/s^2")]
MagneticField = Annotated[float, Quantity("T")]
ForceOrMoment = Annotated[float, Quantity("N", "N m")]
Allowable = Annotated[float, Quantity("Pa", "N", "N m", "N/m", "m/s^2")]
ImpactDamping = Annotated[float, Quantity("s/m", "s/rad")]
