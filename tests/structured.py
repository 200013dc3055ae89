"""Structured meshes of every cell type, supports and solutions for the accuracy tests of the elements."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigsh
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.fe.mesh.cells import CELLS
from modalprep.linalg.factor import factorise
from modalprep.linalg.modes import lowest_modes

Map = Callable[[np.ndarray, np.ndarray], Iterable[np.ndarray]]
QUAD_SPLIT = {"right": ((0, 1, 2), (0, 2, 3)), "left": ((0, 1, 3), (1, 2, 3))}
HEX_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
HEX_FACES = [
    (0, 3, 7, 4),
    (1, 2, 6, 5),
    (0, 1, 5, 4),
    (2, 3, 7, 6),
    (0, 1, 2, 3),
    (4, 5, 6, 7),
]  # VTK: -x +x -y +y -z +z
QUAD_EDGES = [[0, 1], [1, 2], [2, 3], [3, 0]]
MIDDLES = {"triangle6": [[0, 1], [1, 2], [2, 0]], "quad8": QUAD_EDGES, "quad9": [*QUAD_EDGES, [0, 1, 2, 3]]}
TET_EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]


# --- meshes -------------------------------------------------------------------------------------------------------


def unit_grid(nx: int, ny: int, *, distort: float = 0.0, seed: int = 0) -> np.ndarray:
    """((nx+1)(ny+1), 2) points of the unit square, x slowest; inner ones moved at random by `distort` cells at most."""
    grid = np.stack(np.meshgrid(np.linspace(0, 1, nx + 1), np.linspace(0, 1, ny + 1), indexing="ij"), axis=-1)
    move = np.random.default_rng(seed).uniform(-distort, distort, grid.shape) / (nx, ny)
    inner = np.zeros(grid.shape[:2], dtype=bool)
    inner[1:-1, 1:-1] = True
    return (grid + move * inner[..., None]).reshape(-1, 2)


def grid_cells(nx: int, ny: int, kind: str = "quad", *, diagonal: str = "right") -> np.ndarray:
    """Quads or triangles on the points of `unit_grid`; `diagonal` right, left, or alternating."""
    number = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)
    if kind == "quad":
        return quads.reshape(-1, 4)
    odd = np.add.outer(np.arange(nx), np.arange(ny)) % 2 == 1
    right = ~odd if diagonal == "alternating" else np.full((nx, ny), diagonal == "right")
    return np.concatenate([quads[mask][:, list(t)] for mask, way in ((right, "right"), (~right, "left"))
                           for t in QUAD_SPLIT[way]])  # fmt: skip


def surface(nx: int, ny: int, kind: str, shape: Map | None = None, **options) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells of a surface ``x, y, z = shape(s, t)`` over the unit square (default: that square).

    Mid-side nodes are in the middle of their side on the square, so that they lie on a curved surface too.
    """
    diagonal = options.pop("diagonal", "right")
    flat, cells = unit_grid(nx, ny, **options), grid_cells(nx, ny, kind.rstrip("689"), diagonal=diagonal)
    if kind[-1] in "689":
        flat, cells = _with_middles(flat, cells, MIDDLES[kind])
    s, t = flat.T
    points = np.stack(np.broadcast_arrays(*(shape(s, t) if shape else (s, t, 0.0 * s))), axis=-1)
    return points, cells


def random_surface(kind: str, seed: int = 0, n: int = 3, height: float = 0.15) -> tuple[np.ndarray, np.ndarray]:
    """A distorted and warped patch in a random position."""
    rng = np.random.default_rng(seed)
    points, cells = surface(n, n, kind, distort=0.25, seed=seed)
    points[:, 2] = rng.uniform(-height, height, len(points)) / n
    return points @ random_rotation(seed).T + rng.standard_normal(3), cells


def random_rotation(seed: int) -> np.ndarray:
    """(3, 3)."""
    return Rotation.random(random_state=seed).as_matrix()


MACNEAL_HARDER = np.array(
    [[0, 0], [0.24, 0], [0.24, 0.12], [0, 0.12], [0.04, 0.02], [0.18, 0.03], [0.16, 0.08], [0.08, 0.08]]
)  # m; Finite Elements in Analysis and Design 1 (1985) 3, patch test for plates


def macneal_harder(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """The patch of five quads (or ten triangles) in its own plane, inner corners 4 to 7."""
    quads = np.array([[4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
    cells = quads if kind[0] == "q" else np.concatenate([quads[:, list(t)] for t in QUAD_SPLIT["right"]])
    points = np.column_stack([MACNEAL_HARDER, np.zeros(8)])
    return _with_middles(points, cells, MIDDLES[kind]) if kind in MIDDLES else (points, cells)


def box(kind: str, n: tuple[int, int, int], size=(1.0, 1.0, 1.0), *, distort: float = 0.0, seed: int = 0):
    """Points and cells of a box of nx x ny x nz bricks, each split as its kind needs, meshio's node order.

    `distort` moves every inner corner at random by that share of a brick; edges stay straight.
    """
    corners = np.stack(np.meshgrid(*[np.linspace(0, 1, k + 1) for k in n], indexing="ij"), axis=-1)
    move = np.random.default_rng(seed).uniform(-distort, distort, corners.shape) / n
    move[[0, -1], :, :, 0] = move[:, [0, -1], :, 1] = move[:, :, [0, -1], 2] = 0
    points = ((corners + move) * np.array(size)).reshape(-1, 3)
    number = np.arange(len(points)).reshape(corners.shape[:3])
    bricks = []
    for i, j, k in np.ndindex(*n):
        bricks.append([number[i + a, j + b, k + c] for c in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))])
    return _split(points, np.array(bricks), kind)


def _split(points: np.ndarray, bricks: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray]:
    if kind == "hexahedron":
        return points, bricks
    if kind.startswith("wedge"):
        wedges = np.concatenate([bricks[:, list(w)] for w in [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)]])
        return (points, wedges) if kind == "wedge" else _with_middles(points, wedges, CELLS[kind].edges.tolist())
    if kind.startswith("pyramid"):  # six in each brick, with their apex in its middle
        apex = len(points) + np.arange(len(bricks))[:, None]
        points = np.concatenate([points, points[bricks].mean(axis=1)])
        cells = np.concatenate([np.hstack([bricks[:, f[::-1]], apex]) for f in CELLS["hexahedron"].faces])
        return (points, cells) if kind == "pyramid" else _with_middles(points, cells, CELLS[kind].edges.tolist())
    if kind.startswith("tetra"):  # Kuhn's six along the diagonal 0-6, which conform from brick to brick
        paths = [(1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1)]
        tets = np.concatenate([bricks[:, [0, a, b, 6]] for a, b in paths])
        return (points, tets) if kind == "tetra" else _with_middles(points, tets, [list(e) for e in TET_EDGES])
    middles = [list(e) for e in HEX_EDGES]
    if kind == "hexahedron27":
        middles += [list(f) for f in HEX_FACES] + [list(range(8))]
    return _with_middles(points, bricks, middles)


def _with_middles(points: np.ndarray, cells: np.ndarray, middles: list) -> tuple[np.ndarray, np.ndarray]:
    """Add one node at the mean of each listed set of corners, shared between cells."""
    number, extra, full = {}, [], []
    for cell in cells:
        new = []
        for corners in middles:
            key = tuple(sorted(cell[corners]))
            if key not in number:
                number[key] = len(points) + len(extra)
                extra.append(points[list(key)].mean(axis=0))
            new.append(number[key])
        full.append([*cell, *new])
    return np.concatenate([points, extra]), np.array(full)


# --- models -------------------------------------------------------------------------------------------------------


def shell_model(points: np.ndarray, cells: np.ndarray, section, corner: int = 0) -> mp.fe.FEModel:
    """Assemble a shell whose root is its node `corner`; no DOF is held."""
    kind = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}[cells.shape[1]]
    mesh = mp.fe.Mesh(
        points=points,
        cells={kind: cells, "vertex": np.array([[corner]])},
        groups={"shell": {kind: np.arange(len(cells))}, "corner": {"vertex": np.array([0])}},
    )
    return mp.assemble(mesh, {"shell": section}, {"root": mp.Interface(group="corner", kind="node")})


def solid_model(points: np.ndarray, cells: np.ndarray, kind: str, section, face: np.ndarray | None = None):
    """Assemble a body without nodal rotations whose root frame is tied to the nodes `face` (default: all)."""
    face = np.arange(len(points)) if face is None else face
    mesh = mp.fe.Mesh(
        points=points,
        cells={kind: cells, "vertex": face[:, None]},
        groups={"body": {kind: np.arange(len(cells))}, "face": {"vertex": np.arange(len(face))}},
    )
    return mp.assemble(mesh, {"body": section}, {"root": mp.Interface(group="face")})


def local_axes(model: mp.fe.FEModel, R: np.ndarray) -> csr_array:
    """Q with ``d = Q d_local``: every translation and rotation in axes that R turns into those of the mesh."""
    Q = np.zeros((model.n_dof, 3))
    cols = np.zeros((model.n_dof, 3), dtype=int)
    for first in (0, 3):
        dof = model.dof[:, first : first + 3]
        dof = dof[np.all(dof >= 0, axis=1)]
        Q[dof] = R
        cols[dof] = dof[:, None, :]
    return csr_array((Q.ravel(), cols.ravel(), np.arange(0, 3 * model.n_dof + 1, 3)), shape=(model.n_dof,) * 2)


def free_dofs(model: mp.fe.FEModel, *held: np.ndarray, components: Iterable[int] = range(6)) -> np.ndarray:
    """DOFs of the listed components at mesh nodes, without those `held`."""
    dof = model.dof[: len(model.points), list(components)].ravel()
    return np.setdiff1d(dof[dof >= 0], np.concatenate([np.zeros(0, dtype=int), *[np.ravel(h) for h in held]]))


def submatrix(A, keep: np.ndarray) -> csr_array:
    """Rows and columns `keep`."""
    return A.tocsr()[keep][:, keep].tocsr()


# --- solutions ----------------------------------------------------------------------------------------------------

SOLVER = "superlu"  # quicker than PARDISO at these sizes


def static(model: mp.fe.FEModel, keep: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Displacements under the nodal loads (n_dof,) or (n_dof, k) with all DOFs but `keep` held."""
    d = np.zeros(load.shape)
    d[keep] = factorise(submatrix(model.K, keep), SOLVER).solve(load[keep])
    return d


def frequencies(model: mp.fe.FEModel, keep: np.ndarray, n: int) -> np.ndarray:
    """Lowest n frequencies (rad/s) of the DOFs `keep`."""
    K, M = (submatrix(A, keep) for A in (model.K, model.M))
    return np.sqrt(lowest_modes(K, M, n, factor=factorise(K, SOLVER))[0])


def buckling_factors(model: mp.fe.FEModel, keep: np.ndarray, d: np.ndarray, load: np.ndarray, n: int = 1) -> np.ndarray:
    """Lowest n factors (ascending) by which the prestress of `d` buckles the DOFs `keep`."""
    K, Kg = submatrix(model.K, keep), submatrix(model.geometric_stiffness(d, load), keep)
    factor = factorise(K, SOLVER)
    inverse = LinearOperator(K.shape, matvec=factor.solve, matmat=factor.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(len(keep))
    mu = eigsh(-Kg, n, K, Minv=inverse, which="LA", v0=start, ncv=max(40, 4 * n), return_eigenvectors=False)
    return np.sort(1 / mu)


def free_spectrum(model: mp.fe.FEModel, keep: np.ndarray, n: int) -> np.ndarray:
    """Lowest n eigenvalues (rad/s)^2, rigid motions too; M may be singular (drilling carries no mass)."""
    K, M = (submatrix(A, keep).toarray() for A in (model.K, model.M))
    shift = 1e-3 * K.diagonal().mean() / M.diagonal().mean()
    return 1 / eigh(M, K + shift * M, eigvals_only=True)[::-1][:n] - shift


def zero_modes(model: mp.fe.FEModel, keep: np.ndarray) -> np.ndarray:
    """Seven lowest eigenvalues of the free body over the seventh."""
    w2 = free_spectrum(model, keep, 7)
    return w2 / w2[6]


def rigid_residual(model: mp.fe.FEModel, keep: np.ndarray) -> float:
    """``|K R| / |K|`` of the rigid motions, scaled to unit size."""
    R = model.rigid_body()
    return float(np.abs(model.K @ R)[keep].max() / (abs(model.K).max() * np.abs(R).max()))
