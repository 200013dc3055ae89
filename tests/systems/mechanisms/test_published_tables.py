"""Blades, cables, columns, deep beams and falling chains: published tables and closed forms without a pipeline file."""

import numpy as np
import pytest
from analytic import timoshenko_cantilever, timoshenko_simply_supported
from beam_series import blade
from scipy.linalg import eigh
from scipy.optimize import fsolve
from systems.planar_chain import Chain
from systems.segments import cantilever, frequencies
from systems.shipped import shipped

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.examples import beam_mesh, spinup_section, uniform_beam
from modalprep.fe.mesh.mesh import Mesh

UNIT = np.sqrt(1.4e4 / (1.2 * 10.0**4))  # sqrt(EI / (mu L^4)) of the spin-up beam, rad/s
ENDS = {name: mp.Interface(group=name, kind="node") for name in ("root", "tip")}


def body_of(section, elements=40, length=10.0, modes=16):
    model = mp.assemble(beam_mesh(elements, length), {"beam": section}, {"root": ENDS["root"]})
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes, truncation=("inertia",)), name="beam")


# ---- rotating blades ----


@pytest.fixture(scope="module")
def body():
    return body_of(spinup_section(theory="euler-bernoulli", Iy=2e-4, J=2e-4))  # stiff out of the x-y plane


@pytest.mark.parametrize("gamma", [1, 2, 4, 6, 8, 10, 12])
def test_blade_on_a_hub(body, gamma):
    """A hub as long as the blade, whose root accelerates towards the axis; 40 elements of constant axial force.

    Two flap frequencies (spin about y) and the first of lag (about z) against the Ritz series, which has the published
    frequencies of blades without hub and with a tip mass (tests/body/test_body.py).
    """
    flap = blade(gamma, hub=1.0)[:2]
    pull = np.array([-((gamma * UNIT) ** 2) * 10.0, 0, 0])
    for axis, expected in (([0, 1, 0], flap), ([0, 0, 1], np.sqrt(flap[:1] ** 2 - gamma**2))):
        found = mp.multibody.spin_modes(body, gamma * UNIT * np.array(axis), pull).frequency * 2 * np.pi / UNIT
        np.testing.assert_allclose(found[: len(expected)], expected, rtol=1e-3)


# angle in degrees: measured frequencies, Hz, at 0, 500, 750 rpm, as the test "rotating" of GXBeam.jl prints them; the
# experiment is attributed to Epps and Chandra, whose paper was not at hand
SWEPT = {
    0: ([1.4, 10.2, 14.8], [10.3, 25.2, 36.1], [27.7, 47.0, 62.9]),
    15: ([1.8, 10.1, 14.4], [10.2, 25.2, 34.8], [27.2, 44.4, 55.9]),
    30: ([1.7, 10.2, 14.9], [10.4, 23.7, 30.7], [26.6, 39.3, 48.6]),
    45: ([1.6, 10.2, 14.7], [10.4, 21.6, 26.1], [24.8, 35.1, 44.8]),
}
INCH, PSI, SLUG = 0.0254, 6894.757, 0.45359237 * 386.0886  # kg of one lbf s^2 / in


@pytest.mark.parametrize("sweep", SWEPT)
def test_swept_tip_of_a_blade(sweep):
    """Within 10 % of the measurement, as the beam codes of the literature are."""
    angle, b, t = np.radians(sweep), 1.0 * INCH, 0.063 * INCH
    straight, tip = np.linspace(0, 31.5, 22)[:, None] * [INCH, 0], np.linspace(0, 6, 5)[1:, None]
    line = np.vstack([straight, straight[-1] + INCH * tip * [np.cos(angle), -np.sin(angle)]])
    points = np.column_stack([line, np.zeros(len(line))])
    n = len(points) - 1
    cells = {"line": np.column_stack([np.arange(n), np.arange(1, n + 1)]), "vertex": np.array([[0]])}
    groups = {"beam": {"line": np.arange(n)}, "root": {"vertex": np.array([0])}}
    mesh = Mesh(points=points, cells=cells, groups=groups)
    material = mp.Material(E=1.06e7 * PSI, nu=0.325, rho=2.51e-4 * SLUG / INCH**3)
    section = mp.Beam(material=material, A=b * t, Iy=b * t**3 / 12, Iz=t * b**3 / 12, J=b * t**3 / 3, up=(0, 0, 1))
    model = mp.assemble(mesh, {"beam": section}, {"root": ENDS["root"]})
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=12, truncation=("inertia",)), name="blade")
    for k, rpm in enumerate((0, 500, 750)):
        spin = rpm * np.pi / 30
        found = mp.multibody.spin_modes(
            body, np.array([0, 0, spin]), np.array([-(spin**2) * 2.5 * INCH, 0, 0])
        ).frequency
        for measured in SWEPT[sweep]:
            if measured[k] > 2:  # the first at rest is given with two digits, and without its clamp
                assert np.abs(found / measured[k] - 1).min() < 0.1


@pytest.mark.parametrize("gamma", [3, 6, 12])
def test_blade_with_a_tip_mass_in_steady_spin(gamma, tmp_path):
    """The Ritz series, and without the stiffness of the joint's force; axial force constant in 40 elements."""
    system, _ = shipped("rotor-tip-mass", tmp_path)
    rotor = system.joints[0].with_(motion=mp.multibody.TimeFunction(f"{gamma * UNIT}*t"))
    system = system.with_(joints=(rotor, *system.joints[1:]), loads=())
    whole = system.bodies["blade"]
    bare = whole.with_(Kg_F=0 * whole.Kg_F, Kg_T=0 * whole.Kg_T)
    for body, carried in ((whole, 1.0), (bare, 0.0)):
        expected = blade(gamma, tip_mass=1.0, carried=carried)[0]
        each = system.with_(bodies=system.bodies | {"blade": body})
        rest = mp.static_equilibrium(each, steady=True)
        found = mp.system_modes(each, rest.y).frequency * 2 * np.pi / UNIT
        assert found[np.abs(found - expected).argmin()] == pytest.approx(expected, rel=3e-3)


def test_spinning_cable(tmp_path):
    """Out of the plane ``Omega sqrt(k (2 k - 1))``; the first for any number of rods, the others of order two."""
    hub = '[bodies.hub]\nmass = 1.0\n[joints.hub]\ntype = "revolute"\nchild = "hub.root"\nmotion = "t"'
    more = 'parent = "hub.root"\nroot = { stiffness = [1e3, 0.0] }\n' + hub
    found = [frequencies(cantilever(tmp_path, n, EI="[1e-12, 1e3]", more=more))[:3] for n in (20, 40)]
    exact = np.sqrt([1.0, 6.0, 15.0])
    np.testing.assert_allclose([row[0] for row in found], 1.0, rtol=1e-6)
    np.testing.assert_allclose(found[1], exact, rtol=4e-3)
    np.testing.assert_allclose((4 * found[1] - found[0]) / 3, exact, rtol=2e-4)


# ---- columns and deep beams ----


def beck():
    """``P L^2 / EI`` at which two frequencies of a column under a follower force meet: Beck (1952), 20.05.

    ``f = P^2 + 2 w^2 (1 + cosh a cos b) + P w sinh a sin b`` vanishes with its derivative in w.
    """

    def f(P, w):
        size = np.sqrt(P**2 / 4 + w**2)
        a, b = np.sqrt(size - P / 2), np.sqrt(size + P / 2)
        return P**2 + 2 * w**2 * (1 + np.cosh(a) * np.cos(b)) + P * w * np.sinh(a) * np.sin(b)

    return fsolve(lambda z: [f(*z), (f(z[0], z[1] + 1e-4) - f(z[0], z[1] - 1e-4)) / 2e-4], [20.0, 11.0])[0]


def test_flutter_of_a_column_under_a_follower_force():
    """Shear of the spin-up beam and 40 elements leave 2e-3."""
    critical = beck()
    assert critical == pytest.approx(20.05, abs=5e-3)  # Beck, Z. angew. Math. Phys. 3 (1952) 225
    clamp = mp.Joint(name="clamp", type="weld", parent="ground", child="beam")

    def growth(P):
        push = mp.PointForce(name="push", at="beam.tip", force=(-P * 1.4e4 / 100, 0, 0), axes="body")
        column = mp.System(bodies={"beam": uniform_beam(modes=10)}, joints=(clamp,), loads=(push,))
        rest = mp.static_equilibrium(column)
        return mp.system_modes(column, rest.y).eigenvalue.real.max() / UNIT

    assert growth(critical * 0.995) < 1e-5
    assert growth(critical * 1.005) > 0.1


@pytest.mark.parametrize("ratio", [0.01, 0.02, 0.05, 0.1])
def test_cantilever_that_shears(ratio):
    """Radius of gyration over length from 0.01 to 0.1: first three frequencies of Timoshenko's theory."""
    material = mp.Material(E=1.0, nu=0.3, rho=1.0)
    section = mp.Beam(material=material, A=1.0, Iy=100 * ratio**2, Iz=ratio**2, J=100 * ratio**2, ky=5 / 6, kz=5 / 6)
    body = body_of(section, elements=80, length=1.0, modes=24)
    found = 2 * np.pi * body.frequency / ratio
    exact = timoshenko_cantilever(3, E=1.0, G=material.G, k=5 / 6, rho=1.0, A=1.0, I=ratio**2, L=1.0) / ratio
    near = [found[np.abs(found - each).argmin()] for each in exact]
    np.testing.assert_allclose(near, exact, rtol=2e-3)  # order h^2, the third at 0.1 worst


def test_deep_simply_supported_beam():
    """Test FV5 of NAFEMS R0015 (10 m by 2 m by 2 m) to 1 %, Timoshenko's theory to the square of 40 elements."""
    material = mp.Material(E=200e9, nu=0.3, rho=8000.0)
    section = mp.Beam(material=material, A=4.0, Iy=4 / 3, Iz=4 / 3, J=8 / 3, ky=5 / 6, kz=5 / 6)
    model = mp.assemble(beam_mesh(40, 10.0), {"beam": section}, {"root": ENDS["root"]})
    ends = np.argsort(mesh_x(model))[[0, -1]]
    held = [*model.dof[ends[0], :4], *model.dof[ends[1], 1:3]]
    free = np.setdiff1d(np.arange(model.n_dof), held)
    K, M = (A.toarray()[np.ix_(free, free)] for A in (model.K, model.M))
    found = np.sqrt(np.abs(eigh(K, M, eigvals_only=True, subset_by_index=(0, 8)))) / (2 * np.pi)
    published = [42.649, 42.649, 77.542, 125.0, 148.31, 148.31, 233.10, 284.55, 284.55]
    np.testing.assert_allclose(found, published, rtol=1e-2)
    exact = timoshenko_simply_supported(3, E=200e9, G=material.G, k=5 / 6, rho=8000.0, A=4.0, I=4 / 3, L=10.0)
    np.testing.assert_allclose(found[[0, 4, 7]], exact / (2 * np.pi), rtol=2e-3)


def mesh_x(model):
    return model.points[:, 0]


# ---- falling chains ----


@pytest.mark.parametrize("links", [1, 2, 5, 20])
def test_chain_that_falls(links):
    """Links of 1 m and 1 kg, released level: tip after 0.5 and 1 s by Lagrange's equations in absolute angles."""
    ends = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
    rod = rigid_body("rod", mass=1.0, centre=ends["tip"] / 2, inertia=np.eye(3) / 12, interfaces=ends)
    joints = tuple(
        mp.Joint(name=f"j{i}", type="revolute", parent=f"r{i - 1}.tip" if i else "ground", child=f"r{i}")
        for i in range(links)
    )
    bodies = {f"r{i}": rod for i in range(links)}
    system = mp.System(bodies=bodies, joints=joints, gravity=np.array([0, -9.81, 0]))
    run = mp.simulate(system, t_end=1.0, output_step=0.5, rtol=1e-10, atol=1e-12, method="explicit")
    chain = Chain(links, float(links), float(links), gravity=9.81)
    expected = chain.tip(chain.motion([0.5, 1.0], rtol=1e-10))
    np.testing.assert_allclose(run[f"r{links - 1}.tip.position"][1:, :2], expected, atol=1e-7 * links)


def test_plate_that_spins_below_its_first_frequency(tmp_path):
    """Ritz series of the plate, own computation: -0.011698 m at 14.835 s; the conventional theory -0.01208 m."""
    system, _ = shipped("spinup-plate", tmp_path)
    law = [(30.0, "1.25/30*(t**2/2 + (15/pi)**2*(cos(pi*t/15) - 1))"), (np.inf, "1.25*t - 18.75")]
    hub = system.joints[0].with_(motion=mp.multibody.TimeFunction(law))
    slow = system.with_(joints=(hub, *system.joints[1:]))
    for each, expected in ((slow, -0.011698), (slow.conventional(), -0.01208)):
        run = mp.simulate(each, t_end=30.0, output_step=0.05, rtol=1e-5, atol=1e-8)
        corner = run["plate.corner.deflection.z"]
        assert corner.min() == pytest.approx(expected, rel=5e-3)
        assert run.time[corner.argmin()] == pytest.approx(14.835, abs=0.3)  # flat: 1e-3 of the depth
