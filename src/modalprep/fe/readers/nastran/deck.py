"""Nastran bulk data decks: grids, elements, sections and rigid elements to a mesh in SI units."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.nastran import constraints as nastran_constraints
from modalprep.fe.readers.nastran import elements as nastran_elements
from modalprep.fe.readers.nastran import links as nastran_links
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card, Deck, read_cards
from modalprep.fe.readers.nastran.grids import Grids, Tables
from modalprep.fe.readers.nastran.materials import Units
from modalprep.fe.readers.nastran.superelements import read_parts, sections
from modalprep.fe.readers.nastran.unused import unused

# Cards with an id share it within a family; every other card that is read stands for itself.
FAMILY = {
    **dict.fromkeys(("CORD1R", "CORD1C", "CORD1S", "CORD2R", "CORD2C", "CORD2S"), "system"),
    **dict.fromkeys(("MAT1", "MAT2", "MAT3", "MAT8", "MAT9", "MAT10", "MAT11"), "material"),
    **dict.fromkeys(("PSHELL", "PCOMP", "PCOMPG"), "shell"),
    **dict.fromkeys(("PBAR", "PBARL"), "bar"),
    **dict.fromkeys(("PBEAM", "PBEAML"), "beam"),
    **{"GRID": "grid", "PROD": "rod", "PSOLID": "solid", "PBUSH": "bush", "PELAS": "elas"},
}
LISTS = (
    "GRDSET",
    "BAROR",
    "BEAMOR",
    "PARAM",
    "SPOINT",
    "SPCADD",
    *nastran_constraints.LISTS,
    *nastran_links.SUPPORTS,
    *nastran_links.NODE_SETS,
)
SKIPPED = re.compile(
    r"PLOTEL|FORCE\d?|MOMENT\d?|PLOAD\d?|GRAV|ACCEL1?|RFORCE|[DT]?LOAD\d?|[RT]LOAD\d|DAREA|TABLE\w*|TABD\w*|EIG\w+|TSTEP\w*"
    r"|FREQ\d?|SET\d|TEMP\w*|DPHASE|DELAY|D(RESP|ESVAR|CONSTR|VPREL|OPTPRM)\w*|MDLPRM|NLPARM|SPCD|CSUPEXT|OMIT1?|ECHO\w*"
)
ADVICE = (
    "replace by cards that are read, such as RBE2, RBE3, CONM2, CBUSH, what of these carries mass, stiffness or "
    "constraints"
)
HANDLERS = {**nastran_elements.HANDLERS, **nastran_links.HANDLERS}


def read_nastran(path: Path, length: float, mass: float) -> Mesh:
    r"""Read a Nastran deck with its sections, rigid elements and constraint sets.

    A deck without any property card gives groups without properties. Groups are ``pshell_4``, ``pbar_12``,
    ``conm2_10000``, ...; node sets are vertex groups ``spc_1``, ``aset``, ``bset``, ``suport``, ... and ``grid_ps``
    (field PS of GRID), with vertex cells of their own. Grids that a set holds in some components only are the group
    ``spc_1_123``.

    Parameters
    ----------
    path : Path
    length, mass : float
        m and kg per unit of length and mass of the deck; its time is in seconds, its force mass length / s^2.

    Raises
    ------
    InputError
        When the deck is damaged or refers to what it does not hold, or a card has no counterpart here.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "rod.bdf"
    >>> text = "GRID,1\nGRID,2,,2.\nCROD,5,3,1,2\nPROD,3,7,.5\nMAT1,7,2.+11,,.3,8000.\nENDDATA"
    >>> _ = path.write_text(text)
    >>> mesh = read_nastran(path, 1.0, 1.0)
    >>> mesh.cells["line"], mesh.properties["prod_3"].A
    (array([[0, 1]]), 0.5)
    """
    if not (0 < length < math.inf and 0 < mass < math.inf):
        raise InputError(f"length {length:g} and mass {mass:g} must be positive; give m and kg per unit of the deck")
    deck = read_cards(path)
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            return _whole(path, deck, Units(length=length, mass=mass))
    except ArithmeticError:
        raise InputError(f"{path.name}: its numbers overflow; correct its coordinates and values") from None


def _whole(path: Path, deck: Deck, units: Units) -> Mesh:
    parts = sections(deck.cards)
    if len(parts) == 1:
        mesh = _mesh(path, deck, units)
    else:
        mesh = read_parts(parts, lambda k, own: _mesh(path, replace(deck, cards=own, ended=deck.ended or k > 0), units))
    if all(kind == "vertex" for kind in mesh.cells):
        raise InputError(f"{path.name}: the deck has no elements that can be read; give the deck with its elements")
    return mesh


def _mesh(path: Path, deck: Deck, units: Units) -> Mesh:
    tables, notes = _filed(deck.cards)
    if not deck.ended:
        notes.append("the deck has no ENDDATA; if it was cut short, elements are missing")
    notes += unused(deck.cards)
    grids = Grids(path, tables)
    builder = Builder(tables, grids, replace(units, wtmass=_wtmass(tables)))
    for card in deck.cards:
        if handler := HANDLERS.get(card.name):
            builder.add(card, handler)
    nastran_constraints.add_equations(builder, path)
    nastran_links.add_node_sets(builder)
    return builder.mesh(path, deck.sha256, notes)


def _filed(cards: list[Card]) -> tuple[Tables, list[str]]:
    """Return the cards that other cards refer to, by family and id, and the note on what is left out."""
    tables: Tables = {}
    unknown: list[tuple[str, str]] = []
    for card in cards:
        family = FAMILY.get(card.name)
        if family:
            for entry in _entries(card):
                known = tables.setdefault(family, {}).setdefault(entry.id, entry)
                if known.fields != entry.fields or known.name != entry.name:
                    raise entry.error(f"another {known.name} in line {known.line} has this id; keep one of the two")
        elif card.name in (*LISTS, *nastran_constraints.LISTS):
            table = tables.setdefault(card.name, {})
            table[len(table)] = card
        elif card.name not in HANDLERS and not SKIPPED.fullmatch(card.name):
            unknown.append((card.name[:16], f"{card.file} line {card.line}"))
    return tables, list(left_out(unknown, ADVICE))


def _entries(card: Card) -> list[Card]:
    """Split the cards that hold two entries."""
    if card.name[:5] != "CORD1" and card.name != "PELAS":
        return [card]
    halves = [card.fields[:4], card.fields[4:8]]
    return [Card(card.name, half, card.file, card.line) for half in halves if any(half)]


def _wtmass(tables: Tables) -> float:
    for card in tables.get("PARAM", {}).values():
        if card.text(0) == "WTMASS":
            if (factor := card.real(1, "WTMASS")) > 0:
                return factor
            raise card.error(f"WTMASS = {factor:g} must be positive; give 1. or 1/g")
    return 1.0
