"""Faces of 20-node hexahedra of reduced integration whose hourglass motion no neighbour holds (theory 7.5)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from modalprep.fe.assembly.parts import Part
from modalprep.fe.elements.solid import integration_of
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.facets import facets, numbered
from modalprep.fe.properties.properties import Solid

BESIDE = np.array([[k // 2 != j // 2 for j in range(6)] for k in range(6)])  # faces next to each face


def with_free_faces(parts: list[Part]) -> tuple[list[Part], list[str]]:
    """Give the elements of reduced integration the share ``data["free_faces"] (ne, 6)`` of each free face; and a note.

    A face is free where the one or two elements that have it have no neighbour at the four faces beside it: at single
    elements, in rows of them and at the ends of such rows.
    """
    reduced = [part for part in parts if _is_reduced(part)]
    if not reduced:
        return parts, []
    number = numbered(np.concatenate([_quads(p) for p in sorted(parts, key=_is_reduced, reverse=True)]))
    count = np.bincount(number)
    own = number[: 6 * sum(len(part.nodes) for part in reduced)].reshape(-1, 6)
    alone = ~((count[own] > 1) @ BESIDE.T)
    agreed = np.bincount(own.ravel(), alone.ravel(), len(count))
    share = np.where(agreed[own] == count[own], 1 / count[own], 0.0)
    pieces = iter(np.split(share, np.cumsum([len(part.nodes) for part in reduced])[:-1]))
    held = [replace(p, data={**p.data, "free_faces": next(pieces)}) if _is_reduced(p) else p for p in parts]
    return held, _notes(share)


def _notes(share: np.ndarray) -> list[str]:
    count = int(np.any(share, axis=1).sum())
    if not count:
        return []
    return [
        f"{count} hexahedra of reduced integration have no neighbours across their row: the hourglass motion of "
        f"{share.sum():.0f} of their faces, which their points do not see, has a stiffness of its own (theory 7.5); "
        "two elements across, or full integration, need none"
    ]


def _is_reduced(part: Part) -> bool:
    section = part.section
    if part.kind != "hexahedron20" or not isinstance(section, Solid):
        return False
    return integration_of(part.kind, section, part.data) != "full"


def _quads(part: Part) -> np.ndarray:
    """Return the corners ``(n, 4)`` of the quadrilateral faces of solids and shells, six by six of hexahedra."""
    faces = [(part.kind, part.nodes)] if cell_dimension(part.kind) == 2 else facets([(part.kind, part.nodes)])
    found = [nodes[:, :4] for kind, nodes in faces if kind.startswith("quad")]
    return np.stack(found, axis=1).reshape(-1, 4) if found else np.zeros((0, 4), dtype=int)
