"""The whole ring of a cyclic symmetry: a mesh of one sector, copied around the axis and joined at its edges."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.links.sector_edges import SectorEdges, sector_edges
from modalprep.fe.mesh.analysis import LoadSet
from modalprep.fe.mesh.cyclic import CyclicSymmetry
from modalprep.fe.mesh.mesh import Equation, Link, Mesh, SupportSet
from modalprep.fe.properties.materials import Material
from modalprep.fe.properties.points import PointMass, Spring
from modalprep.fe.properties.properties import Beam, Property, Shell, Solid
from modalprep.vectors import inertia_tensor

VECTORS = ("up", "axis", "ends", "frame")  # data of cells that are vectors in mesh axes, in the last direction
SAME = 1e-12  # of a turned vector


@dataclass(frozen=True, eq=False)
class Copies:
    """Where the nodes and the cells of a sector lie in the ring: rows of ``(sectors, count)``."""

    nodes: np.ndarray
    cells: dict[str, np.ndarray]


def make_ring(
    mesh: Mesh, cyclic: CyclicSymmetry | None = None, properties: Mapping[str, Property] | None = None
) -> Mesh:
    """Return the mesh of all sectors of a ring, with the properties of its groups.

    Each group has the cells of every sector; ``NAME_1``, ``NAME_2`` and so on have those of one, in the order of the
    rotation. Loads act on every sector. A property with directions in mesh axes, such as `up` of a beam, becomes one
    for each sector, turned.

    Parameters
    ----------
    mesh : Mesh
        Of one sector.
    cyclic : CyclicSymmetry
        Default that of the mesh.
    properties : {group: Property}
        Beside those of the mesh.

    Returns
    -------
    Mesh
        Nodes of sector k have the numbers of the first one, with k - 1 before.

    Raises
    ------
    InputError
        When the mesh has no cyclic symmetry, or its edges do not fit each other.

    References
    ----------
    Theory 3.9.

    Examples
    --------
    >>> from modalprep.examples import disc_sector
    >>> mesh, _, cyclic = disc_sector()
    >>> ring = make_ring(mesh, cyclic)
    >>> len(ring.points), len(ring.cells["quad"]), ring.groups["disc_2"]["quad"]
    (64, 48, array([ 6,  7,  8,  9, 10, 11]))
    """
    cyclic = cyclic or mesh.cyclic
    if cyclic is None or cyclic.whole:
        raise InputError("the mesh has no cyclic symmetry to make a ring of; give that of a sector")
    if mesh.matrices:
        raise InputError(
            f"the mesh has matrices ({mesh.matrices[0].name}), which cannot be copied around a ring; use [cyclic]"
        )
    edges = sector_edges(mesh, cyclic, np.unique(np.concatenate([conn.ravel() for conn in mesh.cells.values()])))
    copies = _copies(mesh, cyclic, edges)
    return mesh.with_(
        points=_points(mesh, cyclic, copies),
        cells={kind: _cells(mesh, copies, kind) for kind in mesh.cells},
        groups=_groups(mesh, copies),
        labels=_labels(mesh, copies),
        properties=_properties({**mesh.properties, **(properties or {})}, mesh.groups, cyclic),
        links=_links(mesh, cyclic, copies),
        equations=(*_equations(mesh, cyclic, copies), *_tied(edges, copies)),
        supports={name: _support(held, cyclic, copies) for name, held in mesh.supports.items()},
        loads={name: _load(load, cyclic, copies) for name, load in mesh.loads.items()},
        data={name: _data(name, of, cyclic, copies) for name, of in mesh.data.items()},
        cyclic=cyclic.with_(whole=True),
        notes=(*mesh.notes, *edges.notes),
    )


def _copies(mesh: Mesh, cyclic: CyclicSymmetry, edges: SectorEdges) -> Copies:
    n = len(mesh.points)
    once = np.zeros(n, dtype=bool)
    once[edges.axis] = True
    if edges.match:
        once[edges.high] = True
    base = np.flatnonzero(~once)
    nodes = np.zeros((cyclic.sectors, n), dtype=int)
    nodes[:, base] = np.arange(cyclic.sectors * len(base)).reshape(cyclic.sectors, -1)
    nodes[:, edges.axis] = cyclic.sectors * len(base) + np.arange(len(edges.axis))
    if edges.match:
        nodes[:, edges.high] = np.roll(nodes, -edges.turns, axis=0)[:, edges.weights.indices]
    return Copies(nodes, {kind: _rows(mesh, kind, nodes) for kind in mesh.cells})


def _rows(mesh: Mesh, kind: str, nodes: np.ndarray) -> np.ndarray:
    """Return the rows (sectors, count) of the copies of cells; vertices of the same groups at one node are one."""
    conn = mesh.cells[kind]
    every = np.arange(len(nodes) * len(conn)).reshape(len(nodes), -1)
    if kind != "vertex":
        return every
    member = np.zeros((len(conn), len(mesh.groups)), dtype=bool)
    for k, group in enumerate(mesh.groups.values()):
        member[group.get(kind, []), k] = True
    _, alike = np.unique(member, axis=0, return_inverse=True)
    keys = np.stack([nodes[:, conn[:, 0]].ravel(), np.tile(alike.ravel(), len(nodes))])
    _, first, back = np.unique(keys, axis=1, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=int)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[back.ravel()].reshape(every.shape)


def _points(mesh: Mesh, cyclic: CyclicSymmetry, copies: Copies) -> np.ndarray:
    points = np.zeros((copies.nodes.max() + 1, 3))
    for k in range(cyclic.sectors)[::-1]:
        points[copies.nodes[k]] = cyclic.turned(mesh.points, k)
    return points


def _cells(mesh: Mesh, copies: Copies, kind: str) -> np.ndarray:
    rows = copies.cells[kind]
    conn = np.zeros((rows.max(initial=-1) + 1, mesh.cells[kind].shape[1]), dtype=int)
    for nodes, own in zip(copies.nodes, rows, strict=True):
        conn[own] = nodes[mesh.cells[kind]]
    return conn


def _labels(mesh: Mesh, copies: Copies) -> np.ndarray:
    own = mesh.labels if len(mesh.labels) else np.arange(1, len(mesh.points) + 1)
    step = 10 ** len(str(own.max()))
    labels = np.zeros(copies.nodes.max() + 1, dtype=int)
    for k in range(len(copies.nodes))[::-1]:
        labels[copies.nodes[k]] = own + k * step
    return labels


def _groups(mesh: Mesh, copies: Copies) -> dict[str, dict[str, np.ndarray]]:
    groups = {}
    for name, group in mesh.groups.items():
        if f"{name}_1" in mesh.groups:
            raise InputError(f"the mesh has groups {name!r} and '{name}_1', the name of the first sector; rename one")
        own = {kind: copies.cells[kind][:, rows] for kind, rows in group.items()}
        groups[name] = {kind: np.unique(rows) for kind, rows in own.items()}
        groups |= {f"{name}_{k + 1}": {kind: rows[k] for kind, rows in own.items()} for k in range(len(copies.nodes))}
    return groups


def _properties(given: Mapping[str, Property], groups: Collection[str], cyclic: CyclicSymmetry) -> dict[str, Property]:
    """Return the properties without directions, and those of groups with directions, one for each sector."""
    found = {}
    for name, section in given.items():
        turns = range(cyclic.sectors) if name in groups else ()
        copies = [turned_property(section, cyclic.rotation(k)) for k in turns]
        alike = all(copy == section for copy in copies)
        found |= {name: section} if alike else {f"{name}_{k}": copy for k, copy in enumerate(copies, start=1)}
    return found


def turned_property(section: Property, R: np.ndarray) -> Property:
    """Return a property whose directions in mesh axes are rotated by R (3, 3).

    Examples
    --------
    >>> quarter_turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    >>> turned_property(PointMass(mass=1.0, offset=(2.0, 0.0, 0.0)), quarter_turn)  # doctest: +ELLIPSIS
    PointMass(mass=1.0, ..., offset=(0.0, 2.0, 0.0))
    """
    changes: dict[str, Any] = {}
    if isinstance(section, (Beam, Spring)):
        changes["up"] = _turned(section.up, R)
    if isinstance(section, Shell) and section.axis is not None:
        changes["axis"] = _turned(section.axis, R)
    if isinstance(section, Solid) and not (section.axes is None and isinstance(section.material, Material)):
        axes = section.axes or ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        changes["axes"] = tuple(_turned(axis, R) for axis in axes)
    if isinstance(section, PointMass):
        J = R @ inertia_tensor(section.inertia) @ R.T
        if np.abs(J - inertia_tensor(section.inertia)).max() > SAME * np.abs(J).max():
            changes["inertia"] = tuple(float(J[a, b]) for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
        changes["offset"] = _turned(section.offset, R)
    return replace(section, **changes) if changes else section


def _turned(vector: tuple[float, ...], R: np.ndarray) -> tuple[float, ...]:
    """Return a rotated vector; itself where the rotation does not change it."""
    found = R @ vector
    if np.abs(found - vector).max() <= SAME * np.abs(found).max():
        return vector
    return tuple(float(x) for x in found)


def _axes(axes: np.ndarray, count: int, R: np.ndarray) -> np.ndarray:
    """Return rotated rows (count, 3, 3); without any those of the mesh."""
    return (axes if len(axes) else np.tile(np.eye(3), (count, 1, 1))) @ R.T


def _links(mesh: Mesh, cyclic: CyclicSymmetry, copies: Copies) -> tuple[Link, ...]:
    """Return the links of all sectors; rigid ones from one node on the axis are joined to one."""
    found: dict[tuple[int, int], Link] = {}
    for k, nodes in enumerate(copies.nodes):
        for j, link in enumerate(mesh.links):
            own = link.renumbered(nodes)
            if not np.all(link.components):
                count = len(link.nodes) if link.kind == "rbe2" else 1
                own = own.with_(axes=_axes(link.axes, count, cyclic.rotation(k)))
            same = found.get((j, own.node))
            found[j, own.node] = own if same is None or link.kind != "rbe2" else _joined(same, own)
    return tuple(found.values())


def _joined(one: Link, other: Link) -> Link:
    """Return one rigid link with the nodes of two."""
    new = ~np.isin(other.nodes, one.nodes)
    of = {"nodes": np.append(one.nodes, other.nodes[new])}
    if one.components.ndim == 2:
        of["components"] = np.concatenate([one.components, other.components[new]])
    if len(one.axes):
        of["axes"] = np.concatenate([one.axes, other.axes[new]])
    return one.with_(**of)


def _equations(mesh: Mesh, cyclic: CyclicSymmetry, copies: Copies) -> list[Equation]:
    found = []
    for k, nodes in enumerate(copies.nodes):
        R = cyclic.rotation(k)
        for equation in mesh.equations:
            turned = (equation.coefficients.reshape(-1, 2, 3) @ R.T).reshape(-1, 6)
            found.append(equation.with_(nodes=nodes[equation.nodes], coefficients=turned))
    return found


def _tied(edges: SectorEdges, copies: Copies) -> list[Equation]:
    """Return the equations of edges that do not match: each node of one follows a face of the other."""
    found = []
    for k, nodes in enumerate(copies.nodes) if not edges.match else ():
        other = copies.nodes[(k + edges.turns) % len(copies.nodes)]
        for node, start, end in zip(edges.high, edges.weights.indptr[:-1], edges.weights.indptr[1:], strict=True):
            place = np.append(nodes[node], other[edges.weights.indices[start:end]])
            values = np.append(1.0, -edges.weights.data[start:end])
            for c in range(3):
                name = f"the edge between sectors {k + 1} and {(k + edges.turns) % len(copies.nodes) + 1}"
                found.append(Equation(nodes=place, coefficients=np.outer(values, np.eye(6)[c]), name=name))
    return found


def _support(held: SupportSet, cyclic: CyclicSymmetry, copies: Copies) -> SupportSet:
    nodes = copies.nodes[:, held.nodes].ravel()
    axes = np.concatenate([_axes(held.axes, len(held.nodes), cyclic.rotation(k)) for k in range(cyclic.sectors)])
    components = np.tile(held.components, (cyclic.sectors, 1))
    _, first = np.unique(nodes, return_index=True)
    return held.with_(nodes=nodes[first], components=components[first], axes=axes[first])


def _load(load: LoadSet, cyclic: CyclicSymmetry, copies: Copies) -> LoadSet:
    """Return a load on all sectors alike."""
    turns = [cyclic.rotation(k) for k in range(cyclic.sectors)]
    forces, moments = (np.concatenate([values @ R.T for R in turns]) for values in (load.forces, load.moments))
    return LoadSet(nodes=copies.nodes[:, load.nodes].ravel(), forces=forces, moments=moments)


def _data(name: str, of: Mapping[str, np.ndarray], cyclic: CyclicSymmetry, copies: Copies) -> dict[str, np.ndarray]:
    """Return the values of cells by kind, of those that are vectors rotated."""
    found = {}
    for kind, values in of.items():
        rows = copies.cells[kind]
        found[kind] = np.zeros((rows.max(initial=-1) + 1, *values.shape[1:]))
        for k, own in enumerate(rows):
            found[kind][own] = values @ cyclic.rotation(k).T if name in VECTORS else values
    return found
