"""Many solids or shells of Ansys in a row with the same attributes, at once where nothing about them is special."""

from __future__ import annotations

from typing import Any

import numpy as np

from modalprep.fe.properties.properties import Shell, Solid
from modalprep.fe.readers.ansys.builder import Builder
from modalprep.fe.readers.ansys.deck import Element, ElementBlock
from modalprep.fe.readers.ansys.elements import (
    BRICKS,
    COUNT,
    ELEMENTS,
    QUADS,
    TETRAS,
    add_shell,
    add_solid,
    add_tetra,
    middle_sides,
    note_solids,
    shell_group,
    solid_group,
)


def add_alike(b: Builder, name: str, block: ElementBlock) -> bool:
    """Add a block of elements of one type; False, and nothing added, where one of them asks for a look of its own."""
    handle = ELEMENTS[name].handle if name in ELEMENTS else None
    shapes = _shapes(handle, block.nodes)
    if shapes is None:
        return False
    names, shape, table, corners = shapes
    own = [np.flatnonzero(shape == k) for k in range(len(names))]
    first = sorted((int(rows[0]), k) for k, rows in enumerate(own) if len(rows))
    found = [_cells(b, block, own[k], names[k], table, corners) for _, k in first]
    cells = [one for one in found if one is not None]
    if len(cells) < len(found):
        return False
    for kind, rows, nodes in cells:
        (_add_shells if handle is add_shell else _add_solids)(b, kind, block, rows, nodes)
    return True


def _shapes(handle: Any, nodes: np.ndarray) -> tuple[tuple[str, ...], np.ndarray, dict, int] | None:
    """Return the shapes that elements may have, which of them each has, the indices of their nodes, and their corners.

    None of elements that are no solids and no shells.
    """
    count = nodes.shape[1]
    if handle is add_shell and count >= 3:
        triangle = nodes[:, 2] == nodes[:, 3] if count > 3 else np.ones(len(nodes), dtype=bool)
        return ("quad", "triangle"), triangle.astype(int), QUADS, 4
    if handle is add_tetra and (count < 8 or count == 10):
        return ("tetra",), np.zeros(len(nodes), dtype=int), TETRAS, 4
    if handle in (add_solid, add_tetra) and count >= 8:
        return ("hexahedron", "wedge", "pyramid", "tetra"), _brick_shapes(nodes), BRICKS, 8
    return None


def _add_solids(b: Builder, kind: str, block: ElementBlock, rows: np.ndarray, nodes: np.ndarray) -> None:
    first = block.element(int(rows[0]))
    b.refuse_without_element(first, kind, Solid)
    added = _add(b, kind, block.labels[rows], nodes, solid_group(b, first))
    note_solids(b, first, kind, added)
    if (axes := _axes(b, first, nodes)) is not None:
        b.data.setdefault(("frame", kind), {}).update(zip(added, axes, strict=True))


def _add_shells(b: Builder, kind: str, block: ElementBlock, rows: np.ndarray, nodes: np.ndarray) -> None:
    first = block.element(int(rows[0]))
    b.refuse_without_element(first, kind, Shell)
    added = _add(b, kind, block.labels[rows], nodes, shell_group(b, first))
    b.turning.update(np.unique(nodes).tolist())
    axes = _axes(b, first, nodes)
    axes = middle_sides(b.points[nodes], kind.startswith("triangle")) if axes is None else axes[:, 0]
    b.data.setdefault(("axis", kind), {}).update(zip(added, axes, strict=True))


def _axes(b: Builder, first: Element, nodes: np.ndarray) -> np.ndarray | None:
    """Return the axes (n, 3, 3) of the system that elements have, in their middles; None in the global one."""
    system = b.system(first)
    if system is None:
        return None
    return np.array([system.axes_at(centre) for centre in np.mean(b.points[nodes], axis=1)])


def _add(b: Builder, kind: str, labels: np.ndarray, nodes: np.ndarray, group: str) -> range:
    added = b.extend(kind, nodes)
    b.join(group, kind, added)
    b.placed.setdefault(kind, []).append((labels, added))
    return added


def _brick_shapes(nodes: np.ndarray) -> np.ndarray:
    """Return what the eight corners of each brick are, as its place among hexahedron, wedge, pyramid and tetra."""
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
