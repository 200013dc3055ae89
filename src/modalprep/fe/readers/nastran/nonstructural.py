"""Nonstructural mass of Nastran: NSM and NSM1 per length or area, NSML and NSML1 as a whole, joined by NSMADD."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.properties.properties import Beam, Property, Shell, Truss
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.constraints import selected

LISTS = ("NSM", "NSM1", "NSML", "NSML1", "NSMADD")
LAID_OUT = {"PBAR": "pbarl", "PBEAM": "pbeaml"}  # properties by dimensions, which are of these types too


class Place(NamedTuple):
    """A cell of an element: its group, its kind and its row."""

    group: str
    kind: str
    row: int


def add_nonstructural_mass(b: Builder, path: Path) -> None:
    """Add the mass of the set that the deck's case control selects, or of its only one."""
    cards = [card for name in LISTS[:-1] for card in b.tables.get(name, {}).values()]
    joined = {card.id: card.numbers(1, "a set", b.grids.ids) for card in b.tables.get("NSMADD", {}).values()}
    if b.bare:
        return
    parts = {n for chosen in selected(b, path, "NSM", cards, joined) for n in joined.get(chosen, [chosen])}
    for card in cards:
        if card.id in parts:
            for value, places in _shares(b, card):
                _give(b, card, value, places)


def _shares(b: Builder, card: Card) -> Iterator[tuple[float, list[Place]]]:
    """Yield the values of a card, per length or area in SI, and the cells that have them."""
    kind = card.text(1)
    if card.name.endswith("1"):
        pairs = [(card.real(2, "VALUE"), _numbers(b, card, kind))]
    else:
        pairs = [(card.real(k + 1, "VALUE"), [card.integer(k, "ID", lowest=1)]) for k in range(2, len(card.fields), 2)]
    for value, numbers in pairs:
        places = [place for number in numbers for place in _places(b, card, kind, number)]
        if not places:
            raise card.error(f"no element of the deck belongs to {kind} {numbers[:3]}; correct its list")
        sizes = [_size(b, place) for place in places]
        if card.name.startswith("NSML"):
            yield value * b.units.inertial / sum(sizes), places
        else:
            power = CELLS[places[0].kind].dimension
            yield value * b.units.inertial / b.units.length**power, places


def _numbers(b: Builder, card: Card, kind: str) -> list[int]:
    """Return the numbers of NSM1 and NSML1: a list, ``a THRU b BY c``, or ALL."""
    words = " ".join(card.fields[3:]).split()
    if words == ["ALL"]:
        return list(b.places) if kind == "ELEMENT" else _known(b, kind)
    step = 1
    if "BY" in words:
        step = Card(card.name, words, card.file, card.line).integer(words.index("BY") + 1, "BY", lowest=1)
        words = words[: words.index("BY")]
    known = np.array(sorted(b.places if kind == "ELEMENT" else _known(b, kind)), dtype=int)
    found = Card(card.name, words, card.file, card.line).numbers(0, "ID", known)
    return [number for number in found if (number - found[0]) % step == 0] if step > 1 else found


def _known(b: Builder, kind: str) -> list[int]:
    return [int(name.rsplit("_", 1)[1]) for name in b.groups if name.rsplit("_", 1)[0] in _names(kind)]


def _names(kind: str) -> set[str]:
    return {kind.lower(), LAID_OUT.get(kind, kind.lower())}


def _places(b: Builder, card: Card, kind: str, number: int) -> list[Place]:
    """Return the cells of an element, or of all elements of a property."""
    if kind == "ELEMENT":
        if number not in b.places:
            raise card.error(f"element {number} is not in the deck; correct its list")
        return [Place(*place) for place in b.places[number] if not place[0].startswith("cshear_")]
    names = [f"{name}_{number}" for name in _names(kind) if f"{name}_{number}" in b.groups]
    return [Place(name, cell, row) for name in names for cell, rows in b.groups[name].items() for row in rows]


def _size(b: Builder, place: Place) -> float:
    """Return the length, m, or the area, m^2, of a cell with straight edges."""
    cell = CELLS[place.kind]
    nodes = b.cells[place.kind][place.row][: len(cell.corners)]
    x = np.array([b.centre([node], b.grids.points) for node in nodes]) * b.units.length
    if cell.dimension == 1:
        x = x + b.data.get(("ends", place.kind), {}).get(place.row, 0.0)
        return float(np.linalg.norm(x[1] - x[0]))
    return float(np.linalg.norm(np.cross(x[2] - x[0], x[-1] - x[1]))) / 2


def _give(b: Builder, card: Card, value: float, places: list[Place]) -> None:
    """Add a mass to the section of cells; those of a part of a group become a group of their own."""
    of: dict[str, list[Place]] = {}
    for place in dict.fromkeys(places):
        of.setdefault(place.group, []).append(place)
    for name, own in of.items():
        if sum(len(rows) for rows in b.groups[name].values()) > len(own):
            name = _split(b, name, own)
        b.properties[name] = _heavier(card, b.properties[name], value)


def _split(b: Builder, name: str, own: list[Place]) -> str:
    """Move cells of a group to a new one with the same section, and return its name."""
    number = next(k for k in range(1, len(b.groups) + 2) if f"{name}_nsm{k}" not in b.groups)
    new = f"{name}_nsm{number}"
    b.properties[new] = b.properties[name]
    moved = set(own)
    for kind, rows in list(b.groups[name].items()):
        apart = [row for row in rows if Place(name, kind, row) in moved]
        b.groups[name][kind] = [row for row in rows if Place(name, kind, row) not in moved]
        b.groups.setdefault(new, {})[kind] = apart
    for group in (name, new):
        b.groups[group] = {kind: rows for kind, rows in b.groups[group].items() if rows}
    for found in b.places.values():
        found[:] = [(new, *place[1:]) if Place(*place) in moved else place for place in found]
    return new


def _heavier(card: Card, section: Property, value: float) -> Property:
    if isinstance(section, Beam):
        taper = tuple((*station[:-1], station[-1] + value) for station in section.taper)
        return replace(section, nsm=section.nsm + value, taper=taper)
    if isinstance(section, (Shell, Truss)):
        return replace(section, nsm=section.nsm + value)
    raise card.error(
        "its elements are neither lines nor surfaces, which alone have nonstructural mass; correct its list"
    )
