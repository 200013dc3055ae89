"""Materials of a first pipeline file: named ones, or given numbers."""

from __future__ import annotations

from modalprep.errors import InputError
from modalprep.suggest import suggestion

MATERIALS = {  # E in Pa, Poisson's ratio, density in kg/m^3: rounded data-sheet values
    "steel": (210e9, 0.3, 7850.0),
    "aluminium": (70e9, 0.33, 2700.0),
    "titanium": (114e9, 0.34, 4430.0),
    "magnesium": (45e9, 0.35, 1740.0),
    "brass": (100e9, 0.34, 8500.0),
    "copper": (120e9, 0.34, 8940.0),
    "cast_iron": (110e9, 0.26, 7200.0),
    "invar": (141e9, 0.29, 8050.0),
    "abs": (2.2e9, 0.37, 1050.0),
    "nylon": (2.8e9, 0.4, 1140.0),
    "peek": (3.6e9, 0.38, 1300.0),
}


def chosen_material(text: str | None) -> tuple[str, tuple[float, float, float]]:
    """Return the name and E (Pa), nu, rho (kg/m^3) of ``NAME`` or ``E,nu,rho``; steel without any.

    Raises
    ------
    InputError
        When the name is not known, or the numbers are not three.

    Examples
    --------
    >>> chosen_material("70e9, 0.33, 2700")
    ('given', (70000000000.0, 0.33, 2700.0))
    >>> chosen_material("steal")
    Traceback (most recent call last):
    modalprep.errors.InputError: --material 'steal' is neither a known name nor E,nu,rho; did you mean 'steel'? \
known are steel, aluminium, titanium, magnesium, brass, copper, cast_iron, invar, abs, nylon, peek
    """
    if text is None or text.lower() in MATERIALS:
        name = (text or "steel").lower()
        return name, MATERIALS[name]
    try:
        E, nu, rho = (float(part) for part in text.split(","))
    except ValueError:
        advice = suggestion(text, MATERIALS, "known are")
        raise InputError(f"--material {text!r} is neither a known name nor E,nu,rho; {advice}") from None
    if not (E > 0 and rho > 0 and -1 < nu < 0.5):
        raise InputError(f"--material {text!r}: E in Pa and rho in kg/m^3 must be positive, and nu below 0.5")
    return "given", (E, nu, rho)
