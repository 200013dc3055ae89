"""From a mesh and its properties to the finite-element model: FORMULATION section 1."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import reduce
from operator import add

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from modalprep.errors import InputError
from modalprep.fe.beam import BeamBlock
from modalprep.fe.block import PAIRS, csr_of
from modalprep.fe.interface import Interface, InterfaceFrame, interface_position
from modalprep.fe.mesh import Mesh, cell_dimension
from modalprep.fe.model import FEModel, GeometricStiffness
from modalprep.fe.properties import Beam, Property, Solid
from modalprep.fe.solid import SolidBlock
from modalprep.vectors import skew

CHUNK = 20_000  # elements evaluated at once: bounds the memory of shape gradients
FAMILY = {(Beam, "line"): (BeamBlock, 6), (Solid, "tetra10"): (SolidBlock, 3)}


def assemble(
    mesh: Mesh,
    properties: Mapping[str, Property],
    interfaces: Mapping[str, Interface],
    root: str | None = None,
) -> FEModel:
    """Assemble a mesh.

    Parameters
    ----------
    mesh : Mesh
    properties : {group: Beam or Solid}
        Every structural cell needs exactly one.
    interfaces : {name: Interface}
        At least one.
    root : str
        The interface at which the body frame sits; default the first.

    Raises
    ------
    InputError
        When a group or root is unknown, a cell has no property or two, an element is degenerate,
        an interface node has no rotations, or the structure is in several parts.

    Examples
    --------
    >>> from modalprep.examples import beam_mesh, spinup_section
    >>> model = assemble(beam_mesh(4), {"beam": spinup_section()}, {"root": Interface(group="root", kind="node")})
    >>> model
    FEModel(5 nodes, 30 DOFs, m=12 kg; interfaces root)
    >>> bool(abs(model.K @ model.rigid_body()).max() < 1e-6 * abs(model.K).max())
    True
    """
    order = _root_first(interfaces, root)
    place = {name: interface_position(mesh, name, interfaces[name]) for name in order}
    origin = place[order[0]]
    points = mesh.points - origin
    parts = _parts(mesh, properties)
    _refuse_disconnected(mesh, parts, interfaces)
    dof, n = _number(len(points), parts, [interfaces[name].kind for name in order])
    blocks = list(_blocks(mesh.points, parts, dof, origin))
    frames = _frames(mesh, interfaces, order, place, dof, len(points))
    C, free = _rigid_links(points, dof, frames, n)
    mass = [block.mass() for block in blocks]
    tensor = {ab: csr_of([t for m in mass for t in m.tensor[ab]], n, symmetric=ab[0] == ab[1]) for ab in PAIRS}
    K = csr_of([t for block in blocks for t in block.stiffness()], n, symmetric=True)
    return FEModel(
        points=points,
        cells=_cells(parts),
        dof=dof,
        K=K,
        M=(tensor[0, 0] + tensor[1, 1] + tensor[2, 2]).tocsr(),
        g=_scatter([(m.dofs, m.g) for m in mass], n),
        h=_scatter([(m.dofs, m.h) for m in mass], n),
        M_ab=tensor,
        rigid=reduce(add, (m.rigid for m in mass)),
        C=C,
        free=free,
        interfaces=frames,
        geometric_stiffness=GeometricStiffness(blocks, K, points, dof, frames),
        origin=origin,
        source={"mesh": mesh.source, "mesh_sha256": mesh.sha256},
    )


def _root_first(interfaces: Mapping[str, Interface], root: str | None) -> list[str]:
    names = list(interfaces)
    if not names:
        raise InputError("the model has no interface; name at least one under [interfaces] to carry the body frame")
    root = names[0] if root is None else root
    if root not in names:
        raise InputError(f"root {root!r} is not an interface; known are {', '.join(names)}")
    return [root, *(name for name in names if name != root)]


def _parts(mesh: Mesh, properties: Mapping[str, Property]) -> list[tuple[Property, np.ndarray]]:
    """Return [(property, connectivity)], every structural cell once."""
    covered = {kind: np.zeros(len(c), dtype=int) for kind, c in mesh.cells.items()}
    parts = []
    for group, section in properties.items():
        wanted = [kind for (family, kind) in FAMILY if family is type(section)]
        cells = {kind: c for kind, c in mesh.group(group).items() if cell_dimension(kind) == cell_dimension(wanted[0])}
        if not cells or set(cells) - set(wanted):
            has = ", ".join(mesh.group(group))
            name = type(section).__name__.lower()
            raise InputError(f"group {group!r} has {has} cells, but type {name!r} needs {' or '.join(wanted)} cells")
        for kind, conn in cells.items():
            covered[kind][mesh.groups[group][kind]] += 1
            parts.append((section, conn))
    _refuse_uncovered(mesh, covered, max(cell_dimension(k) for k in covered))
    return parts


def _refuse_uncovered(mesh: Mesh, covered: dict[str, np.ndarray], dimension: int) -> None:
    for kind, count in covered.items():
        if np.any(count > 1):
            raise InputError(f"{np.sum(count > 1)} {kind} cells have two properties; give each group its own cells")
        if cell_dimension(kind) == dimension and np.any(count == 0):
            names = [g for g, rows in mesh.groups.items() if kind in rows and np.any(count[rows[kind]] == 0)]
            where = f"group {names[0]!r}" if names else "cells in no group"
            raise InputError(
                f"{np.sum(count == 0)} of {len(count)} {kind} cells have no property ({where}); "
                "add one under [properties]"
            )


def _refuse_disconnected(mesh: Mesh, parts: list, interfaces: Mapping[str, Interface]) -> None:
    groups = [conn for _, conn in parts]
    groups += [mesh.nodes(i.group)[None] for i in interfaces.values() if i.kind == "rbe2"]
    rows = np.concatenate([np.repeat(c[:, 0], c.shape[1]) for c in groups])
    cols = np.concatenate([c.ravel() for c in groups])
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, cols)), shape=(len(mesh.points),) * 2)
    used = np.unique(np.concatenate([conn.ravel() for _, conn in parts]))
    label = connected_components(graph, directed=False)[1][used]
    names, count = np.unique(label, return_counts=True)
    if len(names) > 1:
        small = used[label == names[np.argmin(count)]]
        at = ", ".join(f"{x:.4g}" for x in mesh.points[small].mean(axis=0))
        raise InputError(
            f"the structure is in {len(names)} disconnected parts, the smallest has {len(small)} nodes "
            f"around ({at}) m; merge coincident nodes or mesh the parts together"
        )


def _number(n_points: int, parts: list, kinds: list[str]) -> tuple[np.ndarray, int]:
    """Number the DOFs node by node; each RBE2 interface adds a node of six."""
    active = np.zeros((n_points + kinds.count("rbe2"), 6), dtype=bool)
    active[n_points:] = True
    for section, conn in parts:
        active[np.unique(conn), : _family(section)[1]] = True
    dof = np.full(active.shape, -1)
    dof[active] = np.arange(active.sum())
    return dof, int(active.sum())


def _family(section: Property) -> tuple:
    return next(value for (family, _), value in FAMILY.items() if family is type(section))


def _blocks(points: np.ndarray, parts: list, dof: np.ndarray, origin: np.ndarray) -> Iterator[BeamBlock | SolidBlock]:
    for section, conn in parts:
        block, components = _family(section)
        for start in range(0, len(conn), CHUNK):
            piece = conn[start : start + CHUNK]
            yield block.build(points, piece, dof[piece, :components].reshape(len(piece), -1), section, origin)


def _cells(parts: list) -> dict[str, np.ndarray]:
    kinds = {2: "line", 10: "tetra10"}
    cells: dict[str, list] = {}
    for _, conn in parts:
        cells.setdefault(kinds[conn.shape[1]], []).append(conn)
    return {kind: np.concatenate(c) for kind, c in cells.items()}


def _scatter(pieces: list[tuple[np.ndarray, np.ndarray]], n: int) -> np.ndarray:
    out = np.zeros((n, *pieces[0][1].shape[2:]))
    for dofs, values in pieces:
        np.add.at(out, dofs, values)
    return out


def _frames(mesh, interfaces, order, place, dof, n_points) -> tuple[InterfaceFrame, ...]:
    frames, extra = [], n_points
    owner: dict[int, str] = {}
    for name in order:
        spec, nodes = interfaces[name], mesh.nodes(interfaces[name].group)
        rigid = spec.kind == "rbe2"
        node = extra if rigid else int(nodes[0])
        extra += rigid
        tied = nodes[dof[nodes, 0] >= 0] if rigid else np.zeros(0, dtype=int)
        _refuse_loose(name, spec, dof, node, tied, mesh.points)
        for held in tied if rigid else [node]:
            if int(held) in owner:
                raise InputError(f"node {held + 1} belongs to both interfaces {owner[int(held)]!r} and {name!r}")
            owner[int(held)] = name
        boundary = "fixed" if name == order[0] else spec.boundary
        frames.append(
            InterfaceFrame(
                name=name,
                position=place[name] - place[order[0]],
                dofs=dof[node],
                nodes=tied,
                boundary=boundary,
            )
        )
    return tuple(frames)


def _refuse_loose(name: str, spec: Interface, dof: np.ndarray, node: int, tied: np.ndarray, points: np.ndarray) -> None:
    if spec.kind == "node" and np.any(dof[node] < 0):
        raise InputError(f"interface {name!r}: its node has no rotations (solid or no element); use kind = 'rbe2'")
    if spec.kind == "node":
        return
    if not len(tied):
        raise InputError(f"interface {name!r}: no node of group {spec.group!r} belongs to an element with a property")
    spread = np.linalg.svd(points[tied] - points[tied].mean(axis=0), compute_uv=False)
    if np.all(dof[tied, 3] < 0) and (len(tied) < 3 or spread[1] <= 1e-9 * spread[0]):
        raise InputError(
            f"interface {name!r}: the {len(tied)} nodes of group {spec.group!r} lie on one line and cannot hold "
            "its rotation; add nodes off that line"
        )


def _rigid_links(points, dof, frames, n) -> tuple[csr_array, np.ndarray]:
    """Return C with u = u_frame + theta x r and theta = theta_frame at every tied node, and the free DOFs."""
    rows, cols, values = [], [], []
    for frame in frames:
        link = np.zeros((len(frame.nodes), 6, 6))
        link[:, :, :] = np.eye(6)
        link[:, :3, 3:] = -skew(points[frame.nodes] - frame.position)
        present = dof[frame.nodes] >= 0
        rows.append(np.repeat(dof[frame.nodes][present], 6))
        cols.append(np.tile(frame.dofs, present.sum()))
        values.append(link[present].ravel())
    dependent = np.unique(np.concatenate([np.zeros(0, dtype=int), *rows]))
    free = np.setdiff1d(np.arange(n), dependent)
    rows, cols, values = [free, *rows], [free, *cols], [np.ones(len(free)), *values]
    C = coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(cols))), shape=(n, n)).tocsr()
    return C[:, free].tocsr(), free
