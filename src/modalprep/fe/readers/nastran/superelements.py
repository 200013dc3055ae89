"""Nastran part superelements (BEGIN SUPER): each part a mesh of its own, joined to the others at its boundary grids."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import combinations
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from modalprep.fe.mesh.join import join_meshes
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.grids import system_from_points
from modalprep.fe.readers.systems import BASIC, System

NUMBER = re.compile(r"SUPER\s*=?\s*(\d+)")
OWN = ("SEBULK", "SELOC", "SECONCT", "SETREE", "SEELT", "SEEXCLD", "SELABEL", "SEBNDRY", "SESET", "SECSET1", "SEQSET1")
REFUSED = {"SEMPLN": "it mirrors a part", "CSUPER": "its part has no cards of its own"}
TOLERANCE = 1e-5  # of Nastran, in units of the deck
Pair = tuple[tuple[int, int], tuple[int, int]]


def sections(cards: list[Any]) -> dict[int, list[Any]]:
    """Return the cards, also in blocks, of each part by its number, those of the residual structure by 0.

    Raises
    ------
    InputError
        When a part has no number, or a card moves, copies or replaces a part.
    """
    found: dict[int, list[Any]] = {0: []}
    part = 0
    for card in cards:
        if card.name == "BEGIN":
            match = NUMBER.search("BEGIN SU" + "".join(card.fields) if card.fields else "")
            if not match:
                raise card.error("the number of the superelement is missing; write BEGIN SUPER = 1")
            part = int(match[1])
            found.setdefault(part, [])
        elif card.name in REFUSED:
            raise card.error(f"{REFUSED[card.name]}, which is not read; give the parts in place, as parts of their own")
        else:
            found[part].append(card)
    return found


def read_parts(parts: dict[int, list[Card]], build: Callable[[int, list[Card], System], Mesh]) -> Mesh:
    """Return the mesh of the residual structure and of all parts, joined by SECONCT and where grids coincide.

    SEBULK REPEAT makes a part like another one; SELOC puts a part where three of its grids lie on three of the residual
    structure. Groups and supports of part 2
    begin with ``part2_``; `join_meshes` says which numbers the grids have.
    """
    own = {number: [card for card in cards if card.name not in OWN] for number, cards in parts.items()}
    listed = {number: cards for number, cards in own.items() if any(c.name == "GRID" for c in cards)}
    tables = [card for cards in parts.values() for card in cards if card.name in OWN]
    listed |= _repeated(tables, listed)
    meshes = {number: build(number, cards, BASIC) for number, cards in listed.items()}
    for card in (card for card in tables if card.name == "SELOC"):
        meshes[card.id] = build(card.id, listed.get(card.id, []), _moved(card, meshes))
    manual = set()
    for card in (card for card in tables if card.name == "SEBULK"):
        if card.text(1) not in ("", "PRIMARY", "REPEAT"):
            raise card.error(f"a part of type {card.text(1)} is not read; {_instead(card)}")
        manual |= {card.id} if card.text(3) == "MANUAL" else set()
    same = [pair for card in tables if card.name == "SECONCT" for pair in _connected(card, meshes)]
    same += _coincident({number: mesh for number, mesh in meshes.items() if number not in manual})
    rows = {number: {int(grid): k for k, grid in enumerate(mesh.labels)} for number, mesh in meshes.items()}
    return join_meshes(meshes, [((a, rows[a][i]), (b, rows[b][j])) for (a, i), (b, j) in same])


def _repeated(tables: list[Card], listed: dict[int, list[Card]]) -> dict[int, list[Card]]:
    """Return the cards of parts that repeat others (SEBULK REPEAT), which SELOC puts elsewhere."""
    placed = {card.id for card in tables if card.name == "SELOC"}
    found = {}
    for card in (card for card in tables if card.name == "SEBULK" and card.text(1) == "REPEAT"):
        of = card.integer(2, "RSEID", lowest=1)
        if of not in listed or card.id in listed:
            what = f"part {of}, which it repeats, has no cards" if of not in listed else "it has cards of its own"
            raise card.error(f"{what}; give the part that is repeated by BEGIN SUPER, and none for its copy")
        if card.id not in placed:
            raise card.error(f"a copy of part {of} needs its place; add SELOC")
        found[card.id] = listed[of]
    return found


def _moved(card: Card, meshes: dict[int, Mesh]) -> System:
    """SELOC: the system that the basic one of a part becomes; the first grids coincide, the others give directions."""
    triads = []
    for part, first in ((card.id, 1), (0, 4)):
        numbers = [card.integer(k, "a grid", lowest=1) for k in range(first, first + 3)]
        if part not in meshes or not np.isin(numbers, meshes[part].labels).all():
            raise card.error(
                f"grids {numbers} are not in {f'part {part}' if part else 'the residual structure'}; add them"
            )
        mesh = meshes[part]
        triads.append(system_from_points(card, mesh.points[np.searchsorted(mesh.labels, numbers)] / mesh.scale))
    own, other = triads
    turn = other.axes.T @ own.axes
    return System("R", other.origin - turn @ own.origin, turn.T)


def _instead(card: Card) -> str:
    if not card.text(1).startswith("EXTOP"):
        return "give PRIMARY parts with their own cards"
    return (
        "it is reduced already and has no mesh: read its .op4 file as a body ([bodies.NAME] file), with its .asm and "
        ".pch beside it, and join the bodies by [welds] and [synthesis]"
    )


def _connected(card: Card, meshes: dict[int, Mesh]) -> Iterator[Pair]:
    """Yield the grids that a SECONCT joins: pairs, or two ranges of the same length."""
    a, b = card.integer(0, "SEIDA", lowest=0), card.integer(1, "SEIDB", lowest=0)
    words = [text for text in card.fields[8:] if text]
    while words:
        span = 6 if words[1:2] == ["THRU"] else 2
        inner = Card(card.name, words[:span], card.file, card.line)
        words = words[span:]
        at = (0, 3) if span == 6 else (0, 1)
        first, second = (inner.integer(k, "a grid", lowest=1) for k in at)
        count = inner.integer(2, "the last grid") - first + 1 if span == 6 else 1
        for k in range(count):
            pair = (a, first + k), (b, second + k)
            if all(part in meshes and grid in meshes[part].labels for part, grid in pair):
                yield pair
            elif span == 2 and any(part in meshes and grid in meshes[part].labels for part, grid in pair):
                raise card.error(f"grids {first} and {second} cannot be joined, because one of them is not in its part")


def _coincident(meshes: dict[int, Mesh]) -> list[Pair]:
    """Return the grids of different parts that lie in one place."""
    found = []
    for (a, one), (b, other) in combinations(meshes.items(), 2):
        near = cKDTree(one.points).query(other.points, distance_upper_bound=TOLERANCE * one.scale)[1]
        found += [
            ((a, int(one.labels[i])), (b, int(other.labels[k]))) for k, i in enumerate(near) if i < len(one.points)
        ]
    return found
