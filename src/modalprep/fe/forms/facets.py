"""Faces of solids and edges of shells as cells of their own, found by scikit-fem."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from modalprep.fe.forms.cells import corner_mesh, reference
from modalprep.fe.mesh.cells import CELLS

Where = Callable[[np.ndarray], np.ndarray]


def boundary(
    parts: Iterable[tuple[str, np.ndarray]], points: np.ndarray, where: Where | None = None
) -> dict[str, np.ndarray]:
    """Return the facets of cells that no other of the cells shares, ``{kind: nodes (k, n)}``.

    Parameters
    ----------
    parts : (kind, nodes (ne, nn)) of cells
    points : (n, 3)
        m.
    where : callable
        As scikit-fem's `facets_satisfying`: whether facets with corners' means at ``x (3, k)`` count; default all.

    Returns
    -------
    dict
        Their nodes in meshio's order, seen from outside.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> boundary([("tetra", np.array([[0, 1, 2, 3]]))], points, lambda x: x[2] == 0)
    {'triangle': array([[0, 2, 1]])}
    """
    found = [(kind, cell, key) for own in parts for kind, cell, key in _facets(*own, points, where)]
    keys = np.array([key for _, _, key in found], dtype=object)
    _, place, count = np.unique([str(key) for key in keys], return_inverse=True, return_counts=True)
    cells: dict[str, list] = {}
    for (kind, cell, _), alone in zip(found, count[place] == 1, strict=True):
        if alone:
            cells.setdefault(kind, []).append(cell)
    return {kind: np.array(own) for kind, own in cells.items()}


def _facets(kind: str, nodes: np.ndarray, points: np.ndarray, where: Where | None) -> list[tuple]:
    """Return kind, nodes and sorted corners of the facets of cells of one kind that one cell has."""
    mesh = corner_mesh(kind, points, nodes)
    some = mesh.boundary_facets() if where is None else mesh.facets_satisfying(where, boundaries_only=True)
    cells = mesh.f2t[0, some]
    sides = [facet_of(kind, k) for k in range(len(mesh.t2f))]
    which = np.argmax(mesh.t2f[:, cells] == some, axis=0)
    found = []
    for cell, side in zip(cells, which, strict=True):
        name, own = sides[side]
        facet = nodes[cell, own]
        found.append((name, facet, sorted(facet[: len(CELLS[name].corners)].tolist())))
    return found


def facet_of(kind: str, number: int) -> tuple[str, list[int]]:
    """Return the kind of scikit-fem's facet of a cell, and which nodes of the cell it has.

    Examples
    --------
    >>> facet_of("quad8", 0)
    ('line3', [0, 1, 4])
    """
    cell, unit = CELLS[kind], reference(kind)
    corners = unit.p[:, unit.facets[number]].T if unit.facets else np.zeros((0, cell.dimension))
    mine = {int(np.argmin(np.abs(cell.corners - at).sum(axis=1))) for at in corners}
    if cell.dimension == 3:
        return next(cell.face(k) for k, face in enumerate(cell.faces) if set(face) == mine)
    edge = next(k for k, ends in enumerate(cell.edges.tolist()) if set(ends) == mine)
    middle = [len(cell.corners) + edge] * cell.second_order
    return ("line3" if middle else "line"), [*cell.edges[edge].tolist(), *middle]
