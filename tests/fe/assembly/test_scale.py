"""Assembly at scale: against scikit-fem's own forms, over threads and chunks, and within bounded memory."""

import tracemalloc

import numpy as np
import pytest
import skfem
from scipy.sparse import csr_array
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity
from structured import box, shell_model, solid_model, surface

import modalprep as mp
from modalprep.fe.assembly import parts, sparsity
from modalprep.fe.elements import kernels

STEEL = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
PAIRS = [(a, b) for a in range(3) for b in range(3)]


def patch(kind: str, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells of a distorted box of tetra10 or a warped sheet of quads; their number grows as n."""
    if kind == "tetra10":
        return box("tetra10", (n, 3, 3), (1.0, 0.8, 0.6), distort=0.3, seed=2)
    return surface(8 * n, 12, "quad", lambda s, t: (s, t, 0.1 * s * t), distort=0.2)


def model_of(kind: str, points: np.ndarray, cells: np.ndarray) -> mp.fe.FEModel:
    """Assembled."""
    if kind == "tetra10":
        return solid_model(points, cells, "tetra10", mp.Solid(material=STEEL))
    return shell_model(points, cells, mp.Shell(material=STEEL, thickness=0.01))


def matrices(model: mp.fe.FEModel) -> dict[str, np.ndarray]:
    """Every array that assembly sums over elements."""
    result = {"K": model.K.data, "M": model.M.data, "g": model.g, "h": model.h}
    result |= {"s0": model.rigid.s0, "E0": model.rigid.E0}
    return result | {f"M_{a}{b}": model.M_ab[a, b].data for a, b in PAIRS}


# --- a second implementation --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def both():
    """Our model, scikit-fem's basis on the same mesh, and P with ``d_skfem = P d``."""
    points, cells = patch("tetra10", 2)
    model = model_of("tetra10", points, cells)
    used, corners = np.unique(cells[:, :4], return_inverse=True)
    domain = skfem.MeshTet(points[used].T.copy(), corners.reshape(-1, 4).T.copy())
    basis = skfem.Basis(domain, skfem.ElementVector(skfem.ElementTetP2()), intorder=6)
    distance = np.abs(basis.doflocs.T[:, None] - points[None]).max(axis=2)
    assert distance.min(axis=1).max() < 1e-12
    component = np.zeros(basis.N, dtype=int)
    for a in range(3):
        component[basis.get_dofs(elements=True).all(f"u^{a + 1}")] = a
    ours = model.dof[np.argmin(distance, axis=1), component]
    P = csr_array((np.ones(basis.N), (np.arange(basis.N), ours)), shape=(basis.N, model.n_dof))
    return model, basis, P


def assert_equal(ours, theirs, P):
    """To 1e-12 of the largest entry; DOFs outside the mesh (the interface frame) carry nothing."""
    assert abs(P.T @ theirs @ P - ours).max() < 1e-12 * abs(theirs).max()


def test_stiffness_equals_scikit_fem(both):
    model, basis, P = both
    theirs = linear_elasticity(*lame_parameters(STEEL.E, STEEL.nu)).assemble(basis)
    assert_equal(model.K, theirs, P)


def test_mass_equals_scikit_fem(both):
    model, basis, P = both
    assert_equal(model.M, skfem.BilinearForm(lambda u, v, _: STEEL.rho * dot(u, v)).assemble(basis), P)


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_mass_tensor_equals_scikit_fem(both, a, b):
    model, basis, P = both
    theirs = skfem.BilinearForm(lambda u, v, _: STEEL.rho * v[a] * u[b]).assemble(basis)
    assert_equal(model.M_ab[a, b], theirs, P)


@pytest.mark.parametrize("a", range(3))
def test_linear_vectors_equal_scikit_fem(both, a):
    model, basis, P = both
    g = skfem.LinearForm(lambda v, _: STEEL.rho * v[a]).assemble(basis)
    np.testing.assert_allclose(P.T @ g, model.g[:, a], rtol=0, atol=1e-12 * abs(g).max())
    for b in range(3):
        at = model.origin[b]
        h = skfem.LinearForm(lambda v, w, at=at, b=b: STEEL.rho * (w.x[b] - at) * v[a]).assemble(basis)
        np.testing.assert_allclose(P.T @ h, model.h[:, a, b], rtol=0, atol=1e-12 * abs(h).max())


# --- threads and chunks -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["tetra10", "quad"])
def test_threads_change_no_bit(kind, monkeypatch):
    found = []
    for threads in (1, 2, 3):
        monkeypatch.setattr(kernels, "THREADS", threads)
        found.append(matrices(model_of(kind, *patch(kind, 3))))
    for other in found[1:]:
        for name, values in found[0].items():
            np.testing.assert_array_equal(other[name], values, err_msg=name)


@pytest.mark.parametrize("kind", ["tetra10", "quad"])
def test_chunks_change_round_off_only(kind, monkeypatch):
    whole = matrices(model_of(kind, *patch(kind, 3)))
    for chunk in (1, 7):
        monkeypatch.setattr(parts, "CHUNK", chunk)
        for name, values in matrices(model_of(kind, *patch(kind, 3))).items():
            limit = 1e-13 * np.abs(whole[name]).max()
            np.testing.assert_allclose(values, whole[name], rtol=0, atol=limit, err_msg=name)


# --- memory -------------------------------------------------------------------------------------------------------


def stored(model: mp.fe.FEModel) -> int:
    """Bytes of K, M, M_ab, g, h and the rigid motions; a shared array counts once."""
    tensor = model.M_ab
    arrays = [model.g, model.h, model.rigid_body()]
    arrays += [x for A in (model.K, model.M) for x in (A.data, A.indices, A.indptr)]
    if tensor._scalar is not None:
        arrays += [tensor._scalar.data, tensor._scalar.indices]
    if tensor._functions is not None:
        arrays += [tensor._functions.data, tensor._functions.graph.indices]
    return sum({x.__array_interface__["data"][0]: x.nbytes for x in arrays}.values())


@pytest.mark.parametrize("kind", ["tetra10", "quad"])
def test_memory_grows_as_the_matrices_do(kind, monkeypatch):
    """Element matrices do not pile up: all at once they would make the peak grow 2.6 times as much, shells 3.4."""
    monkeypatch.setattr(parts, "CHUNK", 64)
    monkeypatch.setattr(sparsity, "NODES", 64)
    model_of(kind, *patch(kind, 1))  # compiles
    peak, size = [], []
    for n in (12, 24):
        mesh = patch(kind, n)
        tracemalloc.start()
        try:
            model = model_of(kind, *mesh)
            peak.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
        size.append(stored(model))
    assert peak[1] - peak[0] < 1.5 * (size[1] - size[0])
