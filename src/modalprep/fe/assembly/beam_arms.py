"""The beams that stand on the nodes of shells, and their arms: there the drilling rotation of shells yields."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from modalprep.fe.assembly.parts import Part
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.properties import Beam, Shell

Arms = tuple[np.ndarray, np.ndarray]  # nodes (k,), and arms (k, 3) from there, m


def with_beam_arms(mesh: Mesh, parts: Sequence[Part]) -> list[Part]:
    """Return the parts, where shells know the arms of the beams on their nodes as ``data["beam_arm"] (ne, n, 3)``.

    Of several beams on a node the one that is farthest counts. A rigid link from one node to another is an arm too.
    """
    beams = [part for part in parts if isinstance(part.section, Beam)]
    if not beams or not any(isinstance(part.section, Shell) for part in parts):
        return list(parts)
    nodes, arms = (np.concatenate(x) for x in zip(*_own_arms(mesh, beams), strict=True))
    nodes, arms = (np.concatenate(x) for x in zip((nodes, arms), *_linked(mesh, nodes, arms), strict=True))
    far = np.argsort(np.linalg.norm(arms, axis=1), kind="stable")  # the last one at a node stays
    found = np.full((len(mesh.points), 3), np.nan)
    found[nodes[far]] = arms[far]
    return [
        replace(part, data=part.data | {"beam_arm": found[part.nodes]}) if isinstance(part.section, Shell) else part
        for part in parts
    ]


def _own_arms(mesh: Mesh, beams: Sequence[Part]) -> Iterator[Arms]:
    """Yield the nodes of beams, and the arms of their offsets."""
    for part in beams:
        if not np.any(part.section.offset) and "ends" not in part.data:
            yield part.nodes.ravel(), np.zeros((part.nodes.size, 3))
            continue
        for piece in part.pieces():
            block = part.block(piece, mesh.points, np.zeros(3))
            yield block.nodes.ravel(), block.arm.reshape(-1, 3)


def _linked(mesh: Mesh, nodes: np.ndarray, arms: np.ndarray) -> Iterator[Arms]:
    """Yield the other ends of rigid links, each from one node to one, and the arms from there."""
    order = np.argsort(nodes, kind="stable")
    nodes, arms = nodes[order], arms[order]
    for link in mesh.links:
        if link.kind == "rbe2" and len(link.nodes) == 1:
            for here, there in ((link.node, link.nodes[0]), (link.nodes[0], link.node)):
                own = arms[slice(*np.searchsorted(nodes, (there, there + 1)))]
                yield np.full(len(own), here), own + mesh.points[there] - mesh.points[here]
