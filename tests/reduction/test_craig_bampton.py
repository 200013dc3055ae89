"""Reduction: exact limits, published tables, static exactness, selection."""

import numpy as np
import pytest
from beam_series import effective_masses
from scipy.linalg import eigh

import modalprep as mp
from modalprep.body.verify import check_projection
from modalprep.errors import InputError, MechanismError
from modalprep.examples import beam_mesh, cantilever_model, spinup_section
from modalprep.linalg.onemkl import library
from modalprep.reduction.clamped import clamp
from modalprep.reduction.selection import select


def slender_cantilever(elements=40):
    section = spinup_section(theory="euler-bernoulli")
    return mp.assemble(beam_mesh(elements), {"beam": section}, {"root": mp.Interface(group="root", kind="node")})


def test_effective_masses_of_a_cantilever():
    table = mp.craig_bampton(slender_cantilever(), modes=12, truncation=()).table
    in_plane = table.effective_mass[:, 1] > 1e-6 * table.total[1]
    mass, inertia = effective_masses(4)
    np.testing.assert_allclose(table.fraction[in_plane, 1][:4], mass, atol=2e-5)  # h^2 / 100
    np.testing.assert_allclose(table.fraction[in_plane, 5][:4], inertia, rtol=1e-3)


@pytest.mark.parametrize("tip", ["fixed", "free"])
def test_all_modes_give_the_full_spectrum(tip):
    model = cantilever_model(8, tip)
    reduction = mp.craig_bampton(model, modes=model.n_dof, truncation=())
    full = eigh(model.K.toarray()[6:, 6:], model.M.toarray()[6:, 6:], eigvals_only=True)
    np.testing.assert_allclose((2 * np.pi * reduction.frequency) ** 2, full, rtol=1e-8)  # spread of 1e9 in w^2


def test_effective_masses_of_all_modes_sum_to_the_moving_mass():
    model = slender_cantilever(8)
    held = clamp(model)
    table = mp.craig_bampton(model, modes=held.K_ii.shape[0], truncation=()).table
    R = model.rigid_body()[held.model.free]
    M_bb, M_bi = held.M.border[:, held.b], held.M.coupling
    carried = held.M_ii @ R[held.i] + M_bi.T @ R[held.b]
    expected = np.einsum("ij,ij->j", carried, np.linalg.solve(held.M_ii.toarray(), carried))
    np.testing.assert_allclose(table.effective_mass.sum(axis=0), expected, rtol=1e-9)
    assert M_bb.shape == (6, 6)


def test_guyan_is_exact_in_statics():
    model = cantilever_model(8, "fixed")
    reduction = mp.guyan(model)
    load = np.zeros(model.n_dof)
    load[model.interfaces[1].dofs] = np.arange(1.0, 7.0)
    exact = np.zeros(model.n_dof)
    exact[6:] = np.linalg.solve(model.K.toarray()[6:, 6:], load[6:])
    found = reduction.basis @ ((reduction.basis.T @ load) / (2 * np.pi * reduction.frequency) ** 2)
    np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())


@pytest.mark.parametrize("keep", ["all", "mode < 3", "frequency < 0"])
def test_truncation_vectors_make_their_loads_exact(keep):
    model = cantilever_model(10)
    reduction = mp.craig_bampton(model, modes=6, keep=keep, truncation=("inertia", "interfaces"))
    w2 = (2 * np.pi * reduction.frequency) ** 2
    energies = np.einsum("dk,dk->k", reduction.static, model.K @ reduction.static)
    for load, exact, energy in zip(reduction.loads.T, reduction.static.T, energies, strict=True):
        found = reduction.basis @ ((reduction.basis.T @ load) / w2)
        error = found - exact
        if energy > 1e-8 * energies.max():  # loads of less energy are left out by decision
            assert error @ model.K @ error <= 1e-9 * energy


def test_without_truncation_vectors_the_tip_load_misses_part_of_its_response():
    model = slender_cantilever()
    model_tip = np.zeros(model.n_dof)
    model_tip[model.dof[-1, 1]] = 1.0
    reduction = mp.craig_bampton(model, modes=1, truncation=())
    tip = reduction.basis[model.dof[-1, 1], 0] ** 2 / (2 * np.pi * reduction.frequency[0]) ** 2
    share = effective_masses(1)[1][0]  # (phi(1) / w)^2 = 3 (int x phi)^2, for phi(1) = 2 and int x phi = 2 / beta^2
    assert tip == pytest.approx(share * 10.0**3 / (3 * 1.4e4), rel=1e-4)


def test_basis_is_orthonormal_and_locked_at_the_root(bracket_model):
    reduction = mp.craig_bampton(bracket_model, modes=8)
    Phi, n = reduction.basis, len(reduction.frequency)
    np.testing.assert_allclose(Phi.T @ (bracket_model.M @ Phi), np.eye(n), atol=1e-9)
    K = Phi.T @ (bracket_model.K @ Phi)
    np.testing.assert_allclose(K, np.diag((2 * np.pi * reduction.frequency) ** 2), atol=1e-9 * K.max())
    assert np.abs(Phi[bracket_model.interfaces[0].dofs]).max() < 1e-12 * np.abs(Phi).max()


@pytest.mark.skipif(library() is None, reason="PARDISO has no wheel here")
def test_solvers_agree(bracket_model):
    found = [mp.craig_bampton(bracket_model, modes=4, solver=s).frequency for s in ("in_memory", "superlu")]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-8)


def test_bracket_frequencies_converge_with_the_modes(bracket_model):
    coarse, fine = (mp.craig_bampton(bracket_model, modes=n).frequency for n in (4, 30))
    np.testing.assert_allclose(coarse[:5], fine[:5], rtol=2e-3)
    assert np.all(coarse[:10] >= fine[:10] * (1 - 1e-9))  # Rayleigh-Ritz: more vectors, lower frequencies


def test_mechanism_names_where_it_moves():
    mesh = beam_mesh(4)
    section = spinup_section()
    model = mp.assemble(mesh, {"beam": section}, {"root": mp.Interface(group="root", kind="node")})
    loose = model.with_(K=model.K.copy())
    twist = model.dof[1:, 3]
    K = loose.K.tolil()
    K[twist, :] = 0
    K[:, twist] = 0
    with pytest.raises(MechanismError, match="mechanism.*turns about x"):
        clamp(model.with_(K=(K.tocsr() + 0 * model.K).tocsr()))


def test_selection_reasons():
    frequency = np.array([1.0, 10.0, 100.0])
    fraction = np.zeros((3, 6))
    fraction[:, 1] = 0.6, 0.2, 0.001
    kept, reason = select("effective_mass > 10% and frequency < 5 Hz", frequency, fraction)
    assert kept.tolist() == [True, False, False]
    assert reason[1] == "frequency 10 Hz, not < 5"
    kept, _ = select("not (frequency > 20) or mode == 3".replace("mode == 3", "mode >= 3"), frequency, fraction)
    assert kept.tolist() == [True, True, True]


@pytest.mark.parametrize(
    "keep", ["frequency <", "mass > 1", "__import__('os')", "frequency < mode", "1 < 2", "1 < frequency < mode", ""]
)
def test_bad_selection_is_refused(keep):
    with pytest.raises(InputError, match="keep"):
        select(keep, np.ones(1), np.ones((1, 6)))


def test_inputs_are_not_modified():
    model = cantilever_model(6)
    before = model.K.toarray().copy(), model.g.copy()
    mp.craig_bampton(model, modes=3)
    assert np.array_equal(before[0], model.K.toarray())
    assert np.array_equal(before[1], model.g)


@pytest.mark.parametrize(("x", "kind"), [(0.0, slice), (5.0, np.ndarray)], ids=["at an end", "between"])
def test_interior_dofs_are_those_outside_fixed_interfaces_wherever_these_lie(x, kind):
    root = mp.Interface(box=((x, 0, 0), (x, 0, 0)), kind="node")
    held = clamp(mp.assemble(beam_mesh(6), {"beam": spinup_section()}, {"root": root}))
    assert isinstance(held.i, kind)
    inside = np.setdiff1d(np.arange(42), held.b)
    for A, whole, part in ((held.model.K, held.K, held.K_ii), (held.model.M, held.M, held.M_ii)):
        exact = (held.model.C.T @ A @ held.model.C).toarray()
        np.testing.assert_array_equal(part.toarray(), exact[np.ix_(inside, inside)])
        np.testing.assert_array_equal(whole.tocsr().toarray(), exact)
        np.testing.assert_array_equal(whole.diagonal(), exact.diagonal())
        np.testing.assert_allclose(whole @ exact, exact @ exact, rtol=0, atol=1e-13 * np.abs(exact).max() ** 2)


def test_a_body_whose_nodes_are_all_held_has_its_constraint_modes(tmp_path):
    """A bar of one element between two fixed interfaces: no mode inside, and the same body as with a free end."""
    deck = "GRID,1\nGRID,2,,1.\nCBAR,1,5,1,2,0.,1.,0.\nPBAR,5,7,.01,3.-6,2.-6,4.-6\nMAT1,7,2.+11,,.3,8000.\nENDDATA\n"
    (tmp_path / "bar.bdf").write_text(deck)
    mesh = mp.read_mesh(tmp_path / "bar.bdf")
    root = mp.Interface(node=1, kind="node")
    found = []
    for boundary in ("fixed", "free"):
        model = mp.assemble(mesh, {}, {"root": root, "tip": mp.Interface(node=2, kind="node", boundary=boundary)})
        reduction = mp.craig_bampton(model, modes=6)
        body = mp.flexible_body(model, reduction, name="bar")
        assert [check for check in check_projection(model, reduction, body) if not check.passed] == []
        found.append(reduction.frequency)
    assert len(found[0]) == 6
    np.testing.assert_allclose(*found, rtol=1e-9)  # round-off of an axial stiffness over a bending one
    with pytest.raises(mp.InputError, match="every node belongs to the fixed interface"):
        mp.craig_bampton(mp.assemble(mesh, {}, {"root": mp.Interface(group="pbar_5", kind="rbe2")}), modes=1)
