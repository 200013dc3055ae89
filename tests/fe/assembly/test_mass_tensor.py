"""The mass tensor of elements of every form in one model: matrices, products with a basis, and M agree."""

import numpy as np
import pytest
from structured import surface

import modalprep as mp

STEEL = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
UP = (0.0, 0.0, 1.0)


@pytest.fixture(scope="module")
def model() -> mp.fe.FEModel:
    """A warped eccentric sheet of quads and triangles, with beams and bars on it, a mass and a solid beside it."""
    points, quads = surface(6, 5, "quad", lambda s, t: (s, 0.8 * t, 0.1 * s * t), distort=0.2)
    n = len(points)
    brick = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]) * 0.3
    points = np.concatenate([points, brick + points[quads[0, 0]] - [0.3, 0.3, 0.3]])
    solid = n + np.arange(8)[None]
    solid[0, 6] = quads[0, 0]
    triangles = np.concatenate([quads[20:, :3], quads[20:, [0, 2, 3]]])
    lines = np.concatenate([quads[:4, :2], quads[5:9, ::2]])
    mesh = mp.fe.Mesh(
        points=points,
        cells={
            "quad": quads[:20],
            "triangle": triangles,
            "line": lines,
            "hexahedron": solid,
            "vertex": quads[[3, 9], :1],
        },
        groups={
            "sheet": {"quad": np.arange(20), "triangle": np.arange(len(triangles))},
            "beams": {"line": np.arange(4)},
            "bars": {"line": np.arange(4, 8)},
            "brick": {"hexahedron": np.arange(1)},
            "mass": {"vertex": np.arange(1)},
            "root": {"vertex": np.arange(1, 2)},
        },
    )
    properties = {
        "sheet": mp.Shell(material=STEEL, thickness=0.01, offset=0.02),
        "beams": mp.Beam(material=STEEL, A=1e-4, Iy=1e-8, Iz=2e-8, J=1e-8, up=UP),
        "bars": mp.Truss(material=STEEL, A=1e-4),
        "brick": mp.Solid(material=STEEL),
        "mass": mp.PointMass(mass=2.0, inertia=(0.1, 0.2, 0.25, 0, 0, 0), offset=(0.1, 0, 0.2)),
    }
    return mp.assemble(mesh, properties, {"root": mp.Interface(group="root", kind="node")})


def test_diagonal_of_the_tensor_is_the_mass_matrix(model):
    total = sum(model.M_ab[a, a] for a in range(3))
    assert abs(total - model.M).max() < 1e-14 * abs(model.M).max()


def test_mass_matrix_is_symmetric_to_the_last_bit(model):
    assert abs(model.M - model.M.T).max() == 0


def test_products_with_a_basis_are_those_of_the_matrices(model):
    Phi = np.random.default_rng(4).normal(size=(model.n_dof, 19))  # two blocks of columns
    P = model.M_ab.project(Phi)
    for a in range(3):
        for b in range(3):
            wanted = Phi.T @ (model.M_ab[a, b] @ Phi)
            np.testing.assert_allclose(P[a, b], wanted, rtol=0, atol=1e-13 * np.abs(P).max())


@pytest.mark.parametrize("a", range(3))
def test_translations_of_the_tensor_give_the_linear_vectors(model, a):
    """``M_ab`` times the translation along b is ``g_a`` for every b, and the mass of two translations is m."""
    g = np.zeros((model.n_dof, 3))
    for b in range(3):
        translation = model.rigid_body()[:, b]
        g[:, b] = model.M_ab[a, b] @ translation
    np.testing.assert_allclose(g, np.repeat(model.g[:, a : a + 1], 3, axis=1), rtol=0, atol=1e-13 * np.abs(g).max())
    assert np.isclose(model.rigid_body()[:, a] @ g[:, a], model.rigid.m, rtol=1e-12)
