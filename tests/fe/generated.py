"""Which shapes the mesh generators are tried with, and areas of what they make."""

import numpy as np
import pytest


def gmsh_problem():
    try:
        import gmsh  # noqa: F401
    except (ImportError, OSError) as error:
        return f"gmsh cannot be imported: {error}"
    return None


needs_gmsh = pytest.mark.skipif(gmsh_problem() is not None, reason=str(gmsh_problem()))
STRUCTURE = {
    "beam": ("beam",),
    "plate": ("plate",),
    "stiffened-panel": ("skin", "stiffeners"),
    "tube": ("tube",),
    "box": ("box",),
    "truss-tower": ("legs", "braces"),
    "boom": ("boom",),
    "l-bracket": ("bracket",),
    "blade": ("blade",),
}
HOLED = {"hole": 0.2}


def title(case):
    return "-".join([case[0], *(f"{k}={v}" for k, v in case[1].items())])


def every(cases):
    return pytest.mark.parametrize("case", cases, ids=title)


def triangles(mesh, group):
    """Corners (k, 3, 3) of the triangles that the shells of a group are, or are cut into."""
    cells = mesh.group(group)
    quads, plain = cells.get("quad", np.zeros((0, 4), int)), cells.get("triangle", np.zeros((0, 3), int))
    return mesh.points[np.concatenate([plain, quads[:, :3], quads[:, [2, 3, 0]]])]


def normals(mesh, group):
    """Area vectors of those triangles, m2."""
    corner = triangles(mesh, group)
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2


def area(mesh, group):
    return np.linalg.norm(normals(mesh, group), axis=1).sum()
