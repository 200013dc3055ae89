"""Does the stated error of a reduction bound the true one? Ten bodies, seven of them plates and shells.

    python benchmarks/reduction_error.py [--quick]

Each body is reduced in three ways, and `reduction_error` states its dynamic error over a band. The true error is the
largest difference of the compliance of the full model, with every mode of its dense matrices, over its size, at 4000
frequencies and at all resonances of both, with the damping of the statement. `--quick`: three bodies and 500
frequencies. The last line is JSON: `worst`, the largest ratio of true to stated error (2 is allowed), and `loosest`,
the smallest.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable

import numpy as np
import scipy

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section

ALUMINIUM = mp.Material(E=70e9, nu=0.33, rho=2700.0)
CORE = mp.Material(E=1e9, nu=0.3, rho=100.0)
PLATE = mp.Shell(material=ALUMINIUM, thickness=0.004)
Place = Callable[[np.ndarray, np.ndarray], tuple]
CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def net(place: Place, cells: tuple[int, int], kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points, cells and shares (u, v) of a surface ``place(u, v)``, u and v from 0 to 1."""
    u, v = np.meshgrid(*(np.linspace(0, 1, n + 1) for n in cells), indexing="ij")
    k = np.arange(u.size).reshape(u.shape)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    found = quads if kind == "quad" else np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return (
        np.stack(np.broadcast_arrays(*place(u, v)), axis=-1).reshape(-1, 3),
        found,
        np.stack([u, v], -1).reshape(-1, 2),
    )


def shell(
    place: Place, kind: str = "quad", cells: tuple[int, int] = (8, 5), section: mp.Shell = PLATE, root: str = "edge",
    tip: str = "edge", link: str = "rbe2", boundary: str = "free",
) -> mp.fe.FEModel:  # fmt: skip
    """Return a surface that is held at u = 0 and loaded at u = 1, on its edge, its corner, or the edge's middle."""
    points, found, share = net(place, cells, kind)
    at = {"edge": share[:, 1] >= 0, "corner": share[:, 1] == 0, "middle": np.abs(share[:, 1] - 0.4) < 0.01}
    ends = [np.flatnonzero((np.abs(share[:, 0] - u) < 1e-9) & at[where]) for u, where in ((0.0, root), (1.0, tip))]
    kinds = ["node" if len(nodes) == 1 else way for nodes, way in zip(ends, ("rbe2", link), strict=True)]
    return assembled(points, {kind: found}, ends, {"all": section}, kinds, boundary)


def assembled(points, cells, ends, properties, kinds, boundary="free") -> mp.fe.FEModel:
    """Return a model with the interfaces root and tip on nodes `ends`."""
    vertices = np.concatenate(ends)
    held = {"root": np.arange(len(ends[0])), "tip": len(ends[0]) + np.arange(len(ends[1]))}
    mesh = mp.fe.Mesh(
        points=points, cells=cells | {"vertex": vertices[:, None]},
        groups={"all": {name: np.arange(len(rows)) for name, rows in cells.items()}}
        | {name: {"vertex": rows} for name, rows in held.items()},
    )  # fmt: skip
    faces = {
        name: mp.Interface(group=name, kind=kind, boundary=b)
        for name, kind, b in zip(held, kinds, ("fixed", boundary), strict=True)
    }
    return mp.assemble(mesh, properties, faces)


def block() -> mp.fe.FEModel:
    """Return a bar of 8 x 2 x 2 hexahedra, 0.4 m x 0.05 m x 0.05 m."""
    n = (8, 2, 2)
    grid = np.stack(np.meshgrid(*(np.arange(k + 1) for k in n), indexing="ij"), axis=-1)
    number = np.arange(grid[..., 0].size).reshape(grid.shape[:3])
    rows = [number[a : a + n[0], b : b + n[1], c : c + n[2]].ravel() for a, b, c in CUBE]
    points = grid.reshape(-1, 3) * [0.05, 0.025, 0.025]
    ends = [np.flatnonzero(points[:, 0] == x) for x in (0.0, points[:, 0].max())]
    return assembled(
        points, {"hexahedron": np.stack(rows, -1)}, ends, {"all": mp.Solid(material=ALUMINIUM)}, ["rbe2"] * 2
    )


def beam() -> mp.fe.FEModel:
    """Return the spin-up beam."""
    faces = {"root": "fixed", "tip": "free"}
    ends = {name: mp.Interface(group=name, kind="node", boundary=b) for name, b in faces.items()}
    return mp.assemble(beam_mesh(16, 10.0), {"beam": spinup_section()}, ends)


def flat(u, v):
    return 0.5 * u, 0.4 * v, 0 * u


def rolled(u, v):
    return 0.5 * u, 0.3 * np.sin(2 * v), 0.3 * np.cos(2 * v)


def twisted(u, v):
    return 0.6 * u, 0.15 * (v - 0.5) * np.cos(u), 0.15 * (v - 0.5) * np.sin(u)


def cap(u, v):
    return 0.5 * u, 0.4 * v, 0.3 * (u - u**2) * (v - v**2) * 4


def tube(u, v):
    return 0.8 * u, 0.05 * np.cos(6.2 * v), 0.05 * np.sin(6.2 * v)


SANDWICH = mp.Shell(
    plies=tuple(mp.fe.Ply(material=m, thickness=h) for m, h in ((ALUMINIUM, 4e-4), (CORE, 8e-3), (ALUMINIUM, 4e-4)))
)
BODIES: dict[str, Callable[[], mp.fe.FEModel]] = {
    "plate": lambda: shell(flat),
    "plate of triangles, loaded at a corner": lambda: shell(flat, "triangle", tip="corner"),
    "plate held at a corner": lambda: shell(flat, root="corner"),
    "twisted blade": lambda: shell(twisted, cells=(10, 3), link="rbe3"),
    "rolled shell": lambda: shell(rolled, "triangle", cells=(6, 6)),
    "cap between two held edges": lambda: shell(cap, cells=(6, 6), boundary="fixed"),
    "slit tube": lambda: shell(tube, cells=(10, 8), section=mp.Shell(material=ALUMINIUM, thickness=0.002)),
    "sandwich plate, loaded in the middle of an edge": lambda: shell(flat, section=SANDWICH, tip="middle"),
    "beam": beam,
    "block": block,
}
REDUCTIONS = {  # share of the frequency of its highest candidate to which the error is stated, and the reduction
    "8 modes": (0.8, lambda model: mp.craig_bampton(model, modes=8)),
    "5 modes, no truncation vectors": (0.9, lambda model: mp.craig_bampton(model, modes=5, truncation=())),
    "8 modes without the third": (0.6, lambda model: mp.craig_bampton(model, modes=8, keep=[1, 2, 4, 5, 6, 7, 8])),
}


def true_error(model: mp.fe.FEModel, reduction: mp.reduction.Reduction, up_to: float, damping: float, points: int):
    """Return the largest error of the compliance over the band, and its frequency (Hz), from dense matrices."""
    C = model.C.toarray()[
        :, np.setdiff1d(np.arange(len(model.free)), np.searchsorted(model.free, model.interfaces[0].dofs))
    ]
    K, M = (C.T @ A.toarray() @ C for A in (model.K, model.M))
    F = np.zeros((model.n_dof, 6))
    F[model.interfaces[1].dofs, np.arange(6)] = 1.0
    soft, Y = scipy.linalg.eigh(M, K)  # flexibilities: massless directions have none
    own = reduction.basis.T @ F
    w2 = (2 * np.pi * reduction.frequency) ** 2
    a, z = Y.T @ C.T @ F, 1 + 2j * damping
    scale = 1 / np.sqrt(np.einsum("nk,nk->k", a, a))
    true = np.sqrt(1 / soft[soft > 1e-14 * soft.max()]) / (2 * np.pi)
    at = np.concatenate([np.linspace(0, up_to, points + 1)[1:], true, reduction.frequency])
    worst = 0.0, 0.0
    for f in np.sort(at[at <= up_to]):
        square = (2 * np.pi * f) ** 2
        H = (a.T / (z - square * soft)) @ a * scale * scale[:, None]
        R = (own.T / (w2 * z - square)) @ own * scale * scale[:, None]
        worst = max(worst, (np.linalg.norm(R - H) / np.linalg.norm(H), f))
    return worst


def rows(names: list[str], points: int) -> list[tuple[str, str, int, float, float, float]]:
    """Return body, reduction, modes in the band, its end (Hz), stated and true error."""
    found = []
    for name in names:
        model = BODIES[name]()
        for label, (share, reduce) in REDUCTIONS.items():
            reduction = reduce(model)
            up_to = share * float(reduction.table.frequency[:8][np.isfinite(reduction.table.frequency[:8])].max())
            stated = mp.reduction.reduction_error(model, reduction, up_to)
            true, _ = true_error(model, reduction, up_to, stated.damping, points)
            found.append((name, label, len(stated.full), up_to, float(stated.dynamic.max()), true))
    return found


def line(name: str, label: str, count: int, _up_to: float, stated: float, true: float) -> str:
    """Return a row of the table of docs/reference/measured.md."""
    return f"| {name} | {label} | {count} | {stated:.2g} | {true:.2g} | {true / stated:.2f} |"


def main() -> None:
    """Print a row for each reduction of each body, and the extremes of true over stated error."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="three bodies and 500 frequencies")
    quick = parser.parse_args().quick
    names = list(BODIES)[:8:3] if quick else list(BODIES)
    ratios = []
    print("| body | reduction | modes in the band | stated | true | true / stated |\n|---|---|---|---|---|---|")
    for row in rows(names, 500 if quick else 4000):
        ratios.append(row[5] / row[4])
        print(line(*row))
    print(json.dumps({"worst": max(ratios), "loosest": min(ratios), "reductions": len(ratios)}))


if __name__ == "__main__":
    main()
