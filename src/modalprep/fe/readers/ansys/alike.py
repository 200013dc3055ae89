"""Many solids of Ansys that follow each other with the same attributes, at once where nothing about them is special."""

from __future__ import annotations

import numpy as np

from modalprep.fe.properties.properties import Solid
from modalprep.fe.readers.ansys.builder import Builder
from modalprep.fe.readers.ansys.deck import ElementBlock
from modalprep.fe.readers.ansys.elements import BRICKS, COUNT, ELEMENTS, TETRAS, add_tetra, note_solids, solid_group
from modalprep.fe.readers.ansys.elements import add_solid as add_brick

SHAPES = ("hexahedron", "wedge", "pyramid", "tetra")


def add_alike(b: Builder, name: str, block: ElementBlock) -> bool:
    """Add a block of elements of one type; False, and nothing added, where one of them asks for a look of its own."""
    handle = ELEMENTS[name].handle if name in ELEMENTS else None
    count = block.nodes.shape[1]
    if b.system(block.element(0)) or handle not in (add_brick, add_tetra):
        return False
    if handle is add_tetra and (count < 8 or count == 10):
        found = [_cells(b, block, np.arange(len(block.labels)), "tetra", TETRAS, 4)]
    elif count >= 8:
        shapes = _brick_shapes(block.nodes)
        own = [(shape, np.flatnonzero(shapes == k)) for k, shape in enumerate(SHAPES)]
        own.sort(key=lambda one: one[1][0] if len(one[1]) else len(shapes))
        found = [_cells(b, block, rows, shape, BRICKS, 8) for shape, rows in own if len(rows)]
    else:
        return False
    cells = [one for one in found if one is not None]
    if len(cells) < len(found):
        return False
    for kind, rows, nodes in cells:
        first = block.element(int(rows[0]))
        b.refuse_without_element(first, kind, Solid)
        name = solid_group(b, first)
        added = b.extend(kind, nodes)
        b.join(name, kind, added)
        b.placed.setdefault(kind, []).append((block.labels[rows], added))
        note_solids(b, first, kind, added)
    return True


def _brick_shapes(nodes: np.ndarray) -> np.ndarray:
    """Return what the eight corners of each brick are, as its place in `SHAPES`."""
    same = nodes[:, 2] == nodes[:, 3]
    point = (nodes[:, 5:8] == nodes[:, 4:5]).all(axis=1)
    return np.select([point & same, point, same & (nodes[:, 6] == nodes[:, 7])], [3, 2, 1], 0)


def _cells(
    b: Builder, block: ElementBlock, rows: np.ndarray, shape: str, table: dict, corners: int
) -> tuple[str, np.ndarray, np.ndarray] | None:
    """Return kind, rows in the block, and nodes of cells of one shape; None unless each has all nodes, once."""
    own, middle = (list(places) for places in table[shape])
    nodes = block.nodes[rows]
    there = nodes[:, [k for k in middle if k < nodes.shape[1]]] > 0
    second = nodes.shape[1] > corners and bool(there.any())
    if second and not (there.shape[1] == len(middle) and there.all()):
        return None
    found = b.find(nodes[:, own + middle * second])
    order = np.sort(found, axis=1)
    if (order[:, 0] < 0).any() or (order[:, 1:] == order[:, :-1]).any():
        return None
    return f"{shape}{COUNT[shape]}" if second else shape, rows, found
