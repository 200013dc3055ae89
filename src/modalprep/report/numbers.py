"""Numbers as an engineer writes them: no exponents where digits do, powers of ten where they do not, usual units."""

from __future__ import annotations

import math
import re

POWERS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
EXPONENT = re.compile(r"(\d[\d.]*)e([+-]?\d+)")
LEAST, MOST = 1e-4, 1e7  # numbers between them have no power of ten
G = 9.80665  # m/s^2, standard gravity
SHOWN = {"m/s^2": (1 / G, "g"), "Pa": (1e-6, "MPa")}  # units of axes: factor and name
STEPS = {  # units by the size of a number, the largest first: from which size, factor, name
    "Pa": ((1e10, 1e-9, "GPa"), (1e4, 1e-6, "MPa")),
    "N": ((1e7, 1e-6, "MN"), (1e4, 1e-3, "kN")),
    "N m": ((1e7, 1e-6, "MN m"), (1e4, 1e-3, "kN m")),
    "J": ((1e7, 1e-6, "MJ"), (1e4, 1e-3, "kJ")),
    "W": ((1e7, 1e-6, "MW"), (1e4, 1e-3, "kW")),
    "m": ((0.1, 1.0, "m"), (1e-4, 1e3, "mm"), (1e-12, 1e6, "µm")),
}


def number(value: float, digits: int = 4) -> str:
    """Write a number; an empty text for NaN.

    Examples
    --------
    >>> number(21520.7), number(0.93145), number(650.0, 2), number(0.0), number(float("nan"))
    ('21521', '0.9315', '650', '0', '')
    >>> number(1.81e12) == "1.81 \N{MULTIPLICATION SIGN} 10¹²", number(-1e-9)
    (True, '-10⁻⁹')
    """
    if math.isnan(value):
        return ""
    if math.isinf(value):
        return "infinite" if value > 0 else "-infinite"
    text = f"{value + 0.0:.{digits}g}"
    if value == 0 or LEAST <= abs(value) < MOST:
        return f"{value:.0f}" if "e" in text or abs(value) >= 10**digits else text
    return raised(text)


def raised(text: str) -> str:
    """Write the exponents in a text as powers of ten.

    Examples
    --------
    >>> raised("limit 1e-09"), raised("0.0e+00"), raised("skin")
    ('limit 10⁻⁹', '0.0', 'skin')
    """
    return EXPONENT.sub(_power, text)


def _power(match: re.Match[str]) -> str:
    base = match[1]
    power = int(match[2])
    if not power:
        return base
    tens = f"10{str(power).translate(POWERS)}"
    return tens if base == "1" else f"{base} \N{MULTIPLICATION SIGN} {tens}"


def quantity(value: float, unit: str, digits: int = 4) -> str:
    """Write a number with its unit, SI or a usual multiple; accelerations in g too; an empty text for NaN.

    Examples
    --------
    >>> quantity(21520.0, "N"), quantity(2.5e6, "Pa"), quantity(19.6133, "m/s^2"), quantity(2e-3, "m")
    ('21.52 kN', '2.5 MPa', '19.61 m/s² (2 g)', '2 mm')
    """
    if math.isnan(value):
        return ""
    size = abs(value)
    factor, name = next(((f, name) for least, f, name in STEPS.get(unit, ()) if size >= least), (1.0, unit))
    text = f"{number(factor * value, digits)} {name.replace('^2', '²')}".strip()
    return f"{text} ({number(value / G, digits)} g)" if unit == "m/s^2" and size else text


def shown_unit(unit: str) -> tuple[float, str]:
    """Return the factor and the unit of an axis: g for accelerations, MPa for stress.

    Examples
    --------
    >>> shown_unit("Pa"), shown_unit("N m")
    ((1e-06, 'MPa'), (1.0, 'N m'))
    """
    return SHOWN.get(unit, (1.0, unit))
