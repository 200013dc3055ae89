"""How fast and how lean is assembly, against NGSolve and plain scikit-fem on the same mesh?

    python benchmarks/assembly.py [--quick | --million]

What every program is timed for: K, M, the twelve linear vectors ``g_a = int rho N_a``, ``h_ab = int rho x_b N_a``,
and the mass tensor ``M_ab``. Meshes are built beforehand; function spaces, numbering and sparsity count. Two threads
where a program has them; the programs alternate, medians. Where other work shares the processors these mislead
(NGSolve's threads wait for each other, and lose most): the ratio of the fastest runs is printed beside them.

(a) A box of quadratic tetrahedra with straight edges. `modalprep.assemble` does all of it, checks of the mesh and an
    rbe2 interface included. NGSolve and scikit-fem: K and M of three components, one scalar mass matrix (M_ab is
    that matrix at components a, b) and four scalar linear forms (g and h are these at component a). NGSolve runs
    in the faster of its ways: blocks of three (`dim=3`) and compiled integrands; its matrices stay its own, uncopied.
    scikit-fem: `ElementVector(ElementTetP2())`, `linear_elasticity`, the fewest quadrature points that are exact.
    The programs must agree on the strain and the kinetic energy of a quadratic displacement field.
(b) A square of four-node shells. NGSolve has no shell of nodal rotations; scikit-fem's user writes one: six components
    of `ElementQuad1`, membrane, bending and drilling with 2 x 2 points, shear with one, M, scalar mass and four
    linear forms as above. That is simpler than ours: no incompatible modes, no edge functions (so one scalar mass
    instead of six matrices), no warping, one fixed plane.
(c) A few hundred or thousand distorted elements of every family by our own weak forms in scikit-fem
    (`assemble(..., forms="plain")`), the reference implementation, and by the compiled loops: the same matrices.

The last line is JSON: `tet_vs_skfem`, `tet_vs_ngsolve`, `small_vs_ngsolve` (384 tetrahedra), `quad_vs_skfem` (their
time over ours; null where NGSolve is not installed) and `plain` (of each family, time of
the weak forms over that of the compiled loops), and `peak_mib` (growth of resident memory over case (a) in a
process of its own: VmHWM after minus VmRSS before, kernels compiled and mesh in memory; null where there is no /proc).
`--million` assembles a tetrahedral box of 1 million DOFs in the same way: `million_per_dof` (time per DOF over that of
case (a)) and `million_peak_gib`.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from itertools import permutations
from pathlib import Path

import numpy as np
import skfem
from skfem.helpers import ddot, dot, eye, trace
from skfem.models.elasticity import lame_parameters, linear_elasticity

import modalprep as mp

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from structured import box, surface

STEEL = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
T = 0.01  # m, of the shell
TETS = {
    "small": (4, 4, 4),
    "quick": (12, 11, 11),
    "full": (16, 16, 16),
    "million": (35, 34, 34),
}  # bricks, six tetrahedra each
QUADS = {"quick": 80, "full": 128}
PLAIN = {"quick": 100, "full": 1000}  # elements of case (c)
ROUNDS = {"small": 15, "quick": 3, "full": 7}
EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))  # meshio's order of the mid nodes
Call = Callable[[], object]
BEAM = mp.fe.beam_section("rectangle", STEEL, width=0.02, height=0.03, up=(0, 0, 1))
SHEETS = ("triangle", "quad", "triangle6", "quad8", "quad9")
BRICKS = ("tetra", "tetra10", "pyramid", "pyramid13", "wedge", "wedge15")
BRICKS += ("hexahedron", "hexahedron20", "hexahedron27")
FAMILIES = {  # of case (c)
    "truss": mp.Truss(material=STEEL, A=1e-4, J=1e-9),
    "line": BEAM,
    "line3": BEAM,
    **dict.fromkeys(SHEETS, mp.Shell(material=STEEL, thickness=T)),
    **dict.fromkeys(BRICKS, mp.Solid(material=STEEL)),
}


# --- meshes -------------------------------------------------------------------------------------------------------


def tet_mesh(bricks: tuple[int, int, int]) -> mp.fe.Mesh:
    """Unit-size box, each brick cut into Kuhn's six tetrahedra; every point of the grid of half bricks is a node."""
    fine = [2 * k + 1 for k in bricks]
    points = np.stack(np.meshgrid(*[np.linspace(0, 1, k) for k in fine], indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(fine)
    first = 2 * np.stack(np.meshgrid(*[np.arange(k) for k in bricks], indexing="ij"), axis=-1).reshape(-1, 1, 3)
    cells = []
    for path in permutations(range(3)):
        corner = np.zeros((4, 3), dtype=int)
        for step, axis in enumerate(path):
            corner[step + 1 :, axis] = 2
        if np.linalg.det(corner[1:]) < 0:
            corner[1:3] = corner[2:0:-1]
        at = first + np.concatenate([corner, [(corner[i] + corner[j]) // 2 for i, j in EDGES]])
        cells.append(number[tuple(np.moveaxis(at, -1, 0))])
    return _mesh(points, "tetra10", np.stack(cells, axis=1).reshape(-1, 10), number[0].ravel())


def quad_mesh(n: int) -> mp.fe.Mesh:
    """Unit square of n x n quads in the plane z = 0."""
    points = np.stack(np.meshgrid(*[np.linspace(0, 1, n + 1)] * 2, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(n + 1, n + 1)
    cells = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    return _mesh(points, "quad", cells, number[0])


def _mesh(points: np.ndarray, kind: str, cells: np.ndarray, root: np.ndarray) -> mp.fe.Mesh:
    return mp.fe.Mesh(
        points=points,
        cells={kind: cells, "vertex": root[:, None]},
        groups={"body": {kind: np.arange(len(cells))}, "root": {"vertex": np.arange(len(root))}},
    )


# --- the programs -------------------------------------------------------------------------------------------------


def ours(mesh: mp.fe.Mesh) -> Call:
    """From Mesh to FEModel."""
    section = mp.Shell(material=STEEL, thickness=T) if "quad" in mesh.cells else mp.Solid(material=STEEL)
    return lambda: mp.assemble(mesh, {"body": section}, {"root": mp.Interface(group="root")})


def energies(model: mp.fe.FEModel) -> list[float]:
    """Twice the strain and the kinetic energy of `field`."""
    d = np.zeros(model.n_dof)
    d[model.dof[: len(model.points), :3]] = np.stack(field(*(model.points + model.origin).T), axis=1)
    return [d @ (A @ d) for A in (model.K, model.M)]


def ngsolve_mesh(mesh: mp.fe.Mesh):
    """NGSolve's mesh of the same points and cells; it makes the mid nodes itself."""
    import netgen.meshing as netgen
    import ngsolve as ng

    points, corners = _corners(mesh)
    raw = netgen.Mesh(dim=3)
    raw.AddPoints(points)
    raw.AddElements(dim=3, index=1, data=corners.astype(np.int32), base=0)
    return ng.Mesh(raw)


def ngsolve_tets(mesh: mp.fe.Mesh) -> tuple[Call, list[float]] | None:
    """NGSolve in the faster of its ways."""
    try:
        import ngsolve as ng
    except ImportError:
        return None
    ng.SetNumThreads(2)
    domain, (lam, mu), rho = ngsolve_mesh(mesh), lame_parameters(STEEL.E, STEEL.nu), STEEL.rho

    def form(integrand: ng.CoefficientFunction) -> ng.BilinearForm:
        return ng.BilinearForm(integrand.Compile() * ng.dx).Assemble()

    def call() -> tuple:
        with ng.TaskManager():
            vector, scalar = ng.H1(domain, order=2, dim=3), ng.H1(domain, order=2)
            (u, v), (p, q) = vector.TnT(), scalar.TnT()
            eu, ev = ((ng.Grad(w) + ng.Grad(w).trans) / 2 for w in (u, v))
            K = form(2 * mu * ng.InnerProduct(eu, ev) + lam * ng.Trace(ng.Grad(u)) * ng.Trace(ng.Grad(v)))
            M, one = form(rho * ng.InnerProduct(u, v)), form(rho * p * q)
            at = (ng.CF(1), ng.x, ng.y, ng.z)
            return K, M, one, [ng.LinearForm((rho * f * q).Compile() * ng.dx).Assemble() for f in at]

    K, M, *_ = call()
    d = ng.GridFunction(K.space)
    d.Set(ng.CF(field(ng.x, ng.y, ng.z)))
    return call, [ng.InnerProduct(d.vec, (A.mat * d.vec).Evaluate()) for A in (K, M)]


def skfem_tets(mesh: mp.fe.Mesh) -> tuple[Call, list[float]]:
    """Plain scikit-fem; the matrices in its own numbering."""
    points, corners = _corners(mesh)
    domain = skfem.MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(corners.T, dtype=np.int32))
    element, stiffness = skfem.ElementTetP2(), linear_elasticity(*lame_parameters(STEEL.E, STEEL.nu))
    mass = skfem.BilinearForm(lambda u, v, _: STEEL.rho * dot(u, v))

    def call() -> tuple:
        K = stiffness.assemble(skfem.Basis(domain, skfem.ElementVector(element), intorder=2))
        M = mass.assemble(skfem.Basis(domain, skfem.ElementVector(element), intorder=4))
        return K, M, *_scalar(domain, element, intorder=4)

    K, M, *_ = call()
    at = skfem.Basis(domain, skfem.ElementVector(element), intorder=1)
    d = np.stack(field(*at.doflocs))[np.arange(at.N) % 3, np.arange(at.N)]
    return call, [d @ A @ d for A in (K, M)]


def skfem_quads(mesh: mp.fe.Mesh) -> Call:
    """The flat shell that a user of plain scikit-fem would write; components u, v, w, tx, ty, tz."""
    cells = np.ascontiguousarray(mesh.cells["quad"].T, dtype=np.int32)
    domain, E, nu, G = skfem.MeshQuad(np.ascontiguousarray(mesh.points[:, :2].T), cells), STEEL.E, STEEL.nu, STEEL.G
    element, moduli = skfem.ElementQuad1(), np.array([E * T, E * T**3 / 12]) / (1 - nu**2)
    turn = STEEL.rho * T**3 / 12

    def bent(e: np.ndarray, f: np.ndarray, modulus: float) -> np.ndarray:
        return modulus * ddot((1 - nu) * e + nu * eye(trace(e), 2), f)

    def strains(g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        k = np.stack([g[4], -g[3]])
        return sym_grad_of(g[:2]), sym_grad_of(k)

    def sym_grad_of(g: np.ndarray) -> np.ndarray:
        return (g + np.swapaxes(g, 0, 1)) / 2

    @skfem.BilinearForm
    def flat(u, v, _):
        (eu, ku), (ev, kv) = strains(u.grad), strains(v.grad)
        du, dv = ((x.grad[1, 0] - x.grad[0, 1]) / 2 - x[5] for x in (u, v))
        return bent(eu, ev, moduli[0]) + bent(ku, kv, moduli[1]) + 0.05 * G * T * du * dv

    @skfem.BilinearForm
    def shear(u, v, _):
        gu, gv = ((x.grad[2, 0] + x[4], x.grad[2, 1] - x[3]) for x in (u, v))
        return 5 / 6 * G * T * (gu[0] * gv[0] + gu[1] * gv[1])

    @skfem.BilinearForm
    def mass(u, v, _):
        return STEEL.rho * T * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) + turn * (u[3] * v[3] + u[4] * v[4])

    def call() -> tuple:
        full, reduced = (skfem.Basis(domain, skfem.ElementVector(element, 6), intorder=k) for k in (3, 1))
        K = flat.assemble(full) + shear.assemble(reduced)
        return K, mass.assemble(full), *_scalar(domain, element, intorder=3)

    return call


def _scalar(domain: skfem.Mesh, element: skfem.Element, intorder: int) -> tuple:
    basis = skfem.Basis(domain, element, intorder=intorder)
    one = skfem.BilinearForm(lambda u, v, _: STEEL.rho * u * v).assemble(basis)
    first = skfem.LinearForm(lambda v, _: STEEL.rho * v).assemble(basis)
    return one, [first, *(_moment(k).assemble(basis) for k in range(domain.dim()))]


def _moment(k: int) -> skfem.LinearForm:
    return skfem.LinearForm(lambda v, w: STEEL.rho * w.x[k] * v)


def _corners(mesh: mp.fe.Mesh) -> tuple[np.ndarray, np.ndarray]:
    used, cells = np.unique(mesh.cells["tetra10"][:, :4], return_inverse=True)
    return mesh.points[used], cells.reshape(-1, 4)


def field(x, y, z) -> tuple:
    """A quadratic displacement."""
    return x * y, y * z - x, x * x + y * z


# --- measurements -------------------------------------------------------------------------------------------------


def ratios(mine: Call, peers: list[Call], rounds: int) -> list[tuple[float, float]]:
    """Each peer's time over ours, the calls alternating: of the medians, and of the fastest runs."""
    calls = [mine, *peers]
    for call in calls:
        call()
    seconds: list[list[float]] = [[] for _ in calls]
    for _ in range(rounds):
        for call, spent in zip(calls, seconds, strict=True):
            begin = time.perf_counter()
            call()
            spent.append(time.perf_counter() - begin)
    own, *theirs = ((statistics.median(s), min(s)) for s in seconds)
    return [(middle / own[0], fastest / own[1]) for middle, fastest in theirs]


def tets(size: str) -> dict[str, float | None]:
    """Case (a)."""
    mesh = tet_mesh(TETS[size])
    mine, peers = ours(mesh), {"skfem": skfem_tets(mesh), "ngsolve": ngsolve_tets(mesh)}
    model, found = mine(), {name: peer for name, peer in peers.items() if peer}
    for name, (_, energy) in found.items():
        np.testing.assert_allclose(energy, energies(model), rtol=1e-9, err_msg=name)
    print(f"{mesh.cells['tetra10'].shape[0]} quadratic tetrahedra, {3 * len(mesh.points)} DOFs in every program:")
    theirs = ratios(mine, [call for call, _ in found.values()], ROUNDS[size])
    ratio = dict.fromkeys(f"tet_vs_{name}" for name in peers)
    for name, (middle, fastest) in zip(found, theirs, strict=True):
        ratio[f"tet_vs_{name}"] = round(middle, 2)
        print(f"  {name} takes {middle:.2f} times our time (fastest runs {fastest:.2f})")
    if ratio["tet_vs_ngsolve"] is None:
        print("  NGSolve is not installed")
    return ratio


def quads(size: str) -> dict[str, float]:
    """Case (b)."""
    mesh = quad_mesh(QUADS[size])
    [(middle, fastest)] = ratios(ours(mesh), [skfem_quads(mesh)], ROUNDS[size])
    print(f"{len(mesh.cells['quad'])} quad shells, {6 * len(mesh.points)} DOFs in both programs:")
    print(f"  skfem takes {middle:.2f} times our time (fastest runs {fastest:.2f})")
    return {"quad_vs_skfem": round(middle, 2)}


def family_mesh(name: str, n: int) -> mp.fe.Mesh:
    """About n elements, on a unit line, square or box; the first hundredth is the root."""
    if name in SHEETS:
        side = round((n / (2 if name[0] == "t" else 1)) ** 0.5)
        points, cells = surface(side, side, name, distort=0.2)
    elif name in BRICKS:
        split = {"t": 6, "p": 6, "w": 2, "h": 1}[name[0]]
        side = max(2, round((n / split) ** (1 / 3)))
        points, cells = box(name, (side, side, side), distort=0.2)
    else:
        step = 2 if name == "line3" else 1
        points = np.column_stack([np.linspace(0, 1, step * n + 1), np.zeros((step * n + 1, 2))])
        first = step * np.arange(n)
        cells = np.column_stack([first, first + step, *([first + 1] if step == 2 else [])])
    kind = "line" if name == "truss" else name
    root = np.flatnonzero(points[:, 0] < 1e-6)
    return _mesh(points, kind, cells, root)


def plain(size: str) -> dict[str, dict[str, float]]:
    """Case (c)."""
    found = {}
    print("weak forms in scikit-fem, times the time of the compiled loops:")
    for name, section in FAMILIES.items():
        mesh = family_mesh(name, PLAIN[size])
        kind = "node" if name in ("truss", "line", "line3") else "rbe2"
        held = {"root": mp.Interface(group="root", kind=kind)}
        calls = [partial(mp.assemble, mesh, {"body": section}, held, forms=forms) for forms in ("compiled", "plain")]
        compiled, weak = (call() for call in calls)
        assert abs(compiled.K - weak.K).max() <= 1e-11 * abs(compiled.K).max(), name
        [(middle, _)] = ratios(calls[0], calls[1:], 3 if size == "full" else 1)
        found[name] = round(middle, 1)
        count = sum(map(len, compiled.cells.values()))
        print(f"  {name:14} {count:5} elements: {middle:6.1f}")
    return {"plain": found}


def alone(size: str) -> dict[str, float | None]:
    """Assemble the box of case (a) in a process of its own: seconds per DOF, and growth of resident memory in MiB."""
    done = subprocess.run([sys.executable, __file__, "--alone", size], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def _alone(size: str) -> dict[str, float | None]:
    ours(tet_mesh((2, 2, 2)))()
    mesh = tet_mesh(TETS[size])
    before, begin = _memory("VmRSS"), time.perf_counter()
    model = ours(mesh)()
    spent, after = time.perf_counter() - begin, _memory("VmHWM")
    return {"per_dof": spent / model.n_dof, "mib": None if after is None else (after - before) / 1024}


def _memory(name: str) -> int | None:
    """Return a figure of this process in KiB; unlike ru_maxrss it owes nothing to the parent's peak."""
    status = Path("/proc/self/status")
    if not status.exists():
        return None
    return next(int(line.split()[1]) for line in status.read_text().splitlines() if line.startswith(name))


def million() -> dict[str, float | None]:
    """A million DOFs against case (a), alternating."""
    runs = [(alone("full"), alone("million")) for _ in range(3)]
    ratio = statistics.median(large["per_dof"] / small["per_dof"] for small, large in runs)
    mib = runs[0][1]["mib"]
    print(f"a million DOFs take {ratio:.2f} times the time per DOF of case (a)")
    return {"million_per_dof": round(ratio, 2), "million_peak_gib": mib and round(mib / 1024, 2)}


def main() -> None:
    """Print the ratios and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="40 000 DOFs, fewer rounds")
    size.add_argument("--million", action="store_true", help="ours alone, a million DOFs")
    size.add_argument("--alone", choices=TETS, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.alone:
        result = _alone(asked.alone)
    elif asked.million:
        result = million()
    else:
        name = "quick" if asked.quick else "full"
        mib = alone(name)["mib"]
        small = {"small_vs_ngsolve": tets("small")["tet_vs_ngsolve"]}
        result = tets(name) | small | quads(name) | plain(name) | {"peak_mib": mib and round(mib)}
    print(json.dumps(result))


if __name__ == "__main__":
    main()
