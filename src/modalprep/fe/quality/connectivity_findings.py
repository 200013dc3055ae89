"""Findings about the connectivity of the cells of a mesh."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from modalprep.fe.quality import connectivity
from modalprep.fe.quality.connectivity import ShellEdges
from modalprep.fe.quality.findings import Checked, Finding, plural

UNEQUAL = "the meshes do not fit together"


def find(checked: Checked) -> tuple[list[Finding | None], ShellEdges | None]:
    """Return the findings, None for those that are absent, and the edges of the shells."""
    mesh = checked.mesh
    n = len(checked.mesh.points)
    found = [_not_numbers(checked), _unconnected(checked), *_repeated(checked), _several_parts(checked)]
    sizes = {kind: shape.size for kind, shape in checked.shapes.items()}
    pairs = connectivity.close_pairs(mesh.points, connectivity.node_size(checked.cells, sizes, n))
    pairs = pairs[~connectivity.tied(pairs, [*checked.cells.values(), *checked.links], n)]
    found.append(_coincident(checked, pairs))
    edges = connectivity.shell_edges({kind: checked.cells[kind][rows] for kind, rows in checked.shells.items()})
    if edges is not None:
        found += _edge_findings(checked, edges, pairs)
    return found, edges


def _not_numbers(checked: Checked) -> Finding | None:
    nodes = np.flatnonzero(~np.isfinite(checked.mesh.points).all(axis=1))
    text = f"{{what}} {{are}} without a position (coordinates that are not numbers), the first is node {nodes[:1] + 1}"
    return checked.of_nodes("not a number", "error", nodes, f"{text}; repair the mesh")


def _unconnected(checked: Checked) -> Finding | None:
    """Find nodes that no cell uses, points and links included."""
    mesh = checked.mesh
    used = np.asarray(~np.isfinite(mesh.points).all(axis=1))
    for conn in (*mesh.cells.values(), *checked.links):
        used[conn] = True
    text = "{what} {are} used by no element, the first near {at}; remove what is left over, or connect it"
    return checked.of_nodes("unconnected", "warning", np.flatnonzero(~used), text)


def _repeated(checked: Checked) -> list[Finding | None]:
    """Find cells with the same nodes; with different properties they may be intended, as a bar on a beam."""
    again, other = {}, {}
    for kind, conn in checked.cells.items():
        rows = np.flatnonzero(checked.plain[kind])
        owned = np.column_stack([conn, len(checked.mesh.points) + checked.owner[kind]])  # the group as one more node
        again[kind] = rows[connectivity.repeated(owned[rows])]
        other[kind] = np.setdiff1d(rows[connectivity.repeated(conn[rows])], again[kind])
    text = "{what} {are} there twice (the same nodes), the first near {at}; "
    return [
        checked.of_cells("duplicate", "error", again, text + "remove one of each: it counts double"),
        checked.of_cells(
            "overlay", "warning", other, text + "their properties differ: remove one unless both are meant"
        ),
    ]


def _several_parts(checked: Checked) -> Finding | None:
    if not checked.cells:
        return None
    mesh = checked.mesh
    used = np.unique(np.concatenate([conn.ravel() for conn in checked.cells.values()]))
    label = connectivity.connected_parts([*checked.cells.values(), *checked.links], len(mesh.points))
    names, count = np.unique(label[used], return_counts=True)
    if len(names) == 1:
        return None
    small = names[np.argmin(count)]
    rows = {kind: np.flatnonzero(label[conn[:, 0]] == small) for kind, conn in checked.cells.items()}
    text = (
        "the structure is in {count} disconnected parts, the smallest has {size} and lies near {at}; "
        "merge coincident nodes, mesh the parts together, or tie them"
    )
    size = f"{count.min()} {plural('node', count.min())}"
    return checked.of_cells("disconnected", "error", rows, text.replace("{size}", size), count=len(names))


def _coincident(checked: Checked, pairs: np.ndarray) -> Finding | None:
    text = (
        "{what} {are} in one place with another and not merged, the first near {at}; there the mesh is open like a "
        "crack: merge coincident nodes"
    )
    return checked.of_nodes("coincident", "warning", np.unique(pairs), text)


def _edge_findings(checked: Checked, edges: ShellEdges, pairs: np.ndarray) -> Iterator[Finding | None]:
    same = connectivity.connected_parts([pairs], len(checked.mesh.points))
    open_ = connectivity.cracks(edges, same)
    yield _of_edges(
        checked,
        edges,
        open_,
        same,
        "crack",
        "shells are open along {what} (two free edges in one place), the first near {at}; merge coincident nodes, or "
        "tie them if a hinge is meant",
    )
    yield _of_edges(
        checked,
        edges,
        connectivity.opposite(edges, _flawed(checked, edges)),
        same,
        "opposite normals",
        "neighbouring shells have opposite normals across {what}, the first near {at}; orient the shells alike where "
        "offsets, laminates or pressure matter",
    )
    yield _of_edges(
        checked,
        edges,
        connectivity.unequal_order(edges),
        same,
        "mixed order",
        f"first- and second-order shells meet at {{what}}, the first near {{at}}; {UNEQUAL}: save all in one order",
    )
    yield _hanging(checked, edges, np.setdiff1d(edges.free, open_))


def _flawed(checked: Checked, edges: ShellEdges) -> np.ndarray:
    """Whether the cell of each entry is crossed or degenerate: such a cell has no sides."""
    flawed = np.zeros(len(edges.row), dtype=bool)
    for kind, rows in checked.shells.items():
        entry = np.flatnonzero(edges.kind == kind)
        shape = checked.shapes[kind]
        flawed[entry] = (shape.crossed | shape.degenerate)[rows[edges.row[entry]]]
    return flawed


def _of_edges(checked: Checked, edges: ShellEdges, entries, same: np.ndarray, kind: str, text: str) -> Finding | None:
    """Return the finding about edges; those in one place (`same` numbers the places of nodes) count once."""
    cells = {}
    for name, rows in checked.shells.items():
        cells[name] = rows[np.unique(edges.row[entries[edges.kind[entries] == name]])]
    place = np.sort(same[edges.ends[entries]], axis=1)
    first = np.sort(np.unique(place, axis=0, return_index=True)[1])
    return checked.of_edges(kind, edges.ends[entries[first]], cells, text)


def _hanging(checked: Checked, edges: ShellEdges, free: np.ndarray) -> Finding | None:
    used = np.unique(np.concatenate([conn.ravel() for conn in checked.cells.values()]))
    tied = np.concatenate([np.zeros(0, dtype=int), *(link.ravel() for link in checked.links)])
    hits = connectivity.hanging(edges, free, checked.mesh.points, np.setdiff1d(used, tied))
    text = (
        f"{{what}} {{are}} hanging (within the free edge of a shell that does not use it), the first near {{at}}; "
        f"{UNEQUAL}: give both sides the same nodes"
    )
    return checked.of_nodes("hanging", "warning", np.unique(hits[:, 0]), text)
