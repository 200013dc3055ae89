"""Notes on values that no structure has, which are mostly those of another unit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from modalprep.fe.properties.materials import Material, Orthotropic
from modalprep.fe.properties.properties import Beam, Property, Shell, Truss

MODULUS = (1e6, 2e12)  # Pa, from soft rubber to diamond; metals in MPa have 4e4 to 4e5
DENSITY = (25.0, 2.3e4)  # kg/m^3, to osmium, which has 22.6 in g/cm^3
CORE = (1e7, 5.0)  # Pa: below it also light foams and honeycombs of this density exist
MASSLESS = 1e-6  # kg/m^3: given on purpose, also by readers for materials without density
THIN, THICK = 1e-6, 0.2  # thickness of shells over the size of the mesh: from a film to a block
WIDE = 0.5  # side of a square with the area of a section, over the size of the mesh

Values = Iterator[tuple[str, float, tuple[float, float], str]]


def implausible_sections(sections: Mapping[str, Property], size: float) -> list[str]:
    """Return a note for each implausible value of the sections of a mesh of some size (m).

    Examples
    --------
    >>> alloy = Material(E=70e3, nu=0.3, rho=2700.0)
    >>> for note in implausible_sections({"skin": Shell(material=alloy, thickness=3.0)}, 1.8): print(note)
    the modulus of 'skin', 7e+04 Pa, is implausible (1e+06 to 2e+12 Pa): give SI units, check length_unit and mass_unit
    the thickness of 'skin', 3 m, is implausible (1.8e-06 to 0.36 m): give SI units, check length_unit and mass_unit
    """
    found: dict[tuple[str, float], tuple[str, str]] = {}
    for group, section in sections.items():
        for what, value, (low, high), unit in (*_materials(section), *_sizes(section, size)):
            if not low <= value <= high:
                found.setdefault((what, value), (group, f"({low:.2g} to {high:.2g} {unit})"))
    return [
        f"the {what} of {group!r}, {value:.3g} {span.split()[-1][:-1]}, is implausible {span}: "
        "give SI units, check length_unit and mass_unit"
        for (what, value), (group, span) in found.items()
    ]


def _materials(section: Property) -> Values:
    plies = getattr(section, "plies", ())
    for material in (getattr(section, "material", None), *(ply.material for ply in plies)):
        if isinstance(material, (Material, Orthotropic)):
            modulus = material.E if isinstance(material, Material) else max(material.E1, material.E2)
            least = 0.0 if material.rho <= MASSLESS else CORE[1] if modulus < CORE[0] else DENSITY[0]
            yield "modulus", modulus, MODULUS, "Pa"
            yield "density", material.rho, (least, DENSITY[1]), "kg/m^3"


def _sizes(section: Property, size: float) -> Values:
    if isinstance(section, Shell):
        thickness = section.thickness or sum(ply.thickness for ply in section.plies)
        yield "thickness", thickness, (THIN * size, THICK * size), "m"
    if isinstance(section, (Beam, Truss)):
        yield "area", section.A, (0.0, (WIDE * size) ** 2), "m^2"
