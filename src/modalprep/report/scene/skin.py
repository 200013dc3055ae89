"""The outer surface of a mesh as plain arrays, without VTK: for the viewer in the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from modalprep.errors import RenderError
from modalprep.fe.mesh.cells import CELLS, Cell, cell_of
from modalprep.fe.mesh.facets import boundary

# a ring is a row of nine nodes: four corners, the middles after each, the centre; -1 where there is none
PATTERN = {  # (corners, with middles, with centre): triangles of places in the ring
    (3, False, False): [(0, 1, 2)],
    (3, True, False): [(0, 4, 6), (4, 1, 5), (6, 5, 2), (4, 5, 6)],
    (4, False, False): [(0, 1, 2), (0, 2, 3)],
    (4, True, False): [(0, 4, 7), (1, 5, 4), (2, 6, 5), (3, 7, 6), (4, 5, 6), (4, 6, 7)],
    (4, True, True): [(0, 4, 8), (4, 1, 8), (1, 5, 8), (5, 2, 8), (2, 6, 8), (6, 3, 8), (3, 7, 8), (7, 0, 8)],
}
NONE = np.zeros((0, 4), dtype=int)
SHARP = np.cos(np.radians(30))


@dataclass(frozen=True, eq=False)
class Skin:
    """Visible parts of a mesh, as node numbers.

    Attributes
    ----------
    triangles : (n, 3) int
        The outer faces of solids and all shells, through their mid-side nodes.
    edges, outline : (n, 2) int
        Element edges on the surface; those at its boundary and at sharp folds.
    lines : (n, 2) int
        Beams and trusses.
    """

    triangles: np.ndarray
    edges: np.ndarray
    outline: np.ndarray
    lines: np.ndarray


def outer_skin(points: np.ndarray, cells: Mapping[str, np.ndarray], *, curved: bool = True) -> Skin:
    """Return the outer surface and the lines of a mesh.

    Parameters
    ----------
    points : (n_points, 3)
    cells : {meshio type: (n_cells, n_nodes) int}
    curved : bool
        Follow the mid-side nodes; without, a face has the triangles of its corners.

    Raises
    ------
    RenderError
        When a cell type is not known.

    Examples
    --------
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1.0]])
    >>> skin = outer_skin(corners, {"tetra": np.array([[0, 1, 2, 3], [1, 2, 3, 4]])})
    >>> skin.triangles.shape, skin.edges.shape  # the face between the two is not seen
    ((6, 3), (9, 2))
    """
    known = [(_known(kind), np.asarray(nodes)) for kind, nodes in cells.items() if len(nodes)]
    shells, solids = ([(c.name, nodes[:, : c.count]) for c, nodes in known if c.dimension == d] for d in (2, 3))
    rings = np.concatenate([_rings(*faces) for faces in [*shells, *boundary(solids).items(), ("quad", NONE)]])
    if not curved:
        rings[:, 4:] = -1
    beams = [nodes[:, cell.along] for cell, nodes in known if cell.dimension == 1]
    lines = [np.stack([run[:, :-1], run[:, 1:]], axis=2).reshape(-1, 2) for run in beams]
    first, second, sharp = _sides(points, rings)
    whole = np.concatenate([first, second])
    whole, fold = whole[(whole >= 0).all(axis=1)], np.concatenate([sharp, sharp])[(whole >= 0).all(axis=1)]
    return Skin(_triangles(rings), whole, whole[fold], np.concatenate([np.zeros((0, 2), dtype=int), *lines]))


def _known(kind: str) -> Cell:
    cell = cell_of(kind)
    if cell is None:
        shapes = [name for name, cell in CELLS.items() if cell.dimension and not cell.second_order]
        raise RenderError(f"cells of type {kind} cannot be drawn; known are {', '.join(shapes)}")
    return cell


def _rings(kind: str, nodes: np.ndarray) -> np.ndarray:
    """Return the rings (n, 9) of faces."""
    corners, middles, centre = np.split(nodes, [len(CELLS[kind].corners), 2 * len(CELLS[kind].corners)], axis=1)
    ring = np.full((len(nodes), 9), -1)
    ring[:, : corners.shape[1]] = corners
    ring[:, 4 : 4 + middles.shape[1]] = middles
    if kind == "quad9":
        ring[:, 8:] = centre
    return ring


def _triangles(rings: np.ndarray) -> np.ndarray:
    found = [np.zeros((0, 3), dtype=int)]
    sides = (rings[:, :4] >= 0).sum(axis=1)
    for (corners, middles, centre), pattern in PATTERN.items():
        own = (sides == corners) & ((rings[:, 4] >= 0) == middles) & ((rings[:, 8] >= 0) == centre)
        found.append(rings[own][:, pattern].reshape(-1, 3))
    return np.concatenate(found)


def _sides(points: np.ndarray, rings: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return each side once as its two halves (n, 2), or as a whole and -1, and whether it is a sharp edge."""
    after = np.where(rings[:, [1, 2, 3, 0]] >= 0, rings[:, [1, 2, 3, 0]], rings[:, [0]])
    sides = np.stack([rings[:, :4], rings[:, 4:8], after], axis=2)
    normal = np.broadcast_to(_normals(points, rings)[:, None], (len(rings), 4, 3))
    real = rings[:, :4] >= 0
    sides, normal = sides[real], normal[real]
    ends = np.sort(sides[:, [0, 2]], axis=1)
    order = np.lexsort(ends.T)
    sides, normal, ends = sides[order], normal[order], ends[order]
    first = np.flatnonzero(np.r_[True, (ends[1:] != ends[:-1]).any(axis=1)][: len(ends)])
    count = np.diff(np.r_[first, len(ends)])
    other = np.minimum(first + 1, max(len(ends) - 1, 0))
    sharp = (count != 2) | (np.abs((normal[first] * normal[other]).sum(axis=1)) < SHARP)
    start, middle, end = sides[first].T
    bent = middle >= 0
    halves = np.column_stack([start, np.where(bent, middle, end)]), np.column_stack([middle, np.where(bent, end, -1)])
    return *halves, sharp


def _normals(points: np.ndarray, rings: np.ndarray) -> np.ndarray:
    """Unit normals of faces by their corners; zero where a face has no area."""
    a, b, c, d = (points[rings[:, k]] for k in range(4))
    four = (rings[:, 3] >= 0)[:, None]
    normal = np.cross(c - a, np.where(four, d - b, b - a))
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return normal / np.where(length > 0, length, 1.0)


def simplified(points: np.ndarray, skin: Skin, limit: int) -> Skin:
    """Return a skin of at most `limit` triangles: nodes in one box of a grid are merged into the first.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(30.0), np.arange(30.0))
    >>> node = np.arange(900).reshape(30, 30)
    >>> quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=2).reshape(-1, 4)
    >>> points = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    >>> len(simplified(points, outer_skin(points, {"quad": quads}), 200).triangles) <= 200
    True
    """
    a, b, c = (points[skin.triangles[:, k]] for k in range(3))
    box = np.sqrt(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / max(limit, 1)) / 1.2
    small = skin
    while len(small.triangles) > limit:
        place = np.floor((points - points.min(axis=0)) / box).astype(int)
        _, first, group = np.unique(place, axis=0, return_index=True, return_inverse=True)
        node = first[group.ravel()]
        triangles, edges, outline = (_distinct(node[part]) for part in (skin.triangles, skin.edges, skin.outline))
        small = Skin(triangles, edges, outline, skin.lines)
        box *= 1.25
    return small


def _distinct(rows: np.ndarray) -> np.ndarray:
    """Return the rows whose nodes differ, each once."""
    ordered = np.sort(rows, axis=1)
    rows = ordered[(ordered[:, 1:] != ordered[:, :-1]).all(axis=1)]
    return np.unique(rows, axis=0)
