"""Solids whose grids are numbered left-handed, which Nastran takes, are turned."""

from __future__ import annotations

import numpy as np

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.readers.nastran.builder import Builder


def turn_left_handed(b: Builder) -> None:
    """Renumber solids whose edges are left-handed triads at every corner, with a note."""
    turned = [(kind, row) for kind in b.cells if CELLS[kind].dimension == 3 for row in _left_handed(b, kind)]
    for kind, row in turned:
        nodes = b.cells[kind][row]
        b.cells[kind][row] = [nodes[k] for k in mirrored(kind)]
    if turned:
        first = next(number for number, places in b.places.items() if turned[0] in [place[1:] for place in places])
        b.conversion.note(f"{len(turned)} solids are numbered left-handed and are turned (first element {first})")


def _left_handed(b: Builder, kind: str) -> list[int]:
    cell = CELLS[kind]
    x = b.grids.points[np.array(b.cells[kind])[:, : len(cell.corners)]]
    triads = np.array(cell.triads())
    edges = x[:, triads[:, 1:]] - x[:, triads[:, :1]]
    return np.flatnonzero(np.all(np.linalg.det(edges) < 0, axis=1)).tolist()


def mirrored(kind: str) -> list[int]:
    """Return the nodes of a solid in the order of its mirror image, the first two coordinates exchanged.

    Examples
    --------
    >>> mirrored("tetra"), mirrored("hexahedron")
    ([0, 2, 1, 3], [0, 3, 2, 1, 4, 7, 6, 5])
    """
    x = CELLS[kind].node_coordinates()
    apart = np.linalg.norm(x[:, [1, 0, 2]][:, None] - x, axis=2)
    return apart.argmin(axis=1).tolist()
