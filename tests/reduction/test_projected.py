"""Singular directions of projected system modes: they reproduce the system they came from, and say why."""

import io

import numpy as np
import pytest
from scipy.linalg import eigh

import modalprep as mp
from modalprep.body.checks import check_body
from modalprep.errors import InputError
from modalprep.examples import cantilever_model
from modalprep.reduction.projected import body_matrices, interface_shapes, projected_basis, reduced_body
from modalprep.reduction.synthesis import synthesise


@pytest.fixture
def cb():
    """PyYeti's Craig-Bampton tools, which set how numpy prints."""
    with np.printoptions():
        yield pytest.importorskip("pyyeti.cb")


def body(elements, tip="fixed"):
    model = cantilever_model(elements, tip)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=40, truncation=()), name="beam", damping=0.01)


@pytest.fixture(scope="module")
def system():
    """Two unequal halves, clamped."""
    parts = {"a": body(6), "b": body(8, "free")}
    return synthesise(parts, [("a.tip", "b.root")], ground=["a.root"])


def projected(system, name, count, **options):
    component = system.bodies[name]
    shapes = system.coordinates[name][6:, :count]
    return projected_basis(shapes, np.diag(component.K), np.eye(component.n), **options)


def again(system, smaller):
    return synthesise(smaller, [("a.tip", "b.root")], ground=["a.root"])


@pytest.mark.parametrize("count", [1, 4, 9])
def test_bodies_of_the_projected_modes_reproduce_the_system(system, count):
    bases = {name: projected(system, name, count, tolerance=1e-9) for name in system.bodies}
    smaller = {name: reduced_body(system.bodies[name], basis) for name, basis in bases.items()}
    assert all(part.n <= count for part in smaller.values())
    found = again(system, smaller)
    np.testing.assert_allclose(found.frequency[:count], system.frequency[:count], rtol=1e-9)
    for name in system.bodies:
        full, small = system.coordinates[name][:, :count], found.coordinates[name][:, :count]
        x = np.vstack([small[:6], bases[name].basis @ small[6:]])
        M = body_matrices(system.bodies[name])[0]
        values = [eigh(y.T @ M @ y, eigvals_only=True) for y in (full, x, np.hstack([full, x]))]
        np.testing.assert_allclose(values[1], values[0], atol=1e-9)
        np.testing.assert_allclose(values[2][:count], 0, atol=1e-9)  # both span the same space


def test_frequencies_of_simple_modes_come_back_with_their_shapes(bracket_body):
    pair = synthesise({"a": bracket_body, "b": bracket_body}, [("a.bolt_b", "b.bolt_a")], ground=["a.bolt_a"])
    count = 5
    smaller = {n: reduced_body(bracket_body, projected(pair, n, count, tolerance=1e-10)) for n in pair.bodies}
    found = synthesise(smaller, [("a.bolt_b", "b.bolt_a")], ground=["a.bolt_a"])
    np.testing.assert_allclose(found.frequency[:count], pair.frequency[:count], rtol=1e-9)
    for name in pair.bodies:
        exact, shape = (s.nodal_shape(name)[..., :count] for s in (pair, found))
        sign = np.sign(np.einsum("pam,pam->m", exact, shape))
        np.testing.assert_allclose(sign * shape, exact, atol=1e-9 * np.abs(exact).max())


def test_the_basis_is_orthonormal_and_diagonal(system):
    basis = projected(system, "a", 8).basis
    K = system.bodies["a"].K
    w2 = np.einsum("ij,i,ij->j", basis, K, basis)
    np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-10)
    np.testing.assert_allclose(basis.T @ (K[:, None] * basis), np.diag(w2), atol=1e-9 * w2.max())
    np.testing.assert_allclose(np.sqrt(w2) / (2 * np.pi), projected(system, "a", 8).frequency, rtol=1e-9)


def test_nodal_shapes_of_a_model_with_their_mass():
    """Modes of the clamped beam, seen at its nodes; the singular values are those of the weighted matrix."""
    model = cantilever_model(8)
    K, M = (A.toarray()[6:, 6:] for A in (model.K, model.M))
    w2, phi = eigh(K, M)
    mixed = phi[:, [0, 2, 5]] @ np.array([[3.0, 1, 0, 4], [0, 2, 1, 3], [1, 0, 1, 2]])  # rank 3 of 4
    found = projected_basis(mixed, K, M)
    np.testing.assert_allclose(found.frequency, np.sqrt(w2[[0, 2, 5]]) / (2 * np.pi), rtol=1e-9)
    sigma = np.linalg.svd(np.linalg.cholesky(M).T @ mixed, compute_uv=False)
    np.testing.assert_allclose(found.singular[:3], sigma[:3], rtol=1e-9)
    np.testing.assert_allclose(found.captured, 1, atol=1e-9)
    np.testing.assert_allclose(found.contribution.sum(axis=0), 1, atol=1e-9)
    assert found.kept.sum() == 3


def test_a_free_component_takes_its_rigid_motions():
    model = cantilever_model(8)
    K, M, R = model.K, model.M, model.rigid_body()
    _, phi = eigh(K.toarray(), M.toarray())
    shapes = phi[:, 6:9] + R @ np.random.default_rng(0).standard_normal((6, 3))
    with pytest.raises(InputError, match="without strain; give all of those as 'rigid'"):
        projected_basis(np.hstack([shapes, R]), K, M)
    found = projected_basis(shapes, K, M, rigid=R)
    assert found.frequency[:6].tolist() == [0.0] * 6
    exact = np.sqrt(eigh(K.toarray(), M.toarray(), eigvals_only=True)[6:9]) / (2 * np.pi)
    np.testing.assert_allclose(found.frequency[6:], exact, rtol=1e-7)
    np.testing.assert_allclose(found.captured, 1, atol=1e-9)


def test_dropped_directions_and_their_reasons(system):
    found = projected(system, "a", 9, tolerance=0.1)
    relative = found.singular / found.singular[0]
    assert found.kept.tolist() == (relative > 0.1).tolist()
    assert 0 < found.kept.sum() < len(found.kept)
    dropped = found.reason[-1]
    assert dropped.startswith("singular value")
    assert "not > 0.1" in dropped
    np.testing.assert_allclose(found.contribution[found.kept].sum(axis=0), found.captured, atol=1e-9)
    assert found.captured.min() < 1


def test_a_fraction_keeps_the_fewest_directions_that_hold_it(system):
    found = projected(system, "a", 9, fraction=0.9)
    held = np.cumsum(found.singular**2) / np.sum(found.singular**2)
    assert held[found.kept.sum() - 1] >= 0.9
    assert held[found.kept.sum() - 2] < 0.9
    assert projected(system, "a", 9, fraction=1.0).kept.all()


def test_interface_shapes_keep_the_static_answer_of_an_interface(system):
    component = system.bodies["a"]
    kept = interface_shapes(component, "tip")
    smaller = reduced_body(component, projected(system, "a", 2, keep=kept, tolerance=0.5))
    stiff = component.phi[1] / component.K @ component.phi[1].T
    np.testing.assert_allclose(smaller.phi[1] / smaller.K @ smaller.phi[1].T, stiff, rtol=1e-9, atol=1e-9 * stiff.max())


def test_a_reduced_body_passes_the_checks_of_a_body(bracket_body):
    pair = synthesise({"a": bracket_body, "b": bracket_body}, [("a.bolt_b", "b.bolt_a")], ground=["a.bolt_a"])
    smaller = reduced_body(bracket_body, projected(pair, "a", 6))
    assert [check for check in check_body(smaller) if not check.passed] == []
    basis = projected(pair, "a", 6).basis
    np.testing.assert_allclose(smaller.D, np.diag(basis.T @ np.diag(bracket_body.D) @ basis))
    assert smaller.modes.kind == ("projected",) * 6
    assert smaller.n == projected(pair, "a", 6).kept.sum()


def test_a_reduced_body_has_the_integrals_of_the_same_motion(bracket_body):
    """At ``q = basis p`` both bodies have the same momenta, strain and geometric work, and interface motion."""
    rng = np.random.default_rng(0)
    found = projected_basis(rng.standard_normal((bracket_body.n, 4)), np.diag(bracket_body.K), np.eye(bracket_body.n))
    smaller, p = reduced_body(bracket_body, found), rng.standard_normal(4)
    q = found.basis @ p
    for name in ("S", "H", "phi", "psi", "shape"):
        exact = getattr(bracket_body, name) @ q
        np.testing.assert_allclose(getattr(smaller, name) @ p, exact, atol=1e-9 * np.abs(exact).max())
    for name in ("P", "Kg_A", "Kg_W", "Kg_F", "Kg_T"):
        exact = getattr(bracket_body, name) @ q @ q
        np.testing.assert_allclose(getattr(smaller, name) @ p @ p, exact, atol=1e-9 * np.abs(exact).max())
    assert smaller.K @ p**2 == pytest.approx(bracket_body.K @ q**2, rel=1e-9)


def test_effective_masses_of_the_directions_are_those_of_pyyeti(cb, system):
    component = system.bodies["a"]
    smaller = reduced_body(component, projected(system, "a", 6))
    M, K = body_matrices(smaller)
    b = np.arange(6)
    checked = cb.cbcheck(io.StringIO(), M, np.diag(K), b, b, n_freefree_modes=8)
    np.testing.assert_allclose(checked.cb_frq, smaller.frequency, rtol=1e-9)
    carried = checked.effmass.to_numpy().sum(axis=0)  # a rotation of the directions changes no sum
    np.testing.assert_allclose(smaller.modes.effective_mass[smaller.modes.kept].sum(axis=0), carried, atol=1e-9)


def test_body_matrices_are_the_craig_bampton_ones_of_pyyeti(cb, bracket_body):
    M, K = body_matrices(bracket_body)
    b = np.arange(6)
    checked = cb.cbcheck(io.StringIO(), M, np.diag(K), b, b, n_freefree_modes=8)
    np.testing.assert_allclose(checked.cb_frq, bracket_body.frequency, rtol=1e-9)
    np.testing.assert_allclose(checked.m[6:, :6] ** 2, checked.effmass.to_numpy(), rtol=1e-9, atol=1e-15)
    total = bracket_body.modes.total
    np.testing.assert_allclose(np.diag(M)[:6], total, rtol=1e-9)
    share = checked.effmass_percent.to_numpy().sum(axis=0) / 100
    rows = np.vstack([bracket_body.S, M[3:6, 6:]]) ** 2
    np.testing.assert_allclose(rows.sum(axis=1) / total, share, rtol=1e-9)


def test_units_of_the_matrices_are_those_of_pyyeti(cb, bracket_body):
    """Converted to inches and slinches, the body has its frequencies and its centre in inches."""
    M, K = body_matrices(bracket_body)
    b = np.arange(6)
    M_inch, K_inch = (cb.cbconvert(A, b, "m2e") for A in (M, np.diag(K)))
    w2 = eigh(K_inch, M_inch, eigvals_only=True)[6:]
    np.testing.assert_allclose(np.sqrt(w2) / (2 * np.pi), synthesise({"a": bracket_body}).frequency[6:], rtol=1e-8)
    mass = (M_inch[:6, :6] + M_inch[:6, :6].T) / 2
    centre = bracket_body.s0 / bracket_body.m / 0.0254
    np.testing.assert_allclose(cb.cgmass(mass)[1], centre, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (dict(tolerance=-0.1), "tolerance = -0.1"),
        (dict(tolerance=1.0), "tolerance = 1"),
        (dict(fraction=0.0), "fraction = 0 "),
        (dict(fraction=1.1), "fraction = 1.1"),
        (dict(rigid=np.ones((3, 1))), "differ in size"),
        (dict(keep=np.ones((3, 1))), "differ in size"),
    ],
)
def test_bad_options_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        projected_basis(np.eye(2), np.eye(2), np.eye(2), **options)


def test_names_and_sizes_that_do_not_fit_are_refused(system):
    component = system.bodies["a"]
    with pytest.raises(InputError, match="interface 'top' does not exist; did you mean 'tip'"):
        interface_shapes(component, "top")
    with pytest.raises(InputError, match="2 rows but the body"):
        reduced_body(component, projected_basis(np.eye(2), np.eye(2), np.eye(2)))


def test_frequencies_of_the_directions_are_rayleigh_quotients(system):
    component = system.bodies["a"]
    found = projected(system, "a", 6)
    stiffness = np.diag(found.directions.T @ np.diag(component.K) @ found.directions)
    table = reduced_body(component, found).modes
    np.testing.assert_allclose((2 * np.pi * table.frequency) ** 2, stiffness, rtol=1e-9)
