"""Tethers in orbit: shipped files, chains and rings made here, against closed forms and independent integrations."""

import numpy as np
import pytest
from numpy.polynomial import Legendre
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq
from systems.shipped import run_shipped, shipped

import modalprep as mp
from modalprep.multibody.model.environment import EARTH_MU, EARTH_RADIUS

N = 1.177977227e-3  # orbit of 220 km
TAU = [1, 2, 3, 5, 8, 10, 15, 20]


def run_of(name, folder):
    (run,) = run_shipped(name, folder).runs.values()
    return run


def at(run, tau):
    rows = [int(np.argmin(np.abs(run.time * N - t))) for t in tau]
    np.testing.assert_allclose(run.time[rows] * N, tau, atol=1e-7)
    return rows


def dumbbell(tau, y, c, k, d):
    """Massless dumbbell in a circular orbit, ``L' / L = c(tau)``, angles in the plane and across it, with thrusters.

    Lagrange's equations in the time N t with the gravity gradient to first order.
    """
    (a, b), (da, db), c = y[:2], y[2:], c(tau)
    qa, qb = -(k * a + d * da) / np.cos(b), -(k * b + d * db)
    dda = qa - 2 * (c - db * np.tan(b)) * (da + 1) - 3 * np.sin(a) * np.cos(a)
    ddb = qb - 2 * c * db - ((da + 1) ** 2 + 3 * np.cos(a) ** 2) * np.sin(b) * np.cos(b)
    return [da, db, dda, ddb]


def swing(c, tau, start=(0.0, 0.0), k=0.0, d=0.0):
    """Both angles (2, len(tau)) of the dumbbell from rest, rad."""
    y, law = [*start, 0.0, 0.0], (c, k, d)
    return solve_ivp(dumbbell, (0, tau[-1]), y, "DOP853", tau, args=law, rtol=1e-12, atol=1e-14).y[:2]


@pytest.fixture(scope="module")
def deployment(tmp_path_factory):
    return run_of("tether-deployment", tmp_path_factory.mktemp("deployment"))


UNIFORM = 2.0 / (1000.0 * N)  # 2 m/s of 1000 m, in the time N t


def uniform(tau):
    """``L' / L`` of a length that grows at a constant rate."""
    return UNIFORM / (1 + UNIFORM * tau)


def test_deployment_at_a_uniform_rate(deployment):
    """2e-5 degrees: steps are a fifteenth of a period long, and outputs are interpolated."""
    expected = np.degrees(swing(uniform, TAU)[0])
    np.testing.assert_allclose(np.degrees(deployment["uniform.angle.1"][at(deployment, TAU)]), expected, atol=2e-5)
    assert deployment.stats["energy_error"] < 1e-10


def test_deployment_at_an_exponential_rate(deployment, tmp_path):
    expected = np.degrees(swing(lambda tau: 0.25, TAU[:6])[0])
    np.testing.assert_allclose(
        np.degrees(deployment["exponential.angle.1"][at(deployment, TAU[:6])]), expected, atol=2e-5
    )
    late = np.degrees(deployment["exponential.angle.1"][deployment.time * N > 15])
    balance = -np.degrees(np.arcsin(4 * 0.25 / 3)) / 2  # sin 2 theta = -4 c / 3
    assert np.mean(late) == pytest.approx(balance, abs=0.05)  # what is left of the swing, e^-5 of 10 degrees
    system = reeled(shipped("tether-deployment", tmp_path)[0], "other_tether", 0.5)
    run = mp.simulate(system, t_end=10 / N, output_step=0.5 / N, rtol=1e-11, atol=1e-13)
    expected = np.degrees(swing(lambda tau: 0.5, TAU[:6])[0])
    np.testing.assert_allclose(np.degrees(run["exponential.angle.1"][at(run, TAU[:6])]), expected, atol=2e-5)


def reeled(system, tether, c):
    law = mp.multibody.TimeFunction(f"1000*exp({c * N}*t)")
    return system.with_(joints=tuple(j.with_(motion=law) if j.name == tether else j for j in system.joints))


def test_tension_of_a_deployed_tether(deployment):
    """T = m (L (phi'^2 + (theta' + n)^2 cos^2 phi + 3 n^2 cos^2 theta cos^2 phi - n^2) - L'')."""
    theta, rate = deployment["uniform.angle.1"], deployment["uniform.rate.1"]
    L = deployment["tether.displacement"]
    expected = 500 * L * ((rate + N) ** 2 + 3 * N**2 * np.cos(theta) ** 2 - N**2)
    np.testing.assert_allclose(-deployment["tether.drive"], expected, rtol=1e-9)
    assert np.abs(deployment["uniform.angle.2"]).max() < 1e-12


@pytest.fixture(scope="module")
def retrieval(tmp_path_factory):
    return run_of("tether-retrieval", tmp_path_factory.mktemp("retrieval"))


def test_retrieval_is_unstable(retrieval):
    rows = at(retrieval, TAU[:6])
    expected = np.degrees(swing(lambda tau: -0.25, TAU[:6], np.radians([5, 1])))
    assert expected[0, -1] > 90  # it falls over
    found = np.degrees([retrieval[f"swing.angle.{k}"][rows] for k in (1, 2)])
    np.testing.assert_allclose(found[:, :5], expected[:, :5], atol=2e-5)
    np.testing.assert_allclose(found[:, 5], expected[:, 5], atol=6e-3)  # what the instability makes of 2e-5


def test_retrieval_with_thrusters(retrieval):
    rows, expected = at(retrieval, TAU[:6]), swing(lambda tau: -0.25, TAU[:6], np.radians([5, 1]), k=2.0, d=2.5)
    np.testing.assert_allclose(retrieval["steered_swing.angle"][rows], expected.T, atol=1e-7)
    rest = brentq(lambda a: 1.5 * np.sin(2 * a) + 2 * a - 0.5, 0, 1)
    assert retrieval["steered_swing.angle.1"][-1] == pytest.approx(rest, abs=1e-3)
    assert retrieval["steered_tether.drive"].max() < -2.0  # taut by the axial thrust
    assert retrieval.stats["energy_error"] < 1e-8


def test_station_keeping(tmp_path):
    """theta'' + 2 l' + 3 theta = 0, l'' + 4 l' + 4 l = 2 theta', phi'' + 4 phi = 0 about the rest."""
    system, _ = shipped("tether-station-keeping", tmp_path)
    rest = mp.static_equilibrium(system)
    assert rest.joints["tether"][0] == pytest.approx(2e4, rel=1e-9)
    np.testing.assert_allclose(rest.joints["swing"], 0, atol=1e-12)
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-3, 0, 0, -2], [0, -4, 2, -4]])
    roots = np.linalg.eigvals(A)
    expected = np.sort([*roots[roots.imag >= 0].round(12), 2j])
    found = mp.system_modes(system, rest.y).eigenvalue / N
    np.testing.assert_allclose(np.sort(found.round(9)), expected, atol=1e-6)
    run = run_of("tether-station-keeping", tmp_path)
    assert np.abs(run["swing.angle.1"][run.time > 1.2e4]).max() < 0.01 < 0.3 < run["swing.angle.1"][0]
    assert run["tether.drive"].max() < 0
    assert -run["tether.drive"][-1] == pytest.approx(3 * 500 * N**2 * 2e4, rel=0.02)  # swinging across still


def chain(count, length, density, end, *, lumped=False, joint="revolute", orbit=None):
    """Tether up from the origin: rods, or massless ones with half their mass at each end."""
    step, m = length / count, density * length / count
    ends = {"root": np.zeros(3), "tip": np.array([step, 0, 0])}
    bodies, joints = {}, []
    for i in range(count):
        last = i == count - 1
        mass = (m / 2 if last else m) if lumped else m
        extra = end if last else 0.0
        far = lumped or mass == 0
        centre = step if far else (mass * step / 2 + extra * step) / (mass + extra)
        own = 0.0 if far else mass * (step**2 / 12 + (centre - step / 2) ** 2) + extra * (step - centre) ** 2
        bodies[f"r{i}"] = mp.rigid_body(f"r{i}", mass=mass + extra, centre=np.array([centre, 0, 0]),
                                        inertia=np.diag([1e-9, own + 1e-9, own + 1e-9]), interfaces=ends)  # fmt: skip
        second = {"second_axis": np.array([0, -1.0, 0])} if joint == "universal" else {}
        joints.append(mp.Joint(name=f"j{i}", type=joint, parent=f"r{i - 1}.tip" if i else "ground", child=f"r{i}",
                               **second))  # fmt: skip
    return mp.System(bodies=bodies, joints=tuple(joints), orbit=orbit or mp.multibody.Orbit(rate=N))


def frequencies(system):
    roots = np.linalg.eigvals(mp.linearise(system).A).imag / N
    return np.sort(roots[roots > 1e-3])


def pull(system):
    return mp.simulate(system, t_end=1.0, output_step=1.0)["j0.force.x"][0]


def test_tension_at_the_orbit():
    """``3 n^2 (m L + rho L^2 / 2)`` to first order of the field; and all of it."""
    light, heavy = 3 * N**2 * 500 * 1e5, 3 * N**2 * (500 * 1e5 + 5.6e-3 * 1e5**2 / 2)
    assert -pull(chain(1, 1e5, 0.0, 500.0)) == pytest.approx(light, rel=1e-9)
    for count in (1, 7):
        assert -pull(chain(count, 1e5, 5.6e-3, 500.0)) == pytest.approx(heavy, rel=1e-9)
    orbit = mp.multibody.Orbit.circular(EARTH_RADIUS + 220e3)  # the whole field: of a particle n^2 r - mu / r^2
    r = orbit.radius + 1e5
    particle = mp.rigid_body("m", mass=500.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    wall = mp.Joint(name="j0", type="weld", parent="ground", child="m", position=np.array([1e5, 0, 0]))
    found = -pull(mp.System(bodies={"m": particle}, joints=(wall,), orbit=orbit))
    assert found == pytest.approx(500 * (orbit.rate**2 * r - EARTH_MU / r**2), rel=1e-9)
    assert found < 0.99 * light


def test_libration_is_exact_whatever_the_rods():
    """In the plane sqrt(3) n, across it 2 n, and every other pair apart by n^2."""
    found = frequencies(chain(4, 1e5, 5.6e-3, 500.0, joint="universal"))
    inside, across = found[0::2], found[1::2]
    np.testing.assert_allclose([inside[0], across[0]], [np.sqrt(3), 2.0], rtol=1e-7)
    np.testing.assert_allclose(across**2 - inside**2, 1.0, rtol=1e-5)


def test_modes_of_a_tether_without_end_mass():
    """Odd Legendre functions, n sqrt(3 k (k + 1) / 2); rods converge with order 2."""
    k = np.array([1, 3, 5, 7])
    exact = np.sqrt(3 * k * (k + 1) / 2)
    errors = [frequencies(chain(count, 1e5, 5.6e-3, 0.0))[:4] / exact - 1 for count in (12, 24)]
    assert np.abs(errors[1]).max() < 0.02
    order = np.log2(np.abs(errors[0][1:] / errors[1][1:]))
    np.testing.assert_allclose(order, 2.0, atol=0.2)
    np.testing.assert_allclose(errors[1][0], 0, atol=1e-7)


def lumped_frequencies(count, ratio):
    """Point masses on a taut string, whose tension is all the pull beyond: tridiagonal; over n."""
    mass = np.full(count, 1 / count)
    mass[-1] = 0.5 / count + ratio
    tension = np.cumsum((3 * mass * np.arange(1, count + 1) / count)[::-1])[::-1] * count
    K = np.diag(tension + np.append(tension[1:], 0.0)) - np.diag(tension[1:], 1) - np.diag(tension[1:], -1)
    return np.sqrt(eigh(K, np.diag(mass), eigvals_only=True))


@pytest.mark.parametrize("count", [2, 5, 20])
def test_lumped_tether_with_an_end_mass(count):
    """End mass equal to that of the tether."""
    found, expected = frequencies(chain(count, 1e4, 5.6e-3, 56.0, lumped=True)), lumped_frequencies(count, 1.0)
    assert expected[0] == pytest.approx(np.sqrt(3), rel=1e-12)
    np.testing.assert_allclose(found[:2], expected[:2], rtol=1e-6)


def heavy_frequencies(ratio, terms=12):
    """Rayleigh-Ritz of a heavy string with an end mass, Legendre polynomials times x; over n.

    ``w^2 (int y^2 + r y(1)^2) = 3 int ((1 - x^2) / 2 + r) y'^2``
    """
    points, weights = np.polynomial.legendre.leggauss(40)
    x, weights = (points + 1) / 2, weights / 2
    polynomials = [Legendre.basis(k, domain=[0, 1]) for k in range(terms)]
    y, slope = (np.array([f(p) for p in polynomials]) for f in (lambda p: x * p(x), lambda p: p(x) + x * p.deriv()(x)))
    K = 3 * (weights * ((1 - x**2) / 2 + ratio) * slope) @ slope.T
    return np.sqrt(eigh(K, (weights * y) @ y.T + ratio, eigvals_only=True))


@pytest.mark.parametrize("ratio", [0.2, 1.0])
def test_heavy_tether_with_an_end_mass(ratio):
    """Richardson's value of 7 and 14 rods, error of order 4."""
    exact = heavy_frequencies(ratio)[:3]
    assert exact[0] == pytest.approx(np.sqrt(3), rel=1e-9)
    one, two = (frequencies(chain(count, 1e4, 5.6e-3, 56.0 * ratio))[:3] for count in (7, 14))
    np.testing.assert_allclose(two + (two - one) / 3, exact, rtol=1.5e-3)
    np.testing.assert_allclose(two, exact, rtol=2.5e-2)


def test_swing_of_the_heavy_tether(tmp_path):
    """It librates at sqrt(3) n and 2 n; the push reaches the end, and energy balances."""
    run = run_of("heavy-tether", tmp_path)
    for axis, w in (("y", np.sqrt(3)), ("z", 2.0)):
        x = run[f"satellite.root.position.{axis}"]
        up = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
        zeros = run.time[up] - x[up] * (run.time[up + 1] - run.time[up]) / (x[up + 1] - x[up])
        assert np.diff(zeros).mean() == pytest.approx(2 * np.pi / (w * N), rel=5e-3)  # of 3 degrees, and waves
    assert run.stats["energy_error"] < 1e-9


def ring(count, side, rate, orbit=None, mass=200.0):
    """Particles at the corners of a polygon, turning, on tethers of constant length."""
    R = side / (2 * np.sin(np.pi / count))
    bodies, joints, tethers = {}, [], []
    for k in range(count):
        a = 2 * np.pi * k / count
        p = R * np.array([np.cos(a), np.sin(a), 0])
        bodies[f"m{k}"] = mp.rigid_body(f"m{k}", mass=mass, centre=np.zeros(3), inertia=np.eye(3),
                                        interfaces={"root": np.zeros(3)})  # fmt: skip
        joints.append(mp.Joint(name=f"f{k}", type="free", parent="ground", child=f"m{k}", position=p,
                               velocity=rate * np.array([-p[1], p[0], 0])))  # fmt: skip
        tethers.append(
            mp.multibody.Closure(name=f"t{k}", type="distance", a=f"m{k}.root", b=f"m{(k + 1) % count}.root")
        )
    return mp.System(bodies=bodies, joints=tuple(joints), closures=tuple(tethers), orbit=orbit), R


@pytest.mark.parametrize("count", [3, 4, 6])
def test_ring_in_free_space(count):
    """T = m w^2 R / (2 sin(pi / N)); of a triangle m w^2 s / 3."""
    w = 0.01
    system, R = ring(count, 1000.0, w)
    run = mp.simulate(system, t_end=60.0, output_step=60.0, rtol=1e-10)
    found = [np.linalg.norm(run[f"t{k}.force"][-1]) for k in range(count)]
    np.testing.assert_allclose(found, 200 * w**2 * R / (2 * np.sin(np.pi / count)), rtol=1e-8)
    if count == 3:
        np.testing.assert_allclose(found, 200 * w**2 * 1000 / 3, rtol=1e-8)


def triangle_tensions(time, w, side, mass):
    """Of a rigid triangle that turns at w in Hill's frame: m x_k'' - f_k = sum of its two tethers."""
    R, found = side / np.sqrt(3), []
    for t in time:
        p = [R * np.array([np.cos(a), np.sin(a)]) for a in w * t + 2 * np.pi * np.arange(3) / 3]
        need = [mass * np.array([-(w * w + 2 * N * w + 3 * N * N), -(w * w + 2 * N * w)]) * x for x in p]
        unit = [(p[(k + 1) % 3] - p[k]) / side for k in range(3)]
        G = np.zeros((6, 3))
        for k in range(3):
            G[2 * k : 2 * k + 2, k] = unit[k]
            G[2 * ((k + 1) % 3) : 2 * ((k + 1) % 3) + 2, k] = -unit[k]
        found.append(np.linalg.lstsq(G, np.concatenate(need))[0])
    return np.array(found)


def test_rigid_triangle_in_orbit():
    """Its turn is uniform: the gradient has no moment on equal masses."""
    w = 5 * N
    run = mp.simulate(
        ring(3, 1000.0, w, mp.multibody.Orbit(rate=N))[0], t_end=600.0, output_step=60.0, rtol=1e-10, atol=1e-9
    )
    found = np.column_stack([np.linalg.norm(run[f"t{k}.force"], axis=1) for k in range(3)])
    np.testing.assert_allclose(found, triangle_tensions(run.time, w, 1000.0, 200.0), rtol=1e-6)
    assert run.stats["energy_error"] < 1e-9


def test_formation(tmp_path):
    """Elastic tethers of the spinning one follow the rigid triangle; those of the other go slack and catch."""
    run = run_of("tethered-formation", tmp_path)
    late = run.time > 300  # their own vibration is damped
    found = np.column_stack([run[f"spinning_tether{k}.tension"][late] for k in (1, 2, 3)])
    expected = triangle_tensions(run.time[late] + np.pi / 2 / (5 * N), 5 * N, 1000.0, 200.0)
    np.testing.assert_allclose(found, expected, rtol=0.01)  # they are 0.3 m longer, and give by 1e-5 of that
    slack = [np.mean(run[f"resting_tether{k}.tension"] == 0) for k in (1, 2, 3)]
    assert max(slack) > 0.5
    assert all(run[f"resting_tether{k}.tension"].min() == 0 for k in (1, 2, 3))
    assert max(run[f"resting_tether{k}.length"].max() for k in (1, 2, 3)) < 1003
    assert run.stats["energy_error"] < 1e-6


def spiral(days):
    """a0 -> a of the slow spiral, a^2.5 = a0^2.5 + 2.5 k t."""
    a0 = EARTH_RADIUS + 400e3
    k = 2 * 10 * 20e3 * 3.12e-5 * EARTH_RADIUS**3 / (1e5 * np.sqrt(EARTH_MU))
    return (a0**2.5 + 2.5 * k * days * 86400) ** 0.4 - a0


def test_electrodynamic_boost():
    """A rod of 20 km in free flight; the spiral is an approximation of relative order f / g = 6e-6 and (L / a)^2."""
    ends = {"root": np.zeros(3), "low": np.array([-1e4, 0, 0]), "high": np.array([1e4, 0, 0])}
    rod = mp.rigid_body("rod", mass=1e5, centre=np.zeros(3), inertia=np.diag([1e5, 1e6, 1e6]), interfaces=ends)
    flight = mp.Joint(name="flight", type="free", parent="ground", child="rod")
    line = mp.multibody.Conductor(name="line", through=("rod.high", "rod.low"), current=10.0)
    orbit = mp.multibody.Orbit.circular(EARTH_RADIUS + 400e3, dipole=mp.multibody.Dipole(strength=3.12e-5))
    system = mp.System(bodies={"rod": rod}, joints=(flight,), loads=(line,), orbit=orbit)
    run = mp.simulate(system, t_end=30 * 86400.0, output_step=86400.0, rtol=1e-10, atol=1e-8)
    found = run["rod.semi_major_axis"][[1, 10, 30]] - orbit.radius
    np.testing.assert_allclose(found, [spiral(1), spiral(10), spiral(30)], rtol=1e-5)


def test_electrodynamic_tether(tmp_path):
    """The station swings with its tether by 300 m and less: 1e-2 of a day's rise."""
    run = run_of("electrodynamic-tether", tmp_path)
    risen = run["station.semi_major_axis"][-100:].mean() - run["station.semi_major_axis"][:100].mean()
    days = (run.time[-100:].mean() - run.time[:100].mean()) / 86400
    assert risen == pytest.approx(spiral(days), rel=1e-2)
    assert np.abs(run["tether1.angle"]).max() < 0.2
    np.testing.assert_allclose(run["line.emf"], -3730.04, rtol=6e-3)  # 0.3 % per 7 km of height, and swing
    assert run.stats["energy_error"] < 1e-9


def test_tether_that_is_reeled_out_rod_by_rod(tmp_path):
    """The dumbbell's swing, while one rod becomes ten; the tether's mass is 0.4 % of the satellite's by then."""
    system, span = shipped("tether-reel-out", tmp_path)
    run = mp.multibody.simulate_deployment(system, t_end=10 / N, output_step=0.5 / N, rtol=span.rtol, method="explicit")
    x, y, _ = run["satellite.root.position"][at(run, TAU[:6])].T
    expected = np.degrees(swing(uniform, TAU[:6])[0])
    # of 37: mass and bending of the tether
    np.testing.assert_allclose(np.degrees(np.arctan2(y, x)), expected, atol=0.01)
    assert (run["tether.rods"][[0, -1]] == [1, 9]).all()
    assert run["tether.tension"][-1] == pytest.approx(3 * 500 * N**2 * 17978, rel=0.1)  # and what swings
    assert run.stats["energy_error"] < 1e-10
