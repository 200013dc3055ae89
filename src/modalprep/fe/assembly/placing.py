"""Where interfaces, links, supports and equations act in a model: their DOFs and their arms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.links.constraints import PlacedEquation
from modalprep.fe.links.interface import Interface, InterfaceFrame
from modalprep.fe.links.mean_points import MeanPoints, cells_of
from modalprep.fe.links.multipoint import PlacedLink
from modalprep.fe.links.place_equations import place_equations
from modalprep.fe.mesh.mesh import Mesh, SupportSet

NOTHING: Mapping[str, SupportSet] = MappingProxyType({})


class Placed(NamedTuple):
    """Interface frames, the root first, and the constraints of a model, with notes on these."""

    frames: tuple[InterfaceFrame, ...]
    links: list[PlacedLink]
    equations: list[PlacedEquation]
    notes: tuple[str, ...]

    @property
    def kept(self) -> np.ndarray:
        """The DOFs of the frames, which stay independent."""
        return np.concatenate([frame.dofs for frame in self.frames])


def place(mesh: Mesh, interfaces, nodes, positions, dof, supports: Mapping[str, SupportSet] = NOTHING) -> Placed:
    """Place the interface frames in the order of the `positions`, the root first, and every constraint."""
    frames = []
    ends = [k for k, link in enumerate(mesh.links) if link.kind == "rbe2" and not np.any(dof[link.nodes, 0] >= 0)]
    links = [_mesh_link(mesh, dof, k) for k in range(len(mesh.links)) if k not in ends]
    extra = len(mesh.points)
    root = next(iter(positions))
    more = [_appendages(mesh, ends)] if ends else []
    for name, position in positions.items():
        spec, own = interfaces[name], nodes[name]
        framed = spec.kind != "node"
        frame = dof[extra if framed else own[0]]
        extra += framed
        tied = own[dof[own, 0] >= 0] if framed else np.zeros(0, dtype=int)
        _refuse_loose(name, spec, frame, tied, dof, mesh.points)
        if framed and spec.kind != "support":
            arm = mesh.points[tied] - position
            ones = np.ones(len(tied))
            every = np.ones(6, dtype=bool)
            over, note = cells_of(mesh, spec, tied) if spec.kind == "rbe3" else ({}, "")
            more += [f"interface {name!r}: {note}"] * bool(note)
            mean = MeanPoints.over(mesh.points, tied, over) if over else None
            links.append(
                PlacedLink(spec.kind, f"interface {name!r}", frame, dof[tied], arm, every, ones, True, mean_points=mean)
            )
        boundary = "fixed" if name == root else spec.boundary
        frames.append(
            InterfaceFrame(name=name, position=position - positions[root], dofs=frame, nodes=tied, boundary=boundary)
        )
    rigid = nodes[root] if interfaces[root].kind in ("node", "rbe2") else np.zeros(0, dtype=int)
    links += [_support(mesh, name, of, frames[0], positions[root], dof, rigid) for name, of in supports.items()]
    for frame in frames:
        if interfaces[frame.name].kind == "node":
            _make_independent(links, frame.dofs)
    _refuse_shared(frames, links)
    equations, notes = place_equations(mesh, dof, frames[0].dofs, positions[root])
    return Placed(tuple(frames), links, equations, (*more, *notes))


def _support(mesh, name, support: SupportSet, root: InterfaceFrame, origin, dof, rigid: np.ndarray) -> PlacedLink:
    """Return the link from the root to the nodes of a support, without those that the root holds rigidly itself."""
    other = ~np.isin(support.nodes, rigid)
    nodes, axes = support.nodes[other], support.axes[other]
    components = support.components[other]
    if np.any(components) and not np.any((dof[nodes] >= 0) & components) and np.all(other):
        raise InputError(f"support {name!r} holds nothing: its nodes have none of its components; name others")
    ones = np.ones(len(nodes))
    arm = mesh.points[nodes] - origin
    return PlacedLink("rbe2", f"support {name!r}", root.dofs, dof[nodes], arm, components, ones, True, axes)


def _appendages(mesh: Mesh, ends: list[int]) -> str:
    """Return the note on rigid links to nodes without elements, which move with the structure and change nothing."""
    first = _label(mesh, mesh.links[ends[0]].node)
    return (
        f"left out: {len(ends)} rigid links to nodes that no element has, the first at node {first}; they carry "
        "neither mass nor stiffness"
    )


def _label(mesh: Mesh, node: int) -> int:
    return int(mesh.labels[node]) if node < len(mesh.labels) else node + 1


def _mesh_link(mesh: Mesh, dof: np.ndarray, k: int) -> PlacedLink:
    link = mesh.links[k]
    tied = dof[link.nodes, 0] >= 0
    nodes = link.nodes[tied]
    name = f"{link.kind} at node {_label(mesh, link.node)}"
    if not len(nodes):
        raise InputError(f"{name}: none of its nodes belongs to an element with a property")
    arm = mesh.points[nodes] - mesh.points[link.node]
    weights = link.weights[tied] if link.kind == "rbe3" else np.ones(len(nodes))
    components = link.components[tied] if link.components.ndim == 2 else link.components
    axes = link.axes[tied] if len(link.axes) == len(tied) else link.axes
    over = {kind: own for kind, conn in link.over.items() if len(own := conn[(dof[conn, 0] >= 0).all(axis=1)])}
    mean = MeanPoints.over(mesh.points, nodes, over) if over else None
    return PlacedLink(link.kind, name, dof[link.node], dof[nodes], arm, components, weights, False, axes, mean)


def _make_independent(links: list[PlacedLink], node: np.ndarray) -> None:
    """Let the frames of the links that drive ``node (6,)`` follow it, where it determines them: the same constraints.

    A rigid link gets another root, and so does the one that drives its former root. The nodes of an rbe3 follow its
    frame, as those of an interface do.
    """
    for _ in range(len(links)):
        for i, link in enumerate(links):
            k = -1 if link.keeps_frame else link.follower(node)
            if k >= 0:
                links[i] = replace(link.rooted_at(k), keeps_frame=True)
                node = link.frame
                break
            if link.kind == "rbe3" and np.array_equal(link.frame, node) and link.components.all():
                links[i] = replace(link, keeps_frame=True)
                return
        else:
            return


def _refuse_shared(frames: list[InterfaceFrame], links: list[PlacedLink]) -> None:
    """Refuse interfaces whose DOFs depend on another link: they cannot be fixed."""
    dofs = np.concatenate([frame.dofs for frame in frames])
    driven = {d: link.name for link in links for d in dofs[np.isin(dofs, link.rows.dependent)].tolist()}
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
    free = np.all(dof[tied, 3] < 0)
    if free and spec.kind != "support" and (len(tied) < 3 or spread[1] <= 1e-9 * spread[0]):
        raise InputError(
            f"interface {name!r}: the {len(tied)} nodes of {spec} lie on one line and cannot hold "
            "its rotation; add nodes off that line"
        )
