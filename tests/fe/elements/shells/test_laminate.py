"""Laminated shells against classical laminate theory and Navier's solutions with shear."""

from itertools import product

import numpy as np
import pytest
from analytic import laminate, navier_antisymmetric_cross_ply, navier_plate, off_axis_modulus
from size import some
from structured import free_dofs, frequencies, shell_model, surface

import modalprep as mp
from modalprep.fe.properties.materials import Orthotropic
from modalprep.fe.properties.properties import Ply, Shell

LINEAR, CURVED = ("triangle", "quad"), ("triangle6", "quad8", "quad9")
KINDS = (*LINEAR, *CURVED)
CARBON = Orthotropic(E1=140e9, E2=10e9, nu12=0.3, G12=5e9, G13=5e9, G23=3.3e9, rho=1600.0)
AXIS = (1.0, 0.0, 0.0)
QUARTER = np.pi / 2
ERROR = {"triangle": 2.7e-3, "quad": 5.6e-3}  # 24 x 24, up to three half waves; isotropic: 0.2 % and 0.5 %
ERROR |= dict.fromkeys(
    CURVED, 2.7e-3
)  # 10 x 10; all elements converge to frequencies of thick unsymmetric plates .1 to .3 % low


def section(angles, total):
    """Equal plies of CARBON at `angles` (rad), bottom first; also ABD, S of analytic.py and the inertia."""
    t = total / len(angles)
    shell = Shell(plies=tuple(Ply(material=CARBON, thickness=t, angle=a) for a in angles), axis=AXIS)
    ABD, S = laminate([(CARBON, t, a) for a in angles])
    return shell, ABD, S, (CARBON.rho * total, 0.0, CARBON.rho * total**3 / 12)


def rectangle(kind, n, shell, a=1.0, b=1.0, **options):
    n = 10 if n == 24 and kind in CURVED else n
    points, cells = surface(n, n, kind, **{"diagonal": "alternating", **options})
    return shell_model(points * (a, b, 1.0), cells, shell)


def sides(model, a, b):
    x, y = (model.points + model.origin)[:, :2].T
    return np.isclose(x, 0) | np.isclose(x, a), np.isclose(y, 0) | np.isclose(y, b)


def supported(model, a, b, *, tangential=True):
    """Simple supports: SS-1 holds the tangential in-plane displacement (Navier, cross-ply), SS-2 the normal one."""
    at_x, at_y = sides(model, a, b)
    return free_dofs(
        model,
        model.dof[at_x][:, [1 if tangential else 0, 2, 3]],
        model.dof[at_y][:, [0 if tangential else 1, 2, 4]],
    )


def lowest_navier(count, *args, **options):
    values = [navier_plate(*args, m, n, **options) for m in range(1, 6) for n in range(1, 6)]
    return np.sort(values)[:count]


CROSS_PLIES = [(0.0,), (0.0, QUARTER, 0.0), (0.0, QUARTER, QUARTER, 0.0)]


@pytest.mark.parametrize(("kind", "angles"), some(product(KINDS, CROSS_PLIES), 8))
def test_symmetric_plate_against_laminate_theory(kind, angles):
    """Specially orthotropic: ``omega = pi^2 sqrt((D11 p^4 + 2 (D12 + 2 D66) p^2 q^2 + D22 q^4) / rho h)``, p = m/a,
    q = n/b (Jones, Mechanics of Composite Materials, 2nd ed., chapter 5)."""
    a, b, t = 1.0, 0.7, 1e-3
    shell, ABD, _, inertia = section(angles, t)
    D = ABD[3:, 3:]
    waves = [(m / a, n / b) for m in range(1, 6) for n in range(1, 6)]
    exact = [
        np.pi**2 * np.sqrt((D[0, 0] * p**4 + 2 * (D[0, 1] + 2 * D[2, 2]) * p**2 * q**2 + D[1, 1] * q**4) / inertia[0])
        for p, q in waves
    ]
    model = rectangle(kind, 24, shell, a, b)
    found = frequencies(model, supported(model, a, b), 4)
    assert np.all(np.abs(found / np.sort(exact)[:4] - 1) < ERROR[kind])


@pytest.mark.parametrize(("kind", "slender"), some(product(KINDS, [100, 20]), 6))
def test_unsymmetric_cross_ply_against_navier(kind, slender):
    a, b = 1.0, 0.7
    shell, *theory = section((0.0, QUARTER), a / slender)
    model = rectangle(kind, 24, shell, a, b)
    found = frequencies(model, supported(model, a, b), 3)  # the fourth of the thick plate shears in its plane
    exact = lowest_navier(3, *theory, a, b)
    assert np.all(np.abs(found / exact - 1) < ERROR[kind])
    theory[0][:3, 3:] = theory[0][3:, :3] = 0
    assert lowest_navier(1, *theory, a, b)[0] > 1.3 * exact[0]  # the coupling is what is tested


@pytest.mark.parametrize("kind", KINDS)
def test_antisymmetric_angle_ply_against_navier(kind):
    a, b = 1.0, 0.7
    shell, *theory = section((np.pi / 4, -np.pi / 4), a / 100)
    model = rectangle(kind, 24, shell, a, b)
    found = frequencies(model, supported(model, a, b, tangential=False), 4)
    assert np.all(np.abs(found / lowest_navier(4, *theory, a, b, angle_ply=True) - 1) < ERROR[kind])


@pytest.mark.parametrize("kind", LINEAR)
def test_coupled_laminate_converges_with_order_two(kind):
    a, b = 1.0, 0.7
    shell, *theory = section((0.0, QUARTER), a / 100)
    exact, error = lowest_navier(1, *theory, a, b)[0], []
    for n in (8, 16):
        model = rectangle(kind, n, shell, a, b)
        error.append(abs(frequencies(model, supported(model, a, b), 1)[0] / exact - 1))
    assert np.log2(error[0] / error[1]) == pytest.approx(2.0, abs=0.2)


def test_references_of_laminates():
    """Thin: the closed form without shear. Thick: Reddy's table of FSDT, E1/E2 = 40, omega (a^2/h) sqrt(rho/E2)."""
    _, ABD, S, inertia = section((0.0, QUARTER), 1e-4)
    thin = navier_antisymmetric_cross_ply(ABD, inertia[0], 1.0, 0.7, 2, 1)
    assert navier_plate(ABD, S, inertia, 1.0, 0.7, 2, 1) == pytest.approx(thin, rel=1e-6)
    graphite = Orthotropic(E1=40.0, E2=1.0, nu12=0.25, G12=0.6, G13=0.6, G23=0.5, rho=1.0)
    printed = {(0, 90): 10.473, (45, -45): 13.044, (0, 90, 90, 0): 15.143}  # a/h = 10
    for angles, value in printed.items():
        stack = [(graphite, 0.1 / len(angles), np.radians(angle)) for angle in angles]
        found = navier_plate(*laminate(stack), (0.1, 0, 0.1**3 / 12), 1, 1, 1, 1, angle_ply=angles[0] == 45) / 0.1
        assert found == pytest.approx(value, abs=6e-4)


def constant_state(model, strain, curvature):
    """Displacements (n_dof,) of constant membrane strain and curvature (w,xx = -kx ...): bx = ry, by = -rx."""
    x, y = (model.points + model.origin)[:, :2].T
    kx, ky, kxy = curvature  # of bx,x  by,y  bx,y + by,x; thin: b = -grad w
    d = np.zeros(model.n_dof)
    columns = [
        strain[0] * x + strain[2] / 2 * y,
        strain[2] / 2 * x + strain[1] * y,
        -(kx * x**2 + ky * y**2 + kxy * x * y) / 2,
        -(ky * y + kxy / 2 * x),
        kx * x + kxy / 2 * y,
        0 * x,
    ]
    d[model.dof] = np.column_stack(columns)
    return d


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("angles", [(0.0, QUARTER), (np.pi / 4, -np.pi / 4), (0.3, 1.1, -0.4)])
def test_constant_states_carry_the_forces_of_the_laminate(kind, angles):
    """Patch test of A, B and D with their signs: forces and moments on the edge x = 1, equilibrium inside."""
    shell, ABD, *_ = section(angles, 0.02)
    model = rectangle(kind, 4, shell, distort=0.25)
    x, y = (model.points + model.origin)[:, :2].T
    inner = (x > 1e-9) & (x < 1 - 1e-9) & (y > 1e-9) & (y < 1 - 1e-9)
    for e, unit in enumerate(np.eye(6)):
        N, Mo = np.split(ABD @ unit, 2)
        force = model.K @ constant_state(model, unit[:3], unit[3:])
        end = model.dof[np.isclose(x, 1)]
        scale = np.sqrt(ABD[e, e] * np.array([ABD[0, 0], ABD[3, 3]]))
        np.testing.assert_allclose(force[end[:, :2]].sum(axis=0), N[[0, 2]], atol=1e-9 * scale[0])
        assert force[end[:, 4]].sum() == pytest.approx(Mo[0], abs=1e-9 * scale[1])  # Mx turns about y
        assert np.abs(force[model.dof[inner][:, :3]]).max() < 1e-9 * scale[0]
        assert np.abs(force[model.dof[inner][:, 3:]]).max() < 1e-9 * scale.max()
        assert constant_state(model, unit[:3], unit[3:]) @ force == pytest.approx(ABD[e, e], rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_mass_of_plies_of_two_densities(kind):
    """Lead below, carbon above: the mass centre lies below the mid-surface."""
    lead = mp.Material(E=16e9, nu=0.44, rho=11340.0)
    shell = Shell(plies=(Ply(material=lead, thickness=1e-3), Ply(material=CARBON, thickness=3e-3)), axis=AXIS)
    model = rectangle(kind, 3, shell, 0.5, 0.4, distort=0.25)
    area, below, above = 0.2, 11340.0 * 1e-3, 1600.0 * 3e-3
    assert model.rigid.m == pytest.approx(area * (below + above), rel=1e-13)
    assert model.rigid.s0[2] == pytest.approx(area * (below * -1.5e-3 + above * 0.5e-3), rel=1e-12)
    through = below * (1.5e-3**2 + 1e-6 / 12) + above * (0.5e-3**2 + 9e-6 / 12)
    assert model.rigid.E0[2, 2] == pytest.approx(area * through, rel=1e-12)
    assert [check.name for check in mp.body.check_model(model) if not check.passed] == []


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("degrees", [0, 30, 45, 90])
def test_off_axis_modulus(kind, degrees):
    """A strip pulled along x, free to shear and to contract; uniform strain, so any mesh is exact."""
    angle, t = np.radians(degrees), 1e-3
    one_ply, ABD, *_ = section((angle,), t)
    turned = Shell(material=CARBON, thickness=t, axis=AXIS, angle=angle)
    for shell in (one_ply, turned):
        model = rectangle(kind, 3, shell)
        strain = np.linalg.solve(ABD[:3, :3], [1.0, 0.0, 0.0])  # N_x = 1
        d = constant_state(model, strain, np.zeros(3))
        force = model.K @ d
        end = model.dof[np.isclose(model.points[:, 0] + model.origin[0], 1)]
        modulus = force[end[:, 0]].sum() / (t * strain[0])
        assert modulus == pytest.approx(off_axis_modulus(CARBON, angle), rel=1e-9)
        assert d @ force == pytest.approx(strain[0], rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_plies_of_one_isotropic_material_are_a_sheet(kind):
    steel = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
    plies = tuple(Ply(material=steel, thickness=t, angle=a) for t, a in ((1e-3, 0.3), (2e-3, -0.7), (1e-3, 1.0)))
    models = [rectangle(kind, 3, s, distort=0.25) for s in (Shell(plies=plies), Shell(material=steel, thickness=4e-3))]
    for name in ("K", "M"):
        laminated, sheet = (getattr(m, name) for m in models)
        assert abs(laminated - sheet).max() < 1e-12 * abs(sheet).max()


@pytest.mark.parametrize("kind", KINDS)
def test_orthotropic_with_equal_moduli_is_isotropic(kind):
    steel = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
    same = Orthotropic(E1=steel.E, E2=steel.E, nu12=steel.nu, G12=steel.G, G13=steel.G, G23=steel.G, rho=steel.rho)
    one, two = (rectangle(kind, 3, Shell(material=m, thickness=0.05, angle=0.4), distort=0.25) for m in (steel, same))
    assert abs(one.K - two.K).max() < 1e-12 * abs(one.K).max()


@pytest.mark.parametrize("kind", KINDS)
def test_bending_ratio_is_that_of_a_sandwich(kind):
    """Two faces of t/2 at the distance h: bending stiffness ``E t h^2 / 4`` against ``E t^3 / 12``."""
    steel, t, h = mp.Material(E=2.1e11, nu=0.3, rho=7800.0), 1e-3, 8e-3
    plain, sandwich = (
        rectangle(kind, 8, Shell(material=steel, thickness=t, bending_ratio=r, shear_ratio=5 / 6))
        for r in (1.0, 3 * (h / t) ** 2)
    )
    found = [frequencies(m, supported(m, 1, 1), 1)[0] for m in (plain, sandwich)]
    assert found[1] / found[0] == pytest.approx(np.sqrt(3) * h / t, rel=2e-3)  # shear of the stiffer one: below 1e-3
