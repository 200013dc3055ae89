"""The two edges of a sector: which nodes of one follow which of the other, in the next sector."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.spatial import cKDTree

from modalprep.errors import InputError
from modalprep.fe.links.mean_points import cells_of
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.cyclic import CyclicSymmetry
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.nearest_face import Faces
from modalprep.fe.mesh.select import NodeSet

MATCHED = 1e-5  # of the size of the mesh: nodes that the rotation moves so near each other are partners
BESIDE = 0.05  # of the size of a face: how far a node without a partner may lie off it


class SectorEdges(NamedTuple):
    """Nodes ``high (k,)`` that follow others: ``u_high = R sum_j weights_j u_j``, R the rotation by `turns` sectors.

    ``weights (k, n_points)`` are unit rows where meshes match. `axis` are the nodes on the axis of rotation.
    """

    high: np.ndarray
    weights: csr_array
    turns: int
    axis: np.ndarray
    notes: tuple[str, ...] = ()

    @property
    def match(self) -> bool:
        """Whether every node has a partner."""
        return self.weights.nnz == len(self.high)


def sector_edges(mesh: Mesh, cyclic: CyclicSymmetry, used: np.ndarray) -> SectorEdges:
    """Return the edges of a sector among the nodes `used` (k,) by elements.

    Where the meshes of the edges differ, the nodes of the high edge follow the faces of the low one.

    Raises
    ------
    InputError
        When the rotation by one sector moves no edge onto the other.

    Examples
    --------
    >>> quarter = Mesh(points=np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 0]]),
    ...                cells={"triangle": np.array([[0, 1, 2]])}, groups={})
    >>> edges = sector_edges(quarter, CyclicSymmetry(sectors=4), np.arange(3))
    >>> edges.high, edges.weights.toarray(), edges.axis
    (array([1]), array([[1., 0., 0.]]), array([2]))
    """
    points = mesh.points
    slack = cyclic.tolerance or MATCHED * float(np.ptp(points[used], axis=0).max())
    radius = cyclic.radius(points)
    axis = used[radius[used] <= slack]
    off = used[radius[used] > slack]
    low, high = (np.intersect1d(mesh.nodes(name), off) if name else off for name in (cyclic.low, cyclic.high))
    found = [(turns, *_partners(cyclic, points, low, high, turns)) for turns in ((1, -1) if cyclic.low else (1,))]
    turns, distance, partner = min(found, key=lambda one: np.median(one[1]) if len(one[1]) else np.inf)
    near = distance <= slack
    if not cyclic.low:
        _refuse_found(mesh, cyclic, high[near], partner[near], slack)
        high, partner, near = high[near], partner[near], near[near]
    rows = [np.flatnonzero(near)]
    columns = [partner[near]]
    values = [np.ones(np.sum(near))]
    notes = ()
    if not near.all():
        place, weights, notes = _on_faces(mesh, cyclic, low, high[~near], turns)
        rows.append(np.repeat(np.flatnonzero(~near), [len(nodes) for nodes in place]))
        columns.append(np.concatenate(place))
        values.append(np.concatenate(weights))
    place = (np.concatenate(rows), np.concatenate(columns))
    weights = coo_array((np.concatenate(values), place), shape=(len(high), len(points))).tocsr()
    return SectorEdges(high, weights, turns, axis, notes)


def _partners(cyclic: CyclicSymmetry, points: np.ndarray, low: np.ndarray, high: np.ndarray, turns: int):
    """Return the distance (k,) of each high node from the turned low node next to it, and that node."""
    if not len(low) or not len(high):
        name = cyclic.high if len(low) else cyclic.low
        raise InputError(f"cyclic symmetry: the edge {name!r} has no nodes of elements beside the axis; correct it")
    distance, place = cKDTree(cyclic.turned(points[low], turns)).query(points[high])
    return distance, low[place]


def _refuse_found(mesh: Mesh, cyclic: CyclicSymmetry, high: np.ndarray, partner: np.ndarray, slack: float) -> None:
    """Refuse edges found by the rotation alone that are none."""
    what = f"cyclic symmetry: rotation by 360/{cyclic.sectors} degrees about the axis moves"
    if not len(high):
        raise InputError(
            f"{what} no node of the mesh onto another; check sectors, axis and point, or, where the meshes of the two "
            "edges differ, name them"
        )
    if len(np.intersect1d(high, partner)):
        raise InputError(f"{what} nodes onto others that it moves onto others: the mesh has more than one sector")
    lines = any(cell_dimension(kind) == 1 for kind in mesh.cells)  # of which an edge is single nodes
    edge = np.union1d(high, np.flatnonzero(cyclic.radius(mesh.points) <= slack))
    if not lines and not cells_of(mesh, NodeSet(node=1), edge)[0] and not cells_of(mesh, NodeSet(node=1), high)[0]:
        raise InputError(
            f"{what} {len(high)} nodes onto others, which make up no face or edge of the mesh; check sectors, axis and "
            "point, or name the edges"
        )


def _on_faces(mesh: Mesh, cyclic: CyclicSymmetry, low: np.ndarray, high: np.ndarray, turns: int):
    """Return the nodes of the low faces next to nodes without partners, and their weights."""
    found, _ = cells_of(mesh, NodeSet(group=cyclic.low), np.union1d(low, mesh.nodes(cyclic.low)))
    faces = [(kind, nodes) for kind, conn in found.items() if cell_dimension(kind) == 2 for nodes in conn]
    if not faces:
        raise InputError(
            f"cyclic symmetry: {len(high)} nodes of the edge {cyclic.high!r} have no partner on {cyclic.low!r} within "
            "the tolerance, and that edge has no faces to follow; let the meshes of the edges match"
        )
    surface = Faces(faces, mesh.points)
    place, weights = [], []
    for at in cyclic.turned(mesh.points[high], -turns):
        point, nodes, size = surface.nearest(at)
        if point.distance > max(BESIDE * size, cyclic.tolerance):
            raise InputError(
                f"cyclic symmetry: a node of the edge {cyclic.high!r} lies {point.distance:.3g} m from where rotation "
                f"by 360/{cyclic.sectors} degrees moves the edge {cyclic.low!r}; check sectors, axis, point and edges"
            )
        place.append(nodes)
        weights.append(point.weights)
    said = f"cyclic symmetry: {len(high)} nodes of the edge {cyclic.high!r} have no partner and follow the faces of "
    return place, weights, (f"{said}{cyclic.low!r}, which is approximate",)
