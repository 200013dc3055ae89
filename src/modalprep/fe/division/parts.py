"""Parts of a mesh by elements: slabs of equal distance from the root, split at branches (theory 4.10).

A mesh is cut for its kinematics only: elements, nodes and stiffness stay one body. The parent of a part is its
neighbour nearer the root, so that the parts are a tree.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.division.graph import distances, element_nodes, node_positions, touching

SLIVER = 0.1  # elements of a part over those of a slab on average: fewer join the part they hang on
FAR = 1e-9  # of the longest distance


class Division(NamedTuple):
    """Parts of a mesh, each after its parent.

    Attributes
    ----------
    parent : (N,) int
        -1 of those that begin at the root.
    of_element : (n_elements,) int
        Part of each element, in the order of the blocks of the model.
    of_node : (n_nodes,) int
        Part that owns each node of ``model.dof``, -1 of nodes without elements.
    """

    parent: np.ndarray
    of_element: np.ndarray
    of_node: np.ndarray


def divide(model: FEModel, parts: int) -> Division:
    """Divide the mesh of a model into about so many parts along each way from the root.

    Raises
    ------
    InputError
        When the number is not positive, the mesh closes on itself, or the elements are not known.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> divide(cantilever_model(elements=4), 2)
    Division(parent=array([-1,  0]), of_element=array([0, 0, 1, 1]), of_node=array([0, 0, 0, 1, 1]))
    """
    if parts < 1:
        raise InputError(f"stations = {parts} must be at least 1")
    slab = _slabs(model, parts)
    near = touching(model)
    found = _pieces(near, slab)
    found = _without_slivers(near, slab, found)
    parent, of_element = _tree(near, slab, found, _places(model))
    return Division(parent, of_element, _owners(model, of_element))


def _slabs(model: FEModel, parts: int) -> np.ndarray:
    """Return the slab (n_elements,) of each element, by the mean distance of its nodes."""
    way = distances(model)
    far = np.isfinite(way)
    if not np.any(far):
        raise InputError("large_deflection: no element is connected to the root interface")
    at = np.concatenate([np.where(far, way, 0.0)[nodes].mean(axis=1) for nodes in element_nodes(model)])
    longest = float(way[far].max()) or 1.0
    return np.clip((at / longest * parts * (1 + FAR)).astype(int), 0, parts - 1)


def _pieces(near: csr_array, slab: np.ndarray) -> np.ndarray:
    """Return the connected piece (n_elements,) of its slab that each element is in."""
    pairs = near.tocoo()
    same = slab[pairs.row] == slab[pairs.col]
    graph = csr_array((np.ones(same.sum()), (pairs.row[same], pairs.col[same])), shape=near.shape)
    return connected_components(graph, directed=False)[1]


def _without_slivers(near: csr_array, slab: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Join pieces of few elements, that the edges of a slab cut off, to a larger neighbour; `slab` follows."""
    count = np.bincount(found)
    least = SLIVER * len(slab) / (slab.max() + 1)
    pairs = near.tocoo()
    for piece in np.argsort(count):
        if count[piece] >= least:
            break
        own = found == piece
        others = pairs.col[own[pairs.row] & ~own[pairs.col]]
        others = others[count[found[others]] >= least]
        if len(others):
            into = others[np.argmin(slab[others])]
            slab[own], found[own] = slab[into], found[into]
    return np.unique(found, return_inverse=True)[1]


def _tree(near: csr_array, slab: np.ndarray, found: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the parent of each part, and the part of each element, parents first."""
    level = np.zeros(found.max() + 1, dtype=int)
    level[found] = slab
    pairs = near.tocoo()
    edges = np.unique(np.stack([found[pairs.row], found[pairs.col]], axis=1), axis=0)
    edges = edges[level[edges[:, 1]] < level[edges[:, 0]]]
    order = np.argsort(level, kind="stable")
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    parent = np.full(len(order), -1)
    for own, inner in edges:
        if parent[number[own]] >= 0:
            raise InputError(_closed(at[found == own].mean(axis=0)))
        parent[number[own]] = number[inner]
    loose = np.flatnonzero((parent < 0) & (level[order] > level.min()))
    if len(loose):
        raise InputError(_loose(at[found == order[loose[0]]].mean(axis=0)))
    return parent, number[found]


def _places(model: FEModel) -> np.ndarray:
    at = node_positions(model)
    return np.concatenate([at[nodes].mean(axis=1) for nodes in element_nodes(model)]) + model.origin


def _closed(at: np.ndarray) -> str:
    where = ", ".join(f"{x:.4g}" for x in at)
    return (
        f"large_deflection: the body closes on itself near ({where}) m, where two ways from the root meet, and "
        "stations need a body whose parts branch without meeting again; set large_deflection = false, or stations to a "
        "smaller number if a hole or a notch splits the parts"
    )


def _loose(at: np.ndarray) -> str:
    where = ", ".join(f"{x:.4g}" for x in at)
    return f"large_deflection: elements near ({where}) m touch no part nearer the root; set large_deflection = false"


def _owners(model: FEModel, of_element: np.ndarray) -> np.ndarray:
    """Return the part of each node: of its elements the one nearest the root; of frames that of most of their nodes."""
    found = np.full(len(model.dof), len(of_element))
    start = 0
    for nodes in element_nodes(model):
        np.minimum.at(found, nodes, of_element[start : start + len(nodes), None])
        start += len(nodes)
    found[found == len(of_element)] = -1
    return found
