"""Readers of mesh files: decks by own parsers, other formats through meshio; all are validated."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.elements.solid import INTEGRATIONS
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.mesh import Mesh, refuse_far_points
from modalprep.fe.properties.properties import SolidIntegration
from modalprep.fe.readers.abaqus.dialect import Dialect
from modalprep.fe.readers.abaqus.reader import read_abaqus
from modalprep.fe.readers.ansys.read import read_ansys
from modalprep.fe.readers.cad import CAD, read_cad
from modalprep.fe.readers.deck_format import deck_format
from modalprep.fe.readers.integration import with_integration
from modalprep.fe.readers.meshio_files import UNIVERSAL, read_by_meshio
from modalprep.fe.readers.nastran.builder import Gaps
from modalprep.fe.readers.nastran.deck import read_nastran
from modalprep.fe.readers.universal import read_universal
from modalprep.suggest import refuse_missing, refuse_unknown, suggestion
from modalprep.verdicts.notes import told

LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "in": 0.0254, "ft": 0.3048}
POUND = 0.45359237
MASS_UNITS = {
    **{"kg": 1.0, "g": 1e-3, "t": 1e3, "lbm": POUND},
    "slug": POUND * 9.80665 / 0.3048,  # lbf s^2 / ft
    "slinch": POUND * 9.80665 / 0.0254,  # lbf s^2 / in
}
READERS: dict[str, Callable[..., Mesh]] = {"abaqus": read_abaqus, "ansys": read_ansys, "nastran": read_nastran}


@told
def read_mesh(
    path: str | Path,
    length_unit: str = "m",
    mass_unit: str | None = None,
    ignore: Collection[str] = (),
    *,
    size: float | None = None,
    order: Literal[1, 2] | None = None,
    dialect: Dialect | None = None,
    integration: SolidIntegration | None = None,
    gaps: Gaps | None = None,
) -> Mesh:
    """Read a mesh file and convert it to SI units.

    Nastran decks (.bdf, .dat, .nas), Ansys archives (.cdb, .ans) and the decks of Abaqus and CalculiX (.inp) provide
    sections, materials, masses, springs, rigid and averaging elements; of .dat, .inp, .ans and .txt the first lines
    tell whose they are. Universal files (.unv) and the
    formats that meshio reads (.msh 4.1 is best, .med, .vtu, ...) provide points, cells and groups: the file's cell
    sets and node sets, its ``gmsh:physical`` numbers with their names, or the integer cell arrays of a .vtu file
    (``<array>_<value>``); a file without any has the group ``body`` of all its elements. An element that the file
    lists twice, as .msh 2.2 does for two groups, is kept once in both groups. The solids of CAD files (.step,
    .iges, .brep) are meshed with tetrahedra, each solid and each face a group.

    Parameters
    ----------
    path : str or Path
    length_unit : {"m", "mm", "cm", "km", "in", "ft"}
        Unit of the file's coordinates, of a deck also of its sections and materials. STEP and IGES files say their
        own unit; it is then the unit of `size`.
    mass_unit : {"kg", "g", "t", "lbm", "slug", "slinch"}, optional
        Unit of mass that makes a deck's units consistent with seconds (mm and t, in and slinch, m and kg).
        A deck in metres is taken to be in kg; with any other unit of length it must be given.
    ignore : collection of str
        Keywords or cards of a deck that are left out, such as ``"*TIE"``, ``"*ELEMENT, TYPE=CONN3D2"`` or ``"CFAST"``;
        a note counts them.
    size : float, optional
        For CAD files, which need it: edge of an element, in `length_unit`.
    order : {1, 2}, optional
        For CAD files: order of the tetrahedra, by default 2.
    dialect : {"abaqus", "calculix"}, optional
        Of an .inp deck, for keywords that the two programs take differently; by default what the deck itself proves.
    integration : {"full", "reduced_stiffness", "reduced"}, optional
        Of the 20-node hexahedra of a deck, in place of what it says, as in `Solid`; a note has either.
    gaps : {"open", "closed"}, optional
        Of a Nastran deck with CGAP: which stiffness they have.

    Returns
    -------
    Mesh
        In SI units, mesh axes as in the file.

    Raises
    ------
    InputError
        When the file is missing, damaged, truncated, empty or holds NaN coordinates, its format or a unit is unknown,
        or a deck has what cannot be read.

    Examples
    --------
    >>> read_mesh("no.msh")
    Traceback (most recent call last):
    modalprep.errors.InputError: mesh file no.msh does not exist; give a path relative to the pipeline file
    """
    path = Path(path)
    refuse_units(length_unit, mass_unit, path)
    refuse_missing(path, "mesh file", "give a path relative to the pipeline file")
    scale = LENGTH_UNITS[length_unit]
    ending = path.suffix.lower()
    kind = deck_format(path)
    _refuse_options_of_decks(path, kind, dialect, integration, gaps)
    if ending in CAD and not ignore:
        return read_cad(path, scale, size, 2 if order is None else order)
    _refuse_options_of_cad(path, size=size, order=order)
    if kind is not None:
        own = {"abaqus": (dialect,), "nastran": (gaps,)}.get(kind, ())
        mesh = READERS[kind](path, scale, MASS_UNITS[mass_unit or "kg"], ignore, *own)
        refuse_far_points(mesh.points, mesh.labels, f"mesh file {path}")
        mesh = with_integration(mesh, integration)
        _refuse_unknown_mass(mesh, path, length_unit, mass_unit)
        return mesh
    if ignore:
        raise InputError(f"mesh file {path}: 'ignore' names keywords of decks; leave it out for other files")
    if ending in UNIVERSAL:
        mesh = read_universal(path, scale)
        refuse_far_points(mesh.points, mesh.labels, f"mesh file {path}")
    else:
        mesh = read_by_meshio(path, scale)
    return _grouped(mesh)


def read_cells(path: Path, length_unit: str = "m") -> Mesh:
    """Return a mesh of which only nodes and cells matter, whatever dialect and unit of mass its deck has."""
    return read_mesh(path, length_unit, "kg", dialect="calculix" if deck_format(path) == "abaqus" else None)


def refuse_units(length_unit: str, mass_unit: str | None, path: Path | None = None) -> None:
    """Refuse units that are not known, and that of the masses of a mesh file that brings none."""
    for name, unit, known in (("length_unit", length_unit, LENGTH_UNITS), ("mass_unit", mass_unit, MASS_UNITS)):
        if unit is not None and unit not in known:
            raise InputError(f"unknown {name} {unit!r}; {suggestion(unit, known, 'known are')}")
    if path is not None and deck_format(path) is None and mass_unit not in (None, "kg"):
        raise InputError(f"mesh file {path}: 'mass_unit' is for decks, which bring their materials; leave it out")


def _refuse_options_of_decks(
    path: Path, kind: str | None, dialect: Dialect | None, integration: SolidIntegration | None, gaps: Gaps | None
) -> None:
    """Refuse options that the format of the file does not have, and values of them that are not known."""
    if dialect is not None and kind != "abaqus":
        raise InputError(f"mesh file {path}: 'dialect' is for decks of Abaqus and CalculiX (.inp); leave it out")
    if gaps is not None and kind != "nastran":
        raise InputError(f"mesh file {path}: 'gaps' is for CGAP in decks of Nastran; leave it out")
    refuse_unknown(gaps or "open", get_args(Gaps), "gaps of a deck:")
    if integration is not None and kind is None:
        raise InputError(f"mesh file {path}: 'integration' is for decks; give that of each solid among the properties")
    refuse_unknown(integration or "full", INTEGRATIONS, "integration of a deck:")


def _refuse_options_of_cad(path: Path, **options: float | None) -> None:
    for name, given in options.items():
        if given is not None:
            raise InputError(f"mesh file {path}: {name!r} is for CAD files, this mesh has its elements; leave it out")


def _refuse_unknown_mass(mesh: Mesh, path: Path, length_unit: str, mass_unit: str | None) -> None:
    """A deck in metres is taken to be in kg; for every other unit of length the unit of mass must be given."""
    if mesh.properties and mass_unit is None and length_unit != "m":
        raise InputError(
            f"mesh file {path} brings its own materials: give their mass_unit "
            f"({', '.join(MASS_UNITS)}; commonly 't' with mm, 'slinch' with in)"
        )


def _grouped(mesh: Mesh) -> Mesh:
    """Return a mesh without groups with one, ``body``, of all its cells of the highest dimension."""
    if mesh.groups or not mesh.cells:
        return mesh
    highest = max(map(cell_dimension, mesh.cells))
    body = {kind: np.arange(len(rows)) for kind, rows in mesh.cells.items() if cell_dimension(kind) == highest}
    return mesh.with_(groups={"body": body})
