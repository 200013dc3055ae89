"""The beams that stand on the nodes of shells, and their arms: there the drilling rotation of shells yields."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from modalprep.fe.assembly.parts import Part
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.beam3 import ThreeNodeBeamBlock
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.properties import Beam, Shell

SMOOTH = 0.85  # cosine, 32 degrees: arms at a node that are farther from their mean belong to a corner
Arms = tuple[np.ndarray, np.ndarray]  # nodes (k,), and arms (k, 3) from there, m


def with_joined_offsets(mesh: Mesh, parts: Sequence[Part]) -> list[Part]:
    """Return the parts, where the beams of one property that meet smoothly at a node share one arm, ``data["arm"]``.

    An offset is normal to the chord of each beam. On a curved line, such as a ring frame, the arms of two chords would
    differ, so that the beams keep the length of the line of nodes, and not that of the line of their centroids.
    """
    return [
        replace(part, data=part.data | {"arm": _joined(mesh, part)}) if _is_offset(part) else part for part in parts
    ]


def _is_offset(part: Part) -> bool:
    """Whether its arms come from the section alone."""
    return bool(np.any(_offset(part))) and not np.any(np.nan_to_num(part.data.get("ends", 0.0)))


def _offset(part: Part) -> np.ndarray:
    """Return the offset of beams along and across `up`, m; zero of others."""
    return np.asarray(part.section.offset if isinstance(part.section, Beam) else 0.0)


def _blocks(mesh: Mesh, part: Part) -> Iterator[BeamBlock | ThreeNodeBeamBlock]:
    for piece in part.pieces():
        block = part.block(piece, mesh.points, np.zeros(3))
        if isinstance(block, BeamBlock | ThreeNodeBeamBlock):
            yield block


def _joined(mesh: Mesh, part: Part) -> np.ndarray:
    """Return the arms ``(ne, nn, 3)``, along the mean of those at a node unless they are far from it."""
    arm = np.concatenate([block.arm for block in _blocks(mesh, part)])
    total = np.zeros((len(mesh.points), 3))
    np.add.at(total, part.nodes, arm)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    mean = (total / np.where(length > 0, length, 1.0))[part.nodes]
    along = np.einsum("ena,ena->en", arm, mean) > SMOOTH * np.linalg.norm(arm, axis=2)
    return np.where(along[..., None], np.linalg.norm(_offset(part)) * mean, arm)


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
        if not np.any(_offset(part)) and "ends" not in part.data:
            yield part.nodes.ravel(), np.zeros((part.nodes.size, 3))
            continue
        for block in _blocks(mesh, part):
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
