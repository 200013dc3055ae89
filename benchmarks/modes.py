"""How fast are the lowest modes of a clamped model, against SciPy's eigsh and other programs?

    python benchmarks/modes.py [--quick]

A box of quadratic tetrahedra and a square of shells, one edge or face held. In one run:

- ours: `lowest_modes`, block Lanczos on PARDISO's factor, with the check of residuals and the count by inertia (a
  second factorisation) that nobody else does;
- `eigsh` on the same factor, one right-hand side at a time as ARPACK asks for them: the time of the solve alone;
- whole, with the factorisation: `eigsh` on pypardiso's solver, on SuperLU with its options for symmetric matrices, and
  as it comes (150 modes only, but `--quick`); mesh to modes: CalculiX and NGSolve, where installed (150 modes of the
  box, full run only).

ARPACK is asked for ten digits of the Ritz values (`tol=1e-10`), as ours are.

`--quick` takes a smaller box and 150 modes; else 50, 150 and 500 modes of 61 000 DOFs, and of 100 000 DOFs of shell.
The last line is JSON, of 150 modes of the box, their time over ours: `m150_vs_eigsh_same_factor`,
`m150_vs_eigsh_pypardiso`, `m150_vs_eigsh_superlu`, `m150_vs_eigsh_default`, `m150_vs_calculix`, `m150_vs_ngsolve`;
`count_share` (of our time, in the count) and `worst_residual` (ours, ``|K phi - w^2 M phi| / |w^2 M phi|``, of all
cases).
"""

from __future__ import annotations

import argparse
import json
import shutil
import time
from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
from assembly import STEEL, T, quad_mesh, tet_mesh
from modes_peers import arpack, calculix, ngsolve, pypardiso
from scipy.sparse import csr_array

import modalprep as mp
from modalprep.linalg.factor import factorise
from modalprep.linalg.modes import count_below, lowest_modes
from modalprep.reduction.clamped import clamp


def matrices(mesh: mp.fe.Mesh) -> tuple[csr_array, csr_array]:
    """K and M with the root held."""
    section = mp.Solid(material=STEEL) if "tetra10" in mesh.cells else mp.Shell(material=STEEL, thickness=T)
    held = clamp(mp.assemble(mesh, {"body": section}, {"root": mp.Interface(group="root")}))
    return held.K_ii, held.M_ii


def timed(call: Callable) -> tuple[float, object]:
    """Seconds and result of one call."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def compare(name: str, mesh: mp.fe.Mesh, n: int, peers: tuple[str, ...] = ()) -> dict[str, float]:
    """Ratios of one case; the eigenvalues must agree."""
    assembly, (K, M) = timed(lambda: matrices(mesh))
    setup, factor = timed(lambda: factorise(K))
    solve, (w2, phi, _) = timed(lambda: lowest_modes(K, M, n, factor=factor))
    count, _ = timed(lambda: count_below(K, M, 0.999 * w2[-1]))
    same, other = timed(lambda: arpack(K, M, n, factor.solve))
    inertial = (M @ phi) * w2
    residual = np.linalg.norm(K @ phi - inertial, axis=0) / np.linalg.norm(inertial, axis=0)
    found = {"eigsh_same_factor": same / solve, "count_share": count / solve, "worst_residual": float(residual.max())}
    np.testing.assert_allclose(w2, other, rtol=1e-7)
    calls = {
        "eigsh_pypardiso": lambda: pypardiso(K, M, n),
        "eigsh_superlu": lambda: arpack(K, M, n, factorise(K, "superlu").solve),
        "eigsh_default": lambda: arpack(K, M, n),
        "calculix": lambda: calculix(mesh, n),
        "ngsolve": lambda: ngsolve(mesh, n),
    }
    for peer in peers:
        whole, theirs = timed(calls[peer])
        np.testing.assert_allclose(w2, theirs, rtol=1e-2 if peer == "calculix" else 1e-7)
        found[peer] = whole / (setup + solve + (assembly if peer in ("calculix", "ngsolve") else 0.0))
    print(f"{name:28} {n:4} modes  " + "  ".join(f"{key} {value:.3g}" for key, value in found.items()), flush=True)
    return found


def main() -> None:
    """Run the cases and print the table and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="one smaller case, under a minute")
    quick = parser.parse_args().quick
    meshes = {"tetra10": tet_mesh((9, 8, 8) if quick else (14, 13, 13))}
    if not quick:
        meshes["shell"] = quad_mesh(128)
    solvers, programs = ("eigsh_pypardiso", "eigsh_superlu", "eigsh_default"), []
    if not quick:
        programs = ["calculix"] * bool(shutil.which("ccx")) + ["ngsolve"] * bool(find_spec("ngsolve"))
    found = {}
    for kind, mesh in meshes.items():
        for n in (150,) if quick else (50, 150, 500):
            peers = () if n != 150 else (*solvers, *programs) if kind == "tetra10" else solvers
            found[kind, n] = compare(f"{kind}, {len(mesh.points)} nodes", mesh, n, peers)
    best = found["tetra10", 150]
    line = {f"m150_vs_{key}": round(value, 2) for key, value in best.items() if key in (*solvers, *programs)}
    line |= {"m150_vs_eigsh_same_factor": round(best["eigsh_same_factor"], 2)}
    line |= {"count_share": round(best["count_share"], 2)}
    print(json.dumps(line | {"worst_residual": max(case["worst_residual"] for case in found.values())}))


if __name__ == "__main__":
    main()
