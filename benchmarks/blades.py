"""Do spinning blades stiffen as CalculiX says: straight, arched, cambered and twisted, of solids, shells and beams?

    python benchmarks/blades.py [--quick]

Each blade hangs on its root face and spins about an axis through the root: z, along the thickness at the root, and a
skew one. Its modal body has no other interface, 30 modes, vectors for the inertia loads and T, the second order of the
modal mass. CalculiX has the nodes and elements of the solids (C3D20): a linear static step under the centrifugal load,
then the frequencies about it, with stress stiffness, initial displacements and spin softening, without gyroscopic
terms; so without them here too: ``[K + W_ab (P_ab + Kg_W_ab)] q = w^2 M_ff(q0) q``. Compared are the shifts of the
first six squared frequencies over the squared spin, those of CalculiX from runs with and without load. Both have terms
of higher order in the spin, each its own; they are taken out by extrapolation from a tenth and a fifth of the first
circular frequency. Errors are the largest difference over the largest of the six shifts. At that fifth, where tips are
up to 2 % of the length off, CalculiX also takes a geometrically nonlinear static step (NLGEOM): there the body is right
to the square of its slopes, of the squared frequencies and not of their shifts.

Beams cannot do all that solids do: clamped warping makes torsion stiffer, so that arches of beams differ by 2 to 3 %
in the squared frequencies of lateral bending already, and wide thin arches, whose sections bend out of shape, are left
out; and stretch changes the bending of solids by its strain, a share of ``(w L / c)^2`` of the squared spin (c the
speed of sound), which is no longer small where a blade is stocky.

Two refinements; `--quick`: the coarse one and one axis. The last line is JSON, of the last mesh, null where CalculiX is
missing: `worst_solids`, `worst_shells`, `worst_beams` at small spins, and `without_T` of solids there; at the fifth
`finite_solids` of the shifts and `finite_squared` of the squared frequencies themselves.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from scipy.linalg import eigh

import modalprep as mp
from modalprep.body.mass import affine_part, deflected
from modalprep.vectors import skew

ALUMINIUM = mp.Material(E=70e9, nu=0.3, rho=2700.0)
LENGTH = 0.8  # m; the radius of the arch too
MODES, SHIFTS = 30, 6
SHARES = (0.1, 0.2)  # of the first circular frequency: the spins; eigenvalues of CalculiX have seven digits
AXES = {"z": np.array([0.0, 0.0, 1.0]), "skew": np.array([1.0, 2.0, 2.0]) / 3}
CORNERS = [(0, 0), (2, 0), (2, 2), (0, 2)]
EDGES = [(1, 0), (2, 1), (1, 2), (0, 1)]
LEVELS = ((CORNERS, 0), (CORNERS, 2), (EDGES, 0), (EDGES, 2), (CORNERS, 1))
HEX20 = np.array([(*at, level) for side, level in LEVELS for at in side])  # order of CalculiX and of meshes here


# --- blades: points of the middle surface, u from 0 to 1 along the span, v from -1/2 to 1/2 across --------------------


def straight(width, u, v):
    return np.stack([LENGTH * u, width * v, 0 * u * v], axis=-1)


def arch(width, u, v):
    a = u * np.pi / 3
    return np.stack([LENGTH * np.sin(a), width * v, LENGTH * (1 - np.cos(a))], axis=-1)


def cambered(width, u, v):
    radius = width / (np.pi / 4)
    return np.stack([LENGTH * u, radius * np.sin(np.pi / 4 * v), radius * (np.cos(np.pi / 4 * v) - 1)], axis=-1)


def twisted(width, u, v):
    a = np.pi / 4 * u
    return np.stack([LENGTH * u, width * v * np.cos(a), width * v * np.sin(a)], axis=-1)


BLADES = {  # surface, width and thickness (m), kinds
    "straight": (straight, 0.04, 0.02, ("solids", "shells", "beams")),
    "arch": (arch, 0.06, 0.03, ("solids", "shells", "beams")),
    "thin arch": (arch, 0.1, 0.01, ("solids", "shells")),
    "cambered": (cambered, 0.2, 0.01, ("solids", "shells")),
    "twisted": (twisted, 0.1, 0.01, ("solids", "shells", "beams")),
}


def normals(surface, width, u, v, step=1e-5):
    du = surface(width, u + step, v) - surface(width, u - step, v)
    n = np.cross(du, surface(width, u, v + step) - surface(width, u, v - step))
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def grid(*cells):
    return np.meshgrid(*(np.linspace(0, 1, n + 1) - (k > 0) / 2 for k, n in enumerate(cells)), indexing="ij")


# --- models, clamped at the root ------------------------------------------------------------------------------------


def model_of(points, kind, cells, root, section, data=None) -> tuple[mp.fe.FEModel, np.ndarray]:
    """Return the model and the nodes of its root."""
    groups = {"all": {kind: np.arange(len(cells))}, "root": {"vertex": np.arange(len(root))}}
    mesh = mp.fe.Mesh(points=points, cells={kind: cells, "vertex": root[:, None]}, groups=groups, data=data or {})
    face = {"kind": "rbe2", "position": (0.0, 0.0, 0.0)}
    held = mp.Interface(group="root", **({"kind": "node"} if kind == "line" else face))
    return mp.assemble(mesh, {"all": section}, {"root": held}), root


def solids(surface, width, thickness, fine):
    """HEX20, about twice as long as wide in the finer mesh."""
    n = (48, max(3, round(40 * width / LENGTH)), 2) if fine else (30, max(2, round(15 * width / LENGTH)), 1)
    u, v, w = grid(*(2 * k for k in n))
    points = surface(width, u, v) + thickness * w[..., None] * normals(surface, width, u, v)
    k = np.arange(u.size).reshape(u.shape)
    first = np.stack(np.meshgrid(*(np.arange(0, 2 * m, 2) for m in n), indexing="ij"), axis=-1)
    cells = k[tuple(np.moveaxis(first[..., None, :] + HEX20, -1, 0))].reshape(-1, 20)
    used = np.isin(np.arange(u.size), cells)
    new = np.cumsum(used) - 1
    root = new[k[0][used[k[0]]]]
    return model_of(points.reshape(-1, 3)[used], "hexahedron20", new[cells], root, mp.Solid(material=ALUMINIUM))


def shells(surface, width, thickness, fine):
    n = (80, 12) if fine else (40, 6)
    u, v = grid(*n)
    v = np.sin(np.pi * v) / 2  # narrow cells along free edges, where twisting moments turn into shear
    k = np.arange(u.size).reshape(u.shape)
    cells = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    section = mp.Shell(material=ALUMINIUM, thickness=thickness)
    return model_of(surface(width, u, v).reshape(-1, 3), "quad", cells, k[0], section)


def beams(surface, width, thickness, fine):
    n = 80 if fine else 40
    points = surface(width, np.linspace(0, 1, n + 1), np.zeros(n + 1))
    up = normals(surface, width, (np.arange(n) + 0.5) / n, np.zeros(n))
    cells = np.stack([np.arange(n), np.arange(1, n + 1)], axis=-1)
    section = mp.fe.beam_section("rectangle", ALUMINIUM, width=width, height=thickness)
    return model_of(points, "line", cells, np.array([0]), section, {"up": {"line": up}})


def modal(model: mp.fe.FEModel) -> mp.body.FlexibleBody:
    reduction = mp.craig_bampton(model, modes=MODES, truncation=("inertia",))
    return mp.flexible_body(model, reduction, name="blade", second_order_mass=True)


def shifts(body: mp.body.FlexibleBody, spin: np.ndarray) -> np.ndarray:
    """Shift of the lowest squared circular frequencies over the squared spin, without gyroscopic terms."""
    W = skew(spin) @ skew(spin)
    stiffness = np.diag(body.K) + np.einsum("ab,abij->ij", W, body.P + body.Kg_W)
    q0 = -np.linalg.solve(stiffness, np.einsum("ab,abn->n", W, body.H))
    M = body.modal_mass if body.T is None else deflected(affine_part(body), q0).M_ff
    squared = eigh((stiffness + stiffness.T) / 2, M, eigvals_only=True)
    return (squared - np.sort(body.K))[:SHIFTS] / (spin @ spin)


# --- CalculiX -------------------------------------------------------------------------------------------------------


def calculix(model: mp.fe.FEModel, root: np.ndarray, spin: np.ndarray, nonlinear: bool = False) -> np.ndarray:
    """Lowest squared circular frequencies of a model of HEX20 about the centrifugal load."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "blade.inp").write_text("\n".join(_deck(model, root, spin, nonlinear)))
        subprocess.run([shutil.which("ccx"), "blade"], cwd=folder, check=True, capture_output=True)
        text = Path(folder, "blade.dat").read_text()
    table = text[text.index("E I G E N V A L U E") : text.index("P A R T I C I P A T I O N")]
    rows = [row.split() for row in table.splitlines() if re.match(r"\s*\d+\s+\S+\s+\S+", row)]
    return np.array([float(row[1]) for row in rows])[:SHIFTS]


def _deck(model: mp.fe.FEModel, root: np.ndarray, spin: np.ndarray, nonlinear: bool) -> list[str]:
    rate = np.linalg.norm(spin)
    axis = ", ".join(f"{x:.12g}" for x in (spin / rate if rate else AXES["z"]))
    lines = ["*NODE, NSET=ALL", *(f"{i + 1}, {x:.14g}, {y:.14g}, {z:.14g}" for i, (x, y, z) in enumerate(model.points))]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=BLADE")
    for i, cell in enumerate(model.cells["hexahedron20"] + 1):
        lines += [f"{i + 1}, " + ", ".join(map(str, cell[:15])) + ",", ", ".join(map(str, cell[15:]))]
    lines += ["*NSET, NSET=ROOT", *(f"{i + 1}," for i in root)]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{ALUMINIUM.E}, {ALUMINIUM.nu}", "*DENSITY", f"{ALUMINIUM.rho}"]
    lines += ["*SOLID SECTION, ELSET=BLADE, MATERIAL=M", "*BOUNDARY", "ROOT, 1, 3"]
    converged = ["*CONTROLS, PARAMETERS=FIELD", "1e-7, 1e-7, , , 1e-7"]
    lines += ["*STEP, NLGEOM", *converged, "*STATIC"] if nonlinear else ["*STEP", "*STATIC"]
    lines += ["*DLOAD", f"BLADE, CENTRIF, {rate**2:.14g}, 0, 0, 0, {axis}", "*END STEP"]
    return [*lines, "*STEP, PERTURBATION", "*FREQUENCY", f"{SHIFTS + 2}", "*END STEP", ""]


# --- comparison -----------------------------------------------------------------------------------------------------


def compare(name: str, fine: bool, axes) -> dict[str, float]:
    """Print one blade in one refinement; return the worst error of each kind."""
    surface, width, thickness, kinds = BLADES[name]
    models = {kind: globals()[kind](surface, width, thickness, fine) for kind in kinds}
    bodies = {kind: modal(model) for kind, (model, _) in models.items()}
    first, known = np.sqrt(bodies["solids"].K.min()), shutil.which("ccx") is not None
    dofs = ", ".join(f"{model.n_dof} DOFs of {kind}" for kind, (model, _) in models.items())
    print(f"{name}, {width * 1e3:g} x {thickness * 1e3:g} mm: {dofs}")
    rest = calculix(*models["solids"], np.zeros(3)) if known else np.full(SHIFTS, np.nan)
    if known:
        apart = {kind: np.abs(np.sort(bodies[kind].K)[:SHIFTS] / rest - 1).max() for kind in kinds}
        print("  squared frequencies at rest off by", ", ".join(f"{x:.1e} ({kind})" for kind, x in apart.items()))
    worst: dict[str, float] = {}
    for axis in axes:
        slow, fast = (share * first * AXES[axis] for share in SHARES)

        def theirs(spin: np.ndarray, nonlinear: bool = False, rest=rest) -> np.ndarray:
            return (calculix(*models["solids"], spin, nonlinear) - rest) / (spin @ spin) if known else rest

        def small(shift, slow=slow, fast=fast) -> np.ndarray:
            return shift(slow) + (shift(slow) - shift(fast)) / ((fast @ fast) / (slow @ slow) - 1)

        found = {kind: small(lambda w, body=body: shifts(body, w)) for kind, body in bodies.items()}
        found["without_T"] = small(lambda w: shifts(bodies["solids"].with_(T=None), w))
        peer = dict.fromkeys(found, small(theirs))
        found["finite"], peer["finite"] = shifts(bodies["solids"], fast), theirs(fast, nonlinear=True)
        for kind in found:
            if kind in ("solids", "finite"):
                print(f"  {axis:4s} {'CalculiX' if kind == 'solids' else 'NLGEOM':9s}", _row(peer[kind]))
            error = float(np.abs(found[kind] - peer[kind]).max() / np.abs(peer[kind]).max())
            worst[kind] = max(worst.get(kind, 0.0), error)
            print(f"  {axis:4s} {kind:9s}", _row(found[kind]), f"  {100 * error:6.2f} %")
        squared = np.abs(found["finite"] - peer["finite"]) * (fast @ fast) / rest
        worst["finite_squared"] = max(worst.get("finite_squared", 0.0), float(squared.max()))
    return worst


def _row(shift: np.ndarray) -> str:
    return " ".join(f"{x:9.3f}" for x in shift)


def main() -> None:
    """Print all blades and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="the coarse mesh and one axis")
    quick = parser.parse_args().quick
    known = shutil.which("ccx") is not None
    if not known:
        print("CalculiX (ccx) is missing: shifts without a comparison")
    names = {kind: f"worst_{kind}" for kind in ("solids", "shells", "beams")}
    names |= {"without_T": "without_T", "finite": "finite_solids", "finite_squared": "finite_squared"}
    figures = {}
    for fine in (False,) if quick else (False, True):
        print(f"--- {'finer' if fine else 'coarse'} mesh")
        found = [compare(name, fine, ("z",) if quick else AXES) for name in BLADES]
        for kind, figure in names.items():
            worst = max(each.get(kind, 0.0) for each in found)
            figures[figure] = float(f"{worst:.2g}") if known else None
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
