"""How fast are the lowest modes of a clamped model, against SciPy's eigsh with the same and with its own factorization?

    python benchmarks/modes.py [--quick]

A box of quadratic tetrahedra and a square of shells, one edge or face held. Same matrices for all, in one run:

- ours: `lowest_modes`, block Lanczos on PARDISO's factor, with the check of residuals and the count by inertia (a
  second factorization) that nobody else does;
- `eigsh` on the same factor, one right-hand side at a time as ARPACK asks for them;
- `eigsh` on SciPy's SuperLU with its options for symmetric matrices, factorization included: what users run today.

ARPACK is asked for ten digits of the Ritz values (`tol=1e-10`), as ours are. `--quick` takes a smaller box and 150
modes; else 50, 150 and 500 modes of 65 000 DOFs, and of 100 000 DOFs of shell. The last line is JSON:
`m150_vs_eigsh_same_factor` (time of the solve alone over ours), `m150_vs_eigsh_superlu` (their whole time over our
whole time) and `worst_residual` (ours, ``|K phi - w^2 M phi| / |w^2 M phi|``).
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable

import numpy as np
from assembly import STEEL, T, quad_mesh, tet_mesh
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigsh

import modalprep as mp
from modalprep.linalg.factor import Factor, factorize
from modalprep.linalg.modes import lowest_modes
from modalprep.reduction.clamped import clamp


def matrices(mesh: mp.Mesh) -> tuple[csr_array, csr_array]:
    """K and M with the root held."""
    section = mp.Solid(material=STEEL) if "tetra10" in mesh.cells else mp.Shell(material=STEEL, thickness=T)
    held = clamp(mp.assemble(mesh, {"body": section}, {"root": mp.Interface(group="root")}))
    return held.K_ii, held.M_ii


def timed(call: Callable) -> tuple[float, object]:
    """Seconds and result of one call."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def arpack(K: csr_array, M: csr_array, n: int, factor: Factor) -> np.ndarray:
    """Eigenvalues by shift-invert Lanczos of ARPACK on a given factor."""
    inverse = LinearOperator(K.shape, matvec=factor.solve, dtype=float)
    start = M @ np.random.default_rng(0).standard_normal(K.shape[0])
    w2, _ = eigsh(K, n, M, sigma=0.0, OPinv=inverse, v0=start, which="LM", ncv=min(K.shape[0], 2 * n + 20), tol=1e-10)
    return np.sort(w2)


def compare(name: str, K: csr_array, M: csr_array, n: int) -> dict[str, float]:
    """Ratios of one case; the eigenvalues must agree."""
    setup, factor = timed(lambda: factorize(K))
    solve, (w2, phi, _) = timed(lambda: lowest_modes(K, M, n, factor=factor))
    same, other = timed(lambda: arpack(K, M, n, factor))
    superlu, slow = timed(lambda: arpack(K, M, n, factorize(K, "superlu")))
    for theirs in (other, slow):
        np.testing.assert_allclose(w2, theirs, rtol=1e-7)
    inertial = (M @ phi) * w2
    residual = np.linalg.norm(K @ phi - inertial, axis=0) / np.linalg.norm(inertial, axis=0)
    found = {
        "eigsh_same_factor": same / solve,
        "eigsh_superlu": superlu / (setup + solve),
        "factor_share": setup / (setup + solve),
        "worst_residual": float(residual.max()),
    }
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
    found = {}
    for kind, mesh in meshes.items():
        K, M = matrices(mesh)
        for n in (150,) if quick else (50, 150, 500):
            found[kind, n] = compare(f"{kind}, {K.shape[0]} DOFs", K, M, n)
    best = found["tetra10", 150]
    line = {
        "m150_vs_eigsh_same_factor": round(best["eigsh_same_factor"], 2),
        "m150_vs_eigsh_superlu": round(best["eigsh_superlu"], 2),
        "worst_residual": max(case["worst_residual"] for case in found.values()),
    }
    print(json.dumps(line))


if __name__ == "__main__":
    main()
