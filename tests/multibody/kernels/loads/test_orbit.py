"""Systems in orbit: closed forms, inertial axes, the dense equations, identities; conductors; springs that go slack."""

import numpy as np
import pytest
from multibody.closed_trees import closed_tree
from multibody.loaded_trees import loaded_tree
from multibody.loaded_trees import order_n as loaded_order_n
from multibody.trees import order_n, random_state, random_tree

import modalprep as mp
from modalprep.errors import InputError
from modalprep.multibody import AxialSpring, Orbit
from modalprep.multibody.evaluation.evaluate import GOOD, build_equations, evaluate
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.free_body.flight import simulate_free_system
from modalprep.multibody.model.environment import EARTH_MU, EARTH_RADIUS
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.constraints import closed_accelerations
from modalprep.multibody.reference.loads import dense_loads, loaded_accelerations
from modalprep.pipeline.schema.environment import ControlTable, OrbitTable
from modalprep.pipeline.systems.loads import read_orbit

# of the size of random trees, so that every order of the field counts
NEAR = Orbit(rate=0.7, radius=12.0, inclination=0.9, argument_of_latitude=0.4, planet_spin=0.3,
                dipole=mp.multibody.Dipole(strength=2.0, radius=11.0, tilt=0.5, longitude=1.1))  # fmt: skip
HILL = Orbit(rate=0.7)
CURRENT = mp.multibody.Conductor(name="line", through=("b0.a", "b1.b", "b0.root"), current="1 + t")


def in_orbit(system, orbit, *more):
    loads = tuple(load for load in system.loads if not isinstance(load, mp.multibody.CentralGravity))
    return system.with_(gravity=np.zeros(3), orbit=orbit, loads=(*loads, *more))


def particle(name="m", mass=3.0):
    return mp.rigid_body(name, mass=mass, centre=np.zeros(3), inertia=np.zeros((3, 3)) + 1e-9 * np.eye(3),
                         interfaces={"root": np.zeros(3)})  # fmt: skip


def thrown(orbit, position, velocity, **more):
    joint = mp.Joint(name="flight", type="free", parent="ground", child="m", position=position, velocity=velocity)
    return mp.System(bodies={"m": particle()}, joints=(joint,), orbit=orbit, **more)


def test_particle_by_hills_equations():
    """Closed form of Clohessy and Wiltshire (1960); atol: 1e-11 of 300 m, a thousand digits' worth of one orbit."""
    n = 1.2e-3
    (x0, y0, z0), (u0, v0, w0) = position, velocity = np.array([100.0, -40, 25]), np.array([0.02, -0.1, 0.05])
    run = mp.simulate(thrown(Orbit(rate=n), position, velocity), t_end=2 * np.pi / n, output_step=50, rtol=1e-12,
                      atol=1e-13)  # fmt: skip
    s, c, t = np.sin(n * run.time), np.cos(n * run.time), run.time
    x = (4 - 3 * c) * x0 + s * u0 / n + 2 * (1 - c) * v0 / n
    y = 6 * (s - n * t) * x0 + y0 - 2 * (1 - c) * u0 / n + (4 * s / n - 3 * t) * v0
    np.testing.assert_allclose(run["m.root.position"], np.c_[x, y, z0 * c + w0 / n * s], atol=1e-8)
    assert run.stats["energy_error"] < 1e-11


def test_particle_by_kepler():
    """Far from the origin: the osculating axis stays, and after its period the inertial place is the old one."""
    orbit = Orbit.circular(7.0e6)
    position, velocity = np.array([4e5, -9e5, 3e5]), np.array([150.0, -300, 200])
    a = orbit.semi_major_axis(position, velocity)
    period = 2 * np.pi * np.sqrt(a**3 / EARTH_MU)
    run = mp.simulate(thrown(orbit, position, velocity), t_end=period, output_step=period / 50, rtol=1e-12, atol=1e-9)
    found, speed = run["m.root.position"], run["m.root.velocity"]
    np.testing.assert_allclose(orbit.semi_major_axis(found, speed), a, rtol=1e-11)
    angle = orbit.rate * period
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    up = np.array([7.0e6, 0, 0])
    np.testing.assert_allclose(turn @ (found[-1] + up), position + up, atol=1e-3)  # 1e-10 of the orbit
    assert abs(a - 7.0e6) > 1e5


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("orbit", [NEAR, HILL])
def test_order_n_equals_dense_under_every_load(seed, orbit):
    system = in_orbit(loaded_tree(seed), orbit, *([CURRENT] if orbit.dipole else []))
    y = random_state(system, seed)
    found, energies, loading = loaded_order_n(system, y, 0.3)
    expected = loaded_accelerations(system, y, loading.motion, 0.3)
    assert np.abs(found - expected).max() <= 1e-10 * np.abs(expected).max()
    dense = dense_loads(system, pack(system), y, loading.motion, 0.3)
    np.testing.assert_allclose(energies, dense[1:4], rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("seed", [0, 1, 2, 4, 5, 7, 8, 9, 10])
def test_closed_loops_equal_the_dense_solution(seed):
    system, y, _ = closed_tree(seed)
    system = in_orbit(system, NEAR)
    loading, whole = Loading(system, pack(system), 1.0), np.append(y, 0.0)
    eq, rates = build_equations(pack(system), loading), np.zeros(len(whole))
    assert evaluate(eq, 0.3, whole, rates) == GOOD
    found, motion = rates[eq.model.nx : -1], eq.motion
    assert eq.work.rank[0] == len(eq.cons.rows)
    expected, multiplier = closed_accelerations(system, loading.loops, y, motion, 0.3)
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())
    np.testing.assert_allclose(eq.work.multiplier, multiplier, atol=1e-8 * np.abs(multiplier).max())


@pytest.mark.parametrize("seed", range(6))
def test_accelerations_are_those_in_inertial_axes(seed):
    """The same tree on a hub that a prescribed joint carries around the planet."""
    tree = random_tree(seed, root=["free", "revolute", "spherical"][seed % 3], gravity=False, prescribed=False)
    flying = tree.with_(orbit=NEAR)
    y = random_state(flying, seed)
    found, _, _ = loaded_order_n(flying, y, 0.0)
    hub = mp.rigid_body("hub", mass=1.0, centre=np.zeros(3), inertia=np.eye(3),
                        interfaces={"root": np.zeros(3), "out": np.array([NEAR.radius, 0, 0])})  # fmt: skip
    carrier = mp.Joint(name="orbit", type="revolute", parent="ground", child="hub",
                       motion=mp.multibody.TimeFunction(f"{NEAR.rate}*t"))  # fmt: skip
    joints = [joint.with_(parent="hub.out") if joint.parent == "ground" else joint for joint in tree.joints]
    planet = mp.multibody.CentralGravity(mu=NEAR.rate**2 * NEAR.radius**3)
    carried = tree.with_(bodies={"hub": hub, **tree.bodies}, joints=(carrier, *joints), loads=(planet,))
    expected, _, _ = loaded_order_n(carried, y, 0.0)
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())
    assert np.abs(found - order_n(tree, y, np.zeros((len(pack(tree).links), 3)))[0]).max() > 1e-3


@pytest.mark.parametrize("orbit", [NEAR, HILL])
def test_flexible_tree_in_orbit(orbit):
    """Its energy, the Jacobi integral, balances, and velocities and accelerations are what the ground sees."""
    system = in_orbit(random_tree(3, most=4), orbit, mp.PointForce(name="push", at="b1.a", force=("t", 0, 1)))
    start = system.with_(
        joints=(system.joints[0].with_(angular_velocity=np.array([0.2, -0.1, 0.3])), *system.joints[1:])
    )
    run = mp.simulate(start, t_end=1.0, output_step=0.01, rtol=1e-10, atol=1e-12)
    assert run.stats["energy_error"] < 1e-8
    for one, rate in (("position", "velocity"), ("velocity", "acceleration")):
        x = run[f"b1.a.{one}"]
        slope = (x[:-4] - 8 * x[1:-3] + 8 * x[3:-1] - x[4:]) / 0.12
        expected = run[f"b1.a.{rate}"][2:-2]
        np.testing.assert_allclose(slope, expected, atol=1e-5 * np.abs(expected).max())  # h^4 / 30 of fifth derivatives


def test_modes_of_a_satellite():
    """Of its place n, n and 0; pitch, and roll with yaw by gravity's gradient (Hughes 1986, section 9.2)."""
    up, along, normal = 200.0, 900.0, 1000.0
    body = mp.rigid_body("sat", mass=500.0, centre=np.zeros(3), inertia=np.diag([up, along, normal]),
                         interfaces={"root": np.zeros(3)})  # fmt: skip
    joint = mp.Joint(name="flight", type="free", parent="ground", child="sat")
    n = 2e-3
    found = mp.system_modes(mp.System(bodies={"sat": body}, joints=(joint,), orbit=Orbit(rate=n)))
    roll, yaw = (normal - up) / along, (normal - along) / up
    squares = np.roots([1, 1 + 3 * roll + roll * yaw, 4 * roll * yaw])
    expected = np.sort([1, 1, np.sqrt(3 * (along - up) / normal), *np.sqrt(-squares)])
    moving = found.frequency[found.frequency > 1e-3 * n]
    np.testing.assert_allclose(2 * np.pi * moving / n, expected, rtol=1e-7)


def test_rest_of_a_dumbbell_under_a_torque():
    """sin 2 theta = 2 Q / 3 at a hinge torque Q m n^2 L^2."""
    n, m, L, Q = 1e-3, 5.0, 200.0, 0.6
    bob = mp.rigid_body("bob", mass=m, centre=np.array([L, 0, 0]), inertia=1e-9 * np.eye(3),
                        interfaces={"root": np.zeros(3), "end": np.array([L, 0, 0])})  # fmt: skip
    drive = mp.multibody.HingeElement(drive=Q * m * n**2 * L**2)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="bob", elements=drive)
    rest = mp.static_equilibrium(mp.System(bodies={"bob": bob}, joints=(hinge,), orbit=Orbit(rate=n)))
    assert rest.joints["hinge"][0] == pytest.approx(np.arcsin(2 * Q / 3) / 2, rel=1e-9)


STATION = dict(strength=3.12e-5)


def conductor(length, **orbit):
    """A rod along the vertical through the origin, held there, 10 A upwards."""
    ends = {"root": np.zeros(3), "low": np.array([-length / 2, 0, 0]), "high": np.array([length / 2, 0, 0])}
    rod = mp.rigid_body("rod", mass=1e5, centre=np.zeros(3), inertia=1e6 * np.eye(3), interfaces=ends)
    wall = mp.Joint(name="wall", type="weld", parent="ground", child="rod")
    line = mp.multibody.Conductor(name="line", through=("rod.low", "rod.root", "rod.high"), current=10.0)
    orbit = Orbit.circular(EARTH_RADIUS + 400e3, dipole=mp.multibody.Dipole(**STATION), **orbit)
    return mp.System(bodies={"rod": rod}, joints=(wall,), loads=(line,), orbit=orbit)


def test_force_and_voltage_of_a_conductor():
    """I L B and (v - w_E r) B L; the field changes along 20 km by 1e-2 and its middle differs by (L / r)^2 = 1e-5."""
    system = conductor(20e3)
    run = mp.simulate(system, t_end=1.0, output_step=1.0)
    assert run["line.emf"][0] == pytest.approx(3730.04, rel=2e-5)
    assert run["wall.force.y"][0] == pytest.approx(5.199183, rel=2e-5)  # against the drag of a current up
    short = mp.simulate(conductor(2.0), t_end=1.0, output_step=1.0)
    np.testing.assert_allclose(short["line.emf"][0], 0.373004, rtol=2e-6)  # the printed digits
    np.testing.assert_allclose(short["wall.force.y"][0], 5.199183e-4, rtol=2e-7)
    assert short["line.current"][0] == 10.0


def test_voltage_at_the_node_of_an_inclined_orbit():
    """The field points north, the planet turns east: (v cos i - w_E r) B L."""
    i, r = 0.9, EARTH_RADIUS + 400e3
    run = mp.simulate(conductor(2.0, inclination=i), t_end=1.0, output_step=1.0)
    speed = np.sqrt(EARTH_MU / r) * np.cos(i) - 7.292115e-5 * r
    expected = speed * STATION["strength"] * (EARTH_RADIUS / r) ** 3 * 2.0
    assert run["line.emf"][0] == pytest.approx(expected, rel=1e-9)


def test_field_of_a_tilted_dipole_over_the_pole():
    """Over the magnetic north pole the field is 2 B_0 down, and the planet's turn goes across the flight."""
    r = EARTH_RADIUS + 400e3
    B = 2 * STATION["strength"] * (EARTH_RADIUS / r) ** 3
    over = conductor(2.0, inclination=np.pi / 2, argument_of_latitude=np.pi / 2)
    run = mp.simulate(over, t_end=1.0, output_step=1.0)
    assert abs(run["line.emf"][0]) < 1e-12 * B * 7e3  # the rod is along the field
    flat = over.joints[0].with_(rotation=np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]))  # body x along -z
    run = mp.simulate(over.with_(joints=(flat,)), t_end=1.0, output_step=1.0)
    # v y cross -B x = v B z, along the rod -v B L
    assert run["line.emf"][0] == pytest.approx(-np.sqrt(EARTH_MU / r) * B * 2.0, rel=1e-9)
    tilted = mp.multibody.Dipole(**STATION, tilt=np.pi / 2, longitude=0.0)
    equator = over.orbit.with_(dipole=tilted, inclination=0.0, argument_of_latitude=0.0)
    run = mp.simulate(over.with_(joints=(flat,), orbit=equator), t_end=1.0, output_step=1.0)
    speed = np.sqrt(EARTH_MU / r) - equator.planet_spin * r
    assert run["line.emf"][0] == pytest.approx(-speed * B * 2.0, rel=1e-9)


def test_slack_tether_catches_a_particle():
    """Free to the length, half a period of the spring, back at the same speed."""
    k, m, L, v = 50.0, 3.0, 2.0, 4.0
    tether = AxialSpring(name="tether", between=("ground", "m.root"), stiffness=k, free_length=L, tension_only=True)
    run = mp.simulate(thrown(None, np.array([0.5, 0, 0]), np.array([v, 0, 0]), loads=(tether,)), t_end=2.0,
                      output_step=0.01, rtol=1e-10, atol=1e-12)  # fmt: skip
    w, taut = np.sqrt(k / m), (L - 0.5) / v
    free = taut + np.pi / w
    s = np.clip(run.time, taut, free) - taut
    expected = L + v / w * np.sin(w * s) + v * np.minimum(run.time - taut, 0) - v * np.maximum(run.time - free, 0)
    np.testing.assert_allclose(run["m.root.position.x"], expected, atol=1e-8)  # the kinks cost some of 1e-10
    np.testing.assert_allclose(run["tether.tension"], k * v / w * np.sin(w * s), atol=1e-6)
    np.testing.assert_allclose(run["tether.length"], np.abs(expected), atol=1e-8)
    assert run.stats["energy_error"] < 1e-8


def test_damper_of_a_slack_tether_never_pushes():
    tether = AxialSpring(name="tether", between=("m.root", "ground"), stiffness=50.0, damping=40.0, free_length=1.0,
                            tension_only=True)  # fmt: skip
    run = mp.simulate(thrown(None, np.array([0.5, 0, 0]), np.array([4.0, 0, 0]), loads=(tether,)), t_end=2.0,
                      rtol=1e-10, atol=1e-12)  # fmt: skip
    assert run["tether.tension"].min() == 0.0
    assert run["tether.tension"].max() > 50.0
    pulled = (run["tether.length"] > 1.0) & (run["tether.tension"] == 0.0)
    assert pulled.any()  # it shortens too quickly for its damper
    assert run.stats["energy_error"] < 1e-8


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Orbit(rate=0.0), "rate = 0 must be positive"),
        (lambda: Orbit(rate=1e-3, radius=-1.0), "radius = -1 must be positive"),
        (lambda: Orbit.circular(-7e6), "radius = -7e\\+06"),
        (lambda: Orbit(rate=1e-3, dipole=mp.multibody.Dipole(strength=1.0)), "needs the radius of the orbit"),
        (lambda: mp.multibody.Dipole(strength=0.0), "strength = 0"),
        (lambda: mp.multibody.Conductor(name="c", through=("m.root",), current=1.0), "two or more interfaces"),
        (lambda: thrown(HILL, np.zeros(3), np.zeros(3), gravity=np.array([0, 0, -9.81])), "gravity of its orbit"),
        (
            lambda: thrown(HILL, np.zeros(3), np.zeros(3), loads=(mp.multibody.CentralGravity(mu=1.0),)),
            "gravity of its orbit",
        ),
        (lambda: conductor(2.0).with_(orbit=HILL), "'line' needs a magnetic field"),
        (
            lambda: conductor(2.0).with_(
                loads=(mp.multibody.Conductor(name="c", through=("ground", "rod.low"), current=1.0),)
            ),
            "conductor 'c' is on the ground",
        ),
        (
            lambda: AxialSpring(name="s", between=("ground", "m.root"), actuator_force=1.0, tension_only=True),
            "tension_only and actuator_force exclude each other",
        ),
        (lambda: simulate_free_system(thrown(HILL, np.zeros(3), np.zeros(3)), t_end=1.0), "here is an orbit"),
    ],
)
def test_bad_input_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()


def test_orbit_of_a_pipeline_file():
    dipole = {"strength": 3e-5, "tilt": "11 deg"}
    orbit = read_orbit(OrbitTable(altitude=400e3, inclination="51.6 deg", dipole=dipole))
    assert orbit.radius == EARTH_RADIUS + 400e3
    assert orbit.rate == pytest.approx(np.sqrt(EARTH_MU / orbit.radius**3))
    assert np.degrees([orbit.inclination, orbit.dipole.tilt]) == pytest.approx([51.6, 11.0])
    orbit = read_orbit(OrbitTable(rate=1e-3))
    assert (orbit.rate, 1 / orbit.radius) == (1e-3, 0.0)
    mars = read_orbit(OrbitTable(radius=4e6, mu=4.28e13))
    assert mars.rate == pytest.approx(np.sqrt(4.28e13 / 4e6**3))
    assert read_orbit(None) is None


@pytest.mark.parametrize("table", [{}, {"altitude": 4e5, "rate": 1e-3}])
def test_orbit_of_no_or_two_sizes_is_refused(table):
    with pytest.raises(ValueError, match="needs one of 'altitude', 'radius' and 'rate'"):
        OrbitTable(**table)


@pytest.mark.parametrize("table", [{"at": "m.root"}, {"at": "m.root", "values": ["t"], "force": [0, 0, "t"]}])
def test_control_of_no_or_two_kinds_is_refused(table):
    with pytest.raises(ValueError, match="needs 'force' or 'torque' of an interface, or 'values' of a joint"):
        ControlTable(**table)
