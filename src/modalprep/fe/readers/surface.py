"""Surfaces to be seen: the triangles of STL, OBJ and Collada files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.readers.collada import read_collada

CORNERS = {"triangle": [[0, 1, 2]], "quad": [[0, 1, 2], [0, 2, 3]]}


def read_surface(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (n, 3) and triangles (m, 3) of a file.

    Raises
    ------
    InputError
        When it cannot be read, or has no triangles.
    """
    try:
        surfaces = read_collada(path) if path.suffix.lower() == ".dae" else _by_meshio(path)
    except (Exception, SystemExit) as error:  # of many kinds, and meshio ends the process on some
        raise InputError(f"picture {path} cannot be read ({error}); write it anew, or leave it out") from None
    if not sum(len(corners) for _, corners in surfaces):
        raise InputError(f"picture {path} has no triangles; leave it out")
    first = np.cumsum([0, *(len(points) for points, _ in surfaces)])
    triangles = [corners + k for (_, corners), k in zip(surfaces, first[:-1], strict=True)]
    return np.concatenate([points for points, _ in surfaces]), np.concatenate(triangles).astype(int)


def _by_meshio(path: Path) -> list[tuple[np.ndarray, np.ndarray]]:
    import meshio  # not for systems without pictures

    mesh = meshio.read(path)
    parts = [block.data[:, three] for block in mesh.cells for three in CORNERS.get(block.type, [])]
    corners = np.concatenate([np.zeros((0, 3), dtype=int), *parts])
    return [(np.asarray(mesh.points, dtype=float), corners)]
