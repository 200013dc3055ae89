"""Assembly of a mesh and its properties to the finite-element model (theory 1)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import InputError
from modalprep.fe.assembly.geometric_stiffness import GeometricStiffness
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.assembly.parts import Part, find_parts, refuse_disconnected, used_nodes
from modalprep.fe.assembly.rotating_mass import RotatingMass
from modalprep.fe.assembly.rotation_continuity import hidden_hinges
from modalprep.fe.assembly.sparsity import Pattern, node_graph
from modalprep.fe.assembly.strain_energy import StrainEnergy
from modalprep.fe.assembly.totals import Totals
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.distribution import Distribution, Inertia, MassRule
from modalprep.fe.elements.kernels import ahead
from modalprep.fe.elements.mass import MassObjects
from modalprep.fe.links.interface import Connection, Interface, InterfaceFrame, connect, interface_position
from modalprep.fe.links.multipoint import PlacedLink, constraint_matrix
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.plausible import implausible_sections
from modalprep.fe.properties.points import PointMass
from modalprep.fe.properties.properties import Property
from modalprep.suggest import refuse_other, refuse_unknown


def assemble(
    mesh: Mesh,
    properties: Mapping[str, Property],
    interfaces: Mapping[str, Interface],
    root: str | None = None,
    connections: Mapping[str, Connection] | None = None,
    mass: Distribution = "coupled",
) -> FEModel:
    """Assemble the finite-element model of a mesh.

    Parameters
    ----------
    mesh : Mesh
    properties : {group: Beam, Truss, Shell, Solid, PointMass or Spring}
        Every structural cell needs exactly one; those that the mesh file carries need not be repeated.
    interfaces : {name: Interface}
        At least one.
    root : str
        The interface at which the body frame sits; default the first.
    connections : {name: Connection}
        New nodes tied to node sets; each creates a group of its name.
    mass : {"coupled", "lumped", "nastran"}
        Consistent mass of the elements; all mass at the nodes; or as MSC Nastran distributes it, lumped unless the
        deck has ``PARAM,COUPMASS,1``.

    Returns
    -------
    FEModel
        In a frame at the root interface with the axes of the mesh, SI units.

    Raises
    ------
    InputError
        When a group or root is unknown, a cell has no property or two, an element is degenerate,
        an interface node has no rotations, or the structure is in several parts.

    References
    ----------
    Theory 1; of the elements theory 7.

    Examples
    --------
    >>> from modalprep.examples import beam_mesh, spinup_section
    >>> model = assemble(beam_mesh(4), {"beam": spinup_section()}, {"root": Interface(group="root", kind="node")})
    >>> model
    FEModel(5 nodes, 30 DOFs, m=12 kg; interfaces root)
    >>> bool(abs(model.K @ model.rigid_body()).max() < 1e-6 * abs(model.K).max())
    True
    """
    refuse_other("assemble: the mesh", Mesh, mesh)
    refuse_unknown(str(mass), get_args(Distribution), "assemble: mass")
    order, connections = root_first(interfaces, root), dict(connections or {})
    for name in set(connections) & set(mesh.groups):
        raise InputError(f"connection {name!r} has the name of a mesh group; choose another")
    sections = {**mesh.properties, **properties}
    boundary = {spec.group for spec in (*interfaces.values(), *connections.values()) if spec.group}
    known = {name: section for name, section in sections.items() if name not in connections}
    mesh = connect(mesh, connections, used_nodes(find_parts(mesh, known, boundary)[0]))
    parts, notes = find_parts(mesh, sections, boundary)
    nodes = {name: interfaces[name].nodes(mesh, used_nodes(parts)) for name in order}
    place = {name: interface_position(mesh, name, interfaces[name], nodes[name]) for name in order}
    framed = [name for name in order if interfaces[name].kind != "node"]
    tied = [nodes[name] for name in framed] + [np.append(link.nodes, link.node) for link in mesh.links]
    refuse_disconnected(mesh.points, parts, tied)
    parts, more = _without_unused_inertia(mesh, parts)
    dof = _number(mesh, parts, len(framed))
    placed = place_frames(mesh, interfaces, nodes, place, dof)
    more += [*hidden_hinges(mesh, parts), *_odd_units(mesh, parts)]
    rule = MassRule(mass, mesh.coupled_mass)
    return _sum(mesh, parts, dof, rule, place[order[0]], *placed, (*mesh.notes, *notes, *more))


def _odd_units(mesh: Mesh, parts: list[Part]) -> list[str]:
    size = float(np.ptp(mesh.points[used_nodes(parts)], axis=0).max())
    return implausible_sections({part.group: part.section for part in parts}, size)


def root_first(interfaces: Mapping[str, Interface], root: str | None) -> list[str]:
    """Return the names of the interfaces, the root (default the first) before the others."""
    names = list(interfaces)
    if not names:
        raise InputError("the model has no interface; name at least one under [interfaces] to carry the body frame")
    root = names[0] if root is None else root
    if root not in names:
        raise InputError(f"root {root!r} is not an interface; known are {', '.join(names)}")
    return [root, *(name for name in names if name != root)]


def _sum(mesh, parts, dof, rule, origin, frames, links, notes) -> FEModel:
    """Evaluate every element once and sum up the model."""
    pattern = Pattern.build([part.nodes for part in parts], dof)
    total = _totals(parts, pattern, dof, rule)
    built = [(part, piece) for part in parts for piece in part.pieces()]
    blocks, inertias, points = [], [], mesh.points - origin
    for block, inertia, *found in ahead(
        lambda own: _evaluated(own[0].block(own[1], mesh.points, origin), rule, points), built
    ):
        total.add(block, *found)
        blocks.append(block)
        inertias.append(inertia)
    K, M = pattern.csr(total.K), total.mass()
    C, free, step = constraint_matrix(links, total.n)
    diagonal = abs(pattern.diagonal(total.K, dof)) + abs(pattern.diagonal(total.M, dof))
    C, free = without_unused_dofs(C, free, diagonal, frames)
    return FEModel(
        points=points,
        cells=_cells(parts),
        dof=dof,
        K=K,
        M=M,
        g=total.g,
        h=total.h.reshape(-1, 3, 3),
        M_ab=total.tensor(),
        rigid=total.rigid,
        C=C,
        free=free,
        interfaces=frames,
        geometric_stiffness=GeometricStiffness(blocks, pattern, K, dof, links, step),
        rotating_mass=RotatingMass(inertias, dof),
        strain_energy=StrainEnergy([part.kind for part, _ in built], blocks, dof),
        origin=origin,
        source={"mesh": mesh.source, "mesh_sha256": mesh.sha256},
        notes=notes,
    )


def _evaluated(
    block: Block, rule: MassRule, points: np.ndarray
) -> tuple[Block, Inertia, np.ndarray | None, MassObjects | None]:
    inertia = rule.inertia(block, points)
    return block, inertia, block.stiffness(), inertia.mass()


def _totals(parts: list[Part], pattern: Pattern, dof: np.ndarray, rule: MassRule) -> Totals:
    """Begin the sums over elements whose mass tensors have different forms."""
    shells, thin = (
        [part.nodes for part in parts if rule.tensor(part.family) == form] for form in ("functions", "pairs")
    )
    graph = None
    if shells:
        graph = pattern.graph if len(shells) == len(parts) else node_graph(shells, len(dof))
    return Totals(pattern, graph, Pattern.build(thin, dof) if thin else None, dof)


def _without_unused_inertia(mesh: Mesh, parts: list[Part]) -> tuple[list[Part], list[str]]:
    """Drop the inertia and offset of masses on nodes without rotations, such as those of solids."""
    turning = np.zeros(len(mesh.points), dtype=bool)
    for part in parts:
        if not isinstance(part.section, PointMass) and part.components(mesh.points) == 6:
            turning[part.nodes] = True
    for link in mesh.links:
        turning[link.node] = True
        turning[link.nodes] |= link.kind == "rbe2" and bool(link.components[3:].any())
    kept, notes = [], []
    for part in parts:
        idle = isinstance(part.section, PointMass) and not np.all(turning[part.nodes])
        if idle and part.components(mesh.points) == 6:
            notes.append(f"mass {part.group!r} sits on a node without rotations: its inertia and offset are left out")
            part = Part(part.group, PointMass(mass=part.section.mass), part.kind, part.nodes, part.data)
        kept.append(part)
    return kept, notes


def _number(mesh: Mesh, parts: list[Part], frames: int) -> np.ndarray:
    """Number the DOFs node by node, 3 or 6 each; every RBE2 or RBE3 interface adds a node of six."""
    width = np.zeros(len(mesh.points) + frames, dtype=int)
    width[len(mesh.points) :] = 6
    for part in parts:
        np.maximum.at(width, part.nodes, part.components(mesh.points))
    width[[link.node for link in mesh.links]] = 6
    active = np.arange(6) < width[:, None]
    return np.where(active, np.cumsum(active).reshape(active.shape) - 1, -1)


def place_frames(mesh, interfaces, nodes, place, dof) -> tuple[tuple[InterfaceFrame, ...], list[PlacedLink]]:
    """Place the interface frames in the order of `place`, the root first, and every link."""
    frames, links, extra = [], [_mesh_link(mesh, dof, k) for k in range(len(mesh.links))], len(mesh.points)
    root = next(iter(place))
    for name, position in place.items():
        spec, at = interfaces[name], nodes[name]
        framed = spec.kind != "node"
        frame = dof[extra if framed else at[0]]
        extra += framed
        tied = at[dof[at, 0] >= 0] if framed else np.zeros(0, dtype=int)
        _refuse_loose(name, spec, frame, tied, dof, mesh.points)
        if framed:
            arm, ones = mesh.points[tied] - position, np.ones(len(tied))
            every = np.ones(6, dtype=bool)
            links.append(PlacedLink(spec.kind, f"interface {name!r}", frame, dof[tied], arm, every, ones, True))
        boundary = "fixed" if name == root else spec.boundary
        frames.append(
            InterfaceFrame(name=name, position=position - place[root], dofs=frame, nodes=tied, boundary=boundary)
        )
    _refuse_shared(frames, links)
    return tuple(frames), links


def _mesh_link(mesh: Mesh, dof: np.ndarray, k: int) -> PlacedLink:
    link = mesh.links[k]
    tied = dof[link.nodes, 0] >= 0
    nodes = link.nodes[tied]
    label = mesh.labels[link.node] if link.node < len(mesh.labels) else link.node + 1
    name = f"{link.kind} at node {label}"
    if not len(nodes):
        raise InputError(f"{name}: none of its nodes belongs to an element with a property")
    arm = mesh.points[nodes] - mesh.points[link.node]
    weights = link.weights[tied] if link.kind == "rbe3" else np.ones(len(nodes))
    return PlacedLink(link.kind, name, dof[link.node], dof[nodes], arm, link.components, weights, False)


def _refuse_shared(frames: list[InterfaceFrame], links: list[PlacedLink]) -> None:
    """Refuse interfaces whose DOFs depend on another link: they cannot be fixed."""
    driven = {int(d): link.name for link in links for d in link.rows()[0]}
    owner: dict[int, str] = {}
    for frame in frames:
        other = owner.setdefault(int(frame.dofs[0]), frame.name)
        if other != frame.name:
            raise InputError(f"one node belongs to both interfaces {other!r} and {frame.name!r}; join the two")
        for d in frame.dofs:
            if int(d) in driven:
                raise InputError(
                    f"interface {frame.name!r} sits on a node that {driven[int(d)]} drives; use the frame of that link"
                )


def _refuse_loose(name, spec: Interface, frame, tied, dof, points) -> None:
    if spec.kind == "node":
        if np.any(frame < 0):
            raise InputError(f"interface {name!r}: its node has no rotations (solid or no element); use kind = 'rbe2'")
        return
    if not len(tied):
        raise InputError(f"interface {name!r}: no node of {spec} belongs to an element with a property")
    spread = np.linalg.svd(points[tied] - points[tied].mean(axis=0), compute_uv=False)
    held = np.all(dof[tied, 3] < 0) or spec.kind == "rbe3"
    if held and (len(tied) < 3 or spread[1] <= 1e-9 * spread[0]):
        raise InputError(
            f"interface {name!r}: the {len(tied)} nodes of {spec} lie on one line and cannot hold "
            "its rotation; add nodes off that line"
        )


def without_unused_dofs(C, free, diagonal, frames) -> tuple[csr_array, np.ndarray]:
    """Leave out independent DOFs that have neither stiffness nor mass, such as unused rotations.

    `diagonal (n_dof,)` is the sum of the absolute diagonals of K and M.
    """
    idle = C.multiply(C).T @ diagonal == 0
    idle[np.searchsorted(free, np.concatenate([frame.dofs for frame in frames]))] = False
    return C[:, np.flatnonzero(~idle)].tocsr(), free[~idle]


def _cells(parts: list[Part]) -> dict[str, np.ndarray]:
    cells: dict[str, list] = {}
    for part in parts:
        cells.setdefault(part.kind, []).append(part.nodes)
    return {kind: np.concatenate(c) for kind, c in cells.items()}
