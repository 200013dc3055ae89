"""Parameters of a model: thicknesses, moduli, densities and sizes of its properties, and sections with other values."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, TypeVar

from modalprep.fe.properties.materials import Anisotropic
from modalprep.fe.properties.points import PointMass, Spring
from modalprep.fe.properties.properties import Beam, Property, Shell, Truss

Kind = TypeVar("Kind", bound=Property)

MODULI = ("E", "E1", "E2", "E3", "G12", "G13", "G23", "C")  # of all materials; ratios of Poisson stay
SIZES = ("A", "Iy", "Iz", "J")  # of beams and trusses
TAPERED = {"A": 1, "Iy": 2, "Iz": 3, "J": 4}  # their columns in a taper
IN_SHELL = ("material", "bending_material", "shear_material")
UNITS = {
    "thickness": "m",
    "modulus": "Pa",
    "density": "kg/m^3",
    "A": "m^2",
    "Iy": "m^4",
    "Iz": "m^4",
    "J": "m^4",
    "stiffness": "N/m",
    "mass": "kg",
}


class ModelParameter(NamedTuple):
    """A number of the model that may change.

    Attributes
    ----------
    kind : str
        ``thickness`` of shells (of all plies in proportion), ``modulus`` (all moduli of a material in proportion),
        ``density``, ``A``, ``Iy``, ``Iz``, ``J`` of beams and trusses (of a taper in proportion), ``stiffness`` of
        springs (all six in proportion), ``mass`` of point masses.
    of : str
        Name of the mesh group, or of the material.
    value : float
        In `unit`; the first modulus of a material that has several.
    unit : str
    material : material or None
        Of moduli and densities.
    """

    kind: str
    of: str
    value: float
    unit: str
    material: Any = None

    @property
    def name(self) -> str:
        """Kind and owner."""
        return f"{self.kind} of {self.of}"

    def belongs_to(self, group: str, section: Property) -> bool:
        """Whether a property of a group depends on it."""
        return self.material in materials_of(section) if self.material is not None else group == self.of


def find_parameters(sections: Mapping[str, Property], names: Mapping[str, Any]) -> list[ModelParameter]:
    """Return the parameters of the properties of groups; materials of equal values are one.

    Parameters
    ----------
    sections : {group: Property}
    names : {name: material}
        A material without a name is called by the groups that are made of it.

    Examples
    --------
    >>> from modalprep.examples import spinup_section
    >>> [p.name for p in find_parameters({"arm": spinup_section()}, {})][:3]
    ['A of arm', 'Iy of arm', 'Iz of arm']
    """
    found = [p for group, section in sections.items() for p in _sizes(group, section)]
    for material in _distinct(m for section in sections.values() for m in materials_of(section)):
        called = [name for name, own in names.items() if own == material]
        groups = [group for group, section in sections.items() if material in materials_of(section)]
        name = ", ".join(called) or f"the material of {', '.join(groups)}"
        found.append(ModelParameter("modulus", name, _first_modulus(material), UNITS["modulus"], material))
        found.append(ModelParameter("density", name, material.rho, UNITS["density"], material))
    return found


def _sizes(group: str, section: Property) -> list[ModelParameter]:
    match section:
        case Shell():
            values = {"thickness": section.thickness or sum(ply.thickness for ply in section.plies)}
        case Beam() | Truss():
            values = {name: getattr(section, name) for name in SIZES if getattr(section, name, 0.0)}
        case Spring():
            values = {"stiffness": max(section.k)}
        case PointMass():
            values = {"mass": section.mass} if section.mass else {}
        case _:
            values = {}
    return [ModelParameter(kind, group, value, UNITS[kind]) for kind, value in values.items()]


def materials_of(section: Property) -> list[Any]:
    """Return the distinct materials of a property."""
    own = [getattr(section, name, None) for name in IN_SHELL]
    return _distinct([m for m in own if m is not None] + [ply.material for ply in getattr(section, "plies", ())])


def _distinct(materials: Iterable[Any]) -> list[Any]:
    found: list[Any] = []
    for material in materials:
        if material not in found:
            found.append(material)
    return found


def _first_modulus(material: Any) -> float:
    return material.C[0] if isinstance(material, Anisotropic) else getattr(material, "E", None) or material.E1


def scaled(section: Kind, parameter: ModelParameter, factor: complex) -> Kind:
    """Return a property with a parameter times a factor, which may be complex.

    Examples
    --------
    >>> from modalprep.examples import spinup_section
    >>> arm = spinup_section()
    >>> scaled(arm, ModelParameter("A", "arm", arm.A, "m^2"), 2.0).A / arm.A
    2.0
    """
    match parameter.kind:
        case "thickness" if isinstance(section, Shell):
            plies = tuple(_changed(ply, thickness=factor * ply.thickness) for ply in section.plies)
            return _changed(section, thickness=factor * section.thickness, plies=plies)
        case "modulus":
            return _with_material(section, parameter.material, lambda m: _stiffer(m, factor))
        case "density":
            return _with_material(section, parameter.material, lambda m: _changed(m, rho=factor * m.rho))
        case "mass" if isinstance(section, PointMass):
            return _changed(section, mass=factor * section.mass)
        case "stiffness":
            values = {name: tuple(factor * k for k in getattr(section, name)) for name in ("translation", "rotation")}
            return _changed(section, **values)
    more = {"taper": _tapered(section.taper, TAPERED[parameter.kind], factor)} if isinstance(section, Beam) else {}
    return _changed(section, **{parameter.kind: factor * getattr(section, parameter.kind)}, **more)


def _tapered(taper: tuple, column: int, factor: complex) -> tuple:
    return tuple((*place[:column], factor * place[column], *place[column + 1 :]) for place in taper)


def _with_material(section: Kind, material: Any, change: Callable[[Any], Any]) -> Kind:
    own = {name: getattr(section, name, None) for name in IN_SHELL}
    values: dict[str, Any] = {name: change(m) for name, m in own.items() if m is not None and m == material}
    if isinstance(section, Shell) and section.plies:
        values["plies"] = tuple(
            _changed(ply, material=change(ply.material)) if ply.material == material else ply for ply in section.plies
        )
    return _changed(section, **values)


def _stiffer(material: Any, factor: complex) -> Any:
    values = {name: getattr(material, name) for name in MODULI if hasattr(material, name)}
    return _changed(material, **{name: _times(factor, value) for name, value in values.items()})


def _times(factor: complex, value: Any) -> Any:
    return tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value


def _changed(record: Any, **values: Any) -> Any:
    """Return a frozen record with other values, which are not checked: complex ones carry derivatives."""
    other = copy.copy(record)
    for name, value in values.items():
        object.__setattr__(other, name, value)
    return other
