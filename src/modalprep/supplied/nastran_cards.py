"""Cards that Nastran writes beside the matrices of an external superelement: boundary, axes, tables of rows.

EXTSEOUT writes the .pch file for the part itself (BEGIN SUPER, EXTRN, ASET, GRID, CORD2R, SPOINT and DTI tables) and
the .asm file for the assembly (SEBULK, SECONCT, GRID, CORD2R, SPOINT). EXTRN lists the rows of the matrices.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.extrn import LONGEST, boundary_points, refuse_long
from modalprep.fe.readers.nastran.grids import deck_grids
from modalprep.fe.readers.nastran.reader import read_cards


class TableRow(NamedTuple):
    """A line of a DTI table: type (1 grid, 2 scalar point, else of the element), id, components and first row."""

    kind: int
    number: int
    components: int
    first: int


class Cards(NamedTuple):
    """The boundary of an external superelement.

    Attributes
    ----------
    points : {id: components}
        In the order of the rows of the matrices, components as ``"123456"``, of scalar points ``""``.
    position : {id: (3,)}
        Of the grids, basic coordinates in units of the deck.
    axes : {id: (3, 3)}
        Columns: axes of the grid's displacements.
    tables : {name: list of TableRow}
        DTI tables of rows, such as TUG1.
    """

    points: dict[int, str]
    position: dict[int, np.ndarray]
    axes: dict[int, np.ndarray]
    tables: dict[str, list[TableRow]]


def read_boundary(assembly: Path | None, punch: Path | None) -> Cards:
    """Return the boundary from the .asm and the .pch file, one of which may be missing.

    The .pch file alone says all. Without it every grid has six components, as the .asm file cannot say otherwise.

    Raises
    ------
    InputError
        When a file is damaged, or lacks what the boundary needs.
    """
    files = [path for path in (punch, assembly) if path is not None]
    cards = {path: read_cards(path).cards for path in files}
    tables: dict[str, list[TableRow]] = {}
    if punch is not None:
        found = [card for card in cards[punch] if card.name == "EXTRN"]
        points = boundary_points(found)
        if not points:
            raise InputError(f"{punch} has no EXTRN card, which lists the rows of the matrices; export it again")
        tables = _tables(cards[punch])
    else:
        points = _connected(files[0], cards[files[0]])
    grids = deck_grids(files[0], cards[files[0]])
    if grids is None:
        raise InputError(f"{files[0]} has no GRID cards, which say where the boundary is; export it again")
    missing = [number for number, components in points.items() if components and number not in grids.row]
    if missing:
        raise InputError(f"{files[0]} names grid {missing[0]} on the boundary, but has no GRID card of it")
    rows = {number: grids.row[number] for number, components in points.items() if components}
    return Cards(
        points,
        {number: grids.points[row] for number, row in rows.items()},
        {number: grids.displacement(row).T for number, row in rows.items()},
        tables,
    )


def _connected(path: Path, cards: list[Card]) -> dict[int, str]:
    """Return the points of the part that SECONCT joins, in order: grids with six components, and scalar points."""
    grids = {card.id for card in cards if card.name == "GRID"}
    found: dict[int, str] = {}
    for card in (card for card in cards if card.name == "SECONCT"):
        words = [text for text in card.fields[8:] if text]
        while words:
            span = 6 if words[1:2] == ["THRU"] else 2
            part = Card(card.name, words[:span], card.file, card.line)
            words = words[span:]
            first = part.integer(0, "a point", lowest=1)
            last = part.integer(2, "the last point", lowest=first) if span == 6 else first
            refuse_long(part, last - first)
            found |= {number: "123456" if number in grids else "" for number in range(first, last + 1)}
    if not found:
        raise InputError(f"{path} has no SECONCT card, which lists the boundary; give the .pch file too")
    return found


def _tables(cards: list[Card]) -> dict[str, list[TableRow]]:
    """Return the second records of the DTI tables: TYPE, ID, COMP, ROW of each line."""
    found = {}
    for card in cards:
        if card.name == "DTI" and card.text(1) == "2" and "ROW" in card.fields:
            words = [text for text in card.fields[2:] if text.lstrip("-").isdigit()]
            numbers = [int(text) for text in words[: len(words) // 4 * 4]]
            lines = [TableRow(*numbers[k : k + 4]) for k in range(0, len(numbers), 4)]
            if len(words) % 4 or not lines or any(not 0 < line.components <= LONGEST for line in lines):
                raise card.error("its lines of type, id, components and row are damaged or cut short; export it again")
            found[card.text(0)] = lines
    return found
