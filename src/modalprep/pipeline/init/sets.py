"""Interfaces that a file names: its sets of nodes, and the nodes of its rigid elements."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from modalprep.fe.features.groups import structural_cells
from modalprep.fe.features.openings import Opening
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.mesh import Mesh
from modalprep.pipeline.init.geometry import described
from modalprep.pipeline.init.proposal import Proposal, quoted, slug
from modalprep.pipeline.init.units import extent

KEPT = re.compile(r"(\w+\.)?(aset|bset|cset|retained|master)$", re.IGNORECASE)  # nodes that the deck keeps
NODE_BY_NODE = re.compile(r"(suport|qset|spc|boundary)", re.IGNORECASE)  # further sets of single nodes
NUMBERED = re.compile(r"face_\d+")  # faces that a CAD file does not name
SINGLE = 12  # nodes of a set, each of which may be an interface
SCATTERED = 0.75  # of the size: sets that are as wide are no interface
SPIDERS = 6  # rigid elements that may be interfaces
FEWEST = 3  # nodes that hold a frame, where a node has no rotations


def spiders(mesh: Mesh) -> list[Proposal]:
    """Return the nodes of rigid elements that tie several nodes, likely where no element or mass is on them.

    More than `SPIDERS` of these are links inside the structure.
    """
    busy = [conn.ravel() for kind, conn in mesh.cells.items() if cell_dimension(kind)]
    busy += [mesh.nodes(name) for name in mesh.properties if mesh.groups.get(name)]
    linked = [link.nodes for link in mesh.links]
    taken = np.concatenate([*busy, *linked]) if busy or linked else np.zeros(0, dtype=int)
    found = []
    for link in mesh.links:
        if link.kind == "rbe2" and len(link.nodes) >= FEWEST:
            label = _label(mesh, link.node)
            what = f"node {label}, to which a rigid element ties {len(link.nodes)} nodes"
            likely = link.node not in taken
            found.append(
                Proposal(
                    name=f"node_{label}", keys=f"node = {label}", what=what, nodes=np.array([link.node]), likely=likely
                )
            )
    many = sum(one.likely for one in found) > SPIDERS
    return [one.with_(likely=False) for one in found] if many else found


def named_sets(mesh: Mesh, structure: set[str], rounds: list[Opening]) -> Iterator[Proposal]:
    """Yield the groups that are no structure, and not what a set of supports holds."""
    cells = structural_cells(mesh)
    held = [set(one.nodes.tolist()) for one in mesh.supports.values()]
    rotating = _rotating(mesh)
    for name, kinds in mesh.groups.items():
        if (
            name in structure
            or NUMBERED.fullmatch(name)
            or any(cells[kind][rows].any() for kind, rows in kinds.items())
        ):
            continue
        kept = KEPT.match(name) is not None
        if not any(map(len, kinds.values())) or (not kept and set(mesh.nodes(name).tolist()) in held):
            continue
        nodes = mesh.nodes(name)
        dimension = max(map(cell_dimension, mesh.group(name)))
        turning = bool(rotating[nodes].any())
        if dimension == 0 and ((kept and turning) or (1 < len(nodes) <= SINGLE and NODE_BY_NODE.match(name))):
            yield from (single_node(mesh, node, f"of the set {name!r}").with_(asked=kept) for node in nodes)
        elif len(nodes) == 1:
            yield single_node(mesh, nodes[0], f"the set {name!r}", name)
        else:
            yield _set(mesh, name, nodes, rounds)


def single_node(mesh: Mesh, node: int, what: str, name: str | None = None) -> Proposal:
    """Return one node as an interface, likely where it has rotations."""
    label = _label(mesh, node)
    rotates = bool(_rotating(mesh)[node])
    return Proposal(
        name=slug(name) if name else f"node_{label}",
        keys=f"node = {label}",
        what=f"node {label}, {what}" + ("" if rotates else "; without rotations it cannot carry a frame"),
        nodes=np.array([node]),
        likely=rotates,
    )


def _label(mesh: Mesh, node: int) -> int:
    return int(mesh.labels[node]) if len(mesh.labels) else int(node) + 1


def _rotating(mesh: Mesh) -> np.ndarray:
    """Whether a beam, a shell or a rigid element gives each node rotations (n_points,)."""
    found = np.zeros(len(mesh.points), dtype=bool)
    for turns in (True, False):  # solids come last
        for kind, conn in mesh.cells.items():
            dimension = cell_dimension(kind)
            if dimension in ((1, 2) if turns else (3,)):
                found[conn] = turns
    found[[link.node for link in mesh.links if link.kind == "rbe2"]] = True
    return found


def _set(mesh: Mesh, name: str, nodes: np.ndarray, rounds: list[Opening]) -> Proposal:
    members = set(nodes.tolist())
    around = next((one for one in rounds if set(one.nodes.tolist()) <= members), None)
    wide = np.ptp(mesh.points[nodes], axis=0).max() > SCATTERED * extent(mesh) and len(nodes) > 0
    flat = np.sort(np.ptp(mesh.points[nodes], axis=0))[0] < 1e-6 * extent(mesh) and _on_an_end(mesh, nodes)
    what = f"the set {name!r}, {len(nodes)} nodes"
    return Proposal(
        name=slug(name),
        keys=f"group = {quoted(name)}",
        what=f"{what}: {described(around, mesh.scale)}" if around is not None else what,
        nodes=nodes,
        direction=around.cylinder.axis if around is not None else None,
        place=around.centre if around is not None else None,
        likely=len(nodes) >= FEWEST and (around is not None or not wide or bool(flat)),
    )


def _on_an_end(mesh: Mesh, nodes: np.ndarray) -> bool:
    """Whether nodes lie together at an end of the longest extension of the mesh."""
    axis = int(np.argmax(np.ptp(mesh.points, axis=0)))
    return bool(np.ptp(mesh.points[nodes, axis]) < 1e-6 * extent(mesh))
