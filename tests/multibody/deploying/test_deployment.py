"""Deployments: momentum and energy through every event, closed forms of one rod and of a straight cable."""

from types import SimpleNamespace

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section
from modalprep.multibody.kernels.loads import deployment
from modalprep.multibody.model.deployment import LEAST

BOOM = {"name": "boom", "parent": "bus.exit", "length": 4.0, "segments": 8, "mass_per_length": 1.0}
BEAM = BOOM | {"EI": 200.0}
CABLE = BOOM
TETHER = BOOM | {"spatial": True, "rotary_inertia": 1e-3}
FOREVER = float("inf")


def flying(spin=(0.0, 0.0, 0.5)):
    """A free body with the exit off its centre of mass."""
    bus = mp.rigid_body(
        "bus", mass=40.0, centre=np.array([0.1, 0.05, 0]), inertia=50 * np.eye(3),
        interfaces={"root": np.zeros(3), "exit": np.array([0.5, 0.2, 0])},
    )  # fmt: skip
    fly = mp.Joint(
        name="fly",
        type="free",
        parent="ground",
        child="bus",
        angular_velocity=np.array(spin),
        velocity=np.array([0.1, -0.2, 0]),
    )
    return {"bodies": {"bus": bus}, "joints": (fly,)}


def run(deployment, base=None, t_end=3.0, **options):
    system = mp.multibody.DeployingSystem(**(base or flying()), deployments=(deployment,))
    return mp.multibody.simulate_deployment(system, t_end=t_end, output_step=0.05, rtol=1e-9, **options)


def drift(history):
    return np.abs(history - history[0]).max() / np.abs(history).max()


OUT, IN = "1.2 + t/2", "3.7 - 0.6*t"
TURNED = [(1.0, "1.2 + t/2"), (FOREVER, "1.7 - 0.3*(t - 1)")]
CASES = {
    "beam out": (mp.multibody.Deployment(**BEAM, deployed_length=OUT), {"insert"}),
    "beam in": (mp.multibody.Deployment(**BEAM, deployed_length=IN), {"remove"}),
    "beam out and in": (mp.multibody.Deployment(**BEAM, deployed_length="2 + sin(1.5*t)"), {"insert", "remove"}),
    "beam jams": (mp.multibody.Deployment(**BEAM, deployed_length=OUT, stop_time=1.7), {"insert", "stop"}),
    "beam turns back": (mp.multibody.Deployment(**BEAM, deployed_length=TURNED), {"insert", "kink", "remove"}),
    "cable out": (mp.multibody.Deployment(**CABLE, deployed_length=OUT), {"insert", "unlock"}),
    "cable in": (mp.multibody.Deployment(**CABLE, deployed_length=IN), {"lock", "remove"}),
    "tether out": (mp.multibody.Deployment(**TETHER, deployed_length=OUT), {"insert", "unlock"}),
    "tether in": (mp.multibody.Deployment(**TETHER, deployed_length=IN), {"lock", "remove"}),
    "reel out": (
        mp.multibody.Deployment(**CABLE, tension=0.2, brake=0.1, initial_length=1.2, initial_speed=0.3),
        {"insert", "unlock"},
    ),
    "reel in": (
        mp.multibody.Deployment(**CABLE, tension=4.0, brake=0.1, initial_length=3.2, initial_speed=-0.1),
        {"lock", "remove"},
    ),
    "beam on a reel": (
        mp.multibody.Deployment(**BEAM, tension=0.2, brake=0.1, initial_length=1.2, initial_speed=0.3),
        {"insert"},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_momentum_and_energy(case):
    """Of a free base, through every event; with the spin also out of the plane where the cable may follow.

    The integrator's error is 1e-9 at rtol 1e-9; a corner of a cable in the exit is a fast swing, good to 1e-8.
    """
    deployment, names = CASES[case]
    found = run(deployment, flying((0.05, 0.1, 0.5) if deployment.spatial else (0.0, 0.0, 0.5)))
    assert names <= {name.removeprefix("boom.") for name in found.events}
    most = 1e-8 if names >= {"lock"} else 1e-9
    assert drift(found["momentum.linear"]) < most
    assert drift(found["momentum.angular"]) < most
    assert found.stats["energy_error"] < 1e-8
    if names <= {"insert", "unlock"}:  # nothing jumps
        assert np.abs(found["energy.events"]).max() < 1e-12 * found["energy.kinetic"].max()
    elif names & {"lock", "stop"}:
        assert found["energy.events"][-1] < 0


def test_events_of_a_law_are_at_its_levels():
    """Rods of half a metre join and leave where the length says so; a cable's turn from LEAST of a rod on."""
    law = mp.multibody.Deployment(**CABLE, deployed_length="1.2 + t/2")
    found = run(law).events
    np.testing.assert_allclose(1.2 + found["boom.insert"] / 2, [1.5, 2.0, 2.5], rtol=1e-12)
    np.testing.assert_allclose(1.2 + found["boom.unlock"] / 2, np.array([1.5, 2.0, 2.5]) + LEAST / 2, rtol=1e-12)
    reel = run(CASES["reel out"][0])
    at = np.interp(reel.events["boom.insert"], reel.time, reel["boom.length"])
    np.testing.assert_allclose(at, [1.5, 2.0][: len(at)], atol=1e-4)  # of the interpolation


def test_rigid_beam_takes_angular_momentum():
    """A single rod out of a free hub: ``(I + m L^3 / 3) Omega`` stays, exactly (the beam does not bend)."""
    hub = mp.rigid_body("hub", mass=1.0, centre=np.zeros(3), inertia=5 * np.eye(3), interfaces={"root": np.zeros(3)})
    pivot = mp.Joint(name="pivot", type="revolute", parent="ground", child="hub", rate=2.0)
    one = mp.multibody.Deployment(
        name="boom",
        parent="hub.root",
        length=4.0,
        segments=1,
        mass_per_length=1.2,
        EI=1.0,
        deployed_length="t + t**2/4",
    )
    found = run(one, {"bodies": {"hub": hub}, "joints": (pivot,)}, t_end=2.4)
    inertia = 5 + 1.2 * found["boom.length"] ** 3 / 3
    np.testing.assert_allclose(inertia * found["pivot.rate"], 10.0, rtol=1e-9)


def test_reel_drawn_out_by_spin():
    """One rod, no tension, hub at constant Omega: ``m L L'' = m Omega^2 L^2 / 2``, so ``L = L0 cosh(Omega t/sqrt 2)``.

    What is still stowed is not accelerated by the rod outside, but by the reel.
    """
    hub = mp.rigid_body("hub", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    drive = mp.Joint(
        name="drive", type="revolute", parent="ground", child="hub", motion=mp.multibody.TimeFunction("2*t")
    )
    one = mp.multibody.Deployment(
        name="boom",
        parent="hub.root",
        length=9.0,
        segments=1,
        mass_per_length=1.2,
        EI=1.0,
        tension=0.0,
        initial_length=0.5,
    )
    found = run(one, {"bodies": {"hub": hub}, "joints": (drive,)}, t_end=1.5)
    np.testing.assert_allclose(found["boom.length"], 0.5 * np.cosh(np.sqrt(2) * found.time), rtol=1e-8)


def test_stop_takes_the_energy_of_relative_motion():
    """On a straight line ``m (M - m) / M v^2 / 2``: m is outside, M all."""
    straight = flying((0.0, 0.0, 0.0))
    body = straight["bodies"]["bus"]
    centred = mp.rigid_body(
        "bus",
        mass=40.0,
        centre=np.zeros(3),
        inertia=50 * np.eye(3),
        interfaces={"root": np.zeros(3), "exit": np.zeros(3)},
    )
    assert body.m == centred.m
    found = run(
        mp.multibody.Deployment(**BEAM, deployed_length=OUT, stop_time=1.7), straight | {"bodies": {"bus": centred}}
    )
    outside, total = 1.2 + 0.85, 40.0 + 4.0
    assert found["energy.events"][-1] == pytest.approx(-0.5 * outside * (total - outside) / total * 0.25, rel=1e-9)
    assert np.ptp(found["boom.length"][found.time > 1.7]) == 0


def test_hanging_cable_carries_its_weight():
    """Paid out downwards at constant speed, no rod swings: the tension at the exit is the weight outside."""
    cable = mp.multibody.Deployment(
        name="rope", parent="ground", length=5.0, segments=10, mass_per_length=0.7, deployed_length="1 + t",
        axis=np.array([0, -1.0, 0]),
    )  # fmt: skip
    found = run(cable, {"bodies": {}, "joints": (), "gravity": np.array([0, -9.81, 0])})
    np.testing.assert_allclose(found["rope.tension"], 0.7 * 9.81 * found["rope.length"], rtol=1e-9)
    np.testing.assert_allclose(found["rope1.tip.position.y"], -found["rope.length"], rtol=1e-9)


def test_all_in_and_out_again():
    """Nothing is out for a moment: no rods, the tip in the exit; at the end all of it."""
    law = [(2.0, "2*(1 - t/2)**2"), (4.0, "(t - 2)**2"), (FOREVER, "4")]
    found = run(mp.multibody.Deployment(**BEAM, deployed_length=law), t_end=5.0)
    inside = np.argmin(found["boom.length"])
    assert found["boom.rods"][inside] == 0
    np.testing.assert_allclose(found["boom1.tip.position"][inside], found["bus.exit.position"][inside], atol=1e-9)
    assert found["boom.rods"][-1] == 8
    assert np.isnan(found["boom3.tip.position"][inside]).all()
    assert drift(found["momentum.angular"]) < 1e-9


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"deployed_length": "3 + t"}, r"deployed_length = .* must be between"),
        ({"deployed_length": [(1.0, "1"), (FOREVER, "2")]}, "jumps from 1 to 2 m at t = 1 s"),
        ({"deployed_length": None}, "either a 'deployed_length'"),
        ({"deployed_length": "1", "segments": 0}, "segments = 0"),
        ({"deployed_length": "1", "spatial": True}, "bends in a plane"),
        ({"deployed_length": "1", "axis": np.array([0, 0, 1.0])}, "parallel"),
        ({"deployed_length": None, "tension": 1.0, "initial_length": 5.0}, "initial_length = 5 m"),
    ],
)
def test_bad_input(changes, words):
    with pytest.raises(mp.InputError, match=words):
        run(mp.multibody.Deployment(**(BEAM | changes)))


def test_base_with_modes_is_refused():
    from modalprep.examples import uniform_beam

    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="bus")
    with pytest.raises(mp.InputError, match="body 'bus' has modes"):
        mp.multibody.DeployingSystem(
            bodies={"bus": uniform_beam(modes=2)},
            joints=(hinge,),
            deployments=(mp.multibody.Deployment(**BEAM, deployed_length="1"),),
        )


def test_bodies_beside_a_deployment_recover_their_forces():
    """A flexible arm on the bus carries a mass: its root reaction is what the weld gives it, its tip what it takes."""
    mesh = beam_mesh(4, 1.0)
    ends = {"root": mp.Interface(group="root", kind="node"), "tip": mp.Interface(group="tip", kind="node")}
    model = mp.assemble(mesh, {"beam": spinup_section()}, ends)
    wanted = {"base": mp.fe.Recover(kind="reaction"), "beam": mp.fe.Recover(kind="section_force")}
    recovery = mp.fe.model_recovery(model, mesh, wanted)
    arm = mp.flexible_body(model, mp.craig_bampton(model, modes=2), name="arm", damping=0.05, recovery=recovery)
    load = mp.rigid_body("load", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    base = flying()
    joints = (
        *base["joints"],
        mp.Joint(name="foot", type="weld", parent="bus.root", child="arm"),
        mp.Joint(name="hand", type="weld", parent="arm.tip", child="load"),
    )
    system = base | {"bodies": {**base["bodies"], "arm": arm, "load": load}, "joints": joints}
    boom = mp.multibody.Deployment(**BEAM, deployed_length=OUT)
    found = run(boom, system, t_end=1.2)
    assert len(found.events["boom.insert"])
    # forces of the modal dampers, 5 % of critical, and of Coriolis are none of the recovery
    for joint, sign, names in (("foot", 1, "base.root.Fx base.root.Fy"), ("hand", -1, "beam.4.end.N beam.4.end.Vy")):
        own = np.stack([found[f"arm.recovery.{name}"] for name in names.split()], axis=1)
        force = sign * found[f"{joint}.force"]  # in the axes of the parent
        assert own == pytest.approx(force[:, :2], abs=5e-3 * np.abs(force).max())
    assert {each.name for each in mp.multibody.envelopes(found, {"arm": arm})} == {"base", "beam"}


def test_stowed_mass_counts_at_the_exit():
    """Steiner: m r and m (r^2 1 - r r^T), in the order xx, xy, xz, yy, yz, zz."""
    add_stowed = getattr(deployment._stowed, "py_func", deployment._stowed)
    own = SimpleNamespace(mass=1.0, first_moment=np.zeros(3), inertia=np.zeros(6))
    r, m = np.array([0.2, -0.3, 0.5]), 0.8 * (10.0 - 4.0)
    add_stowed(own, r, SimpleNamespace(mass_per_length=0.8, length=10.0), 4.0)
    assert own.mass == pytest.approx(1.0 + m)
    np.testing.assert_allclose(own.first_moment, m * r)
    np.testing.assert_allclose(own.inertia, (m * (r @ r * np.eye(3) - np.outer(r, r)))[np.triu_indices(3)])


def test_the_hinge_at_the_exit_by_differences():
    """k = EI / (b0 + b1 x + b2 x^2), x beyond the innermost rod, and its rest angle; derivatives by the length."""
    law = getattr(deployment._stiffness, "py_func", deployment._stiffness)
    spring = SimpleNamespace(EI=30.0, bend=np.array([0.2, 0.7, 0.9]), fading_rest=0.05)
    reel = SimpleNamespace(inner=2.0, rod_length=0.5)
    k, rest, by_length, rest_by_length = law(spring, reel, 2.3)
    assert k == pytest.approx(30.0 / (0.2 + 0.7 * 0.3 + 0.9 * 0.09))
    assert rest == pytest.approx(0.05 * 0.2 / 0.5)
    before, after = (np.array(law(spring, reel, 2.3 + h)[:2]) for h in (-1e-6, 1e-6))
    np.testing.assert_allclose((after - before) / 2e-6, [by_length, rest_by_length], rtol=1e-7)
