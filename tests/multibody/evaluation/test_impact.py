"""Impacts, sudden constraints, closures that begin and end at events, friction: closed forms and dense equations."""

import re

import numpy as np
import pytest
from multibody.closed_trees import TYPES, Evaluation, random_closures
from multibody.trees import random_body, random_state, random_tree
from size import FULL, some

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.multibody import Closure
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.evaluation.impact import Contact, impulses
from modalprep.multibody.integration.events import actions
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.constraints import closed_accelerations, dense_constraints
from modalprep.multibody.reference.equations import body_states, energy_and_momentum, mass_and_force

G = 9.81


def let_go(closures):
    return tuple(closure.with_(active=False) for closure in closures)


def struck_tree(seed):
    """A free tree, flexible or rigid, whose closures are all hit; the dense rows at its state."""
    system = random_tree(seed, root="free", most=1 if seed % 3 == 0 else 6)
    system = system.with_(closures=let_go(random_closures(system, seed, 1 + seed % 2)))
    y, evaluator = random_state(system, seed), Evaluator(system)
    evaluator.load(y)
    rows = dense_constraints(system, evaluator.packed, evaluator.loops, y, evaluator.loading.motion, 0.0)
    return system, y, rows, evaluator.loading.motion


def dense_impact(system, y, rows, motion, restitution):
    """``u+ - u-`` with whole matrices, and the condition of the rows."""
    M, _ = mass_and_force(system, y, motion)
    S = rows.G @ np.linalg.solve(M, rows.G.T)
    p = -np.linalg.solve(S, (1 + restitution) * rows.rate)
    return np.linalg.solve(M, rows.G.T @ p), np.linalg.cond(S / np.sqrt(np.outer(np.diag(S), np.diag(S))))


SEEDS = [seed for seed in range(22) if seed not in (11, 12, 13)]  # their rows depend on each other


@pytest.mark.parametrize("seed", SEEDS)
def test_impact_equals_the_dense_one_on_random_trees(seed):
    """All types of closure, flexible and rigid bodies, prescribed joints; where the rows are independent."""
    system, y, rows, motion = struck_tree(seed)
    restitution = 0.3 * (seed % 2)
    jump, condition = dense_impact(system, y, rows, motion, restitution)
    found = mp.multibody.impact(system, y, closures=[c.name for c in system.closures], restitution=restitution)
    nx = pack(system).nx
    np.testing.assert_array_equal(found.y[:nx], y[:nx])
    scale = np.abs(jump).max()
    assert np.abs(found.y[nx:] - y[nx:] - jump).max() <= 1e-13 * condition * scale + 1e-11 * scale
    after = dense_constraints(system, pack(system), Evaluator(system).loops, found.y, motion, 0.0).rate
    np.testing.assert_allclose(after, -restitution * rows.rate, atol=1e-9 * np.abs(rows.rate).max())


def test_every_type_of_closure_is_tested():
    kinds = set()
    for seed in SEEDS:
        kinds |= {getattr(c, "type", "coupler") for c in struck_tree(seed)[0].closures}
    assert kinds == {*TYPES, "coupler"}


@pytest.mark.parametrize("seed", [1, 4, 8])
def test_a_sudden_weld_of_two_free_bodies_keeps_all_momentum_and_loses_what_theory_says(seed):
    """Plastic impact of flexible bodies: the energy lost is ``r S^-1 r / 2``, and momentum stays, exactly."""
    rng = np.random.default_rng(seed)
    one, two = random_body(rng, 4), random_body(rng, 3)
    joints = tuple(mp.Joint(name=name, type="free", parent="ground", child=name) for name in ("one", "two"))
    weld = Closure(name="weld", type="weld", a="one.a", b="two.b", active=False)
    system = mp.System(bodies={"one": one, "two": two}, joints=joints, closures=(weld,))
    y, packed = random_state(system, seed), pack(system)
    still = np.zeros((len(packed.links), 3))
    found = mp.multibody.impact(system, y, closures=["weld"])
    sums = [energy_and_momentum(np.zeros(3), body_states(system, packed, state, still)) for state in (y, found.y)]
    for name in ("linear", "angular"):
        np.testing.assert_allclose(sums[1][name], sums[0][name], atol=1e-12 * np.abs(sums[0][name]).max())
    evaluator = Evaluator(system)
    rows = dense_constraints(system, packed, evaluator.loops, y, still, 0.0)
    M, _ = mass_and_force(system, y)
    theory = rows.rate @ np.linalg.solve(rows.G @ np.linalg.solve(M, rows.G.T), rows.rate) / 2
    assert found.energy_loss == pytest.approx(theory, rel=1e-11)
    assert sums[0]["kinetic"] - sums[1]["kinetic"] == pytest.approx(theory, rel=1e-11)


def test_redundant_conditions_change_nothing():
    """Two equal welds act as one."""
    system = falling_rod(0.7)
    welds = [
        Closure(name=name, type="weld", a="ground", b="rod.end", active=False, position=np.array([1.0, 2, 0]))
        for name in ("one", "two")
    ]
    once, twice = (
        mp.multibody.impact(system.with_(closures=tuple(welds)), closures=hits) for hits in (["one"], ["one", "two"])
    )
    np.testing.assert_allclose(twice.y, once.y, atol=1e-14)
    assert twice.energy_loss == pytest.approx(once.energy_loss, rel=1e-13)


def rod(mass=2.0, length=1.5):
    inertia = mass * length**2 / 12
    return rigid_body("rod", mass=mass, centre=np.array([length / 2, 0, 0]), inertia=np.diag([0, inertia, inertia]),
                      interfaces={"end": np.zeros(3), "tip": np.array([length, 0, 0])})  # fmt: skip


def falling_rod(angle, friction=0.0, speed=(0.4, -3.0)):
    """A rod in the plane that comes down on its end, on a floor y = 0."""
    fall = mp.Joint(name="fall", type="planar", parent="ground", child="rod", second_axis=np.array([1.0, 0, 0]),
                    angle=angle, speed=np.array(speed))  # fmt: skip
    floor = Closure(name="floor", type="point_on_plane", a="ground", b="rod.end", axis=np.array([0, 1.0, 0]),
                       friction_coefficient=friction, active=False)  # fmt: skip
    return mp.System(bodies={"rod": rod()}, joints=(fall,), closures=(floor,), gravity=np.array([0, -G, 0]))


@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_a_rod_falls_on_its_end(restitution):
    """Smooth floor: ``p = (1 + e) m v / (1 + 3 cos^2 a)`` for a rod of mass m at angle a to the floor."""
    m, v, a = 2.0, 3.0, 0.7
    found = mp.multibody.impact(falling_rod(a, speed=(0.0, -v)), closures=["floor"], restitution=restitution)
    p = (1 + restitution) * m * v / (1 + 3 * np.cos(a) ** 2)
    assert found.impulse["floor.force"] == pytest.approx([0, p, 0], rel=1e-13, abs=1e-13)
    assert found.energy_loss == pytest.approx((1 - restitution**2) * m * v**2 / (1 + 3 * np.cos(a) ** 2) / 2, rel=1e-13)
    assert found.y[4] == pytest.approx(restitution * v, rel=1e-13, abs=1e-13)


@pytest.mark.parametrize("friction", [0.05, 0.2, 0.35, 0.5, 2.0])
def test_friction_of_an_impact_slides_or_sticks(friction):
    """The end's mobility ``1/m + r~ r~ / J`` is written out; sliding goes on in one direction."""
    m, L, a, v = 2.0, 1.5, 0.7, np.array([2.5, -3.0])
    J, r = m * L**2 / 12, -L / 2 * np.array([np.cos(a), np.sin(a)])  # centre to end
    lever = np.array([-r[1], r[0]])
    S = np.eye(2) / m + np.outer(lever, lever) / J
    stuck = np.linalg.solve(S, -v)
    found = mp.multibody.impact(falling_rod(a, friction, v), closures=["floor"])
    sticks = abs(stuck[0]) <= friction * stuck[1]
    push = np.array([np.sign(stuck[0]) * friction, 1.0])
    p = stuck if sticks else push * (-v[1] / (S[1] @ push))
    assert found.sticks == {"floor": sticks}
    assert found.impulse["floor.force"] == pytest.approx([*p, 0], rel=1e-11, abs=1e-11)
    assert found.energy_loss == pytest.approx(-p @ (v + S @ p / 2), rel=1e-11)


def test_both_branches_of_friction_were_taken():
    sticks = [
        mp.multibody.impact(falling_rod(0.7, f, (2.5, -3.0)), closures=["floor"]).sticks["floor"] for f in (0.05, 2.0)
    ]
    assert sticks == [False, True]


def test_friction_in_two_directions_is_against_the_motion_that_remains():
    """Coupled rows: on the cone, opposite to the slip after the impact."""
    rng = np.random.default_rng(3)
    A = rng.normal(size=(3, 3))
    S, rate = np.eye(3) + 0.1 * (A + A.T), np.array([-1.0, 3.0, 2.0])
    p, sticks = impulses(S, rate, -rate, [Contact([0], [1, 2], 0.4)])
    slip = (rate + S @ p)[1:]
    assert sticks == [False]
    assert (rate + S @ p)[0] == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(p[1:]) == pytest.approx(0.4 * p[0], rel=1e-12)
    assert p[1:] / np.linalg.norm(p[1:]) == pytest.approx(-slip / np.linalg.norm(slip), abs=1e-11)


def test_strongly_coupled_friction_is_found():
    """Friction that presses the ends together, close to where it would jam: ``p_n (1 - 0.9 mu) = 1``."""
    S, rate, mu = np.array([[1.0, -0.9], [-0.9, 1.0]]), np.array([-1.0, -30.0]), 1.05
    p, sticks = impulses(S, rate, -rate, [Contact([0], [1], mu)])
    assert sticks == [False]
    assert p == pytest.approx(np.array([1.0, mu]) / (1 - 0.9 * mu), rel=1e-10)


def ball(height=1.0, friction=0.0, speed=0.0, **options):
    point = rigid_body(
        "ball", mass=0.5, centre=np.zeros(3), inertia=0.001 * np.eye(3), interfaces={"centre": np.zeros(3)}
    )
    fall = mp.Joint(name="fall", type="free", parent="ground", child="ball", position=np.array([0, height, 0]),
                    velocity=np.array([speed, 0, 0]))  # fmt: skip
    floor = Closure(name="floor", type="point_on_plane", a="ground", b="ball.centre", axis=np.array([0, 1.0, 0]),
                       friction_coefficient=friction, active=False, **options)  # fmt: skip
    return mp.System(bodies={"ball": point}, joints=(fall,), closures=(floor,), gravity=np.array([0, -G, 0]))


@pytest.mark.parametrize(("method", "accuracy"), [("explicit", 1e-12), ("generalised_alpha", 1e-6)])
def test_a_ball_bounces(method, accuracy):
    """Times between impacts ``2 e^k v / g``; the energy that impacts take is in the balance."""
    e, v = 0.7, np.sqrt(2 * G)
    bounce = mp.Event(name="bounce", when="floor.gap", direction=-1, impacts=("floor",), restitution=e)
    run = mp.simulate(ball(), t_end=2.0, rtol=1e-9, method=method, events=(bounce,))
    times = np.cumsum([v / G, *(2 * e**k * v / G for k in (1, 2, 3))])
    np.testing.assert_allclose(run.events["bounce"][:4], times[times < 2.0][:4], rtol=accuracy)
    impacts = run.impacts["bounce"]
    lost = [0.5 * 0.5 * (1 - e**2) * (e**k * v) ** 2 for k in range(len(impacts))]
    np.testing.assert_allclose([impact.energy_loss for impact in impacts], lost, rtol=10 * accuracy)
    assert run.stats["energy_error"] < 1e-9
    row = np.searchsorted(run.time, impacts[0].t)
    np.testing.assert_array_equal(run.time[row : row + 2], impacts[0].t)  # before and after
    np.testing.assert_allclose(run["ball.centre.velocity.y"][row : row + 2], [-v, e * v], rtol=10 * accuracy)


@pytest.mark.parametrize("change", ["orbit", "depletion"])
def test_an_impact_is_in_the_balance_of_a_turning_ground_and_of_a_mass_that_changes(change):
    """What the impact took is that of the relative motion, and of the mass of the moment."""
    system = ball().with_(gravity=np.zeros(3), joints=(ball(speed=-0.5).joints[0].with_(velocity=[0.3, -2.0, 0]),))
    if change == "orbit":
        system = system.with_(orbit=mp.multibody.Orbit(rate=0.3))
    else:
        fuel = mp.multibody.Depletion(
            name="fuel",
            body="ball",
            levels=(mp.body.with_density_factor(system.bodies["ball"], 0.4),),
            mass="0.5-0.1*t",
        )
        system = system.with_(depletions=(fuel,))
    bounce = mp.Event(name="bounce", when="floor.gap", direction=-1, impacts=("floor",), restitution=0.5)
    run = mp.simulate(system, t_end=1.5, rtol=1e-10, atol=1e-13, method="explicit", events=(bounce,))
    (impact,) = run.impacts["bounce"]
    row = np.searchsorted(run.time, impact.t)
    mass = 0.5 if change == "orbit" else run["ball.mass"][row]
    assert impact.energy_loss == pytest.approx(
        mass / 2 * (1 - 0.25) * run["ball.centre.velocity.y"][row] ** 2, rel=1e-9
    )
    assert run.stats["energy_error"] < 1e-9


@pytest.mark.parametrize("rtol", some([1e-4, 1e-5, 1e-9], 2))
@pytest.mark.parametrize("e", [0.3, 0.7])
def test_bounces_without_end_are_refused(e, rtol, monkeypatch):
    """They pile up at ``(1 + e) / (1 - e)`` times the fall; none is missed, however short, and the floor holds.

    After 200 they are shorter than round-off of the time.
    """
    if not FULL:
        monkeypatch.setattr(actions, "MOST_IMPACTS", 200)
    bounce = mp.Event(name="bounce", when="floor.gap", direction=-1, impacts=("floor",), restitution=e)
    with pytest.raises(mp.SimulationError, match="comes again and again") as caught:
        mp.simulate(ball(), t_end=3.0, events=(bounce,), rtol=rtol)
    found = float(re.search(r"t = (\S+) s", str(caught.value))[1])
    assert found == pytest.approx(np.sqrt(2 / 9.81) * (1 + e) / (1 - e), rel=1e-5)  # six digits in the message


@pytest.mark.parametrize("method", ["explicit", "generalised_alpha"])
def test_capture_friction_and_release(method):
    """A ball falls on the floor, sticks not, slides with ``mu g``, and flies off where the floor ends."""
    mu, v = 0.3, 4.0
    system = ball(friction=mu, speed=v, transition_velocity=1e-4)
    edge = Closure(name="edge", type="point_on_plane", a="ground", b="ball.centre", axis=np.array([1.0, 0, 0]),
                      position=np.array([3.0, 0, 0]), active=False)  # fmt: skip
    system = system.with_(closures=(*system.closures, edge))
    events = (
        mp.Event(name="touch", when="floor.gap", direction=-1, activates=("floor",)),
        mp.Event(name="leave", when="edge.gap", direction=1, deactivates=("floor",)),
    )
    run = mp.simulate(system, t_end=2.0, rtol=1e-9, output_step=0.05, method=method, events=events)
    t1, fall = np.sqrt(2 / G), np.sqrt(2 * G)
    u = v - mu * fall  # friction of the impact
    x = 3.0 - v * t1
    t2 = t1 + (u - np.sqrt(u**2 - 2 * mu * G * x)) / (mu * G)
    accuracy = 1e-9 if method == "explicit" else 1e-5
    assert run.events["touch"][0] == pytest.approx(t1, rel=accuracy)
    assert run.events["leave"][0] == pytest.approx(t2, rel=accuracy)
    assert run.impacts["touch"][0].sticks == {"floor": False}
    assert run["ball.centre.position.y"][-1] == pytest.approx(-G * (2.0 - t2) ** 2 / 2, rel=20 * accuracy)
    assert run["ball.centre.velocity.x"][-1] == pytest.approx(u - mu * G * (t2 - t1), rel=20 * accuracy)
    slides = (run.time > t1 + 1e-6) & (run.time < t2 - 1e-6)
    np.testing.assert_allclose(run["floor.force"][slides], [[-mu * 0.5 * G, 0.5 * G, 0]] * slides.sum(), atol=1e-6)
    np.testing.assert_array_equal(run["floor.force"][run.time > t2 + 1e-6], 0.0)
    assert run.stats["energy_error"] < (1e-9 if method == "explicit" else 1e-4)


def test_a_bead_slides_down_a_wire():
    """On a line at a to the horizontal: ``g (sin a - mu cos a) t^2 / 2``; the force across is ``m g cos a``."""
    a, mu = 0.6, 0.25
    wire = Closure(name="wire", type="point_on_line", a="ground", b="ball.centre", friction_coefficient=mu,
                      transition_velocity=1e-5, axis=np.array([np.cos(a), -np.sin(a), 0]))  # fmt: skip
    run = mp.simulate(ball(height=0.0).with_(closures=(wire,)), t_end=1.0, rtol=1e-9)
    travel = np.linalg.norm(run["ball.centre.position"], axis=1)
    np.testing.assert_allclose(travel, G * (np.sin(a) - mu * np.cos(a)) * run.time**2 / 2, atol=1e-4)  # it starts loose
    force = run["wire.force"][1:]
    np.testing.assert_allclose(np.linalg.norm(force, axis=1), 0.5 * G * np.cos(a) * np.hypot(1, mu), rtol=1e-6)
    assert run.stats["energy_error"] < 1e-8


def test_events_change_the_closures_of_the_dense_reference_too():
    touch = mp.Event(name="touch", when="floor.gap", direction=-1, activates=("floor",))
    system = ball(height=0.1, friction=0.2, speed=2.0)
    runs = [
        mp.simulate(system, t_end=0.3, events=(touch,), rtol=1e-9, reference=reference) for reference in (False, True)
    ]
    one, two = (run["ball.centre.position"][-1] for run in runs)
    assert one[1] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(one, two, atol=1e-9)


def test_a_particle_leaves_a_sphere_where_it_pulls():
    """From rest at a to the vertical it leaves where ``cos b = 2/3 cos a``: an event of the multiplier."""
    a, R = 0.2, 2.0
    system = ball(height=0.0)
    joint = system.joints[0].with_(position=R * np.array([np.sin(a), np.cos(a), 0]))
    sphere = Closure(name="sphere", type="distance", a="ground", b="ball.centre", length=R)
    system = system.with_(joints=(joint,), closures=(sphere,))
    off = mp.Event(name="off", when="sphere.multiplier", direction=-1, deactivates=("sphere",))
    run = mp.simulate(system, t_end=1.6, output_step=0.01, rtol=1e-10, events=(off,))
    row = np.searchsorted(run.time, run.events["off"][0])
    assert run["ball.centre.position.y"][row] / R == pytest.approx(2 / 3 * np.cos(a), rel=1e-8)
    speed = np.sum(run["ball.centre.velocity"][row] ** 2)
    assert speed == pytest.approx(2 * G * R * np.cos(a) / 3, rel=1e-8)
    flight = run.time[-1] - run.time[row]
    expected = run["ball.centre.position.x"][row] + run["ball.centre.velocity.x"][row] * flight
    assert run["ball.centre.position.x"][-1] == pytest.approx(expected, rel=1e-9)


def test_a_latch_holds_the_angle_at_its_event():
    """A wing on a free hub unfolds and is locked where it is; angular momentum stays, the energy lost is exact."""
    hub = rigid_body("hub", mass=3.0, centre=np.zeros(3), inertia=0.4 * np.eye(3), interfaces={"root": np.zeros(3)})
    joints = (
        mp.Joint(name="turn", type="revolute", parent="ground", child="hub", rate=1.0),
        mp.Joint(name="wing", type="revolute", parent="hub.root", child="rod", angle=-1.0, rate=2.0),
    )
    latch = mp.multibody.Coupler(name="latch", factors={"wing": 1.0}, active=False)
    system = mp.System(bodies={"hub": hub, "rod": rod()}, joints=joints, closures=(latch,))
    stop = mp.Event(name="stop", when="wing.angle - 0.3", activates=("latch",))
    run = mp.simulate(system, t_end=2.0, output_step=0.1, events=(stop,))
    J = 2.0 * 1.5**2 / 3
    assert run.events["stop"] == pytest.approx([1.3 / 2.0], rel=1e-8)
    after = run.time > 0.65 + 1e-6
    np.testing.assert_allclose(run["wing.angle"][after], 0.3, atol=1e-9)
    np.testing.assert_allclose(run["turn.rate"][after], (0.4 * 1.0 + J * 3.0) / (0.4 + J), rtol=1e-9)
    assert run.impacts["stop"][0].energy_loss == pytest.approx(0.4 * J / (0.4 + J) * 2.0**2 / 2, rel=1e-9)
    assert run.impacts["stop"][0].impulse["latch.multiplier"] == pytest.approx(-0.4 * J / (0.4 + J) * 2.0, rel=1e-9)
    assert run.stats["energy_error"] < 1e-9


def test_a_drive_that_goes_on_through_an_impact_does_work():
    """The latch of a wing on a hub whose turn is prescribed: the drive's impulse counts in the energy balance."""
    hub = rigid_body("hub", mass=3.0, centre=np.zeros(3), inertia=0.4 * np.eye(3), interfaces={"root": np.zeros(3)})
    joints = (
        mp.Joint(name="turn", type="revolute", parent="ground", child="hub", motion=mp.multibody.TimeFunction("1.5*t")),
        mp.Joint(name="wing", type="revolute", parent="hub.root", child="rod", angle=-1.0, rate=2.0),
    )
    latch = mp.multibody.Coupler(name="latch", factors={"wing": 1.0}, active=False)
    stop = mp.Event(name="stop", when="wing.angle - 0.3", activates=("latch",))
    run = mp.simulate(mp.System(bodies={"hub": hub, "rod": rod()}, joints=joints, closures=(latch,)), t_end=2.0,
                      events=(stop,))  # fmt: skip
    J = 2.0 * 1.5**2 / 3
    drop = run["energy.work"][-1] - run["energy.work"][0]
    assert drop == pytest.approx(J * (1.5**2 - 3.5**2) / 2, rel=1e-8)
    assert run.stats["energy_error"] < 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_friction_equals_the_dense_solution_on_random_trees(seed):
    system = random_tree(seed, root="free", most=1 if seed % 3 == 0 else 5)
    axis = np.random.default_rng(seed).normal(size=3)
    closures = [
        Closure(name=kind, type=kind, a="ground", b=end, axis=axis, friction_coefficient=0.1, transition_velocity=0.3)
        for kind, end in (("point_on_line", "b0.a"), ("point_on_plane", "b1.b"))
    ]
    gone = Closure(name="gone", type="spherical", a="b0.b", b="b1.a", active=False)
    system = system.with_(closures=(*closures, gone))
    y, motion = random_state(system, seed), np.zeros((len(pack(system).links), 3))
    run = Evaluation(system, y, motion)
    found = run.solve()
    expected, multiplier = closed_accelerations(system, run.loops, y, motion, run.t)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(run.loops.work.multiplier, multiplier, atol=1e-9 * np.abs(multiplier).max())
    sliding = run.loops.closing.sliding(0) + run.loops.closing.sliding(1)
    assert np.abs(multiplier[sliding]).min() > 1e-5 * np.abs(multiplier).max()


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: mp.multibody.impact(ball(), closures=["flor"]), "closure 'flor' does not exist; did you mean 'floor'"),
        (lambda: mp.multibody.impact(ball(), closures=["floor"], restitution=1.5), "restitution = 1.5"),
        (lambda: mp.Event(name="e", when="t", restitution=-1.0), "restitution = -1"),
        (lambda: ball(friction=0.5, transition_velocity=0.0), "transition_velocity = 0 must be positive"),
        (
            lambda: Closure(name="c", type="weld", a="a.b", b="ground", friction_coefficient=0.1),
            "'friction_coefficient' has no effect where type = 'weld'",
        ),
        (
            lambda: mp.multibody.Closure(name="c", type="weld", a="a.b", b="ground", friction_coefficient=0.1),
            "'friction_coefficient' has no effect where type = 'weld'",
        ),
        (
            lambda: mp.simulate(ball(), t_end=1.0, events=(mp.Event(name="e", when="t - 1", activates=("no",)),)),
            "event 'e': closure 'no' does not exist",
        ),
    ],
)
def test_what_cannot_be_is_refused(make, match):
    with pytest.raises(mp.InputError, match=match):
        make()
