"""Notes on flat shells with an offset on a curved surface: they keep the area of their nodes (theory 7.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modalprep.fe.assembly.parts import Part
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.properties import Shell

NOTABLE = 0.01  # of the area
SMOOTH = 0.85  # cosine, 32 degrees: normals that are farther from the mean at a node belong to a fold


def offset_areas(mesh: Mesh, parts: Sequence[Part]) -> list[str]:
    """Return a note for every group whose surface at its offset has notably another area than its flat shells."""
    notes = []
    for part in parts:
        section = part.section
        if not isinstance(section, Shell) or part.family is not ShellBlock:
            continue
        if not (np.any(section.offset) or "offset" in part.data):
            continue
        corners, arm = _joined(mesh, part)
        missing = 1.0 - _area(corners).sum() / _area(corners + arm).sum()
        if abs(missing) > NOTABLE:
            notes.append(
                f"shells {part.group!r} are flat and have an offset on a curved surface: their area and mass are "
                f"{abs(100 * missing):.2g} % too {'small' if missing > 0 else 'large'}; "
                "put the nodes on the mid-surface, or take cells of second order"
            )
    return notes


def _joined(mesh: Mesh, part: Part) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners ``(ne, n, 3)``, and the offsets there along the mean normal of those that meet smoothly."""
    blocks = [part.block(piece, mesh.points, np.zeros(3)) for piece in part.pieces()]
    flat = [block for block in blocks if isinstance(block, ShellBlock)]
    own = np.concatenate([block.offset[:, None] * block.frame[:, 2] for block in flat])[:, None]
    total = np.zeros((len(mesh.points), 3))
    np.add.at(total, part.nodes, np.broadcast_to(own, (*part.nodes.shape, 3)))
    size = np.linalg.norm(own, axis=2)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    mean = (total / np.where(length > 0, length, 1.0))[part.nodes]
    smooth = np.sum(own * mean, axis=2) > SMOOTH * size
    return mesh.points[part.nodes], np.where(smooth[..., None], size[..., None] * mean, own)


def _area(corners: np.ndarray) -> np.ndarray:
    """Return the areas ``(ne,)`` of triangles and quads."""
    k = corners.shape[1] - 3  # two sides of a triangle, the diagonals of a quad
    vectors = np.cross(corners[:, k + 1] - corners[:, 0], corners[:, k + 2] - corners[:, k])
    return np.linalg.norm(vectors, axis=1) / 2
