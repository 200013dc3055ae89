"""Buckling and prestressed modes of full models against closed forms."""

import numpy as np
import pytest
from scipy.optimize import brentq

import modalprep as mp
from modalprep.examples import beam_mesh, cantilever_model, spinup_section

EI, L = 1.4e4, 10.0
EULER = np.pi**2 * EI / (4 * L**2)


def test_euler_loads_of_a_cantilever():
    """Modes 1, 3, 5 quarter waves in the soft plane; the stiff plane has four times the load."""
    model = cantilever_model(20)
    model = mp.assemble(beam_mesh(20), {"beam": spinup_section(shear=False)}, {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free")})  # fmt: skip
    found = mp.buckling(model, mp.interface_load(model, "tip", force=(-1.0, 0, 0)), 3)
    np.testing.assert_allclose(found.value / EULER, [1.0, 4.0, 9.0], rtol=1e-4)  # cubic elements: (k h)^4
    assert found.shape.shape == (model.n_dof, 3)


def test_factor_times_load_is_what_matters():
    model = cantilever_model()
    one, ten = (mp.buckling(model, mp.interface_load(model, "tip", force=(-f, 0, 0))).value[0] for f in (1.0, 10.0))
    assert one == pytest.approx(10 * ten, rel=1e-9)


def test_lateral_torsional_buckling():
    """Cantilever, tip load across its stiff plane: P = 4.013 sqrt(EI GJ) / L^2 (Timoshenko and Gere, 6.3)."""
    section = spinup_section(A=4e-3, Iy=1e-4, Iz=2e-7, J=5e-7, shear=False)
    model = mp.assemble(beam_mesh(32), {"beam": section}, {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free")})  # fmt: skip
    found = mp.buckling(model, mp.interface_load(model, "tip", force=(0, 0, -1.0))).value[0]
    exact = 4.013 * np.sqrt(7e10 * 2e-7 * 2.5e10 * 5e-7) / L**2
    assert found == pytest.approx(exact, rel=2e-3)  # EIz << EIy adds 1e-3


def loaded_cantilever(N, rho_A=1.2):
    """First frequency (rad/s) of a clamped beam with an axial force N that keeps its direction.

    ``w = A (cosh ax - cos bx) + B (sinh ax - a/b sin bx)`` with ``a^2 - b^2 = N / EI``, ``a b = w sqrt(rho A / EI)``;
    at the tip no moment and ``EI w_xxx = N w_x``.
    """

    def determinant(w):
        root = np.sqrt((N / EI) ** 2 / 4 + rho_A * w**2 / EI)
        a, b = np.sqrt(root + N / EI / 2), np.sqrt(root - N / EI / 2)
        ch, sh, c, s = np.cosh(a * L), np.sinh(a * L), np.cos(b * L), np.sin(b * L)
        second = (a**2 * ch + b**2 * c, a**2 * sh + a * b * s)
        slope = (a * sh + b * s, a * ch - a * c)
        third = (a**3 * sh - b**3 * s, a**3 * ch + a * b**2 * c)
        tip = [third[k] - N / EI * slope[k] for k in range(2)]
        return (second[0] * tip[1] - second[1] * tip[0]) / ch**2

    return brentq(determinant, 1e-3, 10.0 if N > 0 else 3.7)


@pytest.mark.parametrize("share", [-0.5, 0.5, 3.0])
def test_frequency_of_a_loaded_column(share):
    model = mp.assemble(beam_mesh(20), {"beam": spinup_section(shear=False)}, {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free")})  # fmt: skip
    load = mp.interface_load(model, "tip", force=(share * EULER, 0, 0))
    first = 2 * np.pi * mp.prestressed_modes(model, load, 2).value[0]
    assert first == pytest.approx(loaded_cantilever(share * EULER), rel=1e-3)  # rotary inertia of the section: 2e-4


def test_gravity_buckles_a_tall_column():
    """Greenhill: q L^3 / EI = 7.837 for a column under its own weight."""
    model = cantilever_model(20)
    found = mp.buckling(model, mp.acceleration_load(model, (-1.0, 0, 0))).value[0]
    assert found * 1.2 * L**3 / EI == pytest.approx(7.837, rel=2e-3)


def test_what_cannot_buckle_says_so():
    model = cantilever_model()
    pull = mp.interface_load(model, "tip", force=(1.0, 0, 0))
    with pytest.raises(mp.InputError, match="only stiffens"):
        mp.buckling(model, pull)
    with pytest.raises(mp.InputError, match="buckles under this load"):
        mp.prestressed_modes(model, -1.01 * EULER * pull)
    with pytest.raises(mp.InputError, match="one per DOF"):
        mp.buckling(model, np.ones(3))
    with pytest.raises(mp.InputError, match="no interface 'top'"):
        mp.interface_load(model, "top")


def test_sparse_and_dense_solvers_agree(monkeypatch):
    from modalprep.reduction import prestress

    model = cantilever_model(30)
    load = mp.interface_load(model, "tip", force=(-1.0, 0, 0))
    dense = mp.buckling(model, load, 3).value
    monkeypatch.setattr(prestress, "DENSE", 0)
    np.testing.assert_allclose(mp.buckling(model, load, 3).value, dense, rtol=1e-9)
