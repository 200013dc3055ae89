"""Small solid bodies without symmetry, with three interfaces, for the tests of the modal body."""

from __future__ import annotations

import numpy as np
from structured import box

import modalprep as mp

ALUMINIUM = mp.Solid(material=mp.Material(E=70e9, nu=0.33, rho=2700.0))
SIZE = (0.6, 0.1, 0.06)


def horn_mesh(n=(5, 2, 1), kind: str = "hexahedron") -> mp.fe.Mesh:
    """A bent, tapered bar with groups ``left``, ``right``, ``side`` (surfaces of nodes) and ``body``."""
    points, cells = box(kind, n, SIZE)
    x, y, z = points.T
    ends = {"left": x < 1e-9, "right": x > SIZE[0] - 1e-9, "side": (y > SIZE[1] - 1e-9) & (x > 0.2) & (x < 0.4)}
    bent = np.stack([x, y * (1 - 0.5 * x) + 0.6 * x**2, z * (1 + x) + 0.2 * x * y], axis=1)
    nodes = {name: np.flatnonzero(at) for name, at in ends.items()}
    first = np.cumsum([0, *(len(k) for k in nodes.values())])
    groups = {name: {"vertex": np.arange(a, a + len(k))} for a, (name, k) in zip(first, nodes.items(), strict=False)}
    return mp.fe.Mesh(
        points=bent,
        cells={kind: cells, "vertex": np.concatenate(list(nodes.values()))[:, None]},
        groups={"body": {kind: np.arange(len(cells))}, **groups},
    )


def horn_model(root: str = "left", names=("left", "right", "side"), **mesh) -> mp.fe.FEModel:
    """Assemble it with rigid frames, all fixed."""
    ends = {name: mp.Interface(group=name) for name in names}
    return mp.assemble(horn_mesh(**mesh), {"body": ALUMINIUM}, ends, root=root)


def horn(root: str = "left", modes: int = 6, **options) -> mp.body.FlexibleBody:
    """Its Craig-Bampton body."""
    model = horn_model(root, **options)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes, truncation=()), name="horn", damping=0.01)
