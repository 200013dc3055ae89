"""One structure in every element family against CalculiX: beams, shells with eccentric beams, solids.

    python benchmarks/families.py [--quick]

A bar, an arch, a flat and a curved panel with a stringer under its skin, a part of a cylinder with a ring frame inside,
and a tube with one; clamped at one end. The edge of the skin at the other end is free, or tied rigidly (RBE2) or by its
mean (RBE3) to a node that carries a mass. CalculiX has the nodes and elements of the solids (C3D20). Compared are the
first five frequencies at rest and, where the end is free, the shifts of the first four squares under a spin about z:
CalculiX takes a static step under the centrifugal load and then a perturbation, modalprep a modal body with its
geometric stiffness and T, the second order of its mass.

Stiffeners are as thick as the skin, but for the last case, whose stringer of 12 mm under a skin of 5 mm also stiffens
the corner where they meet: no shell and beam know of it.

Two refinements; `--quick`: two structures and three shells, the coarse one. The last line is JSON, in per cent, of the
finer mesh: `worst_solids`, `worst_shells`, `worst_beams`, `worst_shifts` of shells, and `thick_stringer`; null without
CalculiX.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.linalg import eigh, qr

import modalprep as mp
from modalprep.body.mass import affine_part, deflected
from modalprep.vectors import skew

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from stiffened import ALUMINIUM, SHELLS, Stiffened, assembled, beams, bricks, frequencies, skin_and_beams

MODES, COUNT, SHIFTS = 30, 5, 4
SPIN = 0.05  # of the first circular frequency
CASES = {  # shape, cells of shells on the coarse mesh and the finer one, of solids
    "bar": (Stiffened(along="", width=0.04, thickness=0.0025), ((32, 4), (80, 10)), (64, 8)),
    "arch": (Stiffened(along="", width=0.04, thickness=0.0025, radius=0.5, arch=True), ((32, 4), (80, 10)), (64, 8)),
    "panel": (Stiffened(), ((24, 8), (48, 16)), (48, 16)),
    "curved panel": (Stiffened(radius=0.3), ((24, 8), (48, 16)), (48, 16)),
    "framed panel": (Stiffened(radius=0.15, along="y", length=0.3), ((16, 12), (32, 24)), (24, 20)),
    "framed tube": (
        Stiffened(radius=0.12, along="y", length=0.4, width=0.24 * np.pi, thickness=0.004, rib=0.004, height=0.02),
        ((12, 32), (24, 64)), (28, 64),
    ),
    "thick stringer": (Stiffened(rib=0.012), ((24, 8), (48, 16)), (48, 16)),
}  # fmt: skip
ENDS = {"free": "", "RBE2": "rbe2", "RBE3": "rbe3"}
QUICK = ("bar", "framed panel"), ("triangle", "quad", "triangle6")


# --- CalculiX -------------------------------------------------------------------------------------------------------


def calculix(shape: Stiffened, mesh: mp.fe.Mesh, end: str, rate: float = 0.0) -> np.ndarray:
    """Frequencies (Hz) of C3D20, or squared circular frequencies about the centrifugal load of a spin about z."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "job.inp").write_text("\n".join(_deck(shape, mesh, end, rate)))
        subprocess.run([shutil.which("ccx"), "job"], cwd=folder, check=True, capture_output=True)
        text = Path(folder, "job.dat").read_text()
    table = text[text.index("E I G E N V A L U E") : text.index("P A R T I C I P A T I O N")]
    rows = [row.split() for row in table.splitlines() if re.match(r"\s*\d+\s+\S+\s+\S+", row)]
    squared = np.array([float(row[1]) for row in rows])[:COUNT]
    return np.sqrt(squared) / (2 * np.pi) if not rate else squared


def _deck(shape: Stiffened, mesh: mp.fe.Mesh, end: str, rate: float) -> list[str]:
    lines = ["*NODE, NSET=ALL", *(f"{i + 1}, {x:.14g}, {y:.14g}, {z:.14g}" for i, (x, y, z) in enumerate(mesh.points))]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=SOLID")
    for i, cell in enumerate(mesh.cells["hexahedron20"] + 1):
        lines += [f"{i + 1}, " + ", ".join(map(str, cell[:15])) + ",", ", ".join(map(str, cell[15:]))]
    lines += ["*NSET, NSET=ROOT", *(f"{i + 1}," for i in mesh.nodes("root"))]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{ALUMINIUM.E}, {ALUMINIUM.nu}", "*DENSITY", f"{ALUMINIUM.rho}"]
    lines += ["*SOLID SECTION, ELSET=SOLID, MATERIAL=M", *_end(shape, mesh, end), "*BOUNDARY", "ROOT, 1, 3"]
    if not rate:
        return [*lines, "*STEP", "*FREQUENCY", f"{COUNT + 3}", "*END STEP", ""]
    lines += ["*STEP", "*STATIC", "*DLOAD", f"SOLID, CENTRIF, {rate**2:.14g}, 0, 0, 0, 0, 0, 1", "*END STEP"]
    return [*lines, "*STEP, PERTURBATION", "*FREQUENCY", f"{COUNT + 3}", "*END STEP", ""]


def _end(shape: Stiffened, mesh: mp.fe.Mesh, end: str) -> list[str]:
    """The mass at the end: on the node of a rigid body, or on nodes that move and turn as the mean of the edge does."""
    if not end:
        return []
    n, nodes = len(mesh.points), mesh.nodes("end")
    x, y, z = shape.placed(shape.length, 0.0, shape.centre)
    lines = ["*NODE", f"{n + 1}, {x:.14g}, {y:.14g}, {z:.14g}", f"{n + 2}, {x:.14g}, {y:.14g}, {z:.14g}"]
    if end == "rbe2":
        lines += ["*NSET, NSET=END", *(f"{i + 1}," for i in nodes)]
        lines.append(f"*RIGID BODY, NSET=END, REF NODE={n + 1}, ROT NODE={n + 2}")
    else:
        G = _mean(mesh, nodes, np.array([x, y, z])).reshape(6, -1)
        names = [(node + 1, k + 1) for node in nodes for k in range(3)]
        chosen = qr(G / np.linalg.norm(G, axis=1, keepdims=True), mode="r", pivoting=True)[1][:6]
        rest = np.setdiff1d(np.arange(len(names)), chosen)  # the chosen displacements follow the mean and the others
        right = np.linalg.solve(G[:, chosen], np.hstack([np.eye(6), -G[:, rest]]))
        sources = [*((n + 1 + c // 3, c % 3 + 1) for c in range(6)), *(names[i] for i in rest)]
        for i, row in zip(chosen, right, strict=True):
            terms = [(*names[i], -1.0), *((*name, value) for name, value in zip(sources, row, strict=True) if value)]
            four = [terms[k : k + 4] for k in range(0, len(terms), 4)]
            lines += ["*EQUATION", f"{len(terms)}"]
            lines += [", ".join(f"{a}, {b}, {value:.14g}" for a, b, value in some) for some in four]
    inertia, first = shape.mass * 0.05**2, len(mesh.cells["hexahedron20"]) + 1
    for label, (node, mass) in enumerate(((n + 1, shape.mass), (n + 2, inertia)), start=first):
        lines += [f"*ELEMENT, TYPE=MASS, ELSET=M{node}", f"{label}, {node}", f"*MASS, ELSET=M{node}", f"{mass:.14g}"]
    return lines


def _mean(mesh: mp.fe.Mesh, nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Coefficients (6, k, 3) of the mean motion of the faces of the end: least squares over 5 x 5 points of each."""
    place, weight = np.polynomial.legendre.leggauss(5)
    r, s = (a.ravel() for a in np.meshgrid(place, place))
    N, (Nr, Ns) = _serendipity(r, s), ((_serendipity(r + a, s + b) - _serendipity(r - a, s - b)) / 2e-5
                                       for a, b in ((1e-5, 0), (0, 1e-5)))  # fmt: skip
    column = np.full(len(mesh.points), -1)
    column[nodes] = np.arange(len(nodes))
    normal, right = np.zeros((6, 6)), np.zeros((6, len(nodes), 3))
    for face in mesh.group("end")["quad8"]:
        points = mesh.points[face]
        area = np.outer(weight, weight).ravel() * np.linalg.norm(np.cross(Nr @ points, Ns @ points), axis=1)
        S = np.concatenate([np.tile(np.eye(3), (len(r), 1, 1)), -skew(N @ points - at)], axis=2)
        normal += np.einsum("q,qai,qaj->ij", area, S, S)
        right[:, column[face]] += np.einsum("q,qai,qn->ina", area, S, N)
    return np.linalg.solve(normal, right.reshape(6, -1)).reshape(right.shape)


def _serendipity(r: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Shape functions of eight nodes (q, 8) between -1 and 1, corners first."""
    corner = [(1 + a * r) * (1 + b * s) * (a * r + b * s - 1) / 4 for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    sides = [(1 - r**2) * (1 - s) / 2, (1 + r) * (1 - s**2) / 2, (1 - r**2) * (1 + s) / 2, (1 - r) * (1 - s**2) / 2]
    return np.stack([*corner, *sides], axis=1)


# --- comparison -----------------------------------------------------------------------------------------------------


def shifts(model: mp.fe.FEModel, rate: float) -> np.ndarray:
    """Shift of the lowest squared circular frequencies over the squared spin about z, without gyroscopic terms."""
    reduction = mp.craig_bampton(model, modes=MODES, truncation=("inertia",))
    body = mp.flexible_body(model, reduction, name="body", second_order_mass=True)
    W = rate**2 * np.diag([-1.0, -1.0, 0.0])
    stiffness = np.diag(body.K) + np.einsum("ab,abij->ij", W, body.P + body.Kg_W)
    q0 = -np.linalg.solve(stiffness, np.einsum("ab,abn->n", W, body.H))
    M = body.modal_mass if body.T is None else deflected(affine_part(body), q0).M_ff
    found = eigh((stiffness + stiffness.T) / 2, M, eigvals_only=True)
    return (found - np.sort(body.K))[:SHIFTS] / rate**2


def families(shape: Stiffened, cells: tuple[int, int], quick: bool) -> dict[str, tuple]:
    """Meshes and properties by the name of the family."""
    found = {}
    if not shape.along:
        found = {kind: beams(shape, kind, cells[0] // (2 if kind == "line3" else 1)) for kind in ("line", "line3")}
    for kind, membrane in SHELLS:
        name = kind + (" cst" if membrane == "cst" else "")
        if not quick or name in QUICK[1]:
            found[name] = skin_and_beams(shape, kind, cells, membrane)
    return found


def compare(name: str, end: str, fine: bool, quick: bool) -> dict[str, float]:
    """Print the errors of every family of one structure; return the worst of each kind in per cent."""
    shape, meshes, n = CASES[name]
    mesh, sections = bricks(shape, n)
    model = assembled(shape, mesh, sections, ENDS[end])
    known = shutil.which("ccx") is not None
    peer = calculix(shape, mesh, ENDS[end]) if known else frequencies(model, COUNT)
    print(f"{name}, {end}: {'CalculiX' if known else 'solids':13s}" + "".join(f"{f:9.2f}" for f in peer) + " Hz")
    worst = {"solids": _row("hexahedron20", frequencies(model, COUNT) / peer - 1)}
    for kind, (own, section) in families(shape, meshes[fine], quick).items():
        if kind.startswith("line") and end == "RBE3":
            continue  # one node has no mean
        error = _row(kind, frequencies(assembled(shape, own, section, ENDS[end]), COUNT) / peer - 1)
        which = "beams" if kind.startswith("line") else "shells"
        worst[which] = max(worst.get(which, 0.0), error)
    if shape.along and end == "free":
        worst["shifts"] = _compare_shifts(shape, mesh, model, families(shape, meshes[fine], quick))
    return worst


def _compare_shifts(shape, mesh, model, others) -> float:
    rate = SPIN * 2 * np.pi * frequencies(model, 1)[0]
    peer = shifts(model, rate)
    if shutil.which("ccx"):
        rest = (2 * np.pi * calculix(shape, mesh, "")) ** 2
        peer = ((calculix(shape, mesh, "", rate) - rest) / rate**2)[:SHIFTS]
    print("  shifts of the squares under a spin about z, over its square: " + " ".join(f"{x:.3f}" for x in peer))
    size, worst = np.abs(peer).max(), 0.0
    _row("hexahedron20", (shifts(model, rate) - peer) / size)
    for kind, (own, section) in others.items():
        worst = max(worst, _row(kind, (shifts(assembled(shape, own, section), rate) - peer) / size))
    return worst


def _row(kind: str, error: np.ndarray) -> float:
    print(f"  {kind:14s}" + "".join(f"{100 * e:8.2f}" for e in error) + " %", flush=True)
    return float(100 * np.abs(error).max())


def main() -> None:
    """Print all structures and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="two structures and three shells on the coarse mesh")
    quick = parser.parse_args().quick
    known = shutil.which("ccx") is not None
    if not known:
        print("CalculiX (ccx) is missing: errors against the solids of modalprep")
    figures: dict[str, float] = {}
    for fine in (False,) if quick else (False, True):
        print(f"--- {'finer' if fine else 'coarse'} mesh")
        figures = {}
        for name in QUICK[0] if quick else CASES:
            for end in ENDS:
                for kind, error in compare(name, end, fine, quick).items():
                    figure = "thick_stringer" if name == "thick stringer" and kind == "shells" else f"worst_{kind}"
                    figures[figure] = max(figures.get(figure, 0.0), error)
    print(json.dumps({name: float(f"{value:.3g}") if known else None for name, value in figures.items()}))


if __name__ == "__main__":
    main()
