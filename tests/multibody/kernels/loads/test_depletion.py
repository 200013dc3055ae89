"""Bodies that lose mass, and their gas: second implementation, energy, closed forms, what is refused."""

import numpy as np
import pytest
from multibody.depleted_trees import depleted_tree
from multibody.loaded_trees import order_n
from multibody.trees import random_body, random_state
from scipy.spatial.transform import Rotation
from size import FULL

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody import ExpelledGas, TimeFunction
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.equations import body_states, energy_and_momentum
from modalprep.multibody.reference.loads import dense_loads, loaded_accelerations

T = 0.3
END = 0.01 if FULL else 0.004  # s, of runs by dense equations


@pytest.mark.parametrize("seed", range(8))
def test_order_n_equals_dense(seed):
    system = depleted_tree(seed)
    y = random_state(system, seed)
    found, _, loading = order_n(system, y, T)
    expected = loaded_accelerations(system, y, loading.motion, T)
    assert np.abs(found - expected).max() <= 1e-10 * np.abs(expected).max()
    whole = loaded_accelerations(system.with_(depletions=()), y, loading.motion, T)
    assert np.abs(found - whole).max() > 1e-3 * np.abs(whole).max()


@pytest.mark.parametrize("seed", range(6))
def test_energy_leaves_with_the_mass(seed):
    """d/dt of the energy of a state that does not move: central differences, good to 1e-7."""
    system = depleted_tree(seed)
    y = random_state(system, seed)
    _, energies, loading = order_n(system, y, T)

    def energy(t):
        at = system.with_masses_at(t)
        found = energy_and_momentum(system.gravity, body_states(at, pack(at), y, loading.motion))
        return found["kinetic"] + found["gravity"]

    left = (energy(T + 1e-4) - energy(T - 1e-4)) / 2e-4
    power = dense_loads(system, pack(system), y, loading.motion, T).power
    assert abs(left) > 1e-3
    assert energies.power == pytest.approx(power + left, rel=1e-6)


@pytest.mark.parametrize("method", ["explicit", "generalised_alpha", "rosenbrock"])
def test_energy_balances_on_a_flight(method):
    """Spinning, bending, burning, under a planet; balance to the tolerance of the methods, of orders 8, 2 and 3."""
    full = uniform_beam(modes=3, elements=10)
    fuel = mp.multibody.Depletion(
        name="fuel",
        body="beam",
        levels=(mp.body.with_density_factor(full, 0.4),),
        mass=mp.multibody.deplete(full.m, 0.4 * full.m, 4.0),
    )
    gas = ExpelledGas(name="jet", at="beam.root", source=fuel.mass, speed=50.0, axis=np.array([-1.0, 0.1, 0.0]),
                         flow_path=("beam.tip",))  # fmt: skip
    flight = mp.Joint(
        name="flight", type="free", parent="ground", child="beam", angular_velocity=np.array([0.1, 0.2, 0.5])
    )
    planet = mp.multibody.CentralGravity(mu=1e5, centre=np.array([0.0, -100.0, 0]))
    system = mp.System(bodies={"beam": full}, joints=(flight,), loads=(gas, planet), depletions=(fuel,))
    run = mp.simulate(system, t_end=2.5, rtol=1e-9 if method == "explicit" else 1e-6, method=method)
    limit = {"explicit": 1e-8, "generalised_alpha": 1e-4, "rosenbrock": 1e-4}[method]
    assert run.status == "done"
    assert run.stats["energy_error"] < limit
    burnt = np.minimum(4.0 * run.time, 0.6 * full.m)  # all is gone at 1.8 s
    np.testing.assert_allclose(run["beam.mass"], full.m - burnt, rtol=1e-12)


def test_dense_run_is_the_same():
    system = depleted_tree(1).with_(gravity=np.zeros(3))
    one, two = (
        mp.simulate(system, t_end=END, rtol=1e-9, output_step=END / 2, reference=reference)
        for reference in (False, True)
    )
    for name in ("energy.kinetic", "momentum.linear", "b1.modal"):
        np.testing.assert_allclose(one[name], two[name], rtol=1e-7, atol=1e-9)


def test_uniform_depletion_keeps_shapes_and_raises_frequencies():
    """w ~ m^(-1/2) of a clamped beam, exactly; also without geometric stiffness, where M_ff is constant in q."""
    full = uniform_beam(modes=3, elements=10)
    fuel = mp.multibody.Depletion(
        name="fuel", body="beam", levels=(mp.body.with_density_factor(full, 0.25),), mass="12*(1 - t/4)"
    )
    wall = mp.Joint(name="wall", type="weld", parent="ground", child="beam")
    system = mp.System(bodies={"beam": full}, joints=(wall,), depletions=(fuel,))
    for each in (system, system.conventional(), system.ruthless(), system.with_masses_at(2.0).conventional()):
        assert mp.system_modes(each, t=2.0).frequency == pytest.approx(full.frequency * np.sqrt(2), rel=1e-10)


def test_implicit_steps_know_the_modal_mass():
    """Free vibration at half the mass: generalized-alpha against the cosine, an order of 2 in its step."""
    body = mp.body.with_density_factor(uniform_beam(modes=1, elements=10), 0.5)
    wall = mp.Joint(name="wall", type="weld", parent="ground", child="beam")
    push = mp.PointForce(name="push", at="beam.tip", force=(0, 0, 1.0))
    system = mp.System(bodies={"beam": body}, joints=(wall,), loads=(push,))
    w = np.sqrt(body.K[0] / 0.5)
    rest = body.phi[1, 2, 0] / body.K[0]
    error = []
    for step in (0.01, 0.005):
        run = mp.simulate(system, t_end=1.0, method="generalised_alpha", step=step, rho_inf=1.0)
        error.append(np.abs(run["beam.modal"][:, 0] - rest * (1 - np.cos(w * run.time))).max())
    assert error[1] < 0.01 * abs(rest)
    assert error[0] / error[1] == pytest.approx(4, rel=0.1)


def rocket(*ends, k2=9.0, **joint):
    """Rigid body of 1000 kg that burns to 360 kg, its radius of gyration kept; gas leaves 5 m behind the centre."""
    places = {"centre": np.zeros(3), "exit": np.array([-5.0, 0, 0]), **{f"end{i}": e for i, e in enumerate(ends)}}
    full, empty = (
        mp.rigid_body("rocket", mass=m, centre=np.zeros(3), inertia=m * np.diag([1.0, k2, k2]), interfaces=places)
        for m in (1000.0, 360.0)
    )
    fuel = mp.multibody.Depletion(
        name="fuel", body="rocket", levels=(empty,), mass=mp.multibody.deplete(1000.0, 360.0, 8.0)
    )
    flight = mp.Joint(name="flight", type="free", parent="ground", child="rocket", **joint)
    return mp.System(bodies={"rocket": full}, joints=(flight,), depletions=(fuel,)), fuel


def test_end_of_the_depletion_is_exact():
    """Tsiolkovsky's rocket, and then it coasts: the restart at burnout keeps the full order."""
    system, fuel = rocket()
    gas = ExpelledGas(name="jet", at="rocket.exit", source=fuel.mass, speed=2500.0, axis=np.array([-1.0, 0, 0]))
    run = mp.simulate(system.with_(loads=(gas,)), t_end=100.0, output_step=10.0, rtol=1e-11)
    mass = np.maximum(1000.0 - 8.0 * run.time, 360.0)
    np.testing.assert_allclose(run["rocket.centre.velocity.x"], 2500 * np.log(1000 / mass), rtol=1e-10)
    assert np.abs(run["rocket.centre.velocity"][-1] - run["rocket.centre.velocity"][-2]).max() == 0.0
    assert fuel.mass.breaks == [80.0]
    assert run.stats["energy_error"] < 1e-9


def test_spinning_rocket_keeps_the_direction_of_its_angular_momentum():
    """With equal decay about all axes H' = -(m' r^2 / m k^2) H, so its direction is fixed, its size (m / m0)^(r^2/k^2).

    Four exits at radius r, 5 m behind: r^2 across the axis, 25 + r^2 / 2 about the others, of k^2 = 1 and 9.
    """
    r = np.sqrt(25 / 8.5)
    exits = [np.array([-5.0, r * c, r * s]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    # the propellant leaves where it keeps the radii of gyration: from six points of those radii, over the exits
    x, y = np.sqrt(8.5), np.sqrt(0.5)
    starts = [np.array([a * x, b * y, c * y]) for a in (1, -1) for b, c in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    system, fuel = rocket(*exits, *starts, angular_velocity=np.array([2.0, 0.5, -0.3]))
    jets = tuple(
        ExpelledGas(name=f"{i}{j}", at=f"rocket.end{i}", source=fuel.mass, speed=0.0, mass_fraction=1 / 32,
                       axis=np.array([-1.0, 0, 0]), flow_path=(f"rocket.end{4 + j}",))
        for i in range(4) for j in range(8)
    )  # fmt: skip
    run = mp.simulate(system.with_(loads=jets), t_end=40.0, output_step=1.0, rtol=1e-10)
    H = angular_momentum(run)
    expected = H[0] * ((1000 - 8 * run.time) / 1000)[:, None] ** (r**2 / 1.0)
    np.testing.assert_allclose(H, expected, atol=1e-7 * np.linalg.norm(H[0]))


def angular_momentum(run):
    """About the centre, inertial axes."""
    turn = Rotation.from_quat(run["rocket.orientation"], scalar_first=True)
    return turn.apply(run["rocket.mass"][:, None] * np.array([1.0, 9, 9]) * run["flight.angular_velocity"])


def test_prescribed_universal_joint_recovers_its_torques():
    """Both hinges follow their laws; what they deliver is the torque of the same joint driven, and does the work."""
    laws = (TimeFunction("0.3*sin(2*t)"), TimeFunction("0.2*(1 - cos(3*t))"))
    nozzle = mp.rigid_body("nozzle", mass=2.0, centre=np.array([-0.4, 0, 0]), inertia=np.diag([0.1, 0.3, 0.3]),
                           interfaces={"hinge": np.zeros(3)})  # fmt: skip
    joint = mp.Joint(name="gimbal", type="universal", parent="ground", child="nozzle", axis=np.array([0, 1.0, 0]),
                     second_axis=np.array([0, 0, 1.0]), motion=laws)  # fmt: skip
    system = mp.System(bodies={"nozzle": nozzle}, joints=(joint,), gravity=np.array([0, 0, -9.0]))
    run = mp.simulate(system, t_end=2.0, rtol=1e-10)
    angles = np.array([[law(t)[:2] for law in laws] for t in run.time])
    np.testing.assert_allclose(run["gimbal.angle"], angles[:, :, 0], atol=1e-10)
    np.testing.assert_allclose(
        run["power.input"], np.sum(run["gimbal.drive"] * angles[:, :, 1], axis=1), rtol=1e-9, atol=1e-9
    )
    assert run.stats["energy_error"] < 1e-9
    free = system.with_(joints=(joint.with_(motion=None, rate=[0.6, 0.0]),))
    needed = mp.multibody.inverse_dynamics(free, {"gimbal": list(laws)}, run.time).force["gimbal"]
    np.testing.assert_allclose(run["gimbal.drive"], needed, atol=1e-7)


def test_modal_file_keeps_the_modal_mass(tmp_path):
    body = mp.body.with_density_factor(uniform_beam(modes=2, elements=6), 0.5)
    assert not body.normalised
    again = mp.read_body(mp.write_body(body, tmp_path / "half.h5"))
    np.testing.assert_array_equal(again.modal_mass, body.modal_mass)
    assert all(check.passed for check in mp.check_body(again) if check.name == "modal mass")


FULL = uniform_beam(modes=2, elements=6)
HALF = mp.body.with_density_factor(FULL, 0.5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: mp.multibody.deplete(5.0, 6.0, 1.0), "nothing depletes"),
        (lambda: mp.multibody.deplete(6.0, 5.0, -1.0), "must not be negative"),
        (lambda: mp.multibody.Depletion(name="f", body="beam", levels=(), mass=1.0), "at one other fill level"),
        (lambda: fuelled(mass=[(1.0, 12.0), (float("inf"), 7.0)]), "jumps"),
        (lambda: fuelled(body="bean"), "did you mean 'beam'"),
        (lambda: fuelled(levels=(uniform_beam(modes=3, elements=6),)), "same modes"),
        (lambda: fuelled(levels=(FULL,)), "must differ in mass"),
        (lambda: fuelled(levels=(HALF.with_(phi=2 * FULL.phi),)), "differ in phi"),
        (lambda: mp.simulate(fuelled(mass="12 - 4*t"), t_end=2.0), "would weigh 5 kg at t = 1.75 s"),
        (lambda: mp.body.with_density_factor(FULL, 0.0), "must be positive"),
        (lambda: ExpelledGas(name="g", at="a.b", source=1.0, speed=-1.0, axis=np.ones(3)), "must not be negative"),
        (lambda: ExpelledGas(name="g", at="a.b", source=1.0, speed=1.0, axis=np.zeros(3)), "no direction"),
        (lambda: fuelled(loads=(jet("beam.tap"),)), "did you mean 'beam.tip'|names no interface"),
        (lambda: fuelled(loads=(jet("ground"),)), "has the ground on its flow path"),
        (lambda: mp.Joint(name="j", type="universal", parent="ground", child="b", second_axis=np.eye(3)[0],
                          motion=TimeFunction(0.0)), "1 prescribed motions"),
        (lambda: mp.Joint(name="j", type="free", parent="ground", child="b", motion=TimeFunction(0)), "a free"),
    ],
)  # fmt: skip
def test_nonsense_is_refused(make, message):
    with pytest.raises(mp.InputError, match=message):
        make()


def jet(at):
    return ExpelledGas(name="g", at=at, source="12 - t", speed=1.0, axis=np.ones(3))


def fuelled(body="beam", levels=(HALF,), mass="12 - t", loads=()):
    wall = mp.Joint(name="wall", type="weld", parent="ground", child="beam")
    fuel = mp.multibody.Depletion(name="fuel", body=body, levels=levels, mass=mass)
    return mp.System(bodies={"beam": FULL}, joints=(wall,), depletions=(fuel,), loads=loads)


def test_a_body_that_loses_mass_has_no_second_order_of_its_modal_mass():
    """T belongs to one density: it is left out, and the system says so."""
    full = random_body(np.random.default_rng(3), 2)
    mass = f"{float(full.m)!r} - {float(full.m) / 10!r}*t"
    fuel = mp.multibody.Depletion(name="fuel", body="tank", levels=(mp.body.with_density_factor(full, 0.5),), mass=mass)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="tank")
    system = mp.System(bodies={"tank": full}, joints=(hinge,), depletions=(fuel,))
    assert full.T is not None
    assert system.bodies["tank"].T is None
    assert "second-order terms of its modal mass" in system.notes[0]
