"""Momenta of what nothing holds: they stay, by every method, and a run that loses them is no success."""

import json

import numpy as np
import pytest
from multibody.trees import random_tree
from scipy.spatial.transform import Rotation
from size import FULL, seeds

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import beam_mesh, uniform_beam
from modalprep.multibody.integration.method_selection import METHODS
from modalprep.multibody.packing import free_parts as packing
from modalprep.multibody.packing.free_parts import FreePart, free_parts
from modalprep.multibody.results.validity import failures
from modalprep.pipeline.systems import systems

GRAVITY = np.array([0.5, 0.0, -9.81])
SMALL = 1e-10  # round-off of the products of places and momenta
RTOL = {"explicit": 1e-7, "rosenbrock": 1e-5, "generalised_alpha": 1e-4}


def flying(body, **start):
    start = {"velocity": np.array([1.0, 0.2, 0.0]), "angular_velocity": np.array([0.1, 0.2, 2.0])} | start
    return mp.Joint(name=f"flight of {body}", type="free", parent="ground", child=body, **start)


def two(*loads, closures=(), joints=("a", "b"), bodies=None, **others):
    bodies = bodies or {name: uniform_beam(modes=1) for name in ("a", "b")}
    return mp.System(bodies=bodies, joints=tuple(map(flying, joints)), loads=loads, closures=closures, **others)


# --- what nothing holds -------------------------------------------------------------------------------------------


def test_bodies_that_exert_forces_on_each_other_are_one_part():
    spring = mp.multibody.AxialSpring(name="s", between=("a.tip", "b.tip"), stiffness=1.0)
    to_ground = mp.multibody.AxialSpring(name="s", between=("ground", "b.tip"), stiffness=1.0)
    rod = mp.multibody.Closure(name="c", type="distance", a="a.tip", b="b.tip", active=False)
    hook = mp.multibody.Closure(name="c", type="spherical", a="ground", b="a.tip", active=False)
    assert [part.bodies for part in free_parts(two())] == [("a",), ("b",)]
    assert [part.bodies for part in free_parts(two(spring))] == [("a", "b")]
    assert [part.bodies for part in free_parts(two(closures=(rod,)))] == [("a", "b")]
    assert [part.bodies for part in free_parts(two(closures=(hook,)))] == [("b",)]
    assert [part.bodies for part in free_parts(two(to_ground, gravity=GRAVITY))] == [("a",)]
    assert free_parts(two(spring, to_ground)) == ()


@pytest.mark.parametrize(("load", "why"), [
    (mp.PointForce(name="push", at="a.tip", force=(1, 0, 0)), "load 'push' acts on it"),
    (mp.multibody.Callback(name="pilot", function=lambda t, state: {}), "load 'pilot' acts on it"),
    (mp.multibody.CentralGravity(mu=1.0, centre=np.array([0, 0, 9.0])), "a planet attracts it"),
])  # fmt: skip
def test_a_part_that_is_loaded_says_that_its_momentum_is_not_audited(load, why):
    """In the notes of the run; the other part is audited where the load cannot reach it."""
    a, b = free_parts(two(load))
    assert (a.loaded, b.loaded) == (why, "" if "push" in why else why)
    run = mp.simulate(two(load), t_end=0.01)
    assert sum("is not audited" in note for note in run.notes) == (1 if "push" in why else 2)
    assert any(f"the momentum of 'a' is not audited, as {why}" in note for note in run.notes)
    assert ("momentum_error" in run.stats) == ("momentum.error" in run) == ("push" in why)


# --- they stay ----------------------------------------------------------------------------------------------------


def satellite():
    """A hub that spins with two flexible panels, each of them to one side: the mass centre is not on the axis."""
    section = mp.Beam(material=mp.Material(E=7e10, nu=0.3, rho=2700.0), A=4e-4, Iy=2e-8, Iz=1e-8, J=3e-8)
    ends = {"root": mp.Interface(group="root", kind="node"),
            "tip": mp.Interface(group="tip", kind="node", boundary="free")}  # fmt: skip
    model = mp.assemble(beam_mesh(20, 2.0), {"beam": section}, ends)
    panel = mp.flexible_body(model, mp.craig_bampton(model, modes=4, truncation=()), name="p")
    sides = {"c": np.zeros(3), "r": np.array([0.3, 0, 0]), "l": np.array([0, -0.3, 0.1])}
    hub = mp.rigid_body("hub", mass=100.0, centre=np.zeros(3), inertia=np.diag([8.0, 10.0, 14.0]), interfaces=sides)
    turn = np.array([[0, 1.0, 0], [-1, 0, 0], [0, 0, 1]])
    joints = (
        flying("hub", velocity=np.zeros(3), angular_velocity=np.array([0.2, 0.3, 3.0])),
        mp.Joint(name="a", type="weld", parent="hub.r", child="p1"),
        mp.Joint(name="b", type="weld", parent="hub.l", child="p2", rotation=turn),
    )
    return mp.System(bodies={"hub": hub, "p1": panel, "p2": panel}, joints=joints)


@pytest.mark.parametrize("method", ["auto", "rosenbrock"])
def test_a_spinning_satellite_keeps_its_momenta(method):
    """In 628 s it lost 0.07 % and 0.5 % of its linear momentum, in proportion to the time."""
    run = mp.simulate(satellite(), t_end=628.0 if FULL else 20.0, output_step=0.5, method=method)
    for name in ("momentum.linear", "momentum.angular"):
        lost = np.linalg.norm(run[name] - run[name][0], axis=1).max()
        assert lost < 1e-10 * np.linalg.norm(run[name][0]), name  # round-off of 2000 places
    assert run.stats["momentum_error"] < 1e-11
    assert failures(run, 1e-5, 100.0) == ()


@pytest.mark.parametrize("method", METHODS)
def test_the_mass_centre_flies_along_its_parabola(method):
    """A rigid body whose root is far from its mass centre, tumbling under gravity 1e4 m from the origin: Euler."""
    centre, J = np.array([0.4, -0.2, 0.7]), np.diag([1.0, 2.0, 2.5])
    body = mp.rigid_body("arm", mass=3.0, centre=centre, inertia=J, interfaces={"root": np.zeros(3)})
    start = Rotation.random(random_state=4).as_matrix()
    joint = flying("arm", position=np.array([1e4, 0, 0]), rotation=start)
    run = mp.simulate(mp.System(bodies={"arm": body}, joints=(joint,), gravity=GRAVITY), t_end=20.0, method=method)
    turn, t = Rotation.from_quat(run["arm.orientation"], scalar_first=True), run.time[:, None]
    spin = run["flight of arm.angular_velocity"]
    speed = start @ (joint.velocity + np.cross(joint.angular_velocity, centre))
    flown = joint.position + start @ centre + speed * t + GRAVITY * t**2 / 2
    way = 1e4  # m
    assert np.abs(run["arm.origin"] + turn.apply(centre) - flown).max() < 1e-12 * way  # round-off
    angular = turn.apply(spin @ J)
    assert np.abs(angular - angular[0]).max() < 1e-11 * np.linalg.norm(angular[0])
    assert run.stats["momentum_error"] < 1e-11


@pytest.mark.parametrize("seed", seeds(100)[: None if FULL else 3])
def test_random_trees_in_free_flight(seed):
    """Trees with modes, all joints, driven and free ones in them, half of them under gravity; every method."""
    system = random_tree(seed, gravity=seed % 2 > 0)
    rng = np.random.default_rng(seed)
    first = system.joints[0].with_(velocity=rng.standard_normal(3), angular_velocity=rng.standard_normal(3))
    system, mass = system.with_(joints=(first, *system.joints[1:])), sum(body.m for body in system.bodies.values())
    for method, rtol in RTOL.items():
        run = mp.simulate(system, t_end=5.0, output_step=0.1, method=method, rtol=rtol)
        pull = mass * np.outer(run.time, system.gravity)
        lost = run["momentum.linear"] - run["momentum.linear"][0] - pull
        assert np.abs(lost).max() < SMALL * np.abs(run["momentum.linear"]).max(), (method, run.stats)
        if seed % 2 == 0:
            lost = run["momentum.angular"] - run["momentum.angular"][0]
            assert np.abs(lost).max() < SMALL * np.abs(run["momentum.angular"]).max(), (method, run.stats)
        assert failures(run, rtol, mass) == (), method


def test_two_bodies_on_a_rod_keep_the_momenta_of_both():
    """A closed loop between two free bodies, and another body that flies by; implicit, with its own deviations."""
    rod = mp.multibody.Closure(name="rod", type="distance", a="a.tip", b="b.root")
    bodies = {name: uniform_beam(modes=2) for name in ("a", "b", "c")}
    system = two(closures=(rod,), joints=("a", "b", "c"), bodies=bodies)
    aside = system.joints[1].with_(position=np.array([11.0, 1.0, 0.5]))
    system = system.with_(joints=(system.joints[0], aside, system.joints[2]))
    run = mp.simulate(system, t_end=2.0, method="rosenbrock")
    for name in ("momentum.linear", "momentum.angular"):
        lost = run[name] - run[name][0]
        assert np.abs(lost).max() < SMALL * np.linalg.norm(run[name][0]), name
    assert np.abs(run["rod.violation"]).max() < 1e-9


# --- the audit ----------------------------------------------------------------------------------------------------


def test_a_force_that_is_overlooked_fails_the_run(monkeypatch):
    """The steps take all away that the force adds, so that the momenta stay, but the sum of it is known."""
    push = mp.PointForce(name="push", at="a.tip", force=(2.0, 0, 0))
    monkeypatch.setattr(packing, "free_parts", lambda system: [FreePart(("a",), "")])
    run = mp.simulate(two(push, joints="a", bodies={"a": uniform_beam(modes=1)}), t_end=4.0)
    assert failures(run, 1e-5, 12.0)[-1].startswith("the steps lost ")
    assert run.stats["momentum_restored"] > 0.03  # 8 N s of the momenta that 600 J can have in 12 kg, 200 N s


def test_momenta_that_do_not_stay_fail_the_run():
    run = mp.Result(time=np.arange(2.0), channels={}, status="done", message="", stats={"momentum_error": 2e-3})
    (why,) = failures(run, 1e-5, 1.0)
    assert why.startswith("the momenta of what nothing holds stay to 2e-03 only, which is worse than 1e-03 (100 times")
    assert failures(run, 1e-4, 1.0) == ()


def test_the_audit_reaches_terminal_json_and_exit_code(tmp_path, capsys, monkeypatch):
    (tmp_path / "job.toml").write_text("""
[bodies.b]
mass = 1.0
centre = [0.1, 0, 0]
inertia = [1, 1, 1]
interfaces = { c = [0, 0, 0] }
[joints.j]
type = "free"
child = "b.c"
start = { angular_velocity = [0, 0, 3] }
[simulation]
t_end = 2.0
""")
    job = str(tmp_path / "job.toml")
    assert main(["simulate", job]) == 0
    assert "momenta kept to " in capsys.readouterr().out
    assert main(["simulate", job, "--json"]) == 0
    (run,) = json.loads(capsys.readouterr().out)["runs"].values()
    assert run["momentum_error"] < SMALL
    found = mp.read_result(tmp_path / "output/job/job-run.h5")
    assert found.stats["momentum_error"] == run["momentum_error"] == found["momentum.error"].max()

    def lossy(*args, **options):
        run = mp.simulate(*args, **options)
        return run.with_(stats=run.stats | {"momentum_error": 0.5})

    monkeypatch.setattr(systems, "simulate", lossy)
    assert main(["simulate", job]) == 1
    said = capsys.readouterr().err
    assert "job.toml: 1 requirement is not met: momenta (the momenta of what nothing holds stay to 5e-01 only" in said


def test_ensembles_have_the_audit_of_every_case():
    system = two(joints="a", bodies={"a": uniform_beam(modes=1)})
    found = mp.simulate_many(system, {"flight of a.angular_velocity.z": [1.0, 2.0]}, t_end=0.5)
    assert found.audit == ("", "")
    assert np.all(found.momentum_error < SMALL)
