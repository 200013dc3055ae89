"""Which groups of a mesh are structure, and which are sets of nodes on it."""

from __future__ import annotations

import re

import numpy as np

from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.facets import corners, facets, numbered, of_dimension
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
    faces = list(facets(of_dimension(mesh.cells, 3)))
    lines = any(cell_dimension(kind) == 1 for kind in mesh.cells)
    edges = list(facets([*faces, *of_dimension(mesh.cells, 2)])) if lines else []
    for kind, conn in mesh.cells.items():
        dimension = cell_dimension(kind)
        found[kind] = np.full(len(conn), dimension > 0)
        if dimension in (1, 2):
            number = numbered(corners([*(edges if dimension == 1 else faces), (kind, conn)], -1))
            own = len(number) - len(conn)
            found[kind] = ~np.isin(number[own:], number[:own])
        if dimension == 1:
            for name, kinds in mesh.groups.items():
                if STIFFENERS.search(name):
                    found[kind][kinds.get(kind, [])] = True
    return found
