"""Models of programs with scikit-fem, and models handed to it."""

import numpy as np
import pytest
import skfem
from scipy.linalg import eigh
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity
from structured import box, random_surface, solid_model

import modalprep as mp
from modalprep.errors import InputError

E, NU, RHO = 2e11, 0.3, 8000.0
STEEL = mp.Material(E=E, nu=NU, rho=RHO)
mass = skfem.BilinearForm(lambda u, v, w: RHO * dot(u, v))


def program(element=skfem.ElementTetP2):
    """A bar of 2 x 0.4 x 0.3 m with a named wall, as a user of scikit-fem writes it."""
    mesh = skfem.MeshTet.init_tensor(np.linspace(0, 2, 4), np.linspace(0, 0.4, 2), np.linspace(0, 0.3, 2))
    mesh = mesh.with_boundaries({"wall": lambda x: x[0] == 0, "tip": lambda x: x[0] == 2})
    basis = skfem.Basis(mesh, skfem.ElementVector(element()))
    return basis, skfem.asm(linear_elasticity(*lame_parameters(E, NU)), basis), skfem.asm(mass, basis)


def frequencies(K, M, held):
    """Of a supported structure in scikit-fem."""
    own = np.setdiff1d(np.arange(K.shape[0]), held)
    return np.sqrt(eigh(K[own][:, own].toarray(), M[own][:, own].toarray(), eigvals_only=True)) / (2 * np.pi)


@pytest.mark.parametrize("element", [skfem.ElementTetP1, skfem.ElementTetP2])
def test_bar_of_a_program(element):
    """Frequencies with the wall held, and the integrals of a box."""
    basis, K, M = program(element)
    model = mp.fe.model_from_skfem(basis, K, M, {"wall": mp.Interface(group="wall")})
    reduction = mp.craig_bampton(model, modes=5, truncation=())
    exact = frequencies(K, M, basis.get_dofs("wall").flatten())[:5]
    np.testing.assert_allclose(reduction.frequency[:5], exact, rtol=1e-9)
    m = RHO * 2 * 0.4 * 0.3
    assert model.rigid.m == pytest.approx(m, rel=1e-12)
    np.testing.assert_allclose(model.rigid.s0, [m, 0, 0], atol=1e-12 * m)
    np.testing.assert_allclose(np.diag(model.rigid.E0), m * np.array([4 / 3, 0.16 / 12, 0.09 / 12]), rtol=1e-9)


def test_boundary_conditions_of_a_program():
    """Held in part: a bar on rollers; frequencies of the condensed problem."""
    basis, K, M = program()
    wall = basis.get_dofs("wall")
    held = np.union1d(wall.all("u^1"), np.union1d(wall.all("u^3"), basis.get_dofs("tip").all(["u^2", "u^3"])))
    model = mp.fe.model_from_skfem(basis, K, M, held=held)
    reduction = mp.craig_bampton(model, modes=4, truncation=())
    np.testing.assert_allclose(reduction.frequency[:4], frequencies(K, M, held)[:4], rtol=1e-9)


def test_foundation_of_a_program():
    """A bed under the bar, glued at its wall; it moves with the root, and K of the program stays free of it."""
    basis, K, M = program()
    floor = skfem.FacetBasis(basis.mesh, basis.elem, facets=basis.mesh.facets_satisfying(lambda x: x[2] == 0))
    bed = skfem.asm(skfem.BilinearForm(lambda u, v, w: 5e8 * u[2] * v[2]), floor)
    model = mp.fe.model_from_skfem(basis, K, M, {"wall": mp.Interface(group="wall")}, foundation=bed)
    reduction = mp.craig_bampton(model, modes=5, truncation=())
    exact = frequencies(K + bed, M, basis.get_dofs("wall").flatten())[:5]
    np.testing.assert_allclose(reduction.frequency[:5], exact, rtol=1e-9)
    assert abs(model.K @ model.rigid_body()).max() < 1e-9 * abs(model.K).max()
    with pytest.raises(InputError, match="rigid"):
        mp.fe.model_from_skfem(basis, K + bed, M, {"wall": mp.Interface(group="wall")})


def test_same_as_its_elements():
    """The tetrahedra of a program and ours, whose nodes are the same: K, M and every integral by the bodies."""
    points, cells = box("tetra10", (2, 1, 1), size=(1.0, 0.5, 0.4), distort=0.1)
    ours = solid_model(points, cells, "tetra10", mp.Solid(material=STEEL), np.flatnonzero(points[:, 0] == 0))
    mesh = skfem.MeshTet(points[np.unique(cells[:, :4])].T, np.searchsorted(np.unique(cells[:, :4]), cells[:, :4]).T)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP2()))
    K, M = skfem.asm(linear_elasticity(*lame_parameters(E, NU)), basis), skfem.asm(mass, basis)
    theirs = mp.fe.model_from_skfem(basis, K, M, {"root": mp.Interface(plane=((0.0, 0, 0), (1.0, 0, 0)))})
    first, second = (mp.flexible_body(m, mp.craig_bampton(m, modes=6), name="bar") for m in (ours, theirs))
    np.testing.assert_allclose(second.frequency, first.frequency, rtol=1e-8)
    np.testing.assert_allclose(abs(second.S), abs(first.S), atol=1e-6 * abs(first.S).max())
    np.testing.assert_allclose(second.E0, first.E0, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kind", ["tetra10", "quad", "triangle6"])
def test_round_trip(kind):
    """Handed over and taken back: the same matrices to the last bit, and the same reduction."""
    if kind == "tetra10":
        points, cells = box(kind, (2, 1, 1), distort=0.1)
        own = solid_model(points, cells, kind, mp.Solid(material=STEEL), np.flatnonzero(points[:, 0] == 0))
        root = mp.Interface(plane=((0.0, 0, 0), (1.0, 0, 0)))
    else:
        points, cells = random_surface(kind)
        mesh = mp.fe.Mesh(points=points, cells={kind: cells}, groups={"skin": {kind: np.arange(len(cells))}})
        root = mp.Interface(near=tuple(points[0]), kind="node")
        own = mp.assemble(mesh, {"skin": mp.Shell(material=STEEL, thickness=0.01)}, {"root": root})
        root = mp.Interface(near=(0.0, 0, 0), kind="node")  # of the frame of the model
    there = mp.fe.to_skfem(own)
    if kind == "tetra10":
        root = mp.Interface(plane=(tuple(-own.origin), (1.0, 0, 0)))
    back = mp.fe.model_from_skfem([b for g in there.bases.values() for b in g], there.K, there.M, {"root": root})
    used = np.sort(own.dof[: len(points)][own.dof[: len(points)] >= 0])
    for first, second in ((own.K, back.K), (own.M, back.M)):
        assert abs(first[used][:, used] - second[: len(used)][:, : len(used)]).max() <= 1e-16 * abs(first).max()
    modes = [mp.craig_bampton(model, modes=6, truncation=()).frequency for model in (own, back)]
    np.testing.assert_allclose(*modes, rtol=1e-9)


def test_refused():
    basis, K, M = program(skfem.ElementTetP1)
    with pytest.raises(InputError, match="there is no interface; name one"):
        mp.fe.model_from_skfem(basis, K, M)
    with pytest.raises(InputError, match="has 9 rows, the basis"):
        mp.fe.model_from_skfem(basis, K[:9][:, :9], M[:9][:, :9], {"wall": mp.Interface(group="wall")})
    plate = skfem.Basis(skfem.MeshTri(), skfem.ElementTriMorley())
    with pytest.raises(InputError, match="'u' of ElementTriMorley is no displacement along x, y or z"):
        mp.fe.model_from_skfem(plate, K, M, {"wall": mp.Interface(node=1)})
