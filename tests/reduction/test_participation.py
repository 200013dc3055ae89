"""Controllability and observability of modes at interfaces: gramians and transfer functions of the full model."""

import numpy as np
import pytest
from analytic import cantilever_roots
from beam_series import effective_masses
from scipy.linalg import solve_continuous_lyapunov
from scipy.sparse.linalg import splu

import modalprep as mp
from modalprep.examples import beam_mesh, cantilever_model, spinup_section
from modalprep.linalg.modes import lowest_modes
from modalprep.reduction.clamped import clamp
from modalprep.reduction.free_interface_basis import free_interface
from modalprep.reduction.participation import fixed_coupling, free_coupling, interface_shares

ZETA = 1e-5  # what other modes and rigid motions answer is smaller by about as much


@pytest.fixture(scope="module")
def mixed():
    """Root and middle fixed, tip free: a beam over two spans, and its six lowest modes."""
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "middle": mp.Interface(near=(6.0, 0, 0), kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    held = clamp(mp.assemble(beam_mesh(20), {"beam": spinup_section()}, ends))
    w2, Phi, _ = lowest_modes(held.K_ii, held.M_ii, 6)
    return held, w2, Phi


def ends_of(held):
    """Inputs B (n_i, 18) of 1 N on the tip (moments over 10 m) and of accelerations times the mass of 12 kg."""
    m, size = 12.0, 10.0
    tip = held.expand(np.eye(held.K_ii.shape[0]))[np.searchsorted(held.model.free, held.model.interfaces[2].dofs)].T
    Psi_full = np.zeros((held.K.shape[0], len(held.b)))
    Psi_full[held.b, np.arange(len(held.b))], Psi_full[held.i] = 1.0, held.Psi
    base = (held.M @ Psi_full)[held.i]
    turn = np.repeat([1.0, size], 3)
    return np.hstack([base / np.tile(turn, 2) / m, tip * turn])


def test_shares_are_the_gramians(mixed):
    """Lyapunov's equation for all modes at once, in states (w q, q'), equal damping."""
    held, w2, Phi = mixed
    w, zero = np.sqrt(w2), np.zeros((6, 6))
    zeta = 1e-3
    A = np.block([[zero, np.diag(w)], [-np.diag(w), -2 * zeta * np.diag(w)]])
    B = np.vstack([np.zeros((6, 18)), Phi.T @ ends_of(held)])
    C = np.hstack([(ends_of(held).T @ Phi) / w, np.zeros((18, 6))])
    control, observe = solve_continuous_lyapunov(A, -B @ B.T), solve_continuous_lyapunov(A.T, -C.T @ C)
    found = interface_shares(fixed_coupling(held, Phi), w2)
    for share, gramian in zip(found, (control, observe), strict=True):
        energy = np.diag(gramian)[:6] + np.diag(gramian)[6:]
        np.testing.assert_allclose(share, energy / energy.max(), rtol=1e-5)  # 2 zeta^2 of the observability


def compare(shares, peaks):
    """Peak of mode k = twice the root of the product of its gramians; the others answer some zeta of it."""
    product = np.sqrt(shares[0] * shares[1])
    np.testing.assert_allclose(product / product.max(), np.array(peaks) / max(peaks), rtol=1e-3, atol=50 * ZETA)


def test_their_product_is_the_peak_of_the_transfer_function(mixed):
    """Solve ``(K (1 + 2 i zeta) - w^2 M) x = B`` at each resonance, without modes."""
    held, w2, Phi = mixed
    B = ends_of(held)
    peaks = []
    for s in w2:
        A = (held.K_ii * (1 + 2j * ZETA) - s * held.M_ii).tocsc()
        peaks.append(np.linalg.norm(B.T @ splu(A).solve(B.astype(complex))))
    compare(interface_shares(fixed_coupling(held, Phi), w2), peaks)


def test_cantilever_by_closed_form():
    """Base motion across and about its root, 12 kg, no free interface: ``l^2 = (m_eff / m + I_eff / (m L^2)) / m``."""
    section = spinup_section(theory="euler-bernoulli")
    model = mp.assemble(beam_mesh(40), {"beam": section}, {"root": mp.Interface(group="root", kind="node")})
    held = clamp(model)
    w2, Phi = (x[..., [0, 2, 4]] for x in lowest_modes(held.K_ii, held.M_ii, 5)[:2])  # those in the x-y plane
    mass = effective_masses(3)[0]
    inertia = (2 / cantilever_roots(3) ** 2) ** 2  # (int rho A x phi)^2 = 4 m L^2 / beta^4
    strength, beta = mass + inertia, cantilever_roots(3)
    control, observe = interface_shares(fixed_coupling(held, Phi), w2)
    np.testing.assert_allclose(control, (strength / beta**2) / (strength / beta**2)[0], rtol=2e-3)
    np.testing.assert_allclose(observe, (strength / beta**6) / (strength / beta**6)[0], rtol=2e-3)


def test_floating_body_by_its_transfer_function():
    model = cantilever_model(12, tip="fixed")
    K, M = ((model.C.T @ A @ model.C).tocsc() for A in (model.K, model.M))
    w2, Phi, _ = lowest_modes(K.tocsr(), M.tocsr(), 12, shift=-1.0)
    w2, Phi = w2[6:], Phi[:, 6:]
    B = np.zeros((model.n_dof, 12))
    B[np.concatenate([f.dofs for f in model.interfaces]), np.arange(12)] = np.tile(np.repeat([1.0, 10.0], 3), 2)
    peaks = [np.linalg.norm(B.T @ splu(K * (1 + 2j * ZETA) - s * M).solve(B.astype(complex))) for s in w2]
    compare(interface_shares(free_coupling(model, Phi), w2), peaks)


def test_selection_by_them():
    held = clamp(cantilever_model(20))
    w2, Phi, _ = lowest_modes(held.K_ii, held.M_ii, 8)
    shares = interface_shares(fixed_coupling(held, Phi), w2)
    for name, share, kept in zip(("controllability", "observability"), shares, (5, 3), strict=True):
        limit = np.sort(share)[-kept] * (1 - 1e-6)
        table = mp.craig_bampton(held.model, modes=8, keep=f"{name} > {limit}", truncation=()).table
        assert table.kept.sum() == kept
        assert table.kept.tolist() == (share > limit).tolist()
        assert table.reason[int(share.argmax())].startswith(f"{name} 100% > ")


def test_scale_of_the_model_does_not_matter():
    """The same beam in mm (a length unit misread) has the same shares: moments count times the size."""
    found = []
    for unit in (1.0, 1e-3):
        section = spinup_section(A=4e-4 * unit**2, Iy=8e-7 * unit**4, Iz=2e-7 * unit**4, J=5e-7 * unit**4)
        ends = {"root": mp.Interface(group="root", kind="node"),
                "tip": mp.Interface(group="tip", kind="node", boundary="free")}  # fmt: skip
        held = clamp(mp.assemble(beam_mesh(10, 10.0 * unit), {"beam": section}, ends))
        w2, Phi, _ = lowest_modes(held.K_ii, held.M_ii, 5)
        found.append(interface_shares(fixed_coupling(held, Phi), w2))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-6)


def test_free_interface_modes_have_static_shares_and_no_effective_mass():
    """Shares of all modes in the energy of a load add up to one: here of the tip force across, the largest."""
    model = cantilever_model(6, tip="fixed")
    kept = free_interface(model, modes=30, keep="static > 20%").table
    assert kept.kept[:2].all()
    assert not kept.kept[:30].all()
    assert kept.reason[0].startswith("static share")
    with pytest.raises(mp.InputError, match="these modes have no effective_mass"):
        free_interface(model, modes=3, keep="effective_mass > 1%")
