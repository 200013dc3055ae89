"""Connectivity of the cells of a mesh: coincident nodes, edges of shells, connected parts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from modalprep.fe.mesh.cells import cell_of, mid_nodes
from modalprep.fe.mesh.facets import Cells, numbered, of_dimension

CLOSE = 1e-6  # of the local element size: nodes closer than this coincide
ON_EDGE = 1e-3  # of an edge: a node nearer than this lies on it; two sheets a thickness apart are further
NEIGHBOURS = 8  # coinciding nodes looked at per node
BATCH = 2000  # edges searched for hanging nodes at once: bounds the memory
WIDEST = 9  # nodes of the widest shell cell


def node_size(cells: Cells, size: Mapping[str, np.ndarray], n_points: int) -> np.ndarray:
    """Return the size of the smallest cell at each node ``(n_points,)``, infinite where there is none."""
    local = np.full(n_points, np.inf)
    for kind, conn in cells.items():
        if kind in size:
            length = np.where(size[kind] > 0, size[kind], np.inf)  # springs may have none
            np.minimum.at(local, conn, length[:, None])
    return local


def close_pairs(points: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Return pairs ``(k, 2)`` of nodes with a finite `local` size that coincide.

    Examples
    --------
    >>> close_pairs(np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0]]), np.ones(3))
    array([[1, 2]])
    """
    nodes = np.flatnonzero(np.isfinite(local))
    if len(nodes) < 2:
        return np.zeros((0, 2), dtype=int)
    tree = cKDTree(points[nodes], compact_nodes=False)
    number = min(NEIGHBOURS, len(nodes))
    reach = CLOSE * local[nodes].max()
    distance, other = tree.query(points[nodes], k=number, distance_upper_bound=max(reach, 1e-300))
    first, column = np.nonzero(np.isfinite(distance))
    pair = np.stack([first, other[first, column]], axis=1)
    near = distance[first, column] <= CLOSE * local[nodes][pair].min(axis=1)
    pair = nodes[pair[near & (pair[:, 0] != pair[:, 1])]]
    return np.unique(np.sort(pair, axis=1), axis=0)


def tied(pairs: np.ndarray, groups: Iterable[np.ndarray], n_points: int) -> np.ndarray:
    """Whether each pair of nodes, lower first, shares a row of one of the `groups` of cells or links."""
    if not len(pairs):
        return np.zeros(0, dtype=bool)
    wanted = np.zeros(n_points, dtype=bool)
    wanted[pairs] = True
    key = pairs[:, 0] * n_points + pairs[:, 1]
    found = [np.zeros(0, dtype=int)]
    for conn in groups:
        if len(conn) == 1:  # a link may have thousands of nodes
            found.append(key[np.isin(pairs, conn).all(axis=1)])
            continue
        rows = conn[wanted[conn].sum(axis=1) >= 2]
        for a, b in combinations(range(conn.shape[1] if len(rows) else 0), 2):
            found.append(np.minimum(rows[:, a], rows[:, b]) * n_points + np.maximum(rows[:, a], rows[:, b]))
    return np.isin(key, np.concatenate(found))


@dataclass(frozen=True, eq=False)
class ShellEdges:
    """The edges of all shell cells, one entry per cell and edge.

    Attributes
    ----------
    ends : (m, 2) int
        Corner nodes, in the direction in which the cell goes round.
    mid : (m,) int
        Mid-side node, or -1.
    kind : (m,) str
    row : (m,) int
        The cell, a row of ``cells[kind]``.
    nodes : (m, 9) int
        All nodes of the cell, filled with -1.
    number : (m,) int
        Which edge it is, the same for all cells that share it.
    shared : (m,) int
        How many cells share it.
    """

    ends: np.ndarray
    mid: np.ndarray
    kind: np.ndarray
    row: np.ndarray
    nodes: np.ndarray
    number: np.ndarray
    shared: np.ndarray

    @property
    def free(self) -> np.ndarray:
        """Entries of edges that belong to a single cell."""
        return np.flatnonzero(self.shared == 1)


def shell_edges(cells: Cells) -> ShellEdges | None:
    """Return the edges of the surface cells; None without any."""
    blocks = [_edges_of(kind, conn) for kind, conn in of_dimension(cells, 2) if len(conn)]
    if not blocks:
        return None
    ends, mid, kind, row, nodes = (np.concatenate(columns) for columns in zip(*blocks, strict=True))
    number = numbered(ends)
    return ShellEdges(ends, mid, kind, row, nodes, number, np.bincount(number)[number])


def _edges_of(kind: str, conn: np.ndarray) -> tuple[np.ndarray, ...]:
    cell = cell_of(kind)
    mid = mid_nodes(kind, conn)
    edges = cell.edges if cell else ()
    n, k = len(conn), len(edges)
    around = np.full((n, WIDEST), -1)
    around[:, : conn.shape[1]] = conn
    return (
        conn[:, edges].reshape(-1, 2),
        mid.ravel() if mid.shape[1] else np.full(n * k, -1),
        np.full(n * k, kind, dtype="U12"),
        np.repeat(np.arange(n), k),
        np.repeat(around, k, axis=0),
    )


def opposite(edges: ShellEdges, flawed: np.ndarray) -> np.ndarray:
    """Return the entries of edges that two cells traverse in the same direction: their normals are opposite.

    Edges of `flawed (m,)` entries are left out.
    """
    forward = np.where(edges.ends[:, 0] < edges.ends[:, 1], 1, -1)
    total = np.bincount(edges.number, weights=forward)
    bad = np.bincount(edges.number, weights=flawed) > 0
    return np.flatnonzero((edges.shared == 2) & ((np.abs(total) == 2) & ~bad)[edges.number])


def unequal_order(edges: ShellEdges) -> np.ndarray:
    """Return the entries of shared edges whose mid-side node some of the cells do not have."""
    order = np.lexsort([edges.mid, edges.number])
    number, mid = edges.number[order], edges.mid[order]
    first = np.flatnonzero(np.diff(number, prepend=-1))
    differ = np.minimum.reduceat(mid, first) != np.maximum.reduceat(mid, first)
    return np.flatnonzero(differ[edges.number])


def cracks(edges: ShellEdges, same: np.ndarray) -> np.ndarray:
    """Return the free entries that lie on another free edge with other nodes.

    ``same (n_points,)`` numbers places: it is equal for nodes that coincide and that nothing ties.
    """
    ends = np.sort(same[edges.ends[edges.free]], axis=1)
    _, place, count = np.unique(ends[:, 0] * len(same) + ends[:, 1], return_inverse=True, return_counts=True)
    return edges.free[(count[place.ravel()] > 1) & (ends[:, 0] != ends[:, 1])]


def hanging(edges: ShellEdges, entries: np.ndarray, points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return which of the `nodes` lie within a free edge of `entries` without belonging to its cell.

    Returns
    -------
    (k, 2) int
        Node and entry.
    """
    found = [np.zeros((0, 2), dtype=int)]
    tree = cKDTree(points[nodes], compact_nodes=False) if len(nodes) and len(entries) else None
    for start in range(0, len(entries), BATCH):
        if tree is None:
            break
        entry = entries[start : start + BATCH]
        a, b = points[edges.ends[entry, 0]], points[edges.ends[entry, 1]]
        near = tree.query_ball_point((a + b) / 2, np.linalg.norm(b - a, axis=1) / 2)
        which = np.repeat(np.arange(len(entry)), [len(hits) for hits in near])
        node = nodes[np.concatenate([np.asarray(hits, dtype=int) for hits in near])]
        keep = _within(points[node], a[which], b[which]) & ~(edges.nodes[entry[which]] == node[:, None]).any(axis=1)
        found.append(np.stack([node[keep], entry[which[keep]]], axis=1))
    return np.concatenate(found)


def _within(x: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    along = b - a
    square = np.einsum("ij,ij->i", along, along)
    t = np.einsum("ij,ij->i", x - a, along) / np.where(square > 0, square, np.inf)
    off = np.linalg.norm(x - a - t[:, None] * along, axis=1)
    return (t > ON_EDGE) & (t < 1 - ON_EDGE) & (off < ON_EDGE * np.sqrt(square))


def repeated(conn: np.ndarray) -> np.ndarray:
    """Return the rows that have the nodes of an earlier row, in any order.

    Examples
    --------
    >>> repeated(np.array([[0, 1, 2], [1, 2, 3], [2, 0, 1]]))
    array([2])
    """
    weight = np.random.default_rng(0).integers(1, 2**62, conn.max(initial=0) + 1, dtype=np.uint64)
    _, place, count = np.unique(weight[conn].sum(axis=1), return_inverse=True, return_counts=True)
    rows = np.flatnonzero(count[place.ravel()] > 1)  # the same sum: very likely the same nodes
    if not len(rows):
        return rows
    _, first = np.unique(np.sort(conn[rows], axis=1), axis=0, return_index=True)
    return np.delete(rows, first)


def connected_parts(groups: Iterable[np.ndarray], n_points: int) -> np.ndarray:
    """Return the number of the connected part of each node; all nodes of a row are connected.

    Examples
    --------
    >>> connected_parts([np.array([[0, 1], [2, 3]])], 4)
    array([0, 0, 1, 1], dtype=int32)
    """
    rows = [np.zeros(0, dtype=int)]
    columns = [np.zeros(0, dtype=int)]
    for conn in groups:
        rows.append(np.repeat(conn[:, 0], conn.shape[1] - 1))
        columns.append(conn[:, 1:].ravel())
    i, j = np.concatenate(rows), np.concatenate(columns)
    graph = coo_array((np.ones(len(i), dtype=bool), (i, j)), shape=(n_points, n_points))
    return connected_components(graph, directed=False)[1]


def smallest_part(groups: Iterable[np.ndarray], used: np.ndarray, points: np.ndarray) -> tuple[int, np.ndarray, str]:
    """Return how many `parts` the `used` nodes are in, the nodes of the smallest, and where it is.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [8, 0, 0]])
    >>> smallest_part([np.array([[0, 1], [1, 2]])], np.arange(4), points)
    (2, array([3]), '(8, 0, 0) m')
    """
    label = connected_parts(groups, len(points))[used]
    names, count = np.unique(label, return_counts=True)
    small = used[label == names[np.argmin(count)]]
    return len(names), small, f"({', '.join(f'{x:.4g}' for x in points[small].mean(axis=0))}) m"
