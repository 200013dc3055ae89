"""The beam element against closed forms."""

import numpy as np
import pytest
from analytic import cantilever_frequency, timoshenko_simply_supported
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.examples import beam_mesh, cantilever_model, spinup_section
from modalprep.fe.assembly.assemble import assemble
from modalprep.fe.links.interface import Interface

ROOT = {"root": Interface(group="root", kind="node")}


def rotated_model(section, elements=8, seed=3):
    R = Rotation.random(random_state=seed).as_matrix()
    mesh = beam_mesh(elements)
    return assemble(mesh.with_(points=mesh.points @ R.T + 5.0), {"beam": section}, ROOT), R


def clamped_modes(model, n):
    free = np.setdiff1d(np.arange(model.n_dof), model.interfaces[0].dofs)
    K, M = (A.toarray()[np.ix_(free, free)] for A in (model.K, model.M))
    return np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=(0, n - 1)))


def test_cantilever_frequencies_in_any_orientation():
    slender = spinup_section(theory="euler-bernoulli", Iy=2e-11, Iz=2e-11, J=2e-11)  # rotary inertia below the error
    model, _ = rotated_model(slender)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=8, truncation=()), name="beam")
    exact = cantilever_frequency(4, EI=1.4, rho_A=1.2, L=10.0) / (2 * np.pi)
    # 8 cubic elements, error of order (k h / L)^4
    assert np.all(np.abs(body.frequency[::2] / exact - 1) < [2.5e-6, 9e-5, 6.5e-4, 2.3e-3])


def test_order_of_convergence_is_four():
    exact = cantilever_frequency(2, EI=1.4e4, rho_A=1.2, L=10.0)[1]
    slender = spinup_section(theory="euler-bernoulli", Iy=2e-11, Iz=2e-11, J=2e-11)  # rotary inertia below the error
    exact *= np.sqrt(1e-4)
    error = [clamped_modes(rotated_model(slender, n)[0], 4)[2] / exact - 1 for n in (4, 8)]
    assert np.log2(error[0] / error[1]) == pytest.approx(4.0, abs=0.2)


def test_timoshenko_frequencies():
    # L/h = 10, square section; supports hold u_y at both ends
    h = 1.0
    section = spinup_section(A=h**2, Iy=h**4 / 12, Iz=h**4 / 12, J=h**4 / 6, ky=5 / 6, kz=5 / 6)
    model, mat = assemble(beam_mesh(16), {"beam": section}, ROOT), section.material
    exact = timoshenko_simply_supported(4, E=mat.E, G=mat.G, k=5 / 6, rho=mat.rho, A=h**2, I=h**4 / 12, L=10.0)
    in_plane = model.dof[:, [1, 5]].copy()
    free = np.setdiff1d(in_plane.ravel(), in_plane[[0, -1], 0])
    K, M = (A.toarray()[np.ix_(free, free)] for A in (model.K, model.M))
    found = np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=(0, 3)))
    assert np.all(np.abs(found / exact - 1) < [1e-4, 1e-3, 4e-3, 9e-3])  # order h^2, measured 4e-5 .. 6.8e-3


def test_static_tip_deflection_is_exact():
    section = spinup_section(A=1.0, Iy=1 / 12, Iz=1 / 12, J=1 / 6, ky=5 / 6, kz=5 / 6)
    model, mat = assemble(beam_mesh(3), {"beam": section}, ROOT), section.material
    free = np.arange(6, model.n_dof)
    tip = np.linalg.solve(model.K.toarray()[6:, 6:], (free == model.dof[-1, 1]).astype(float))[model.dof[-1, 1] - 6]
    exact = 10.0**3 / (3 * mat.E / 12) + 10.0 / (5 / 6 * mat.G)
    assert tip == pytest.approx(exact, rel=1e-10)  # solution of the homogeneous equation: nodally exact


def test_identities_of_the_formulation():
    model, _ = rotated_model(spinup_section())
    R, rigid = model.rigid_body(), model.rigid
    assert np.abs(model.K @ R).max() < 1e-9 * abs(model.K).max() * 10  # round-off times length
    np.testing.assert_allclose(model.g.T @ R[:, :3], rigid.m * np.eye(3), atol=1e-12 * rigid.m)
    h_T = np.einsum("dab,dc->abc", model.h, R[:, :3])
    np.testing.assert_allclose(h_T, np.einsum("ac,b->abc", np.eye(3), rigid.s0), atol=1e-11 * rigid.m)
    J = np.trace(rigid.E0) * np.eye(3) - rigid.E0
    np.testing.assert_allclose(R[:, 3:].T @ (model.M @ R[:, 3:]), J, atol=1e-11 * np.abs(J).max())


def test_six_rigid_motions_and_no_more():
    model = cantilever_model(4)
    w2 = eigh(model.K.toarray(), model.M.toarray(), eigvals_only=True)
    assert np.all(np.abs(w2[:6]) < 1e-9 * w2[6])
    assert w2[6] > 1.0


@pytest.mark.parametrize(("ends", "factor"), [("clamped-free", 0.25), ("pinned-pinned", 1.0)])
def test_euler_buckling(ends, factor):
    model, EI = assemble(beam_mesh(8), {"beam": spinup_section(theory="euler-bernoulli")}, ROOT), 1.4e4
    load = np.zeros(model.n_dof)
    load[model.dof[-1, 0]] = -1.0
    held = np.zeros(model.n_dof)
    held[6:] = np.linalg.solve(model.K.toarray()[6:, 6:], load[6:])
    Kg = model.geometric_stiffness(held, load).toarray()
    plane = model.dof[:, [1, 5]]
    free = np.setdiff1d(plane.ravel(), plane[0] if ends == "clamped-free" else plane[[0, -1], 0])
    K, Kg = (A[np.ix_(free, free)] for A in (model.K.toarray(), Kg))
    critical = 1 / eigh(-Kg, K, eigvals_only=True)[-1]
    assert critical == pytest.approx(factor * np.pi**2 * EI / 10.0**2, rel=1e-4)  # order h^4: 3e-5 at 8 elements


def test_lateral_torsional_buckling_under_uniform_moment():
    section = spinup_section(theory="euler-bernoulli", Iy=2e-5)  # stiff plane x-z, so that My buckles it sideways
    model, E = assemble(beam_mesh(16), {"beam": section}, ROOT), 7e10
    d = np.zeros(model.n_dof)
    x = model.points[:, 0]
    d[model.dof[:, 2]], d[model.dof[:, 4]] = x**2 / 2, -x  # unit curvature: My = -E Iy
    Kg = model.geometric_stiffness(d, model.K @ d).toarray()
    side = model.dof[:, [1, 3, 5]]
    free = np.setdiff1d(side.ravel(), side[[0, -1], :2].ravel())  # fork supports
    K, Kg = (A[np.ix_(free, free)] for A in (model.K.toarray(), Kg))
    values = eigh(Kg, K, eigvals_only=True)
    critical = E * 2e-5 / np.abs(values).max()
    GJ = section.material.G * section.J
    assert critical == pytest.approx(np.pi / 10 * np.sqrt(E * 2e-7 * GJ), rel=4e-3)  # order h^2: 6e-3 at 8


def test_prestress_turns_with_the_beam():
    """Forces turn with the beam, moments half: the work of a moment is on rotation vectors, ``m.(1 + t~ / 2) dt``."""
    model = assemble(beam_mesh(1, 1.0), {"beam": spinup_section(theory="euler-bernoulli")}, ROOT)
    bent = 1e-3 * np.random.default_rng(1).standard_normal(12)
    load = model.K @ bent
    Kg, (force, moment) = model.geometric_stiffness(bent, load), np.split(load.reshape(2, 6), 2, axis=1)
    for turn in np.eye(3):
        motion = np.hstack([np.cross(turn, model.points), np.tile(turn, (2, 1))])
        expected = np.hstack([np.cross(turn, force), 0.5 * np.cross(turn, moment)])
        found = (Kg @ motion.ravel()).reshape(2, 6)
        # along the beam a turned shear force is left to the stretch, which is stiff
        np.testing.assert_allclose(found[:, 1:], expected[:, 1:], rtol=1e-9, atol=1e-9 * np.abs(load).max())
