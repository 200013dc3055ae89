"""Cyclic symmetry of a deck: a sector, its axis, and the two edges that a tie joins."""

from __future__ import annotations

import numpy as np

from modalprep.fe.mesh.cyclic import HIGH, LOW, CyclicSymmetry
from modalprep.fe.readers.abaqus.deck import Deck
from modalprep.fe.readers.abaqus.lexer import Block
from modalprep.fe.readers.abaqus.sets import surface_nodes


def cyclic_tie(deck: Deck, block: Block) -> None:
    """``*TIE, CYCLIC SYMMETRY``: the nodes of the slave edge, then those of the master, by the name of the tie."""
    if "MULTISTAGE" in block.options:
        block.refuse("of several stages is not read; give the sector of one stage")
    ties = deck.current.setdefault("cyclic ties", {})
    ties[block.option("NAME").upper()] = [surface_nodes(deck, block, block.row().text(k)) for k in (0, 1)]


def cyclic_model(deck: Deck, block: Block) -> None:
    """``*CYCLIC SYMMETRY MODEL``: number of sectors, tie of the edges, two points of the axis."""
    ties = deck.current.get("cyclic ties", {})
    tie = block.option("TIE")
    if tie.upper() not in ties:
        block.refuse(f"names the tie {tie!r}, which no *TIE, CYCLIC SYMMETRY before it has; correct the name")
    row = block.row()
    ends = [deck.placed(block.scope, np.array(row.reals(k, 3, "a coordinate"))) for k in (0, 3)]
    count = block.option("N")
    if not count.isdigit() or int(count) < 2:
        block.refuse(f"has N = {count}; give the number of sectors in the circle, at least 2")
    if not np.any(ends[1] - ends[0]):
        raise row.error("the two points of the axis are the same; give two")
    found = CyclicSymmetry(
        sectors=int(count), axis=ends[1] - ends[0], point=ends[0] * deck.units.length, low=LOW, high=HIGH
    )
    if (known := deck.cyclic) is not None and not _same(known, found):
        block.refuse("differs from another in its sectors or its axis; give the sector of one stage")
    deck.cyclic = found
    slave, master = ties[tie.upper()]
    for name, nodes in ((LOW, master), (HIGH, slave)):
        deck.members("NSET", "", name).extend(deck.keys[node] for node in nodes)


def _same(one: CyclicSymmetry, other: CyclicSymmetry) -> bool:
    alike = np.allclose(one.axis, other.axis) and np.allclose(one.point, other.point)
    return one.sectors == other.sectors and alike
