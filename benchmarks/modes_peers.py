"""The lowest modes by the programs that users run today.

Each function returns the eigenvalues and does all that its program needs: factorization, and from a mesh its reading
and assembly too. CalculiX integrates the mass with fewer points: its eigenvalues differ in the third digit.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from assembly import STEEL, ngsolve_mesh
from scipy.sparse import csr_array, triu
from scipy.sparse.linalg import LinearOperator, eigsh
from skfem.models.elasticity import lame_parameters

import modalprep as mp

DIGITS = 1e-10  # of ARPACK's Ritz values, as ours


def arpack(K: csr_array, M: csr_array, n: int, solve=None) -> np.ndarray:
    """Shift-invert Lanczos of ARPACK with a given solve; without one, SuperLU as `eigsh` calls it."""
    inverse = None if solve is None else LinearOperator(K.shape, matvec=solve, dtype=float)
    start = M @ np.random.default_rng(0).standard_normal(K.shape[0])
    ncv = min(K.shape[0], 2 * n + 20)
    return np.sort(eigsh(K.tocsc(), n, M, sigma=0.0, OPinv=inverse, v0=start, ncv=ncv, tol=DIGITS)[0])


def pypardiso(K: csr_array, M: csr_array, n: int) -> np.ndarray:
    """ARPACK on pypardiso's solver for positive definite matrices, as its documentation says."""
    from pypardiso import PyPardisoSolver

    solver, upper = PyPardisoSolver(mtype=2), csr_array(triu(K, format="csr"))
    upper.sort_indices()
    solver.factorize(upper)
    return arpack(K, M, n, lambda b: solver.solve(upper, b.ravel()))


def ngsolve(mesh: mp.fe.Mesh, n: int) -> np.ndarray:
    """NGSolve's shift-invert Arnoldi on its sparse Cholesky factor, assembly included."""
    import ngsolve as ng

    domain, (lam, mu) = ngsolve_mesh(mesh), lame_parameters(STEEL.E, STEEL.nu)
    space = ng.VectorH1(domain, order=2, complex=True)  # its Arnoldi takes no real one
    u, v = space.TnT()
    eu, ev = ((ng.Grad(w) + ng.Grad(w).trans) / 2 for w in (u, v))
    K = 2 * mu * ng.InnerProduct(eu, ev) + lam * ng.Trace(ng.Grad(u)) * ng.Trace(ng.Grad(v))
    with ng.TaskManager():
        K, M = (ng.BilinearForm(f * ng.dx).Assemble() for f in (K, STEEL.rho * ng.InnerProduct(u, v)))
        vectors = ng.GridFunction(space, multidim=2 * n + 20)
        found = ng.ArnoldiSolver(K.mat, M.mat, _free(space), list(vectors.vecs), shift=0, inverse="sparsecholesky")
    return np.sort(np.real(np.array(found)))[:n]


def _free(space):
    """DOFs off the plane x = 0."""
    domain, free = space.mesh, space.FreeDofs()
    held = {v.nr for v in domain.vertices if abs(v.point[0]) < 1e-9}
    nodes = [v for v in domain.vertices if v.nr in held]
    nodes += [e for e in domain.edges if all(v.nr in held for v in e.vertices)]
    for dof in (dof for node in nodes for dof in space.GetDofNrs(node)):
        free.Clear(dof)
    return free


def calculix(mesh: mp.fe.Mesh, n: int) -> np.ndarray:
    """CalculiX (ARPACK on SPOOLES), reading and assembly included."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "box.inp").write_text("\n".join(_deck(mesh, n)))
        subprocess.run([shutil.which("ccx"), "box"], cwd=folder, check=True, capture_output=True)
        text = Path(folder, "box.dat").read_text()
    table = text[text.index("E I G E N V A L U E") : text.index("P A R T I C I P A T I O N")]
    return np.array([float(row.split()[1]) for row in table.splitlines() if re.match(r"\s*\d+\s+\S+\s+\S+", row)])


def _deck(mesh: mp.fe.Mesh, n: int) -> list[str]:
    lines = ["*NODE, NSET=ALL", *(f"{i + 1}, {x:.12g}, {y:.12g}, {z:.12g}" for i, (x, y, z) in enumerate(mesh.points))]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=BODY")
    lines += [f"{i + 1}, " + ", ".join(map(str, cell + 1)) for i, cell in enumerate(mesh.cells["tetra10"])]
    lines += ["*NSET, NSET=ROOT", *(f"{i + 1}," for i in mesh.nodes("root"))]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", f"{STEEL.E}, {STEEL.nu}", "*DENSITY", f"{STEEL.rho}"]
    lines += ["*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL", "*BOUNDARY", "ROOT, 1, 3"]
    return [*lines, "*STEP", "*FREQUENCY", f"{n}", "*END STEP", ""]
