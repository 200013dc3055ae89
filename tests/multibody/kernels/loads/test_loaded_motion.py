"""Loads in simulations: closed forms, energy balance, equal answers by other ways."""

import numpy as np
import pytest
from multibody.loaded_trees import loaded_tree
from multibody.trees import random_body
from scipy.integrate import quad
from scipy.optimize import brentq

import modalprep as mp
from modalprep.multibody import Callback

M = 2.0
BLOCK = mp.rigid_body("block", mass=M, centre=np.zeros(3), inertia=np.diag([0.3, 0.4, 0.5]),
                      interfaces={"root": np.zeros(3), "eye": np.array([0.5, 0, 0])})  # fmt: skip
SHARP = dict(rtol=1e-10, atol=1e-12)
CLOSE = dict(rtol=1e-8, atol=1e-8)  # of a run at rtol 1e-10 over some hundred steps


def slider(elements=(), *loads, **joint):
    """A block that slides along x."""
    options = dict(name="j", type="prismatic", parent="ground", child="block", axis=np.array([1.0, 0, 0]))
    return mp.System(bodies={"block": BLOCK}, joints=(mp.Joint(**options, elements=elements, **joint),), loads=loads)


def free(*loads, **joint):
    """A free block."""
    hinge = mp.Joint(name="j", type="free", parent="ground", child="block", **joint)
    return mp.System(bodies={"block": BLOCK}, joints=(hinge,), loads=loads)


def balanced(run, limit=1e-8):
    return run.status == "done" and run.stats["energy_error"] < limit


@pytest.mark.parametrize("damping", [0.0, 0.8])
def test_spring_and_damper_on_a_mass(damping):
    k, x0 = 18.0, 0.4
    system = slider(mp.multibody.HingeElement(stiffness=k, free_position=0.1, damping=damping), displacement=0.1 + x0)
    run = mp.simulate(system, t_end=5.0, **SHARP)
    decay = damping / (2 * M)
    w = np.sqrt(k / M - decay**2)
    exact = 0.1 + x0 * np.exp(-decay * run.time) * (np.cos(w * run.time) + decay / w * np.sin(w * run.time))
    np.testing.assert_allclose(run["j.displacement"], exact, **CLOSE)
    assert balanced(run)


def test_pendulum_with_torsional_spring():
    """Period by the integral of dx / sqrt(2 (V(x0) - V(x)) / J) over a swing."""
    g, k, x0 = 9.81, 6.0, 1.2
    bob = mp.rigid_body("bob", mass=1.0, centre=np.array([0, -1.0, 0]), inertia=np.zeros((3, 3)),
                        interfaces={"root": np.zeros(3)})  # fmt: skip
    hinge = mp.Joint(name="j", type="revolute", parent="ground", child="bob", angle=x0,
                     elements=mp.multibody.HingeElement(stiffness=k))  # fmt: skip
    system = mp.System(bodies={"bob": bob}, joints=(hinge,), gravity=np.array([0, -g, 0]))
    # x = x0 sin(s) takes the singularity out of the integral
    period, _ = quad(lambda s: 4 * x0 * np.cos(s) / np.sqrt(2 * (swing(x0, g, k) - swing(x0 * np.sin(s), g, k))),
                     0, np.pi / 2, epsabs=1e-12)  # fmt: skip
    run = mp.simulate(system, t_end=period, output_step=period, **SHARP)
    assert run["j.angle"][-1] == pytest.approx(x0, abs=1e-8)
    assert abs(run["j.rate"][-1]) < 1e-6


def swing(x, g, k):
    """Potential of the pendulum."""
    return -g * np.cos(x) + k * x**2 / 2


def test_friction_slows_as_its_closed_form_and_takes_the_energy():
    """M v' = -f tanh(v / s): sinh(v / s) decays exponentially; all of M v^2 / 2 is f times the way, less s^2 terms."""
    f, s, v0 = 3.0, 0.05, 1.5
    run = mp.simulate(
        slider(mp.multibody.HingeElement(friction=f, transition_velocity=s), speed=v0), t_end=2.0, **SHARP
    )
    exact = s * np.arcsinh(np.sinh(v0 / s) * np.exp(-f * run.time / (M * s)))
    np.testing.assert_allclose(run["j.speed"], exact, **CLOSE)
    lost = -run["energy.work"][-1]
    assert lost == pytest.approx(M * v0**2 / 2, rel=1e-8)
    way = run["j.displacement"][-1]
    assert lost == pytest.approx(f * way, rel=2 * (s / v0) ** 2)  # pi^2 / 12 (s / v0)^2 x 2 creeps at the end
    assert balanced(run)


def test_friction_holds_up_to_its_level():
    """Below it the block creeps at s atanh(F / f), above it slides with F - f."""
    f, s = 3.0, 1e-4
    held, moving = (
        mp.simulate(
            slider(mp.multibody.HingeElement(friction=f, transition_velocity=s, drive=pull)),
            t_end=1.0,
            method="rosenbrock",
        )
        for pull in (2.4, 4.0)
    )
    assert held["j.speed"][-1] == pytest.approx(s * np.arctanh(0.8), rel=1e-5)
    assert moving["j.speed"][-1] == pytest.approx((4.0 - f) / M, rel=2e-4)  # s of 1 / M


@pytest.mark.parametrize("a", [0.0, 0.6])
def test_rebound_from_a_limit(a):
    """Hunt and Crossley: v - ln(1 + a v) / a is the same at arrival and departure."""
    v0 = 1.3
    stop = mp.multibody.HingeElement(upper=0.2, limit_stiffness=4e4, limit_damping=a)
    # the force has a kink at contact, where step control is at its worst: 2e-8 at rtol 1e-10, 6e-11 here
    run = mp.simulate(slider(stop, speed=v0), t_end=0.4, rtol=1e-11, atol=1e-13)
    expected = -v0
    if a:
        side = lambda v: v - np.log1p(a * v) / a  # noqa: E731
        expected = brentq(lambda v: side(v) - side(v0), -v0, -1e-9 * v0, xtol=1e-14)
        assert expected == pytest.approx(-v0 / (1 + 2 / 3 * a * v0), rel=0.02)  # what its documentation says
    assert run["j.speed"][-1] == pytest.approx(expected, rel=1e-7)
    assert balanced(run)


def test_force_may_jump():
    """Constant pieces give parabolas, to round-off: the integrator stops at each jump and both sides keep their own."""
    pieces = [(0.123, "4"), (0.5, "-2"), (float("inf"), "6")]
    system = slider((), mp.PointForce(name="f", at="block.eye", force=(mp.multibody.TimeFunction(pieces), 0, 0)))
    run = mp.simulate(system, t_end=1.0, rtol=1e-6)
    speed = (4 * 0.123 - 2 * (0.5 - 0.123) + 6 * 0.5) / M
    assert run["j.speed"][-1] == pytest.approx(speed, rel=1e-13)
    assert balanced(run, 1e-12)


def test_follower_force_turns_with_the_body():
    """Thrust F along body x at spin w: v = F / (M w) (sin wt, 1 - cos wt), and its work is M v^2 / 2."""
    F, w = 3.0, 2.0
    thrust = mp.PointForce(name="f", at="block.root", force=(F, 0, 0), axes="body")
    run = mp.simulate(free(thrust, angular_velocity=np.array([0, 0, w])), t_end=4.0, **SHARP)
    exact = F / (M * w) * np.column_stack([np.sin(w * run.time), 1 - np.cos(w * run.time), 0 * run.time])
    np.testing.assert_allclose(run["block.root.velocity"], exact, **CLOSE)
    np.testing.assert_allclose(run["energy.work"], M / 2 * np.sum(exact**2, axis=1), **CLOSE)


def test_torque_in_inertial_axes_turns_the_angular_momentum():
    torque = mp.PointForce(name="t", at="block.eye", torque=("t", 0.2, "cos(3*t)"))
    run = mp.simulate(free(torque, angular_velocity=np.array([0.3, -1.0, 0.5])), t_end=2.0, **SHARP)
    gained = np.column_stack([run.time**2 / 2, 0.2 * run.time, np.sin(3 * run.time) / 3])
    np.testing.assert_allclose(run["momentum.angular"] - run["momentum.angular"][0], gained, **CLOSE)
    np.testing.assert_allclose(run["momentum.linear"], 0 * gained, atol=1e-10)
    assert balanced(run)


def test_axial_spring_in_polar_coordinates():
    """A block on a spring about the origin: radius by energy and angular momentum, r(t) turns at their root."""
    k, free_length, r0, v0 = 5.0, 0.8, 1.0, 1.1
    spring = mp.multibody.AxialSpring(name="s", between=("ground", "block.root"), stiffness=k, free_length=free_length)
    system = free(spring, position=np.array([r0, 0, 0]), velocity=np.array([0, v0, 0]))
    run = mp.simulate(system, t_end=20.0, output_step=0.01, **SHARP)
    radius = np.linalg.norm(run["block.root.position"], axis=1)

    def surplus(r):  # kinetic energy of the radial motion
        return M * v0**2 / 2 * (1 - (r0 / r) ** 2) + k / 2 * ((r0 - free_length) ** 2 - (r - free_length) ** 2)

    turn = brentq(surplus, 1.0001 * r0, 3.0)
    assert radius.max() == pytest.approx(turn, rel=1e-4)  # the nearest output time is within 5e-3 s of the top
    assert radius.max() <= turn * (1 + 1e-9)
    assert balanced(run)


def test_bushing_is_six_oscillators():
    """About the root at the centre of mass, axes x and the rotation about z: exact, however large."""
    k = np.array([8.0, 11.0, 5.0, 2.0, 3.0, 4.0])
    c = np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.1])
    mount = mp.multibody.Bushing(name="b", between=("ground", "block.root"), stiffness=k, damping=c)
    angle = 1.1
    turned = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    run = mp.simulate(free(mount, position=np.array([0.7, 0, 0]), rotation=turned), t_end=6.0, **SHARP)
    x, spin = run["block.root.position.x"], run["block.eye.position"] - run["block.root.position"]
    np.testing.assert_allclose(x, decay(run.time, M, c[0], k[0], 0.7), **CLOSE)
    found = np.unwrap(np.arctan2(spin[:, 1], spin[:, 0]))
    np.testing.assert_allclose(found, decay(run.time, 0.5, c[5], k[5], angle), **CLOSE)
    assert balanced(run)


def decay(t, m, c, k, x0):
    """Damped oscillation from rest."""
    d = c / (2 * m)
    w = np.sqrt(k / m - d**2)
    return x0 * np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t))


MU, ORBIT = 3.986004418e14, 7.0e6
MEAN_MOTION = np.sqrt(MU / ORBIT**3)
PLANET = mp.multibody.CentralGravity(mu=MU)


def satellite(J, pitch):
    """On a circular orbit in x-y: its x axis `pitch` ahead of the local vertical, y along the track."""
    body = mp.rigid_body("sat", mass=500.0, centre=np.zeros(3), inertia=np.diag(J), interfaces={"root": np.zeros(3)})
    c, s = np.cos(pitch), np.sin(pitch)
    speed = np.sqrt(MU / ORBIT)
    joint = mp.Joint(
        name="orbit", type="free", parent="ground", child="sat", position=np.array([ORBIT, 0, 0]),
        rotation=np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), velocity=np.array([s * speed, c * speed, 0]),
        angular_velocity=np.array([0, 0, MEAN_MOTION]),
    )  # fmt: skip
    return mp.System(bodies={"sat": body}, joints=(joint,), loads=(PLANET,))


def test_pitch_libration_of_a_satellite():
    """sqrt(3 (Jb - Ja) / Jc) n with the long axis a up, b along the track, c normal (Hughes 1986, section 9.1)."""
    J, pitch = (200.0, 900.0, 1000.0), 1e-3
    w = MEAN_MOTION * np.sqrt(3 * (J[1] - J[0]) / J[2])
    run = mp.simulate(satellite(J, pitch).with_(bodies={"sat": long_body(J)}), t_end=2 * np.pi / w, output_step=20.0,
                      rtol=1e-11, atol=1e-13)  # fmt: skip
    along = run["sat.nose.position"] - run["sat.root.position"]
    up = run["sat.root.position"]
    angle = np.unwrap(np.arctan2(along[:, 1], along[:, 0]) - np.arctan2(up[:, 1], up[:, 0]))
    # amplitude^2 / 4 of the pendulum's period, and round-off of 1e-9 m in a position of 7e6 m
    np.testing.assert_allclose(angle, pitch * np.cos(w * run.time), atol=3e-6 * pitch + 1e-8)
    assert balanced(run, 1e-9)


def long_body(J):
    return mp.rigid_body("sat", mass=500.0, centre=np.zeros(3), inertia=np.diag(J),
                         interfaces={"root": np.zeros(3), "nose": np.array([1.0, 0, 0])})  # fmt: skip


def test_kepler_ellipse():
    """Half a period later, at the apoapsis."""
    e = 0.3
    system = satellite((1.0, 1.0, 1.0), 0.0)
    joint = system.joints[0].with_(velocity=np.array([0, np.sqrt(MU / ORBIT * (1 + e)), 0]))
    a = ORBIT / (1 - e)
    half = np.pi * np.sqrt(a**3 / MU)
    run = mp.simulate(system.with_(joints=(joint,)), t_end=half, output_step=half / 10, rtol=1e-11, atol=1e-9)
    expected = [-a * (1 + e), 0, 0]
    np.testing.assert_allclose(run["sat.root.position"][-1], expected, atol=1e-8 * a)
    assert balanced(run, 1e-9)


def test_distributed_load_of_gravity():
    """Weights on the particles' points are what uniform gravity does, for a body without geometric stiffness."""
    rng = np.random.default_rng(4)
    body = random_body(rng, 2, geometric=False)
    mass, points = rng.uniform(0.1, 1.0, 4), rng.standard_normal((4, 3))
    shape = 0.2 * rng.standard_normal((4, 3, 2))
    heavy = body.with_(m=mass.sum(), s0=mass @ points, S=np.einsum("p,pai->ai", mass, shape),
                       E0=np.einsum("p,pa,pb->ab", mass, points, points) + np.eye(3),
                       H=np.einsum("p,pb,pai->abi", mass, points, shape), points=points, shape=shape)  # fmt: skip
    g = np.array([1.0, -2.0, 0.5])
    joint = mp.Joint(name="j", type="universal", parent="ground", child="b", second_axis=np.array([1.0, 0, 0]))
    weights = mp.multibody.DistributedForce(name="w", body="b", force=np.outer(mass, g), axes="inertial")
    fallen = mp.System(bodies={"b": heavy}, joints=(joint,), gravity=g)
    pushed = mp.System(bodies={"b": heavy}, joints=(joint,), loads=(weights,))
    a, b = (mp.simulate(system, t_end=1.0, **SHARP) for system in (fallen, pushed))
    np.testing.assert_allclose(b["j.angle"], a["j.angle"], **CLOSE)
    np.testing.assert_allclose(b["b.modal"], a["b.modal"], **CLOSE)
    np.testing.assert_allclose(b["energy.work"], a["energy.gravity"][0] - a["energy.gravity"], **CLOSE)


def test_callback_controls_a_joint():
    """A spring and damper written as a control law."""
    law = Callback(name="pd", function=lambda t, s: {"j": -7 * s.joint("j").position - 0.5 * s.joint("j").rate})
    eye = Callback(name="pd", function=lambda t, s: {"block.eye": -7 * (s["block.eye"].position - [0.5, 0, 0])
                                                        - 0.5 * s["block.eye"].velocity})  # fmt: skip
    spring = mp.multibody.HingeElement(stiffness=7.0, damping=0.5)
    systems = slider((), law, speed=1.0), slider((), eye, speed=1.0), slider(spring, speed=1.0)
    runs = [mp.simulate(system, t_end=1.0, output_step=0.1, **SHARP) for system in systems]
    for run in runs[:2]:
        np.testing.assert_allclose(run["j.displacement"], runs[2]["j.displacement"], **CLOSE)
        assert balanced(run)


@pytest.mark.parametrize("seed", [0, 2, 3, 5])
def test_energy_balances_under_every_load(seed):
    """d(kinetic + strain + stored + gravity)/dt = power in; integrated along, below 1e-8 at rtol 1e-11."""
    run = mp.simulate(loaded_tree(seed), t_end=0.5, output_step=0.05, rtol=1e-11, atol=1e-13, method="explicit")
    assert np.ptp(run["energy.stored"]) > 1e-3
    assert np.abs(run["energy.work"]).max() > 1e-3
    assert balanced(run)


def test_dense_and_order_n_agree_under_every_load():
    """Steps across the kinks of limits and friction leave 1e-7 N m of 5 N m, wherever they fall."""
    options = {"t_end": 0.05, "output_step": 0.025, "rtol": 1e-9, "method": "explicit"}
    runs = [mp.simulate(loaded_tree(1), reference=reference, **options) for reference in (False, True)]
    for name in runs[0].channels:
        if not name.startswith("energy."):
            np.testing.assert_allclose(runs[1][name], runs[0][name], rtol=1e-6, atol=1e-6, err_msg=name)
