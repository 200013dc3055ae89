"""The mass that stays on the held root: with the effective masses of all modes it is the mass of the body."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_array

import modalprep as mp
from modalprep.body.frames import reroot
from modalprep.examples import block_model, cantilever_model, uniform_beam
from modalprep.reduction.basis import held_mass


def effective_of_all_modes(model):
    """Masses (n, 6) of every mode of the model with its root held, by a dense solver; some DOFs have no mass."""
    f = np.setdiff1d(np.arange(len(model.free)), np.searchsorted(model.free, model.interfaces[0].dofs))
    C = model.C.tocsc()[:, f]
    K, M = ((C.T @ A @ C).toarray() for A in (model.K, model.M))
    compliance, shapes = eigh(M, K)  # 1 / w^2
    moving = compliance > 1e-12 * compliance[-1]
    factors = shapes[:, moving].T @ (C.T @ (model.M @ model.rigid_body()))
    return factors**2 / compliance[moving, None]


@pytest.mark.parametrize("make", [cantilever_model, lambda: cantilever_model(tip="fixed"), block_model])
def test_effective_masses_and_the_held_mass_sum_up_to_the_body(make):
    """The identity that explains why modes never have 100 %; 1e-8: the iteration stops there, see `HELD_TOLERANCE`."""
    model = make()
    R = model.rigid_body()
    whole = np.einsum("ij,ij->j", R, model.M @ R)
    effective, held = effective_of_all_modes(model).sum(axis=0), held_mass(model)
    np.testing.assert_allclose(effective + held, whole, rtol=1e-8)
    assert np.all(held[:3] > 0.001 * whole[:3])


def test_bar_holds_what_the_elimination_of_its_mass_matrix_leaves():
    """Axial: consistent masses of two-node bars, ``m/6 [[2, 1], [1, 2]]``, eliminated from the tip to the root."""
    elements, element = 5, 12.0 / 5
    pivot = element / 3
    for _ in range(elements - 1):
        pivot = 2 * element / 3 - (element / 6) ** 2 / pivot
    expected = element / 3 - (element / 6) ** 2 / pivot
    assert held_mass(cantilever_model(elements=elements))[0] == pytest.approx(expected, rel=1e-8)


def test_mass_that_is_tied_to_the_root_is_held_in_full():
    """A rigid end plate of 7 kg on the root adds its mass, and its inertia about the root, to what is held."""
    model = cantilever_model()
    root = model.interfaces[0].dofs
    plate = np.array([7.0, 7.0, 7.0, 0.1, 0.2, 0.3])
    heavy = model.with_(M=(model.M + csr_array((plate, (root, root)), shape=model.M.shape)).tocsr())
    np.testing.assert_allclose(held_mass(heavy) - held_mass(model), plate, rtol=1e-8)


def test_held_mass_is_stored_and_leaves_with_the_root(tmp_path):
    held = held_mass(cantilever_model())
    body = uniform_beam(modes=3)
    body = body.with_(modes=body.modes.with_(held_mass=held))
    again = mp.read_body(mp.write_body(body, tmp_path / "beam.h5"))
    np.testing.assert_array_equal(again.modes.held_mass, held)
    assert mp.read_body(mp.write_body(uniform_beam(modes=3), tmp_path / "bare.h5")).modes.held_mass is None
    assert reroot(body, "tip").modes.held_mass is None


def test_table_knows_which_interfaces_were_held():
    assert mp.craig_bampton(cantilever_model(tip="fixed"), modes=2).table.held_interfaces == ("tip",)
    assert mp.craig_bampton(cantilever_model(), modes=2).table.held_interfaces == ()
