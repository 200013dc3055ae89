"""Readers of mesh files: decks by own parsers, other formats through meshio; all are validated."""

from __future__ import annotations

import codecs
import contextlib
import hashlib
import io
import re
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.elements.solid import INTEGRATIONS
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.facets import numbered
from modalprep.fe.mesh.mesh import Mesh, refuse_far_points
from modalprep.fe.properties.properties import SolidIntegration
from modalprep.fe.readers.abaqus.dialect import Dialect
from modalprep.fe.readers.abaqus.reader import read_abaqus
from modalprep.fe.readers.ansys.read import read_ansys
from modalprep.fe.readers.cad import CAD, read_cad
from modalprep.fe.readers.deck_format import BY_ENDING, deck_format
from modalprep.fe.readers.integration import with_integration
from modalprep.fe.readers.med import in_vtk_order, learn_cells, name_groups
from modalprep.fe.readers.nastran.builder import Gaps
from modalprep.fe.readers.nastran.deck import read_nastran
from modalprep.fe.readers.universal import read_universal
from modalprep.fe.readers.unpacking import limited_unpacking, refuse_packed_datasets
from modalprep.suggest import refuse_missing, refuse_unknown, suggestion
from modalprep.verdicts.notes import told

LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "in": 0.0254, "ft": 0.3048}
POUND = 0.45359237
MASS_UNITS = {
    **{"kg": 1.0, "g": 1e-3, "t": 1e3, "lbm": POUND},
    "slug": POUND * 9.80665 / 0.3048,  # lbf s^2 / ft
    "slinch": POUND * 9.80665 / 0.0254,  # lbf s^2 / in
}
VTK = (".vtu", ".vtk")
READERS: dict[str, Callable[..., Mesh]] = {"abaqus": read_abaqus, "ansys": read_ansys, "nastran": read_nastran}
UNIVERSAL = {".unv", ".uff"}
MED = ".med"


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
    units = LENGTH_UNITS[length_unit], MASS_UNITS[mass_unit or "kg"]
    kind = deck_format(path)
    if dialect is not None and kind != "abaqus":
        raise InputError(f"mesh file {path}: 'dialect' is for decks of Abaqus and CalculiX (.inp); leave it out")
    if gaps is not None and kind != "nastran":
        raise InputError(f"mesh file {path}: 'gaps' is for CGAP in decks of Nastran; leave it out")
    refuse_unknown(gaps or "open", get_args(Gaps), "gaps of a deck:")
    if integration is not None and kind is None:
        raise InputError(f"mesh file {path}: 'integration' is for decks; give that of each solid among the properties")
    refuse_unknown(integration or "full", INTEGRATIONS, "integration of a deck:")
    if path.suffix.lower() in CAD and not ignore:
        return read_cad(path, units[0], size, 2 if order is None else order)
    for name, given in (("size", size), ("order", order)):
        if given is not None:
            raise InputError(f"mesh file {path}: {name!r} is for CAD files, this mesh has its elements; leave it out")
    if kind is not None:
        own = {"abaqus": (dialect,), "nastran": (gaps,)}.get(kind, ())
        mesh = _checked(READERS[kind](path, *units, ignore, *own), path)
        return _deck(with_integration(mesh, integration), path, length_unit, mass_unit)
    if ignore:
        raise InputError(f"mesh file {path}: 'ignore' names keywords of decks; leave it out for other files")
    if path.suffix.lower() in UNIVERSAL:
        return _grouped(_checked(read_universal(path, LENGTH_UNITS[length_unit]), path))
    content = path.read_bytes()
    raw = _read_with_meshio(path, content)
    if path.suffix.lower() == MED:
        name_groups(raw)
    cells, groups = _merge(raw)
    if not cells:
        raise InputError(f"mesh file {path} holds no cells; save the mesh with its elements")
    points = _points(raw, path)
    _refuse_missing_nodes(cells, len(points), path, content)
    _add_node_sets(raw, cells, groups)
    if path.suffix.lower() in VTK and "wedge" in cells:
        cells["wedge"] = _upright(cells["wedge"], points)
    if path.suffix.lower() == MED:
        cells = {kind: in_vtk_order(kind, rows, points) for kind, rows in cells.items()}
    mesh = Mesh(
        points=points * LENGTH_UNITS[length_unit],
        cells=cells,
        groups=groups,
        source=path.name,
        sha256=hashlib.sha256(content).hexdigest(),
        scale=LENGTH_UNITS[length_unit],
    )
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


def _grouped(mesh: Mesh) -> Mesh:
    """Return a mesh without groups with one, ``body``, of all its cells of the highest dimension."""
    if mesh.groups or not mesh.cells:
        return mesh
    highest = max(map(cell_dimension, mesh.cells))
    body = {kind: np.arange(len(rows)) for kind, rows in mesh.cells.items() if cell_dimension(kind) == highest}
    return mesh.with_(groups={"body": body})


def _deck(mesh: Mesh, path: Path, length_unit: str, mass_unit: str | None) -> Mesh:
    """A deck in metres is taken to be in kg; for every other unit of length the unit of mass must be given."""
    if mesh.properties and mass_unit is None and length_unit != "m":
        raise InputError(
            f"mesh file {path} brings its own materials: give their mass_unit "
            f"({', '.join(MASS_UNITS)}; commonly 't' with mm, 'slinch' with in)"
        )
    return mesh


def _checked(mesh: Mesh, path: Path) -> Mesh:
    refuse_far_points(mesh.points, mesh.labels, f"mesh file {path}")
    return mesh


def _read_with_meshio(path: Path, content: bytes) -> Any:
    import meshio
    from meshio._helpers import extension_to_filetypes

    if path.suffix.lower() not in extension_to_filetypes:
        known = ", ".join(sorted({*extension_to_filetypes, *BY_ENDING, *UNIVERSAL, *CAD}))
        raise InputError(f"mesh file {path}: the format {path.suffix!r} is not known; known are {known}")
    content = content.removeprefix(codecs.BOM_UTF8)
    damaged = f"mesh file {path} is damaged or cut short; export it again (.msh 4.1 is best)"
    if path.suffix == ".msh" and not _msh_is_whole(content):
        raise InputError(damaged)
    try:  # meshio prints its complaint and calls sys.exit
        with (
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()),
            limited_unpacking(len(content)),
        ):
            refuse_packed_datasets(path, content)
            learn_cells()
            return _read_msh(path) if path.suffix == ".msh" else meshio.read(path)
    except (Exception, SystemExit) as error:
        raise InputError(f"{damaged}; the reader said: {str(error).strip() or type(error).__name__}") from None


def _read_msh(path: Path) -> Any:
    """Read a file of gmsh from behind a byte-order mark, which meshio does not know."""
    from meshio.gmsh.main import read_buffer

    with path.open("rb") as file:
        if file.read(len(codecs.BOM_UTF8)) != codecs.BOM_UTF8:
            file.seek(0)
        return read_buffer(file)


def _msh_is_whole(content: bytes) -> bool:
    """Whether the last section of a .msh file is closed and, in text of version 4.1, every section has its lines.

    The reader behind meshio does not notice a missing line: the numbers after it slip to other nodes.
    """
    last = content.rstrip().rsplit(b"\n", 1)[-1].strip()
    sections = re.findall(rb"^\$(?!End)(\w+)\s*$", content, re.MULTILINE)
    if last not in (b"$End" + section for section in sections):
        return False
    if not re.match(rb"\$MeshFormat\s+4\.1\s+0\s", content):
        return True
    return _has_its_lines(content, b"Nodes", 2) and _has_its_lines(content, b"Elements", 1)


def _has_its_lines(content: bytes, section: bytes, per_entry: int) -> bool:
    found = re.search(rb"^\$" + section + rb"\s*\n(.*?)^\$End" + section, content, re.MULTILINE | re.DOTALL)
    lines = found[1].splitlines() if found else [b""]
    try:
        blocks, entries = (int(number) for number in lines[0].split()[:2])
    except ValueError:
        return False
    if section == b"Elements" and not _nodes_are_numbered_from_one(lines[1:]):
        return False
    return len(lines) == 1 + blocks + per_entry * entries


def _nodes_are_numbered_from_one(lines: list[bytes]) -> bool:
    """Walk the blocks of $Elements: a header ``dim tag type count``, then ``number node node ...``."""
    while lines:
        header = lines[0].split()
        if len(header) != 4 or not header[3].isdigit():
            return False
        count = int(header[3])
        if any(b"0" in line.split()[1:] for line in lines[1 : count + 1] if b" 0" in line):
            return False
        lines = lines[count + 1 :]
    return True


def _points(raw: Any, path: Path) -> np.ndarray:
    points = np.asarray(raw.points, dtype=float)
    points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    refuse_far_points(points, np.zeros(0), f"mesh file {path}")
    return points


def _refuse_missing_nodes(cells: dict[str, np.ndarray], n_points: int, path: Path, content: bytes) -> None:
    negative = path.suffix == ".msh" and re.search(rb"\$Elements\r?\n(?:[\d \r\n]*)-", content)
    for kind, conn in cells.items():
        bad = np.flatnonzero(np.any((conn < 0) | (conn >= n_points), axis=1))
        if len(bad) or negative:
            number = bad[0] + 1 if len(bad) else "?"
            raise InputError(
                f"mesh file {path}: {kind} cell {number} refers to a node that is not there; export it again"
            )


def _add_node_sets(raw: Any, cells: dict[str, np.ndarray], groups: dict[str, dict[str, np.ndarray]]) -> None:
    """Give every node set of the file vertex cells, in the group of its name if that has none."""
    for name, nodes in raw.point_sets.items():
        rows = cells.get("vertex", np.zeros((0, 1), dtype=int))
        if len(nodes) and "vertex" not in groups.get(name, {}):
            groups.setdefault(name, {})["vertex"] = np.arange(len(rows), len(rows) + len(nodes))
            cells["vertex"] = np.concatenate([rows, np.asarray(nodes, dtype=int)[:, None]])


def _merge(raw: Any) -> tuple[dict[str, np.ndarray], dict[str, dict[str, np.ndarray]]]:
    """Merge meshio's blocks of equal type, keeping an element that is listed twice only once."""
    kinds = list(dict.fromkeys(block.type for block in raw.cells))
    cells, groups = {}, {}
    for kind in kinds:
        blocks = [i for i, block in enumerate(raw.cells) if block.type == kind]
        stacked = np.concatenate([raw.cells[i].data for i in blocks])
        _, first, row = np.unique(numbered(stacked), return_index=True, return_inverse=True)
        order = np.argsort(np.argsort(first))  # keep the file's order
        cells[kind] = stacked[np.sort(first)]
        for name, members in _block_groups(raw, blocks).items():
            groups.setdefault(name, {})[kind] = np.unique(order[row[members]])
    return cells, groups


def _upright(wedges: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Turn wedges ``(k, 6)`` that stand on their head: meshio swaps their nodes, as VTK no longer does."""
    base = points[wedges[:, :3]]
    normal = np.cross(base[:, 1] - base[:, 0], base[:, 2] - base[:, 0])
    height = points[wedges[:, 3:]].mean(axis=1) - base.mean(axis=1)
    down = np.einsum("ij,ij->i", normal, height) < 0
    return np.where(down[:, None], wedges[:, [0, 2, 1, 3, 5, 4]], wedges)


def _block_groups(raw: Any, blocks: list[int]) -> dict[str, np.ndarray]:
    """Return {group name: rows in the concatenation of `blocks`}."""
    start = np.cumsum([0] + [len(raw.cells[i].data) for i in blocks])
    found: dict[str, list[np.ndarray]] = {}
    for name, sets in raw.cell_sets.items():
        for offset, i in zip(start, blocks, strict=False):
            if not name.startswith("gmsh:") and sets[i] is not None and len(sets[i]):
                found.setdefault(name, []).append(np.asarray(sets[i], dtype=int) + offset)
    if not raw.cell_sets and "gmsh:physical" in raw.cell_data:  # .msh 2.2
        numbers = np.concatenate([raw.cell_data["gmsh:physical"][i] for i in blocks])
        dimension = cell_dimension(raw.cells[blocks[0]].type)
        for name, (number, dim) in raw.field_data.items():
            if dim == dimension and np.any(numbers == number):
                found[name] = [np.flatnonzero(numbers == number)]
    if not raw.cell_sets and not raw.field_data:
        found |= _numbered_groups(raw, blocks)
    return {name: np.concatenate(rows) for name, rows in found.items()}


def _numbered_groups(raw: Any, blocks: list[int]) -> dict[str, list[np.ndarray]]:
    """One group ``<array>_<value>`` for each value of an integer cell array, as .vtu files carry them."""
    found = {}
    for name, values in raw.cell_data.items():
        array = np.concatenate([values[i] for i in blocks])
        if array.ndim == 1 and np.issubdtype(array.dtype, np.integer) and name.removeprefix("gmsh:") != "geometrical":
            for value in np.unique(array):
                found[f"{name.removeprefix('gmsh:')}_{value}"] = [np.flatnonzero(array == value)]
    return found
