"""Second-order tetrahedra: patch, mass, zero modes, bending, prestress; and rigid links."""

import numpy as np
import pytest
from scipy.linalg import eigh

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.links.interface import link_geometric_stiffness
from modalprep.fe.mesh.mesh import Mesh
from modalprep.linalg.factor import factorise
from modalprep.linalg.modes import lowest_modes

STEEL = mp.Solid(material=mp.Material(E=2.1e11, nu=0.3, rho=7800.0))


def box_mesh(n=(6, 2, 2), size=(1.0, 0.1, 0.1)) -> Mesh:
    """Box of 6 tetra10 per brick, groups ``body``, ``left`` and ``right`` (triangle6)."""
    grid = np.stack(np.meshgrid(*[np.arange(2 * k + 1) for k in n], indexing="ij"), axis=-1)
    shape = grid.shape[:3]
    points = grid.reshape(-1, 3) * np.array(size) / (2 * np.array(n))
    number = np.arange(len(points)).reshape(shape)
    paths = [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)]
    pairs = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]  # VTK order of the mid-edge nodes
    cells = []
    for cell in np.ndindex(*n):
        for path in paths:
            corner = [2 * np.array(cell)]
            for axis in path:
                corner.append(corner[-1] + 2 * np.eye(3, dtype=int)[axis])
            if np.linalg.det(np.diff(corner, axis=0)) < 0:
                corner[1], corner[2] = corner[2], corner[1]
            nodes = corner + [(corner[i] + corner[j]) // 2 for i, j in pairs]
            cells.append([number[tuple(v)] for v in nodes])
    used = np.unique(cells)
    ends = {side: used[points[used, 0] == x] for side, x in (("left", 0.0), ("right", size[0]))}
    vertices = np.concatenate(list(ends.values()))[:, None]
    rows = {"left": np.arange(len(ends["left"])), "right": len(ends["left"]) + np.arange(len(ends["right"]))}
    return Mesh(
        points=points,
        cells={"tetra10": np.array(cells), "vertex": vertices},
        groups={"body": {"tetra10": np.arange(len(cells))}, **{s: {"vertex": r} for s, r in rows.items()}},
    )


def box_model(n=(6, 2, 2), size=(1.0, 0.1, 0.1), **interfaces):
    interfaces = interfaces or {"left": mp.Interface(group="left")}
    return mp.assemble(box_mesh(n, size), {"body": STEEL}, interfaces)


def test_linear_displacement_gives_constant_stress():
    model = box_model()
    gradient = np.random.default_rng(0).standard_normal((3, 3)) * 1e-4
    d = np.zeros(model.n_dof)
    tied = model.dof[: len(model.points), :3]
    d[tied] = model.points @ gradient.T
    block = model.geometric_stiffness.blocks[0]
    strain = (gradient + gradient.T) / 2
    lam = 2.1e11 * 0.3 / (1.3 * 0.4)
    exact = 2 * 2.1e11 / 2.6 * strain + lam * np.trace(strain) * np.eye(3)
    stress = block.stress(d[model.dof[block.nodes, :3]][..., None])[..., 0]
    np.testing.assert_allclose(stress, np.broadcast_to(exact, stress.shape), rtol=1e-9)


def test_bracket_mass_and_rigid_motions(bracket_model):
    rigid = bracket_model.rigid
    exact = 8e-9 * (92 * 24 + 38 * 24 + 144 * np.pi + 144 * (1 - np.pi / 4) - 2 * 4.5**2 * np.pi) * 2700
    assert rigid.m == pytest.approx(exact, rel=1e-5)  # quadratic edges on circles: 3e-6
    R = bracket_model.rigid_body()
    mass = R.T @ (bracket_model.M @ R)
    assert mass[0, 0] == pytest.approx(rigid.m, rel=1e-10)
    J = np.trace(rigid.E0) * np.eye(3) - rigid.E0
    np.testing.assert_allclose(mass[3:, 3:], J, atol=1e-10 * np.abs(J).max())


def test_free_bracket_has_six_zero_modes(bracket_model):
    C = bracket_model.C
    K, M = ((C.T @ A @ C).tocsr() for A in (bracket_model.K, bracket_model.M))
    scale = (2 * np.pi * 1000.0) ** 2  # the body's own frequencies are kHz
    w2, _, _ = lowest_modes(K, M, 8, shift=-1e-2 * scale)
    assert np.all(np.abs(w2[:6]) < 1e-6 * w2[6])
    assert w2[6] > scale


def test_cantilever_converges_to_timoshenko():
    # L/h = 20, f1 (lambda = 3.515 with shear and rotary inertia); RBE2 root, 2 elements over the height
    exact = 3.5115 * np.sqrt(2.1e11 * 0.05**2 / 12 / (7800 * 1.0**4)) / (2 * np.pi)
    model = box_model((12, 1, 1), (1.0, 0.05, 0.05))
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=2, truncation=()), name="box")
    assert body.frequency[0] == pytest.approx(exact, rel=2e-2)  # one element over the height: +1.4 %


def test_column_buckles_at_the_euler_load():
    model = box_model((12, 1, 1), (1.0, 0.05, 0.05), left=mp.Interface(group="left"),
                      right=mp.Interface(group="right", boundary="free"))  # fmt: skip
    EI = 2.1e11 * 0.05**4 / 12
    critical = buckling_load(model)
    assert critical == pytest.approx(np.pi**2 * EI / 4, rel=2e-2)  # TetP2, one element over the height: +1.3 %


def test_load_beyond_a_rigid_extension_counts_the_link():
    """Cantilever column of length 1 with a rigid extension of 0.5 that carries the axial load at its end.

    Exact: w = a (cos kx - 1) + b (sin kx - kx) clamped at 0; the load P at the extension's end (u_end = w(1) +
    c w'(1)) gives EI w''(1) = -P c w'(1) and EI w''' + P w' = 0 at 1, i.e. k c tan k = 1.
    """
    from scipy.optimize import brentq

    c = 0.5
    k = brentq(lambda k: k * c * np.tan(k) - 1, 1e-3, np.pi / 2 - 1e-9)
    model = box_model((12, 1, 1), (1.0, 0.05, 0.05), left=mp.Interface(group="left"),
                      right=mp.Interface(group="right", boundary="free", position=(1.0 + c, 0.025, 0.025)))  # fmt: skip
    assert buckling_load(model) == pytest.approx(k**2 * 2.1e11 * 0.05**4 / 12, rel=2e-2)


def buckling_load(model) -> float:
    """Smallest axial compressive load at the last interface from K + lambda Kg of the full model."""
    C, frame = model.C, model.interfaces[-1]
    load = np.zeros(model.n_dof)
    load[frame.dofs[0]] = -1.0
    free = np.setdiff1d(np.arange(C.shape[1]), np.searchsorted(model.free, model.interfaces[0].dofs))
    C = C[:, free]
    K = (C.T @ model.K @ C).tocsr()
    d = C @ factorise(K).solve(C.T @ load)
    Kg = (C.T @ model.geometric_stiffness(d, load) @ C).toarray()
    return 1 / eigh(-Kg, K.toarray(), eigvals_only=True, subset_by_index=(len(Kg) - 1, len(Kg) - 1))[0]


def test_link_stiffness_is_the_second_order_work():
    rng = np.random.default_rng(1)
    force, arm, theta = (
        rng.standard_normal((4, 3)),
        rng.standard_normal((4, 3)),
        1e-3 * rng.standard_normal(3),
    )
    second = np.cross(theta, np.cross(theta, arm)) / 2
    assert theta @ link_geometric_stiffness(force, arm) @ theta / 2 == pytest.approx(np.sum(force * second), rel=1e-12)


def test_inverted_element_is_refused():
    mesh = box_mesh((1, 1, 1))
    cells = mesh.cells["tetra10"].copy()
    cells[2, [1, 2]] = cells[2, [2, 1]]
    cells[2, [4, 6]] = cells[2, [6, 4]]
    cells[2, [8, 9]] = cells[2, [9, 8]]
    with pytest.raises(InputError, match="1 of 6 solid elements are inverted"):
        mp.assemble(
            mesh.with_(cells={**mesh.cells, "tetra10": cells}),
            {"body": STEEL},
            {"left": mp.Interface(group="left")},
        )
