"""Surfaces to be seen: the triangles of STL and OBJ files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from modalprep.errors import InputError

CORNERS = {"triangle": [[0, 1, 2]], "quad": [[0, 1, 2], [0, 2, 3]]}


def read_surface(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (n, 3) and triangles (m, 3) of a file.

    Raises
    ------
    InputError
        When it cannot be read, or has no triangles.
    """
    import meshio  # not for systems without pictures

    try:
        mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # of many kinds, and meshio ends the process on some
        raise InputError(f"picture {path} cannot be read ({error}); write it anew, or leave it out") from None
    parts = [block.data[:, three] for block in mesh.cells for three in CORNERS.get(block.type, [])]
    if not parts:
        raise InputError(f"picture {path} has no triangles; leave it out")
    return np.asarray(mesh.points, dtype=float), np.concatenate(parts).astype(int)
