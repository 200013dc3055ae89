"""The units of a file that does not say them, guessed by which numbers are plausible."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.plausible import COMMON, LONG, SHORT, implausible_sections
from modalprep.fe.readers.abaqus.dialect import Dialect
from modalprep.fe.readers.cad import BREP, CAD, cad_measures
from modalprep.fe.readers.deck_format import deck_format
from modalprep.fe.readers.gmsh_session import TETRAHEDRA
from modalprep.fe.readers.read import LENGTH_UNITS, read_mesh, refuse_units
from modalprep.records import Record

GUESSES = (("m", "kg"), ("mm", "t"), ("in", "slinch"), ("mm", "kg"))  # of a deck: lengths with their usual masses
MASSES = {"m": "kg", "mm": "t", "in": "slinch", "ft": "slug", "cm": "kg", "km": "kg"}
LENGTHS = ("m", "mm", "in")
ELEMENTS = 12_000  # of a CAD part, about
TRIANGLES = 2.3  # in a square whose edge is the element size
ACROSS = 12  # elements along a part, at least
PLAUSIBLE = ", and the materials are plausible in it"
STEPS = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Read(Record):
    """A mesh that was read, with the units and the size of elements that were taken.

    Attributes
    ----------
    mesh : Mesh
    length_unit : str
    why : str
        Where the unit comes from.
    mass_unit : str or None
        Of a deck.
    size : float or None
        Of the elements of a CAD file, in its unit of length.
    dialect : {"abaqus", "calculix"} or None
        Of an .inp deck, where it was given.
    """

    mesh: Mesh
    length_unit: str
    why: str
    mass_unit: str | None = None
    size: float | None = None
    dialect: Dialect | None = None


def read_with_units(
    path: Path,
    length_unit: str | None,
    mass_unit: str | None,
    size: float | None,
    dialect: Dialect | None = None,
) -> Read:
    """Read a file in the given units, or in those in which its numbers are plausible.

    Raises
    ------
    InputError
        As `read_mesh` raises it.
    """
    refuse_units(length_unit or "m", mass_unit, path)
    if path.suffix.lower() in CAD:
        return _cad(path, length_unit, size)
    if size is not None:
        raise InputError(f"mesh file {path}: --size is for CAD files, this mesh has its elements; leave it out")
    if deck_format(path) is not None:
        return _deck(path, length_unit, mass_unit, dialect)
    if dialect is not None:
        raise InputError(f"mesh file {path}: --dialect is for decks of Abaqus and CalculiX; leave it out")
    mesh = read_mesh(path, length_unit or "m")
    if length_unit is not None:
        return Read(mesh=mesh, length_unit=length_unit, why="as given")
    unit = likely_unit(extent(mesh), solid=any(cell_dimension(kind) == 3 for kind in mesh.cells))
    factor = LENGTH_UNITS[unit]
    scaled = mesh.with_(points=factor * mesh.points, scale=factor)
    return Read(mesh=scaled, length_unit=unit, why=_why(unit, extent(mesh)))


def extent(mesh: Mesh) -> float:
    """Return the largest extension of a mesh, m."""
    return float(np.ptp(mesh.points, axis=0).max(initial=0.0)) if len(mesh.points) else 0.0


def likely_unit(size: float, solid: bool = True) -> str:
    """Return the unit in which a number is the size of a common part; those of beams and shells may be larger.

    Examples
    --------
    >>> likely_unit(1.5), likely_unit(80.0), likely_unit(80.0, solid=False), likely_unit(5e4)
    ('m', 'mm', 'm', 'm')
    """
    largest = COMMON[1] if solid else LONG
    fits = [unit for unit in LENGTHS if COMMON[0] <= size * LENGTH_UNITS[unit] <= largest]
    return fits[0] if fits else "m"


def element_size(extension: np.ndarray, volume: float, area: float) -> float:
    """Return a size of elements for a part: one across its walls, and not too many.

    Examples
    --------
    >>> element_size(np.array([80.0, 40.0, 8.0]), 23e3, 8e3)
    6.0
    """
    wall = 2 * volume / max(area, 1e-300)
    size = min(extension.max() / ACROSS, wall)
    size = max(size, (TETRAHEDRA * volume / ELEMENTS) ** (1 / 3), (TRIANGLES * area / ELEMENTS) ** 0.5)
    power = 10 ** np.floor(np.log10(size))
    return float(f"{min(STEPS, key=lambda step: abs(np.log(step * power / size))) * power:.3g}")


def _cad(path: Path, length_unit: str | None, size: float | None) -> Read:
    unit = length_unit or "mm"
    why = "as given"
    extension, volume, area = cad_measures(path, 1.0)  # of a BREP file in its own unit
    if path.suffix.lower() in BREP:
        if length_unit is None:
            unit = likely_unit(extension.max())
            why = _why(likely_unit(extension.max()), extension.max())
        factor = 1.0
    else:
        factor = LENGTH_UNITS[unit]
        why = "of 'size' and of the coordinates here; the CAD file says its own" if length_unit is None else why
    if size is None:
        size = element_size(extension / factor, volume / factor**3, area / factor**2)
    return Read(mesh=read_mesh(path, unit, size=size), length_unit=unit, why=why, size=size)


def _deck(path: Path, length_unit: str | None, mass_unit: str | None, dialect: Dialect | None) -> Read:
    if length_unit is not None:
        mass = mass_unit or MASSES[length_unit]
        mesh = read_mesh(path, length_unit, mass, dialect=dialect)
        return Read(mesh=mesh, length_unit=length_unit, why="as given", mass_unit=mass, dialect=dialect)
    trials = []
    for unit, mass in GUESSES:
        mesh = read_mesh(path, unit, mass_unit or mass, dialect=dialect)
        odd = implausible_sections(mesh.properties, extent(mesh))
        uncommon = not COMMON[0] <= extent(mesh) <= COMMON[1]
        why = _why(unit, extent(mesh) / LENGTH_UNITS[unit], "" if odd or not mesh.properties else PLAUSIBLE)
        read = Read(mesh=mesh, length_unit=unit, why=why, mass_unit=mass_unit or mass, dialect=dialect)
        trials.append((len(odd), uncommon, len(trials), read))
        if not odd and not uncommon:
            break
    return min(trials)[3]


def _why(unit: str, number: float, reason: str = "") -> str:
    if SHORT <= number * LENGTH_UNITS[unit] <= LONG:
        return f"guessed: {number:.4g} {unit} is the size of a part{reason}; correct it where it is another"
    return f"guessed: the size of {number:.4g} is uncommon in every unit; correct it where it is another"
