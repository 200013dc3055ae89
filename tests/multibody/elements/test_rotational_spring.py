"""Rotational springs between interfaces: closed forms, energy, momentum, and what they refuse.

Random trees compare them with the reference implementation (`kernels/test_forces.py`).
"""

import numpy as np
import pytest
from compare import assert_close
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.multibody.elements.rotational_spring import twist
from modalprep.multibody.results.validity import failures
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.force_elements import CharacteristicTable
from modalprep.pipeline.systems.systems import simulate_pipeline

SHARP = dict(rtol=1e-10, atol=1e-12)
J = 0.5
PLAY = (np.array([-0.3, -0.1, 0.1, 0.3]), np.array([-8.0, 0.0, 0.0, 8.0]))


def wheel(name="wheel"):
    return mp.rigid_body(
        name, mass=2.0, centre=np.zeros(3), inertia=np.diag([0.3, 0.4, J]), interfaces={"root": np.zeros(3)}
    )


def on_axle(spring, **start):
    joint = mp.Joint(name="axle", type="revolute", parent="ground", child="wheel", **start)
    return mp.System(bodies={"wheel": wheel()}, joints=(joint,), loads=(spring,))


def spring(**changes):
    return mp.multibody.RotationalSpring(**{"name": "s", "between": ("ground", "wheel.root")} | changes)


def test_linear_spring_and_damper_on_a_wheel():
    k, c, x0 = 18.0, 0.8, 0.4
    run = mp.simulate(on_axle(spring(stiffness=k, damping=c, free_angle=0.1), angle=0.1 + x0), t_end=4.0, **SHARP)
    decay = c / (2 * J)
    w = np.sqrt(k / J - decay**2)
    exact = 0.1 + x0 * np.exp(-decay * run.time) * (np.cos(w * run.time) + decay / w * np.sin(w * run.time))
    np.testing.assert_allclose(run["axle.angle"], exact, atol=1e-8)  # a run at rtol 1e-10 over some hundred steps
    np.testing.assert_allclose(run["s.angle"], run["axle.angle"], atol=1e-12)
    rate = run["axle.rate"]
    np.testing.assert_allclose(run["s.torque"], k * (run["s.angle"] - 0.1) + c * rate, atol=1e-9)
    assert run.stats["energy_error"] < 1e-8


def test_play_and_stops_by_a_table():
    """The period is the integral of dx / sqrt(2 (V(x0) - V(x)) / J); beyond the table the law goes straight on."""
    table, x0 = spring(characteristic=PLAY), 0.4
    knots = table.knots("stiffness")
    assert_close(knots[:, 2], PLAY[1], 1e-15)  # its own points
    energy = PchipInterpolator(*PLAY).antiderivative()

    def V(x):
        inside, beyond = min(x, 0.3), max(0.0, x - 0.3)
        return energy(inside) - energy(0.0) + (8.0 + slope * beyond / 2) * beyond

    slope = PchipInterpolator(*PLAY).derivative()(0.3)
    # x = x0 sin(s) takes the singularity out of the integral
    period = quad(
        lambda s: 4 * x0 * np.cos(s) / np.sqrt(2 * (V(x0) - V(x0 * np.sin(s))) / J), 0, np.pi / 2, epsabs=1e-9
    )[0]
    run = mp.simulate(on_axle(table, angle=x0), t_end=period, output_step=period / 8, **SHARP)
    assert run["axle.angle"][-1] == pytest.approx(x0, abs=1e-6)  # what the integral of a law with kinks leaves
    assert run.stats["energy_error"] < 1e-8


def test_damper_by_a_table():
    """Dry friction by a table: the wheel slows at a constant rate."""
    friction = ([-1.0, -0.01, 0.01, 1.0], [-2.0, -2.0, 2.0, 2.0])
    run = mp.simulate(on_axle(spring(damping_characteristic=friction), rate=6.0), t_end=1.0, **SHARP)
    assert_close(run["axle.rate"], 6.0 - 2.0 / J * run.time, 1e-9)  # of a run at rtol 1e-10
    assert run.stats["energy_error"] < 1e-8


def test_between_free_bodies_momentum_and_energy_stay():
    """The torque is the derivative of the energy also while the interfaces tilt."""
    loads = (spring(between=("a.root", "b.root"), axis=np.array([1.0, 2.0, -0.5]), characteristic=PLAY),)
    joints = [
        mp.Joint(name=f"j{k}", type="free", parent="ground", child=k, angular_velocity=np.array(w))
        for k, w in (("a", [0.3, -0.5, 0.2]), ("b", [-0.1, 0.6, 0.9]))
    ]
    run = mp.simulate(
        mp.System(bodies={"a": wheel("a"), "b": wheel("b")}, joints=tuple(joints), loads=loads), t_end=2.0, **SHARP
    )
    momentum = run["momentum.angular"]
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), atol=1e-9)
    assert run.stats["energy_error"] < 1e-7  # of a law whose slope jumps, at rtol 1e-10


@pytest.mark.parametrize("method", ["explicit", "rosenbrock", "generalised_alpha"])
def test_a_spring_wound_by_half_a_turn_ends_the_run(method):
    """The time by the closed form: with inertia J the angle is ``rate / w sin(w t)``, ``w^2 = k / J``."""
    run = mp.simulate(on_axle(spring(stiffness=0.1), rate=4.0), t_end=1.0, output_step=1e-3, method=method)
    free = mp.simulate(on_axle(spring(damping=1e-9), rate=4.0), t_end=1.0)  # without stiffness nothing jumps
    assert (run.status, free.status) == ("diverged", "done")
    assert run.message.startswith("ended at t = 0.8")
    assert "rotational spring 's' passes half a turn" in run.message
    assert np.pi - 5e-3 < run["s.angle"][-1] < np.pi  # 4 rad/s, outputs every ms
    assert "passes half a turn" in failures(run, 1e-5, 1.0)[0]


def test_a_spring_whose_torque_does_not_jump_turns_on():
    """A detent: the same torque, none, at half a turn forwards and backwards."""
    law = (np.linspace(-np.pi, np.pi, 41), 0.1 * np.sin(np.linspace(-np.pi, np.pi, 41)))
    law[1][[0, -1]] = 0.0
    run = mp.simulate(on_axle(spring(characteristic=law), rate=4.0), t_end=3.0)
    assert run.status == "done"


@pytest.mark.parametrize("seed", range(6))
def test_twist_and_its_derivative(seed):
    """The angle of a rotation about the axis, and its difference quotient under small rotations of the second frame."""
    rng = np.random.default_rng(seed)
    a, n = Rotation.random(random_state=seed), rng.standard_normal(3)
    n /= np.linalg.norm(n)
    flat = tuple(a.as_matrix().ravel())
    about = a * Rotation.from_rotvec(2.0 * n)
    assert twist(flat, tuple(about.as_matrix().ravel()), tuple(n))[0] == pytest.approx(2.0, rel=1e-14)
    tilted, h = about * Rotation.from_rotvec(0.7 * rng.standard_normal(3)), 1e-5
    _, G = twist(flat, tuple(tilted.as_matrix().ravel()), tuple(n))

    def angle(turn):
        return twist(flat, tuple((Rotation.from_rotvec(turn) * tilted).as_matrix().ravel()), tuple(n))[0]

    slope = [(angle(h * e) - angle(-h * e)) / (2 * h) for e in np.eye(3)]
    np.testing.assert_allclose(G, slope, rtol=1e-8, atol=1e-9)  # h^2 of the central difference


@pytest.mark.parametrize("method", ["rosenbrock", "generalised_alpha"])
def test_implicit_methods_know_it(method):
    """A stiff spring: the implicit methods take the explicit method's way, at a tolerance that both hold."""
    load = spring(stiffness=2e4, damping=5.0)
    start = dict(angle=1e-3, rate=0.2)
    exact = mp.simulate(on_axle(load, **start), t_end=0.2, method="explicit", rtol=1e-9, atol=1e-13)
    found = mp.simulate(on_axle(load, **start), t_end=0.2, method=method, rtol=1e-7, atol=1e-12)
    scale = np.abs(exact["axle.angle"]).max()
    assert np.abs(found["axle.angle"] - exact["axle.angle"]).max() < 1e-3 * scale


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"axis": np.zeros(3)}, "axis .* has no direction"),
        ({"stiffness": -1.0}, "stiffness = -1 must not be negative"),
        ({"stiffness": 1.0, "characteristic": PLAY}, "stiffness and characteristic exclude each other"),
        ({"characteristic": ([0.0, 1.0], [0.0])}, "characteristic: needs two lists of as many numbers"),
        ({"characteristic": ([1.0, 0.0], [0.0, 1.0])}, "characteristic: needs finite numbers, the first list incr"),
        ({"damping_characteristic": ([-1.0, 1.0], [2.0, 2.0])}, "damping_characteristic drives at some rates"),
        ({"between": ("wheel.root", "wheel.root")}, "joins wheel.root and wheel.root; name two different ends"),
    ],
)
def test_what_it_refuses(changes, message):
    with pytest.raises(mp.InputError, match=f"rotational spring 's': {message}"):
        spring(**changes)


def test_pipeline_file(tmp_path):
    (tmp_path / "law.csv").write_text("angle, torque\n-1, -3\n0, 0\n1, 3\n")
    text = """
[bodies.wheel]
mass = 2.0
inertia = [0.3, 0.4, 0.5]

[joints.axle]
type = "revolute"
child = "wheel.root"
start = { angle = "20 deg" }

[rotational_springs.s]
between = ["ground", "wheel.root"]
characteristic = { LAW }
damping = 0.1

[simulation]
t_end = 1.0
"""
    runs = []
    for given in ('file = "law.csv"', 'angle = [-1, "0 deg", 1], torque = [-3, 0, 3]'):
        (tmp_path / "job.toml").write_text(text.replace("LAW", given))
        simulated = simulate_pipeline(tmp_path / "job.toml", tmp_path / "out", Reporter(quiet=True))
        runs += simulated.runs.values()
    linear = mp.simulate(on_axle(spring(stiffness=3.0, damping=0.1), angle=np.radians(20)), t_end=1.0)
    assert len(runs) == 2
    for found in runs:
        np.testing.assert_allclose(found["axle.angle"], linear["axle.angle"], atol=1e-9)


def test_a_characteristic_is_given_once():
    for given in ({"angle": [0, 1], "file": "law.csv"}, {"angle": [0, 1]}, {}):
        with pytest.raises(ValueError, match="a characteristic needs both 'angle' and 'torque', or 'file'"):
            CharacteristicTable.model_validate(given)
