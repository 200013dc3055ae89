"""Nastran bulk data decks: grids, elements, sections and rigid elements to a mesh in SI units."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.nastran import constraints as nastran_constraints
from modalprep.fe.readers.nastran import links as nastran_links
from modalprep.fe.readers.nastran.alike import add_alike
from modalprep.fe.readers.nastran.analysis import add_cases
from modalprep.fe.readers.nastran.builder import Builder, Gaps
from modalprep.fe.readers.nastran.cards import INTEGER, Card
from modalprep.fe.readers.nastran.elements import note_integration
from modalprep.fe.readers.nastran.grids import Grids, Tables
from modalprep.fe.readers.nastran.handedness import turn_left_handed
from modalprep.fe.readers.nastran.matrices import add_matrices
from modalprep.fe.readers.nastran.nonstructural import add_nonstructural_mass
from modalprep.fe.readers.nastran.points import add_scalar_masses
from modalprep.fe.readers.nastran.reader import Deck, one_by_one, read_cards
from modalprep.fe.readers.nastran.registry import REGISTRY, Table, refuse_surplus, unused
from modalprep.fe.readers.nastran.runs import CardBlock
from modalprep.fe.readers.nastran.superelements import read_parts, sections
from modalprep.fe.readers.systems import BASIC, System
from modalprep.fe.readers.units import Units

ADVICE = (
    "the reader does not know these cards; replace by cards that are read, such as RBE2, RBE3, CONM2, CBUSH, what of "
    "these carries mass, stiffness or constraints"
)
HARMLESS = "they carry no stiffness, mass or constraints"
IGNORED = "the ignore of this mesh names them"


def read_nastran(
    path: Path, length: float, mass: float, ignore: Collection[str] = (), gaps: Gaps | None = None
) -> Mesh:
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
    ignore : collection of str
        Names of cards that are left out; those that carry stiffness, mass or constraints and cannot be read are
        refused otherwise.
    gaps : {"open", "closed"}, optional
        Which stiffness elements of CGAP have; a deck with some is refused without.

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
            return _mesh_of_parts(
                path, deck, Units(length=length, mass=mass), {name.strip().upper() for name in ignore}, gaps
            )
    except ArithmeticError:
        raise InputError(f"{path.name}: its numbers overflow; correct its coordinates and values") from None


def _mesh_of_parts(path: Path, deck: Deck, units: Units, ignore: set[str], gaps: Gaps | None) -> Mesh:
    parts = sections(deck.entries)
    if len(parts) == 1 and not any(entry.name == "SEBULK" for entry in deck.entries):
        mesh = _mesh(path, replace(deck, entries=_with_blocks_alone(deck.entries)), units, ignore, gaps)
    else:
        parts = {number: one_by_one(own) for number, own in parts.items()}
        mesh = read_parts(
            path,
            parts,
            units,
            lambda k, own, basic: _mesh(
                path, replace(deck, entries=own, ended=deck.ended or k > 0), units, ignore, gaps, basic
            ),
        )
    if all(kind == "vertex" for kind in mesh.cells):
        raise InputError(f"{path.name}: the deck has no elements that can be read; give the deck with its elements")
    return mesh


def _with_blocks_alone(entries: list[Card | CardBlock]) -> list[Card | CardBlock]:
    """Return the entries with blocks one by one where other cards may have their ids, or defaults of their fields."""
    blocks = [entry for entry in entries if isinstance(entry, CardBlock)]
    names = {entry.name for entry in entries if isinstance(entry, Card)}
    split = {"GRID"} if "GRDSET" in names else set()
    for name in {block.name for block in blocks} - split:
        own = [
            int(e.text(0)) for e in entries if isinstance(e, Card) and e.name == name and INTEGER.fullmatch(e.text(0))
        ]
        ids = np.concatenate([own, *(block.ids for block in blocks if block.name == name)])
        if len(np.unique(ids)) < len(ids):
            split.add(name)
    return [one for e in entries for one in (one_by_one([e]) if e.name in split else [e])]


def _mesh(path: Path, deck: Deck, units: Units, ignore: set[str], gaps: Gaps | None, basic: System = BASIC) -> Mesh:
    tables, grids, structure, notes = _sorted(deck.entries, ignore)
    if not deck.ended:
        notes.append("the deck has no ENDDATA; if it was cut short, elements are missing")
    notes += unused(entry for entry in deck.entries if isinstance(entry, Card))
    builder = Builder(tables, Grids(path, tables, grids, basic), replace(units, wtmass=_wtmass(tables)), gaps)
    for entry in structure:
        if isinstance(entry, CardBlock) and add_alike(builder, entry):
            continue
        handler = REGISTRY[entry.name].handle
        assert handler is not None  # cards that are left out are not structure
        for card in one_by_one([entry]):
            builder.add(card, handler)
    turn_left_handed(builder)
    note_integration(builder)
    add_scalar_masses(builder)
    add_nonstructural_mass(builder, path)
    add_matrices(builder, path)
    nastran_constraints.add_equations(builder, path)
    nastran_links.add_node_sets(builder)
    add_cases(builder, path)
    return builder.mesh(path, deck.sha256, notes)


def _sorted(
    entries: list[Card | CardBlock], ignore: set[str]
) -> tuple[Tables, list[CardBlock], list[Card | CardBlock], list[str]]:
    """Return the cards that others refer to, by family and id, blocks of grids, elements and links, and notes."""
    tables: Tables = {}
    grids: list[CardBlock] = []
    structure: list[Card | CardBlock] = []
    others: dict[str, list[tuple[str, str]]] = {ADVICE: [], HARMLESS: [], IGNORED: []}
    refused: list[Card] = []
    for card in entries:
        entry = REGISTRY.get(card.name)
        if isinstance(card, CardBlock):
            if card.name in ignore:
                others[IGNORED] += [(card.name, f"{card.file} line {card.run.first + 1}")] * len(card.values)
            else:
                (grids if card.name == "GRID" else structure).append(card)
            continue
        place = (card.name[:16], f"{card.file} line {card.line}")
        if card.name in ignore:
            others[IGNORED].append(place)
        elif entry is None:
            others[ADVICE].append(place)
        elif isinstance(entry.handle, Table):
            refuse_surplus(card)
            entry.handle(tables, card)
        elif entry.handle:
            refuse_surplus(card)
            structure.append(card)
        elif entry.treatment == "refused":
            refused.append(card)
        elif entry.remark:
            others[HARMLESS].append(place)
    if refused:
        raise _refusal(refused)
    return tables, grids, structure, [note for advice, found in others.items() for note in left_out(found, advice)]


def _refusal(cards: list[Card]) -> InputError:
    """Return the error that names every card that cannot be read, and the way round."""
    names = sorted({card.name for card in cards})
    counted = ", ".join(f"{sum(card.name == name for card in cards)} {name}" for name in names)
    listed = ", ".join(f"'{name}'" for name in names)
    return cards[0].error(
        f"{REGISTRY[cards[0].name].remark} The deck has {counted}; replace them, "
        f"or leave them out by ignore = [{listed}]"
    )


def _wtmass(tables: Tables) -> float:
    for card in tables.get("PARAM", {}).values():
        if card.text(0) == "WTMASS":
            if (factor := card.real(1, "WTMASS")) > 0:
                return factor
            raise card.error(f"WTMASS = {factor:g} must be positive; give 1. or 1/g")
    return 1.0
