"""Rockets: ascent, jet damping, a nozzle that swings, a flexible stage that steers and burns."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from systems.shipped import PIPELINES, run_shipped, shipped

import modalprep as mp
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system


def at(run, t):
    return int(np.argmin(np.abs(run.time - t)))


def only_run(name, folder):
    (run,) = run_shipped(name, folder).runs.values()
    return run


def test_ascent(tmp_path):
    """Tsiolkovsky: ``v = c ln(m0/m)``, ``x = c t - c (m/k) ln(m0/m)``; and the coast after the burn."""
    run = only_run("rocket-ascent", tmp_path)
    end = at(run, 80.0)
    c, rate, full, empty = 2500.0, 8.0, 1000.0, 360.0
    ratio = np.log(full / empty)
    assert run["rocket.centre.velocity.x"][end] == pytest.approx(c * ratio, rel=1e-9)
    assert run["rocket.centre.position.x"][end] == pytest.approx(c * (80.0 - empty / rate * ratio), rel=1e-9)
    assert run["rocket.mass"][end] == pytest.approx(360.0, rel=1e-12)
    assert np.ptp(run["rocket.centre.velocity.x"][end:]) < 1e-9
    assert run.stats["energy_error"] < 1e-9


def test_jet_damping(tmp_path):
    """``w / w0 = (m / m0)^(l^2 / k^2 - 1)``; the transverse angular momentum keeps its direction in inertial space."""
    run = only_run("jet-damping", tmp_path)
    for t in (20.0, 40.0):
        ratio = (run["rocket.mass"][at(run, t)] / run["rocket.mass"][0]) ** (5.0**2 / 9.0 - 1)
        np.testing.assert_allclose(
            run["flight.angular_velocity"][at(run, t), 1:], ratio * np.array([0.3, 0.4]), rtol=1e-7
        )
    turn = Rotation.from_quat(run["rocket.orientation"], scalar_first=True)
    momentum = turn.apply(9 * run["rocket.mass"][:, None] * run["flight.angular_velocity"])
    size = np.linalg.norm(momentum, axis=1)
    np.testing.assert_allclose(momentum / size[:, None], np.tile([0, 0.6, 0.8], (len(size), 1)), atol=1e-9)
    assert size[-1] < 0.1 * size[0]
    assert run.stats["energy_error"] < 1e-9


def test_without_a_flow_path_gas_takes_no_angular_momentum(tmp_path):
    """Only the thrust, through the centre: the spin of the solid that remains stays."""
    system, _ = shipped("jet-damping", tmp_path)
    bare = system.with_(loads=tuple(load.with_(flow_path=()) for load in system.loads))
    run = mp.simulate(bare, t_end=40.0, output_step=20.0)
    np.testing.assert_allclose(run["flight.angular_velocity"][:, 1:], np.tile([0.3, 0.4], (3, 1)), rtol=1e-12)


def test_tail_wags_dog(tmp_path):
    """Side force ``m a - T sin d`` and torques of the actuators in closed form; the zero of the force."""
    run = only_run("nozzle-gimbal", tmp_path)
    t, (m, arm, J, T, size) = run.time, (500.0, 0.8, 420.0, 4e5, 0.01)
    d = size * np.sin(t**2)
    rate = 2 * size * t * np.cos(t**2)
    second = size * (2 * np.cos(t**2) - 4 * t**2 * np.sin(t**2))
    side = -m * arm * (second * np.cos(d) - rate**2 * np.sin(d)) - T * np.sin(d)
    np.testing.assert_allclose(run["gimbal.angle"], np.stack([d, 0 * t], axis=1), atol=1e-11)
    np.testing.assert_allclose(run["gimbal.force.y"], side, atol=1e-8 * T * size)
    # accelerations of tables of time are good to 1e-9 of the largest
    largest = np.abs(J * second).max()
    np.testing.assert_allclose(run["gimbal.drive"], np.stack([J * second, 0 * t], axis=1), atol=2e-9 * largest)
    near = np.abs(2 * t - np.sqrt(T / (m * arm))) < 0.1
    # second order of d, the chirp's own acceleration 2 / w^2, and 0.1 of 31.6 rad/s either side
    assert np.abs(run["gimbal.force.y"][near]).max() < 0.012 * T * size
    assert np.abs(run["gimbal.force.y"][t < 5]).max() > 0.95 * T * size


def test_commanded_nozzle_turns_the_rocket():
    """Rigid limit of a heavy rocket: theta'' = -T l d / I, a = T d / m, by a small constant command."""
    rocket = mp.rigid_body("rocket", mass=1e5, centre=np.array([15.0, 0, 0]), inertia=1e5 * np.diag([1, 75, 75.0]),
                           interfaces={"tail": np.zeros(3), "centre": np.array([15.0, 0, 0])})  # fmt: skip
    nozzle = mp.rigid_body("nozzle", mass=1e-2, centre=np.zeros(3), inertia=1e-2 * np.eye(3),
                           interfaces={"hinge": np.zeros(3)})  # fmt: skip
    command = 1e-3
    motion = (mp.multibody.TimeFunction(command), mp.multibody.TimeFunction(0))
    gimbal = mp.Joint(name="gimbal", type="universal", parent="rocket.tail", child="nozzle",
                      second_axis=np.array([0, 1.0, 0]), motion=motion)  # fmt: skip
    flight = mp.Joint(name="flight", type="free", parent="ground", child="rocket")
    thrust = mp.PointForce(name="thrust", at="nozzle.hinge", force=(4e5, 0, 0), axes="body")
    system = mp.System(bodies={"rocket": rocket, "nozzle": nozzle}, joints=(flight, gimbal), loads=(thrust,))
    run = mp.simulate(system, t_end=1.0, output_step=0.5)
    side = 4e5 * np.sin(command)
    assert run["rocket.centre.acceleration.y"][0] == pytest.approx(side / 1e5, rel=1e-6)  # mass of the nozzle
    assert run["flight.angular_velocity.z"][-1] == pytest.approx(-15 * side / 75e5, rel=1e-6)


@pytest.fixture(scope="module")
def flexible(tmp_path_factory):
    return only_run("flexible-rocket", tmp_path_factory.mktemp("flexible"))


@pytest.mark.slow
def test_flexible_rocket_follows_its_programme(flexible):
    run = flexible
    assert run.status == "done"
    assert run.stats["energy_error"] < 1e-9
    angle = Rotation.from_quat(run["stage.orientation"], scalar_first=True).as_rotvec()
    assert np.abs(angle[:, :2]).max() < 1e-9  # in its plane
    assert angle[at(run, 15.0), 2] == pytest.approx(0.3, abs=0.03)
    np.testing.assert_allclose(run["stage.mass"], np.maximum(6000 - 160 * run.time, 3000), rtol=1e-12)
    assert np.abs(run["stage.nose.deflection.y"]).max() < 1.5  # of 30 m: small for modes
    assert np.abs(run["gimbal.angle"]).max() < 0.1


@pytest.mark.slow
def test_flexible_rocket_speeds_up_as_its_mass_falls(flexible):
    """Impulse: d(m v) = T dt less what leaves at the rocket's speed; steered by less than 0.3 rad."""
    speed = np.linalg.norm(flexible["stage.tail.velocity"][-1])
    assert speed == pytest.approx(2500 * np.log(6100 / 3100), rel=0.01)


def test_flexible_rocket_turns_in(tmp_path):
    """The first seconds: the nozzle pushes the tail aside, the stage turns and bends, energy balances."""
    system, table = shipped("flexible-rocket", tmp_path)
    run = mp.simulate(system, t_end=2.0, output_step=0.5, rtol=table.rtol, method="explicit")
    assert run["gimbal.angle"][-1, 0] < -1e-4
    assert run["stage.nose.deflection.y"][-1] < -1e-3
    assert run["stage.nose.position.y"][-1] > 1e-3
    assert run.stats["energy_error"] < 1e-9
    np.testing.assert_allclose(run["stage.mass"], 6000 - 160 * run.time, rtol=1e-12)


def test_bending_modes_are_damped_where_the_nozzle_acts(tmp_path):
    """Poles of the closed loop over the burn: sensed at the tail none grows, at the nose one does."""
    system, _ = shipped("flexible-rocket", tmp_path)
    for t in (5.0, 18.0):
        assert mp.system_modes(system, t=t).eigenvalue.real.max() < 1e-6
    text = (PIPELINES / "flexible-rocket.toml").read_text().replace('"rocket-', f'"{PIPELINES}/rocket-')
    for what in ("rotation", "angular_velocity"):
        assert f"stage.tail.{what}" in text
        text = text.replace(f"stage.tail.{what}", f"stage.nose.{what}")
    path = tmp_path / "moved.toml"
    path.write_text(text)
    other = read_system(load(path), tmp_path, Reporter(quiet=True))
    assert mp.system_modes(other, t=5.0).eigenvalue.real.max() > 0.1
