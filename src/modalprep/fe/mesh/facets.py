"""Facets: the faces of volumes and the edges of surfaces, as cells of their own.

scikit-fem knows those of a mesh of one kind of cells, by corners in the order of their numbers; of wedges it takes the
triangle between two for two where they begin it with different corners. Here cells are of several kinds, facets have
their mid-side nodes and are seen from outside, and reading a mesh does not import scikit-fem.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np

from modalprep.fe.mesh.cells import cell_dimension, cell_of

Cells = Mapping[str, np.ndarray]  # {kind: nodes (n, nn)}
Facets = Iterable[tuple[str, np.ndarray]]  # kinds and nodes, a kind perhaps several times
CORNERS = 4  # of the widest face


def of_dimension(cells: Cells, dimension: int) -> list[tuple[str, np.ndarray]]:
    """Return kinds and nodes of the lines (1), surfaces (2) or volumes (3) among cells."""
    return [(kind, nodes) for kind, nodes in cells.items() if cell_dimension(kind) == dimension]


def facets(cells: Facets) -> Iterator[tuple[str, np.ndarray]]:
    """Yield kind and nodes ``(n_cells, n)`` of each face of volumes, seen from outside, and each edge of surfaces.

    Cells of an unknown order have the facets of their corners; lines and unknown cells have none.

    Examples
    --------
    >>> [(kind, nodes.tolist()) for kind, nodes in facets([("triangle6", np.arange(6)[None])])]
    [('line3', [[0, 1, 3]]), ('line3', [[1, 2, 4]]), ('line3', [[2, 0, 5]])]
    """
    for kind, nodes in cells:
        cell = cell_of(kind)
        for name, own in cell.facets if cell else ():
            yield name, nodes[:, own]


def boundary(cells: Facets) -> dict[str, np.ndarray]:
    """Return the facets that one cell alone has, ``{kind: nodes (k, n)}``.

    Examples
    --------
    >>> boundary([("tetra", np.array([[0, 1, 2, 3], [1, 2, 3, 4]]))])["triangle"].shape  # the face between has two
    (6, 3)
    """
    return alone(facets(cells))


def alone(cells: Facets) -> dict[str, np.ndarray]:
    """Return the cells with corners that no other has, ``{kind: nodes (k, n)}``.

    Examples
    --------
    >>> alone([("line", np.array([[0, 1], [1, 2], [1, 0]]))])
    {'line': array([[1, 2]])}
    """
    return _each(cells, lambda first, count: first[count == 1])


def distinct(cells: Facets) -> dict[str, np.ndarray]:
    """Return the first of the cells with the same corners, ``{kind: nodes (k, n)}``.

    Examples
    --------
    >>> distinct([("line", np.array([[0, 1], [1, 2], [1, 0]]))])
    {'line': array([[0, 1], [1, 2]])}
    """
    return _each(cells, lambda first, count: first)


def _each(cells: Facets, choose: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> dict[str, np.ndarray]:
    """Return some of the first of the cells with the same corners, chosen by their rows and how many there are."""
    found: dict[str, list[np.ndarray]] = {}
    for kind, nodes in cells:
        found.setdefault(kind, []).append(nodes)
    joined = {kind: np.concatenate(parts) for kind, parts in found.items()}
    _, first, count = np.unique(numbered(corners(joined.items(), -1)), return_index=True, return_counts=True)
    chosen = np.zeros(sum(map(len, joined.values())), dtype=bool)
    chosen[choose(first, count)] = True
    rows = np.split(chosen, np.cumsum([len(nodes) for nodes in joined.values()]))
    return {kind: nodes[own] for (kind, nodes), own in zip(joined.items(), rows, strict=False) if own.any()}


def corners(faces: Facets, fill: int | None = None) -> np.ndarray:
    """Return the corners ``(k, 4)`` of faces or edges; the last of a triangle is there twice, or `fill` after it.

    Examples
    --------
    >>> corners([("quad", np.array([[0, 1, 2, 3]])), ("triangle6", np.arange(6)[None])]).tolist()
    [[0, 1, 2, 3], [0, 1, 2, 2]]
    """
    found = [np.zeros((0, CORNERS), dtype=int)]
    for kind, nodes in faces:
        cell = cell_of(kind)
        own = nodes[:, : len(cell.corners) if cell else 0]
        wide = np.pad(own, ((0, 0), (0, CORNERS - own.shape[1])), mode="edge")
        if fill is not None:
            wide[:, own.shape[1] :] = fill
        found.append(wide)
    return np.concatenate(found)


def numbered(rows: np.ndarray) -> np.ndarray:
    """Return numbers ``(m,)`` of rows of nodes ``(m, k)``, equal for those with the same nodes in any order.

    Examples
    --------
    >>> numbered(np.array([[3, 4], [0, 1], [4, 3]]))
    array([1, 0, 1])
    """
    keys = np.sort(rows, axis=1)
    order = np.lexsort(keys.T)
    keys = keys[order]
    number = np.zeros(len(rows), dtype=int)
    number[order[1:]] = np.cumsum((keys[1:] != keys[:-1]).any(axis=1))
    return number
