"""Notes on values that no structure has, which are mostly those of another unit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from modalprep.fe.properties.materials import Material, Orthotropic
from modalprep.fe.properties.properties import Beam, Property, Shell, Truss

MODULUS = (1e6, 1e14)  # Pa, from soft rubber to stand-ins for rigid parts; metals in MPa have 4e4 to 4e5
METALS = (1e6, 2e12)  # of these, by which another unit is suggested
GEL = ((1e4, 3e4), (900.0, 1200.0))  # Pa and kg/m^3 of gels, which are mostly water
DENSITY = (25.0, 2.3e4)  # kg/m^3, to osmium, which has 22.6 in g/cm^3
CORE = (1e7, 5.0)  # Pa: below it also light foams and honeycombs of this density exist
MASSLESS = 1e-6  # kg/m^3: given on purpose
TONNES = 1e12  # kg/m^3 of t/mm^3, the unit beside mm, N and MPa
THIN, THICK = 1e-6, 0.2  # thickness of shells over the size of the mesh: from a film to a block
WIDE = 0.5  # side of a square with the area of a section, over the size of the mesh
# mass over the cube of the size, kg/m^3: from a thread to more than a cube of osmium
LIGHT, HEAVY = 1e-6, 2.3e4
GIANT = 1e6  # kg; an arm of 0.1 m read as 100 m has 1e9 times its mass
SHORT, LONG = 1e-3, 100.0  # m
SLOW, FAST = 0.1, 1e5  # m/s, first frequency times size: from a film to a block of diamond
TURN = (-2 * math.pi, 2 * math.pi)  # rad
COMMON = (0.01, 20.0)  # m, sizes by which another unit of length is suggested
LENGTHS = {"mm": 1e-3, "m": 1.0, "in": 0.0254}
OTHERS = {  # units in which a value may have been meant, with their factor to SI
    "modulus": (("GPa", 1e9), ("MPa", 1e6)),
    "density": (("g/cm^3", 1e3), ("kg/mm^3", 1e9), ("t/mm^3", TONNES)),
    "thickness": (("mm", 1e-3),),
    "area": (("mm^2", 1e-6),),
    "angle": (("deg", math.pi / 180),),
}

Values = Iterator[tuple[str, float, tuple[float, float], str]]


def implausible_sections(sections: Mapping[str, Property], size: float) -> list[str]:
    """Return a note for each implausible value of the sections of a mesh of some size (m).

    Examples
    --------
    >>> alloy = Material(E=70e3, nu=0.3, rho=2700.0)
    >>> for note in implausible_sections({"skin": Shell(material=alloy, thickness=3.0)}, 1.8): print(note)
    the modulus of 'skin', 7e+04 Pa, is implausible (1e+06 to 1e+14 Pa): did you mean 7e+04 MPa?
    the thickness of 'skin', 3 m, is implausible (1.8e-06 to 0.36 m): did you mean 3 mm?
    """
    found: dict[tuple[str, float], str] = {}
    for group, section in sections.items():
        for what, value, (low, high), unit in (*_materials(section), *_sizes(section, size)):
            if not low <= value <= high:
                span = f"{value:.3g} {unit}, is implausible ({low:.2g} to {high:.2g} {unit})"
                found.setdefault((what, value), f"the {what} of {group!r}, {span}: {_meant(what, value, (low, high))}")
    return list(found.values())


def _meant(what: str, value: float, span: tuple[float, float]) -> str:
    """Return the unit in which a value would be plausible, or what to check."""
    low, high = {"density": DENSITY, "modulus": METALS}.get(what, span)
    for unit, factor in OTHERS[what]:
        if low <= value * factor <= high:
            return f"did you mean {value:.3g} {unit}?"
    return "give SI units, check length_unit and mass_unit"


def implausible_body(size: float, mass: float, frequency: float | None, scale: float) -> list[str]:
    """Return notes on the size (m), the mass (kg) and the first elastic frequency (Hz) of a body.

    Where another unit of length suits the mesh, of which a unit is `scale` m, the notes name it.

    Examples
    --------
    >>> implausible_body(120.0, 9e4, 0.26, 1.0)
    ["its size is implausible for a body of 120 m and 9e+04 kg: did you mean length_unit = 'mm'?"]
    """
    wrong = []
    if not (LIGHT < mass / size**3 < HEAVY and 1 / GIANT < mass < GIANT):
        wrong.append("its mass")
    if not SHORT <= size <= LONG:
        wrong.append("its size")
    if frequency is not None and not SLOW < frequency * size < FAST:
        wrong.append(f"first frequency {frequency:.3g} Hz")
    advice = "check length_unit, mass_unit and the SI units of [materials]"
    if not SHORT <= size <= LONG:
        fits = [unit for unit, metres in LENGTHS.items() if COMMON[0] <= size / scale * metres <= COMMON[1]]
        advice = f"did you mean length_unit = {fits[0]!r}?" if fits else advice
    return [f"{what} is implausible for a body of {size:.3g} m and {mass:.3g} kg: {advice}" for what in wrong]


def _materials(section: Property) -> Values:
    plies = getattr(section, "plies", ())
    for material in (getattr(section, "material", None), *(ply.material for ply in plies)):
        if isinstance(material, (Material, Orthotropic)):
            modulus = material.E if isinstance(material, Material) else max(material.E1, material.E2)
            least = 0.0 if _massless(material.rho) else CORE[1] if modulus < CORE[0] else DENSITY[0]
            if not (GEL[0][0] <= modulus <= GEL[0][1] and GEL[1][0] <= material.rho <= GEL[1][1]):
                yield "modulus", modulus, MODULUS, "Pa"
            yield "density", material.rho, (least, DENSITY[1]), "kg/m^3"


def _massless(rho: float) -> bool:
    """Whether a density is that of a part without mass, and not one in t/mm^3."""
    return rho <= MASSLESS and not DENSITY[0] <= rho * TONNES <= DENSITY[1]


def _sizes(section: Property, size: float) -> Values:
    if isinstance(section, Shell):
        thickness = section.thickness or sum(ply.thickness for ply in section.plies)
        yield "thickness", thickness, (THIN * size, THICK * size), "m"
        for angle in (section.angle, *(ply.angle for ply in section.plies)):
            yield "angle", angle, TURN, "rad"
    if isinstance(section, (Beam, Truss)):
        yield "area", section.A, (0.0, (WIDE * size) ** 2), "m^2"
