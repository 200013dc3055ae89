"""External superelements in a Nastran deck (SEBULK EXTOP4): stiffness and mass between grids from an OUTPUT4 file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import csr_array

from modalprep.fe.mesh.mesh import MatrixElement, Mesh
from modalprep.fe.readers.entries import Labelled, in_basic_axes
from modalprep.fe.readers.matrix_elements import matrix_element
from modalprep.fe.readers.nastran.assign import assigned
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.extrn import boundary_points
from modalprep.fe.readers.nastran.grids import deck_grids
from modalprep.fe.readers.output4 import read_output4
from modalprep.fe.readers.systems import System
from modalprep.fe.readers.units import Units

STIFFNESS, MASS = ("KXX", "KAA", "KAAX"), ("MXX", "MAA", "MAAX")  # names that EXTSEOUT gives
LEFT_OUT = {
    "its damping": ("BXX1", "BXX", "BAA", "BAAX", "K4XX1", "K4XX", "K4AA", "K4AAX"),
    "its loads": ("PX", "PA", "PAX"),
}
UNITNO = 6  # field of SEBULK
AS_BODY = (
    "read the .op4 file as a body ([bodies.NAME] file), with its .asm and .pch beside it, and join the bodies by "
    "[welds] and [synthesis]"
)


def with_matrices(path: Path, card: Card, part: list[Card], mesh: Mesh, basic: System, units: Units) -> Mesh:
    """Return the mesh of the grids of a part with its matrices, which `card`, its SEBULK, names by a unit number.

    Raises
    ------
    InputError
        When the file is not assigned or missing, does not fit EXTRN, or has generalised coordinates.
    """
    points = boundary_points(one for one in part if one.name == "EXTRN")
    if not points:
        raise card.error(
            "its part has no EXTRN, which lists the rows of its matrices; INCLUDE the .pch file of the part"
        )
    if any(kind != "vertex" for kind in mesh.cells):
        raise card.error("its part has elements and matrices; leave one of them out")
    modes = sum(not components for components in points.values())
    if modes:
        raise card.error(f"its matrices have {modes} generalised coordinates, which no mesh has; {AS_BODY}")
    file = _assigned(path, card)
    matrices = {name.upper(): A for name, A in read_output4(file).items()}
    rows = np.array([(grid, int(c) - 1) for grid, components in points.items() for c in components])
    K, M = (_one(card, file, matrices, names, rows) for names in (STIFFNESS, MASS))
    grids = deck_grids(path, part, basic)
    known = {int(number): k for k, number in enumerate(mesh.labels)}
    for number in points:
        if grids is None or number not in known:
            raise card.error(f"EXTRN names grid {number}, which is not in its part; add its GRID card")
    axes = {number: grids.displacement(grids.row[number]).T for number in points} if grids else {}
    K, M = (in_basic_axes(A, axes) for A in (K, M))
    where = f"SEBULK {card.id} ({card.file} line {card.line})"
    own: MatrixElement = matrix_element(K, M, known.__getitem__, units, where)
    said = [
        f"{file.name}: {what} ({name}) is left out"
        for what, names in LEFT_OUT.items()
        for name in names
        if _given(matrices, name)
    ]
    return mesh.with_(matrices=(*mesh.matrices, own), notes=(*mesh.notes, *said))


def _given(matrices: dict[str, csr_array], name: str) -> bool:
    return name in matrices and bool(np.any(matrices[name].data))


def _assigned(path: Path, card: Card) -> Path:
    """Return the file that the deck assigns to the unit of a SEBULK."""
    unit = card.integer(UNITNO, "UNITNO", lowest=1)
    file = assigned(path).get(unit)
    if file is None:
        raise card.error(
            f"no file is assigned to unit {unit}; write ASSIGN INPUTT4='name.op4', UNIT={unit} before CEND"
        )
    if not file.is_file():
        raise card.error(f"the file {file.name} of unit {unit} is not there; put it beside {path.name}")
    return file


def _one(card: Card, file: Path, matrices: dict[str, csr_array], names: tuple[str, ...], rows: np.ndarray) -> Labelled:
    name = next((name for name in names if name in matrices), None)
    if name is None:
        raise card.error(f"{file.name} has none of {', '.join(names)}; it has {', '.join(matrices)}")
    if matrices[name].shape != (len(rows), len(rows)):
        size = "x".join(map(str, matrices[name].shape))
        raise card.error(
            f"{name} of {file.name} is {size}, but EXTRN lists {len(rows)} rows; give the files of one part"
        )
    if np.iscomplexobj(matrices[name].data):
        raise card.error(f"{name} of {file.name} is complex; write real matrices")
    return Labelled(matrices[name], rows)
