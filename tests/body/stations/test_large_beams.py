"""Beams of one body with stations: far bent in statics and in motion, against exact rods and published motions."""

import numpy as np
import pytest
from beam_series import LENGTH, UNIT
from body.stations.statics import bent, equilibrium, line_body
from elastica import Elastica
from scipy.special import ellipe, ellipk
from systems.beams.test_segmented_beams import SLEW, STIFF
from systems.elastic_rod import rod_tip

import modalprep as mp
from modalprep.examples import cantilever_model
from modalprep.multibody import TimeFunction


def line(length, elements=40):
    return np.linspace([0.0, 0, 0], [length, 0, 0], elements + 1)


def section(E, A, Iy, Iz, J, **material):
    return mp.Beam(material=mp.Material(E=E, **material), A=A, Iy=Iy, Iz=Iz, J=J, theory="euler-bernoulli")


@pytest.fixture(scope="module")
def princeton():
    """The aluminium strip of Dowell and Traybar (1975), and its GJ, EI_y, EI_z."""
    E, h, t, nu = 71.7e9, 12.3777e-3, 3.2024e-3, 0.31
    weak, strong = h * t**3 / 12, t * h**3 / 12
    J = 0.198 * (weak + strong)
    body = line_body(line(0.508), section(E, h * t, weak, strong, J, nu=nu, rho=2800.0))
    return body, (E / (2 + 2 * nu) * J, E * weak, E * strong)


@pytest.mark.parametrize("degrees", [30, 60, 90])
def test_princeton_beam(princeton, degrees):
    """Bent in two planes and twisted by 8.896 N, by .15 to .29 of its length: the rod's differential equations."""
    body, bending = princeton
    force = [0.0, *(8.896 * f(np.radians(degrees)) for f in (np.cos, np.sin))]
    tip, _ = equilibrium(body, force=force)
    np.testing.assert_allclose(tip, rod_tip(0.508, force, bending=bending), atol=1e-4 * 0.508)


@pytest.mark.parametrize("degrees", [60, 120])
def test_column_beyond_its_buckling(degrees):
    """Euler's elastica: end slope a, ``P L^2 / EI = K^2``, tip at ``2 E / K - 1``, ``2 k / K``, ``k = sin(a / 2)``."""
    body = line_body(line(1.0), section(1e10, 1e-3, 1e-8, 4e-8, 2e-8, nu=0.3, rho=1000.0))
    k = np.sin(np.radians(degrees) / 2)
    K, E = ellipk(k**2), ellipe(k**2)
    tip, _ = equilibrium(body, force=(-100 * K**2, 0, 1e-3 * K**2))  # a breath of force aside
    np.testing.assert_allclose(tip, [2 * E / K - 1, 0, 2 * k / K], atol=7e-4)


@pytest.fixture(scope="module")
def frame():
    """Two legs of half a metre, EI = 100, GJ = 77 N m^2, with a right angle between them."""
    points = line(1.0, 48)
    points[24:, 1] = points[24:, 0] - 0.5
    points[24:, 0] = 0.5
    return line_body(points, section(1e10, 1e-3, 1e-8, 1e-8, 2e-8, nu=0.3, rho=1000.0))


@pytest.mark.parametrize("force", [(0, 0, 300.0), (0, -150.0, 150.0), (150.0, 0, 0)])
def test_right_angle_frame(frame, force):
    """Out of its plane by half the length of both legs, obliquely, and within the plane."""
    tip, _ = equilibrium(frame, force=force)
    exact = rod_tip(1.0, force, bending=(100 / 1.3, 100.0, 100.0), corner=True)
    np.testing.assert_allclose(tip, exact, atol=3e-4)


def test_spin_up_at_half_the_time():
    """The beam of Simo and Vu-Quoc, 6 rad/s in 7.5 s: its tip lags by 1.19 m of 10 m; to 5e-4 of that."""
    rise = 7.5
    law = TimeFunction(f"6/{rise}*(t**2/2 + ({rise}/(2*pi))**2*(cos(2*pi*t/{rise}) - 1))")

    def drive(t):
        turn = 2 * np.pi * t / UNIT / rise
        return 6 * (turn - np.sin(turn)) / (2 * np.pi) / UNIT, 6 / rise * (1 - np.cos(turn)) / UNIT**2

    hub = mp.Joint(name="hub", type="revolute", parent="ground", child="body", motion=law)
    system = mp.System(bodies={"body": bent(cantilever_model(40), 4, 8, 3)}, joints=(hub,))
    run = mp.simulate(system, t_end=6.0, output_step=0.5, rtol=1e-6, method="rosenbrock")
    beam = Elastica()
    q = beam.motion(run.time * UNIT, np.zeros(5), drive)
    exact = LENGTH * np.array([beam.tip(each) for each in q])
    assert exact[:, 1].min() < -1.1
    found = run["body.tip.deflection"][:, :2] + [LENGTH, 0]
    np.testing.assert_allclose(found, exact, atol=1e-3)


def test_slew_of_a_soft_beam():
    """Geometrically exact beam, which bends by more than its length: one body within .1 %, in 2000 evaluations."""
    law = TimeFunction([(2, "pi/2*(t/2 - sin(pi*t)/(2*pi))"), (np.inf, "pi/2")])
    hub = mp.Joint(name="hub", type="revolute", parent="ground", child="body", motion=law)
    soft = section(1e10, 1e-2, 1.4e-8, 1.4e-8, 2.8e-8, nu=0.3, rho=120.0)
    body = line_body(line(10.0), soft, modes=6, stations=32, derivatives=3)
    system = mp.System(bodies={"body": body}, joints=(hub,))
    run = mp.simulate(system, t_end=5.0, output_step=1.0, method="rosenbrock")
    np.testing.assert_allclose(run["body.tip.position"][1:, :2], SLEW, atol=1e-3 * 10)
    assert run.stats["evaluations"] < 3000


def test_flying_spaghetti():
    """EI = 500 N m^2, rotary inertia of 10 kg m at the nodes: both ends after 2.5 s within .15 % of the length."""
    n, E, rotary = 40, 1e6, 100.0
    J = rotary / n
    masses = {name: mp.PointMass(mass=0.0, inertia=(2 * x, x, x, 0, 0, 0)) for name, x in (("in", J), ("end", J / 2))}
    nodes = {"in": {"vertex": np.arange(1, n)}, "end": {"vertex": np.array([0, n])}}
    mesh = mp.fe.Mesh(
        points=line(10.0),
        cells={"line": np.stack([np.arange(n), np.arange(1, n + 1)], axis=1), "vertex": np.arange(n + 1)[:, None]},
        groups={"rod": {"line": np.arange(n)}, **nodes},
    )
    rod = mp.Beam(material=mp.Material(E=E, nu=0.0, rho=100.0), A=0.01, Iy=0.05, Iz=5e-4, J=0.05, ky=2.0, kz=2.0)
    ends = {"root": mp.Interface(node=1, kind="node"), "tip": mp.Interface(node=n + 1, kind="node", boundary="fixed")}
    body = bent(mp.assemble(mesh, {"rod": rod, **masses}, ends), modes=8, derivatives=3)
    place = {"second_axis": (1, 0, 0), "displacement": (6.0, 0.0), "angle": float(np.arctan2(8, -6))}
    joint = mp.Joint(name="flight", type="planar", parent="ground", child="body", **place)
    push = mp.PointForce(name="push", at="body.root", force=np.array([8.0, 0, 0]), torque=np.array([0, 0, -80.0]))
    system = mp.System(bodies={"body": body}, joints=(joint,), loads=(push,))
    run = mp.simulate(system, t_end=2.5, output_step=2.5, method="rosenbrock")
    found = np.hstack([run["body.root.position"][-1, :2], run["body.tip.position"][-1, :2]])
    np.testing.assert_allclose(found, STIFF, atol=1.5e-3 * 10)
    np.testing.assert_allclose(run["momentum.linear"][-1, :2], [20, 0], atol=2e-3)
