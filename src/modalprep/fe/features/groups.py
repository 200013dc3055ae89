"""Which groups of a mesh are structure, and which are sets of nodes on it."""

from __future__ import annotations

import re

import numpy as np

from modalprep.fe.links.centroid import cell_faces, distinct_faces, face_keys
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.mesh import Mesh

STIFFENERS = re.compile(
    r"(beam|frame|stiff|stringer|strut|truss|bracket|mast|hinge|(^|_)(rib|bar|spar)s?(_|$))", re.IGNORECASE
)


def structural_groups(mesh: Mesh) -> tuple[dict[str, int], int]:
    """Return the groups that need a property, with their dimension, and how many cells of structure no group has.

    Volumes are structure, and every cell of a lower dimension that is no face or edge of another; of lines on shells
    those whose group has the name of a stiffener or frame. Groups that have a property of the file are left out. Of
    groups that overlap the larger is taken, unless it mixes dimensions.

    Examples
    --------
    >>> from modalprep.examples import beam_mesh
    >>> structural_groups(beam_mesh(4))
    ({'beam': 1}, 0)
    """
    open_cells = structural_cells(mesh)
    assigned = {kind: np.zeros(len(conn), dtype=bool) for kind, conn in mesh.cells.items()}
    for name in mesh.properties:
        for kind, rows in mesh.groups.get(name, {}).items():
            assigned[kind][rows] = True
    chosen: dict[str, int] = {}
    for name in sorted(mesh.groups, key=lambda name: _rank(mesh, name)):
        kinds = {kind: rows for kind, rows in mesh.groups[name].items() if cell_dimension(kind) and len(rows)}
        free = not any(assigned[kind][rows].any() for kind, rows in kinds.items())
        if free and any(open_cells[kind][rows].any() for kind, rows in kinds.items()):
            chosen[name] = max(map(cell_dimension, kinds))
            for kind, rows in kinds.items():
                assigned[kind][rows] = True
    order = list(mesh.groups)
    return (
        {name: chosen[name] for name in sorted(chosen, key=order.index)},
        sum(int((cells & ~assigned[kind]).sum()) for kind, cells in open_cells.items()),
    )


def _rank(mesh: Mesh, name: str) -> tuple[int, int]:
    kinds = mesh.groups[name]
    dimensions = {cell_dimension(kind) for kind in kinds} - {0}
    return len(dimensions), -sum(map(len, kinds.values()))


def structural_cells(mesh: Mesh) -> dict[str, np.ndarray]:
    """Return which cells (k,) of each type are structure: no face of a volume and no edge of a face or a volume."""
    found = {}
    volume = cell_faces(mesh.cells, dimension=3)
    edges = _edges(np.concatenate([volume, cell_faces(mesh.cells)]), len(mesh.points))
    for kind, conn in mesh.cells.items():
        dimension = cell_dimension(kind)
        found[kind] = np.full(len(conn), dimension > 0)
        if dimension == 2 and len(volume):
            both = np.concatenate([distinct_faces(volume)[0], cell_faces({kind: conn})])
            found[kind] = ~_repeats(face_keys(both), len(conn))
        if dimension == 1:
            found[kind] = ~np.isin(_codes(conn[:, :2], len(mesh.points)), edges)
            for name, kinds in mesh.groups.items():
                if STIFFENERS.search(name):
                    found[kind][kinds.get(kind, [])] = True
    return found


def _repeats(rows: np.ndarray, last: int) -> np.ndarray:
    """Return which of the `last` rows occur among the others."""
    _, label = np.unique(rows, axis=0, return_inverse=True)
    label = label.ravel()
    return np.isin(label[-last:], label[:-last])


def _edges(faces: np.ndarray, count: int) -> np.ndarray:
    return np.unique(_codes(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), count))


def _codes(pairs: np.ndarray, count: int) -> np.ndarray:
    """Return one number for each pair of nodes, whatever its direction."""
    return pairs.min(axis=1).astype(np.int64) * count + pairs.max(axis=1)
