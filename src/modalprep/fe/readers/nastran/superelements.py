"""Nastran part superelements (BEGIN SUPER): each part a mesh of its own, joined to the others at its boundary grids."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from modalprep.fe.mesh.join import join_meshes
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.nastran.boundaries import joined_grids
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.external import AS_BODY, with_matrices
from modalprep.fe.readers.nastran.placing import Place, placed, places
from modalprep.fe.readers.systems import BASIC, System
from modalprep.fe.readers.units import Units

NUMBER = re.compile(r"SUPER\s*=?\s*(\d+)")
OWN = (
    *("SEBULK", "SELOC", "SEMPLN", "SECONCT", "SETREE", "SEELT", "SEEXCLD", "SELABEL", "SEBNDRY", "SESET"),
    *("SECSET1", "SEQSET1", "EXTRN"),
)
REFUSED = {"CSUPER": "it makes an image of grids and elements that GRID, SESET or SEELT give to a superelement"}
COPIES = ("REPEAT", "MIRROR")
EXTERNAL = "EXTOP4"
KINDS = ("", "PRIMARY", *COPIES, EXTERNAL)


def sections(cards: list[Any]) -> dict[int, list[Any]]:
    """Return the cards, also in blocks, of each part by its number, those of the residual structure by 0.

    Raises
    ------
    InputError
        When a part has no number, or a card makes a superelement that is none by BEGIN SUPER.
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
            raise card.error(
                f"{REFUSED[card.name]}, which is not read; give parts by BEGIN SUPER and SEBULK REPEAT, MIRROR"
            )
        else:
            found[part].append(card)
    return found


def read_parts(
    path: Path, parts: dict[int, list[Card]], units: Units, build: Callable[[int, list[Card], System], Mesh]
) -> Mesh:
    """Return the mesh of the residual structure and of all parts, joined by SECONCT and where grids coincide.

    SEBULK REPEAT makes a part like another one, MIRROR its mirror image at the plane of SEMPLN; SELOC puts a part where
    three of its grids lie on three of the residual structure; EXTOP4 takes its matrices from a file. Groups and
    supports of part 2 begin with ``part2_``; `join_meshes` says which numbers the grids have.
    """
    tables = [card for cards in parts.values() for card in cards if card.name in OWN]
    bulk = {card.id: card for card in tables if card.name == "SEBULK"}
    where = places(tables)
    own = {number: [card for card in cards if card.name not in OWN] for number, cards in parts.items()}
    listed = {number: cards for number, cards in own.items() if any(c.name == "GRID" for c in cards)}
    _refuse_unknown(bulk, listed)
    listed |= _copies(bulk, listed, where)

    def made(number: int, basic: System) -> Mesh:
        mesh = build(number, listed[number], basic)
        source = bulk.get(_original(bulk, number))
        if source is None or source.text(1) != EXTERNAL:
            return mesh
        return with_matrices(path, source, parts[source.id], mesh, basic, units)

    meshes = {number: made(number, BASIC) for number in listed}
    residual = meshes.get(0)
    for number, place in where.items():
        if number not in meshes:
            raise place.first.error(f"part {number} has no grids; give it by BEGIN SUPER = {number}")
        meshes[number] = placed(place, number, meshes[number], residual, partial(made, number))
    rows = {number: {int(grid): k for k, grid in enumerate(mesh.labels)} for number, mesh in meshes.items()}
    same = joined_grids(tables, meshes)
    return join_meshes(meshes, [((a, rows[a][i]), (b, rows[b][j])) for (a, i), (b, j) in same])


def _refuse_unknown(bulk: Mapping[int, Card], listed: Mapping[int, list[Card]]) -> None:
    """Refuse parts of a kind that is not read, and matrices without the grids of their part."""
    for card in bulk.values():
        if card.text(1) not in KINDS:
            instead = AS_BODY if card.text(1).startswith("EXTOP") else "give PRIMARY parts with their own cards"
            raise card.error(f"a part of type {card.text(1)} is not read; {instead}")
        if card.text(1) == EXTERNAL and card.id not in listed:
            raise card.error(f"its part has no grids; INCLUDE its .pch file, which begins with BEGIN SUPER = {card.id}")


def _original(bulk: Mapping[int, Card], number: int) -> int:
    """Return the part whose cards a part has: that which it copies, else itself."""
    card = bulk.get(number)
    return card.integer(2, "RSEID", lowest=1) if card is not None and card.text(1) in COPIES else number


def _copies(
    bulk: Mapping[int, Card], listed: Mapping[int, list[Card]], where: Mapping[int, Place]
) -> dict[int, list[Card]]:
    """Return the cards of parts that are copies (REPEAT) or mirror images (MIRROR) of others."""
    found = {}
    for number, card in bulk.items():
        if card.text(1) not in COPIES:
            continue
        of = _original(bulk, number)
        if of not in listed or number in listed:
            what = f"part {of}, which it repeats, has no cards" if of not in listed else "it has cards of its own"
            raise card.error(f"{what}; give the part that is repeated by BEGIN SUPER, and none for its copy")
        needed = "SEMPLN" if card.text(1) == "MIRROR" else "SELOC"
        if number not in where or needed not in where[number].cards:
            what = "the mirror image" if needed == "SEMPLN" else "a copy"
            raise card.error(f"{what} of part {of} needs its place; add {needed}")
        if of in where and needed == "SEMPLN":
            said = where[of].first
            raise card.error(
                f"part {of}, which it mirrors, is moved by {said.name} in line {said.line}; mirror it in place"
            )
        found[number] = listed[of]
    return found
