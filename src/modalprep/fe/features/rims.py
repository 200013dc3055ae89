"""Round free edges of shells: holes in panels, and ends of tubes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from modalprep.fe.features.cylinder import ROUND, Cylinder, fit_cylinder
from modalprep.fe.mesh.facets import numbered, of_dimension
from modalprep.fe.mesh.mesh import Mesh

FEWEST = 6  # nodes of a circle


def rims(mesh: Mesh) -> Iterator[dict[str, Any]]:
    """Yield what `Opening` takes for each round free edge of the shells of a mesh.

    Examples
    --------
    >>> angle = np.arange(8) * np.pi / 4
    >>> ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> k = np.arange(8)
    >>> quads = np.stack([k, (k + 1) % 8, (k + 1) % 8 + 8, k + 8], axis=1)
    >>> washer = Mesh(points=np.concatenate([ring, 2 * ring]), cells={"quad": quads}, groups={})
    >>> [(round(rim["cylinder"].radius, 12), rim["hole"]) for rim in rims(washer)]
    [(1.0, True), (2.0, False)]
    """
    edges, inner = _free_edges(mesh)
    if not len(edges):
        return
    count = len(mesh.points)
    label = connected_components(coo_array((np.ones(len(edges)), edges.T), shape=(count, count)), directed=False)[1]
    order = np.argsort(label[edges[:, 0]], kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(label[edges[order, 0]])) + 1):
        nodes, times = np.unique(edges[rows], return_counts=True)
        circle = _circle(mesh.points[nodes]) if len(nodes) >= FEWEST and np.all(times == 2) else None
        if circle is not None:
            beside = float(circle.distance(mesh.points[inner[rows]]).mean())
            yield {"cylinder": circle, "nodes": nodes, "hole": beside > 0, "length": 0.0}


def _free_edges(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges (k, 2) of one shell alone, and a corner (k,) of that shell away from the edge."""
    solid = np.zeros(len(mesh.points), dtype=bool)
    for _, nodes in of_dimension(mesh.cells, 3):
        solid[nodes] = True
    found = [np.zeros((0, 3), dtype=int)]
    for kind, nodes in of_dimension(mesh.cells, 2):
        corners = nodes[:, : 3 if kind.startswith("triangle") else 4]
        shells = corners[~solid[corners].all(axis=1)]
        found += [np.roll(shells, -k, axis=1)[:, :3] for k in range(shells.shape[1])]
    sides = np.concatenate(found)
    _, first, times = np.unique(numbered(sides[:, :2]), return_index=True, return_counts=True)
    alone = sides[first[times == 1]]
    return alone[:, :2], alone[:, 2]


def _circle(points: np.ndarray) -> Cylinder | None:
    """Return the cylinder across the plane of a circle of points (k, 3), None where they make none."""
    middle = points.mean(axis=0)
    _, size, axes = np.linalg.svd(points - middle, full_matrices=False)
    if size[2] > ROUND * size[0]:
        return None
    above = size[0] / np.sqrt(len(points)) * axes[2]
    found = fit_cylinder(np.concatenate([points - above, points + above]), points - middle)
    if found is None or found.gap(points) > np.pi / 2 + 1e-6:
        return None
    centre = found.point + (middle - found.point) @ found.axis * found.axis
    return Cylinder(point=centre, axis=found.axis, radius=found.radius)
