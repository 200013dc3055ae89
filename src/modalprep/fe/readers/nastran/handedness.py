"""Solids whose grids are numbered left-handed, which Nastran takes, are turned."""

from __future__ import annotations

import numpy as np

from modalprep.fe.links.mirror import mirrored_nodes
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.readers.nastran.builder import Builder


def turn_left_handed(b: Builder) -> None:
    """Renumber solids whose edges are left-handed triads at every corner, with a note."""
    turned = [(kind, row) for kind in b.cells if CELLS[kind].dimension == 3 for row in _left_handed(b, kind)]
    for kind, row in turned:
        b.cells[kind][row] = b.cells[kind].rows[row, mirrored_nodes(kind)]
    if turned:
        kind, row = turned[0]
        first = next(ids[rows.index(row)] for ids, _, of, rows in b.placed if of == kind and row in rows)
        b.conversion.note(f"{len(turned)} solids are numbered left-handed and are turned (first element {first})")


def _left_handed(b: Builder, kind: str) -> list[int]:
    cell = CELLS[kind]
    nodes = b.cells[kind].rows[:, : len(cell.corners)]
    rows = np.arange(len(nodes))
    for corner, *ends in cell.triads():  # most solids are left after the first corner
        x = b.grids.points[nodes[rows]]
        rows = rows[np.linalg.det(x[:, ends] - x[:, [corner]]) < 0]
    return rows.tolist()
