"""Buckling and prestressed modes of full models against closed forms."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from strips import SURFACES, solids

import modalprep as mp
from modalprep.body.mass import affine_part, deflected
from modalprep.examples import beam_mesh, cantilever_model, spinup_section

EI, L = 1.4e4, 10.0
EULER = np.pi**2 * EI / (4 * L**2)


def test_euler_loads_of_a_cantilever():
    """Modes 1, 3, 5 quarter waves in the soft plane; the stiff plane has four times the load."""
    model = cantilever_model(20)
    model = mp.assemble(beam_mesh(20), {"beam": spinup_section(theory="euler-bernoulli")}, {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free")})  # fmt: skip
    found = mp.reduction.buckling(model, mp.reduction.interface_load(model, "tip", force=(-1.0, 0, 0)), 3)
    np.testing.assert_allclose(found.value / EULER, [1.0, 4.0, 9.0], rtol=1e-4)  # cubic elements: (k h)^4
    assert found.shape.shape == (model.n_dof, 3)


def test_factor_times_load_is_what_matters():
    model = cantilever_model()
    one, ten = (
        mp.reduction.buckling(model, mp.reduction.interface_load(model, "tip", force=(-f, 0, 0))).value[0]
        for f in (1.0, 10.0)
    )
    assert one == pytest.approx(10 * ten, rel=1e-9)


def test_lateral_torsional_buckling():
    """Cantilever, tip load across its stiff plane: P = 4.013 sqrt(EI GJ) / L^2 (Timoshenko and Gere, 6.3)."""
    section = spinup_section(A=4e-3, Iy=1e-4, Iz=2e-7, J=5e-7, theory="euler-bernoulli")
    model = mp.assemble(beam_mesh(32), {"beam": section}, {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free")})  # fmt: skip
    found = mp.reduction.buckling(model, mp.reduction.interface_load(model, "tip", force=(0, 0, -1.0))).value[0]
    exact = 4.013 * np.sqrt(7e10 * 2e-7 * 2.5e10 * 5e-7) / L**2
    assert found == pytest.approx(exact, rel=2e-3)  # EIz << EIy adds 1e-3


def right_angle_frame(thickness, rho, elements=16):
    """Two legs of 0.24 m, 30 mm wide in their plane, clamped at one end."""
    leg, width = np.linspace(0, 0.24, elements + 1), 0.03
    points = np.zeros((2 * elements + 1, 3))
    points[:, 0], points[elements:, 1] = np.minimum(np.arange(2 * elements + 1), elements) * leg[1], leg
    lines = np.stack([np.arange(2 * elements), np.arange(1, 2 * elements + 1)], axis=1)
    mesh = mp.fe.Mesh(
        points=points,
        cells={"line": lines, "vertex": np.array([[0], [2 * elements]])},
        groups={"legs": {"line": np.arange(2 * elements)}, "root": {"vertex": [0]}, "tip": {"vertex": [1]}},
    )
    section = mp.Beam(
        material=mp.Material(E=71.24e9, nu=0.31, rho=rho),
        A=width * thickness,
        Iy=width * thickness**3 / 12,
        Iz=thickness * width**3 / 12,
        J=width * thickness**3 / 3 * (1 - 0.63 * thickness / width),
    )
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    return mp.assemble(mesh, {"legs": section}, ends)


def test_right_angle_frame_buckles_sideways():
    """1.088 N (Argyris et al., 1979); the moment at the corner bends one leg and twists the other.

    Half a per cent: of the torsion constant the thin-strip formula w t^3 / 3 takes 1.3 % more.
    """
    frame = right_angle_frame(0.6e-3, 2700.0)
    assert mp.reduction.buckling(frame, mp.reduction.interface_load(frame, "tip", force=(1.0, 0, 0))).value[
        0
    ] == pytest.approx(1.088, rel=5e-3)


def test_modes_of_a_right_angle_frame():
    """11.2732 and 30.5269 Hz by published shells, whose corner is a plate."""
    frame = right_angle_frame(3e-3, 5000.0)
    found = mp.craig_bampton(frame, modes=2, truncation=()).frequency
    assert (np.abs(found / [11.2732, 30.5269] - 1) < [1e-3, 7e-3]).all()


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
    model = mp.assemble(beam_mesh(20), {"beam": spinup_section(theory="euler-bernoulli")}, {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free")})  # fmt: skip
    load = mp.reduction.interface_load(model, "tip", force=(share * EULER, 0, 0))
    first = 2 * np.pi * mp.reduction.prestressed_modes(model, load, 2).value[0]
    assert first == pytest.approx(loaded_cantilever(share * EULER), rel=1e-3)  # rotary inertia of the section: 2e-4


def test_gravity_buckles_a_tall_column():
    """Greenhill: q L^3 / EI = 7.837 for a column under its own weight."""
    model = cantilever_model(20)
    found = mp.reduction.buckling(model, None, gravity=(-1.0, 0, 0)).value[0]
    assert found * 1.2 * L**3 / EI == pytest.approx(7.837, rel=2e-3)


def test_long_thin_solids_buckle_as_a_strip():
    """800 x 20 x 1 mm under a tip force: 4.013 sqrt(EI GJ) / L^2; few digits gave 1.3 times, and a tenth."""
    surface, metal = SURFACES["straight"](0.02), mp.Material(E=70e9, nu=0.0, rho=2700.0)
    model = solids(surface, [(metal, 1e-3)], (40, 4), each=1)
    EI, GJ = metal.E * 0.02 * 1e-9 / 12, metal.G * 0.02 * 1e-9 / 3 * (1 - 0.63 / 20)
    found = mp.reduction.buckling(model, mp.reduction.interface_load(model, "tip", force=(0, 1.0, 0))).value[0]
    # the rigid end faces and the finite bending stiffness in the plane add 2 %
    assert found == pytest.approx(4.013 * np.sqrt(EI * GJ) / 0.8**2, rel=0.035)


def bent_arch(elements=24):
    """Beams bent to 60 degrees, radius .8 m, 60 x 30 mm."""
    a = np.linspace(0, np.pi / 3, elements + 1)
    line = np.stack([0.8 * np.sin(a), 0 * a, 0.8 * (1 - np.cos(a))], axis=1)
    metal = mp.Material(E=70e9, nu=0.3, rho=2700.0)
    section = mp.fe.beam_section("rectangle", metal, width=0.06, height=0.03, up=(0, 1, 0))
    ends = {"root": mp.Interface(group="root", kind="node")}
    ends["tip"] = mp.Interface(group="tip", kind="node", boundary="free")
    return mp.assemble(beam_mesh(elements).with_(points=line), {"beam": section}, ends)


def test_modes_of_a_loaded_arch_are_those_of_its_body():
    """The body has the second order of its modal mass, T; without it the shifts have another sign."""
    model, force = bent_arch(), np.array([-200.0, 0, 500.0])
    load = mp.reduction.interface_load(model, "tip", force=force)
    free, bent = (mp.reduction.prestressed_modes(model, f, 6).value for f in (0 * load, load))
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=30), name="arch", second_order_mass=True)
    K, q = np.diag(body.K) + np.tensordot(force, body.Kg_F[1], 1), force @ body.phi[1] / body.K

    def frequency(body):
        return np.sqrt(eigh(K, deflected(affine_part(body), q).M_ff, eigvals_only=True)[:6]) / (2 * np.pi)

    shift = bent - free
    np.testing.assert_allclose(frequency(body) - body.frequency[:6], shift, atol=0.01 * np.abs(shift).max())
    other = np.sqrt(eigh(K, eigvals_only=True)[:6]) / (2 * np.pi) - body.frequency[:6]
    assert np.abs(other - shift).max() > 0.3 * np.abs(shift).max()


def test_what_cannot_buckle_is_reported():
    model = cantilever_model()
    pull = mp.reduction.interface_load(model, "tip", force=(1.0, 0, 0))
    with pytest.raises(mp.InputError, match="only stiffens"):
        mp.reduction.buckling(model, pull)
    with pytest.raises(mp.InputError, match="buckles under this load"):
        mp.reduction.prestressed_modes(model, -1.01 * EULER * pull)
    with pytest.raises(mp.InputError, match="one per DOF"):
        mp.reduction.buckling(model, np.ones(3))
    with pytest.raises(mp.InputError, match="interface 'top' does not exist"):
        mp.reduction.interface_load(model, "top")


def test_sparse_and_dense_solvers_agree(monkeypatch):
    from modalprep.reduction import prestress

    model = cantilever_model(30)
    load = mp.reduction.interface_load(model, "tip", force=(-1.0, 0, 0))
    dense = mp.reduction.buckling(model, load, 3).value
    monkeypatch.setattr(prestress, "DENSE", 0)
    np.testing.assert_allclose(mp.reduction.buckling(model, load, 3).value, dense, rtol=1e-9)
