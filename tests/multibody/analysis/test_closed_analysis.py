"""Equilibrium, linear equations and modes of closed loops: closed forms, equivalent trees, trajectories."""

from pathlib import Path

import numpy as np
import pytest
from closures import closure_of
from multibody.closed_trees import closed_tree
from multibody.mechanisms import link, slider_crank
from multibody.trees import axes_of, random_body
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from size import seeds
from systems.shipped import shipped

import modalprep as mp
from modalprep.body.build import flexible_body
from modalprep.examples import cantilever_model, uniform_beam
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.evaluation.evaluate import GOOD, build_equations, evaluate
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.model.constraints import Closure, Coupler
from modalprep.multibody.model.joint_types import JOINT_TYPES
from modalprep.multibody.reference.constraints import closed_accelerations, dense_constraints, reduced_accelerations
from modalprep.multibody.reference.equations import quaternion_matrix
from modalprep.reduction.craig_bampton import craig_bampton

G = 9.81
DOWN = np.array([0, -G, 0])
Y = np.array([0, 1.0, 0])


def parallelogram(angle=0.4, *, spring=60.0, damping=0.0, rest=0.3, closure="revolute"):
    """Cranks and coupler of 1 kg and 1 m each; the coupler only translates."""
    bodies = {name: link(name, 1.0, (0.5, 0), 1 / 12, end=(1, 0)) for name in ("crank", "coupler", "rocker")}
    element = mp.multibody.HingeElement(stiffness=spring, damping=damping, free_position=rest)
    pivot = np.array([1.0, 0, 0])
    joints = (
        mp.Joint(
            name="a", type="revolute", parent="ground", child="crank", angle=angle, keep_start=True, elements=element
        ),
        mp.Joint(name="b", type="revolute", parent="crank.end", child="coupler", angle=-angle),
        mp.Joint(name="c", type="revolute", parent="ground", child="rocker", angle=angle, position=pivot),
    )
    pin = Closure(name="pin", type=closure, a="rocker.end", b="coupler.end")
    return mp.System(bodies=bodies, joints=joints, closures=(pin,), gravity=DOWN)


INERTIA, WEIGHT = 2 / 3 + 1.0, 2 * G  # about the cranks' hinges, and its lever at angle 0


@pytest.mark.parametrize("closure", ["revolute", "spherical", "point_on_line"])
def test_parallelogram_rests_and_vibrates_as_one_pendulum(closure):
    """Three rows of the revolute pin are redundant, one of the spherical one."""
    system = parallelogram(closure=closure)
    rest = mp.static_equilibrium(system)
    a = rest.joints["a"][0]
    assert 60 * (a - 0.3) + WEIGHT * np.cos(a) == pytest.approx(0, abs=1e-10)
    assert (rest.joints["b"][0], rest.joints["c"][0]) == pytest.approx((-a, a), abs=1e-12)
    stiffness = 60 - WEIGHT * np.sin(a)
    assert rest.stable
    assert rest.stiffness[0, 0] == pytest.approx(stiffness, rel=1e-9)  # whichever angle is the independent one
    modes = mp.system_modes(system, rest.y)
    np.testing.assert_allclose(modes.frequency, [np.sqrt(stiffness / INERTIA) / (2 * np.pi)], rtol=1e-9)
    shape = [modes.joints[name][0, 0] for name in "abc"]
    np.testing.assert_allclose(np.array(shape) / shape[0], [1, -1, 1], atol=1e-9)
    np.testing.assert_allclose(modes.motion["coupler.end"][3:] / shape[0], 0, atol=1e-9)  # it does not turn
    # moments about the rocker's free hinge: its weight, and what the coupler exerts on it at the pin
    assert rest.closures["pin.force"][1] == pytest.approx(-0.5 * G * np.cos(a), abs=1e-9)  # in the rocker's axes


def test_frequency_response_of_the_parallelogram():
    system = parallelogram(damping=1.5)
    rest = mp.static_equilibrium(system)
    linear = mp.linearise(system, rest.y, inputs=["c", "coupler.end.force.y"], outputs=["a.angle", "b.rate"])
    f = np.linspace(0.1, 3, 20)
    w, a = 2 * np.pi * f, rest.joints["a"][0]
    gain = 1 / (60 - WEIGHT * np.sin(a) + 1.5j * w - INERTIA * w**2)
    H = mp.multibody.frequency_response(linear, f)
    np.testing.assert_allclose(H[:, 0, 0], gain, rtol=1e-9)
    np.testing.assert_allclose(H[:, 0, 1], gain * np.cos(a), rtol=1e-9)
    np.testing.assert_allclose(H[:, 1, 0], -1j * w * gain, rtol=1e-9)


def pushed_slider(force=8.0, spring=30.0):
    """Crank of 1 m with a spring, rod of 2.5 m, slider pushed back along x."""
    bodies = {
        "crank": link("crank", 1.0, (0.5, 0), 1 / 12, end=(1, 0)),
        "rod": link("rod", 2.0, (1.25, 0), 1.0, end=(2.5, 0)),
        "slider": link("slider", 0.5, (0, 0), 0.1),
    }
    element = mp.multibody.HingeElement(stiffness=spring, free_position=1.0)
    joints = (
        mp.Joint(name="crank", type="revolute", parent="ground", child="crank", angle=1.0, elements=element,
                 keep_start=True),
        mp.Joint(name="knee", type="revolute", parent="crank.end", child="rod", angle=-1.3),
        mp.Joint(name="slide", type="prismatic", parent="ground", child="slider", axis=np.array([1.0, 0, 0]),
                 displacement=3.0),
    )  # fmt: skip
    load = mp.PointForce(name="push", at="slider.root", force=(-force, 0, 0))
    pin = Closure(name="pin", type="spherical", a="slider.root", b="rod.end")
    return mp.System(bodies=bodies, joints=joints, closures=(pin,), loads=(load,))


def test_slider_crank_balances_by_virtual_work():
    rest = mp.static_equilibrium(pushed_slider())
    a, knee, x = (rest.joints[name][0] for name in ("crank", "knee", "slide"))
    drop = np.sqrt(2.5**2 - np.sin(a) ** 2)
    assert x == pytest.approx(np.cos(a) + drop, abs=1e-12)
    assert 30 * (a - 1.0) == pytest.approx(8 * (np.sin(a) + np.sin(a) * np.cos(a) / drop), rel=1e-10)
    # the rod carries no load of its own: its force is along it; the slider's part along x is the push
    np.testing.assert_allclose(rest.closures["pin.force"][:2], -8 * np.array([1, np.tan(a + knee)]), rtol=1e-9)


def test_porter_governor_rises_with_its_speed():
    """Ball of 1.2 kg on an arm of 0.5 m, rod of 0.5 m to a sleeve of 2 kg: cos = (m + 2 M) g / (m w^2 l)."""
    m, M, length, spin, g = 1.2, 2.0, 0.5, 16.0, 9.81
    bodies = {
        "hub": link("hub", 1.0, (0, 0), 0.1),
        "arm": mp.rigid_body("arm", mass=m, centre=np.array([length, 0, 0]), inertia=1e-12 * np.eye(3),
                             interfaces={"root": np.zeros(3), "ball": np.array([length, 0, 0])}),
        "sleeve": link("sleeve", M, (0, 0), 0.1),
    }  # fmt: skip
    joints = (
        mp.Joint(name="shaft", type="revolute", parent="ground", child="hub", axis=Y,
                 motion=mp.multibody.TimeFunction(f"{spin}*t")),
        mp.Joint(name="arm", type="revolute", parent="hub.root", child="arm", angle=-1.0, keep_start=True),
        mp.Joint(name="slide", type="prismatic", parent="hub.root", child="sleeve", axis=Y, displacement=-0.8),
    )  # fmt: skip
    rod = Closure(name="rod", type="distance", a="arm.ball", b="sleeve.root", length=length)
    system = mp.System(bodies=bodies, joints=joints, closures=(rod,), gravity=np.array([0, -g, 0]))
    rest = mp.static_equilibrium(system, steady=True)
    below = np.pi / 2 + rest.joints["arm"][0]  # from the vertical
    wanted = (m + 2 * M) * g / (m * spin**2 * length)
    assert np.cos(below) == pytest.approx(wanted, rel=1e-9)
    assert rest.joints["slide"][0] == pytest.approx(-2 * length * wanted, rel=1e-9)
    stiffness = (m + 2 * M) * g * length * wanted - m * (spin * length) ** 2 * np.cos(2 * below)
    inertia = length**2 * (m + 4 * M * np.sin(below) ** 2)
    frequency = mp.system_modes(system, rest.y).frequency
    np.testing.assert_allclose(frequency, [np.sqrt(stiffness / inertia) / (2 * np.pi)], rtol=1e-9)
    still = mp.static_equilibrium(system, t=0.3)
    assert np.sin(still.joints["arm"][0]) == pytest.approx(-1, abs=1e-9)  # held, it hangs


def halves(closure):
    """Two Craig-Bampton beams of 10 m that meet at 10 m, the second turned round."""
    model = cantilever_model(20, "fixed")
    half = flexible_body(model, craig_bampton(model, modes=12), name="half")
    turn = Rotation.from_rotvec([0, 0, np.pi]).as_matrix()
    joints = (
        mp.Joint(name="left", type="weld", parent="ground", child="one"),
        mp.Joint(name="right", type="weld", parent="ground", child="two", position=np.array([20.0, 0, 0]),
                 rotation=turn),
    )  # fmt: skip
    middle = closure_of(name="middle", type=closure, a="one.tip", b="two.tip", rotation=turn)
    return mp.System(bodies={"one": half, "two": half}, joints=joints, closures=(middle,))


@pytest.mark.parametrize("closure", ["weld", "revolute"])
def test_two_halves_of_a_beam_closed_in_the_middle(closure):
    """Against the synthesis of the same bodies; welded also against the closed form of the clamped-clamped beam."""
    system = halves(closure)
    free = ("rz",) if closure == "revolute" else ()
    places = {joint.child: (joint.position, joint.rotation) for joint in system.joints}
    weld, walls = ("one.tip", "two.tip", free), ["one.root", "two.root"]
    expected = mp.reduction.synthesise(system.bodies, [weld], places, walls, modes=10)
    found = mp.system_modes(system)
    np.testing.assert_allclose(found.frequency[:10], expected.frequency, rtol=1e-8)
    if closure == "weld":
        omega = 22.373285 * np.sqrt(1.4e4 / 1.2) / 20**2
        assert 2 * np.pi * found.frequency[0] == pytest.approx(omega, rel=2e-4)  # shear: 1.4e-4
    tips = found.motion["one.tip"][:3, :4], found.motion["two.tip"][:3, :4]
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-9)


def test_welded_halves_carry_their_weight_as_one_beam():
    """Uniform load: w L^4 / (384 EI) and shear w L^2 / (8 GA) in the middle, no shear force there, w L^2 / 24."""
    system = halves("weld")
    g = 1e-5
    rest = mp.static_equilibrium(system.with_(gravity=np.array([0, -g, 0])))
    one = system.bodies["one"]
    w, length = 1.2 * g, 20.0
    sag = -(one.phi[1, 1] @ rest.modal["one"])
    # modes of 12 of a half: the load's own deflection is left out of fixed-interface modes by 1e-4
    assert sag == pytest.approx(w * length**4 / (384 * 1.4e4) + w * length**2 / (8 * 1e7), rel=1e-3)
    assert abs(rest.closures["middle.torque"][2]) == pytest.approx(w * length**2 / 24, rel=1e-3)
    np.testing.assert_allclose(rest.closures["middle.force"][1], 0, atol=1e-6 * w * length)


KINDS = tuple(name for name, steps in JOINT_TYPES.items() if steps.constrained)


def stiff(body):
    """Deflections of a few percent; the root does not move in its own frame, in second order neither."""
    root = (np.arange(3) > 0)[:, None, None, None]
    return body.with_(K=1000 * body.K, Kg_F=root * body.Kg_F, Kg_T=root * body.Kg_T)


@pytest.mark.parametrize("kind", KINDS)
def test_a_joint_cut_and_closed_again_has_the_same_rest_and_modes(kind):
    """A flexible arm on a bushing carries a body by a joint and a bushing: in the tree, or as a closure."""
    rng = np.random.default_rng(KINDS.index(kind))
    arm, tool = (stiff(random_body(rng, n)) for n in (3, 2))
    axis, second = rng.standard_normal((2, 3))
    soft = {"stiffness": np.full(6, 400.0), "damping": np.full(6, 3.0)}
    place = arm.interface_position[1]
    bushings = (
        mp.multibody.Bushing(name="base", between=("ground", "arm.root"), **soft),
        mp.multibody.Bushing(name="grip", between=("arm.a", "tool.root"), **soft),
    )
    root = mp.Joint(name="root", type="free", parent="ground", child="arm")
    cut = mp.Joint(name="cut", type=kind, parent="arm.a", child="tool", **axes_of(kind, axis, second))
    free = mp.Joint(name="cut", type="free", parent="ground", child="tool", position=place)
    closure = closure_of(name="cut", type=kind, a="arm.a", b="tool.root", axis=axis, second_axis=second)
    common = {"bodies": {"arm": arm, "tool": tool}, "loads": bushings, "gravity": np.array([1.0, -2.0, 3.0])}
    systems = (mp.System(joints=(root, cut), **common), mp.System(joints=(root, free), closures=(closure,), **common))
    rests = [mp.static_equilibrium(system) for system in systems]
    for name in ("arm", "tool"):
        np.testing.assert_allclose(rests[1].modal[name], rests[0].modal[name], atol=1e-9)
    names = {"inputs": ["arm.b.force.x"], "outputs": ["tool.b.position.y", "tool.a.acceleration.z"]}
    one, two = (mp.linearise(system, rest.y, **names) for system, rest in zip(systems, rests, strict=True))
    assert len(one.A) == len(two.A)
    f = np.linspace(0.05, 5, 7)
    H = mp.multibody.frequency_response(one, f)
    np.testing.assert_allclose(mp.multibody.frequency_response(two, f), H, atol=1e-7 * np.abs(H).max())
    roots = [mp.system_modes(system, rest.y).eigenvalue for system, rest in zip(systems, rests, strict=True)]
    np.testing.assert_allclose(np.sort_complex(roots[1]), np.sort_complex(roots[0]), rtol=1e-6)


@pytest.mark.parametrize("seed", seeds(6))
def test_linear_equations_are_the_derivative_of_the_run(seed):
    """Along a random motion of a moving flexible tree with loops, time in its conditions included."""
    system, t = loose(seed), 0.3
    evaluator, rng = Evaluator(system, t), np.random.default_rng(seed)
    chart = Chart(evaluator, evaluator.start)
    n, nu, nx = len(chart.independent), evaluator.nu, evaluator.nx
    y = chart.moved(0.1 * rng.standard_normal(n), 0.3 * rng.standard_normal(n))
    assert max(np.abs(gap).max() for gap in evaluator.gaps(y)) < 1e-12
    linear = mp.linearise(system, y, t)
    free, loading = linear.independent, Loading(system, evaluator.packed, 2.0)
    loading.loops.work.value[:] = evaluator.loops.work.value  # lengths as at the start
    model = build_equations(evaluator.packed, loading)
    z, w, h = rng.standard_normal(len(free)), rng.standard_normal(len(free)), 1e-5

    def rates(size):
        """Move along the loops' tangent and project in the metric of the masses; then give the speeds wanted."""
        state = evaluator.closed(evaluator.moved(y, size * linear.R @ z))
        speeds = y[nx:].copy()
        speeds[free] += size * w
        Gs = evaluator.jacobian(state)[evaluator.kept_rows(state)]
        others = np.setdiff1d(np.arange(nu), free)
        state[nx:] = speeds
        state[nx + others] -= np.linalg.lstsq(Gs[:, others], evaluator.gaps(state)[1][chart.kept])[0]
        ydot = np.zeros(nx + nu + 1)
        assert evaluate(model, t, np.append(state, 0.0), ydot) == GOOD
        return ydot[nx:-1]

    slope = (rates(h) - rates(-h)) / (2 * h)
    found = linear.A[len(free) :] @ np.concatenate([z, w])
    assert np.abs(found - slope[free]).max() < 1e-6 * np.abs(slope).max()  # h^2, and round-off / h
    np.testing.assert_allclose(linear.udot, rates(0.0), atol=1e-9 * np.abs(linear.udot).max())
    assert linear.error < 1e-8


def test_turning_reference_turns_the_changes_of_closed_bodies_back():
    """Two neighbouring states of a spinning body on a rod move on by their speeds; how they part is the first rows."""
    body = mp.rigid_body("top", mass=1.0, centre=np.array([0.2, 0, 0]), inertia=np.diag([1.0, 2, 2.5]),
                         interfaces={"root": np.zeros(3), "end": np.array([1.0, 0.3, 0.2])})  # fmt: skip
    joint = mp.Joint(
        name="ball", type="spherical", parent="ground", child="top", angular_velocity=np.array([2.0, -1, 3])
    )
    rod = Closure(name="rod", type="distance", a="ground", b="top.end", position=np.array([0.5, 2.0, -0.4]))
    system = mp.System(bodies={"top": body}, joints=(joint,), closures=(rod,))
    evaluator = Evaluator(system)
    chart, linear = Chart(evaluator, evaluator.start), mp.linearise(system)
    z, w, h = 1e-4 * np.array([1.0, -2.0]), 1e-4 * np.array([0.5, 3.0]), 1e-4
    states = chart.y, chart.moved(z, w)

    def apart(t):
        A, B = (quaternion_matrix(evaluator.moved(y, t * y[evaluator.nx :])[:4]) for y in states)
        return Rotation.from_matrix(A.T @ B).as_rotvec()

    rate = (apart(h) - apart(-h)) / (2 * h)
    wanted = linear.A[:2] @ np.concatenate([z, w])
    np.testing.assert_allclose(rate[linear.independent], wanted, atol=1e-3 * np.abs(wanted).max())  # second order
    assert np.abs(wanted - w).max() > 0.3 * np.abs(w).max()


def loose(seed):
    """A random tree with a rod, a gear or a driven point, which close wherever it starts."""
    system, _, _ = closed_tree(4 * seed)  # on a free root
    ends = [f"{name}.a" for name in system.bodies]
    rods = Closure(name="rod", type="distance", a=ends[0], b=ends[-1])
    turns = [name for name, count in system.coordinate_counts.items() if count]
    anchor = Closure(name="anchor", type="distance", a="ground", b=ends[1], position=np.array([3.0, 4.0, 5.0]))
    closures = [rods, anchor] if len(ends) > 2 else [anchor]
    if len(turns) > 1:
        factors = {name if system.coordinate_counts[name] == 1 else f"{name}.1": 1.0 + k
                   for k, name in enumerate(turns[:2])}  # fmt: skip
        closures.append(Coupler(name="gear", factors=factors, value="0.2*sin(t)"))
    return system.with_(closures=tuple(closures))


def test_small_motion_of_the_run_is_that_of_the_linear_equations():
    system = parallelogram(damping=2.0)
    rest = mp.static_equilibrium(system)
    linear, size = mp.linearise(system, rest.y), 1e-5
    start = rest.joints["a"][0] + size
    moved = parallelogram(angle=start, damping=2.0)
    run = mp.simulate(moved, t_end=1.0, output_step=0.25, rtol=1e-11, atol=1e-14)
    by_a = linear.R[0, 0]  # change of the crank per independent coordinate
    expected = [by_a * (expm(linear.A * t) @ [size / by_a, 0])[0] for t in run.time]
    # second order of the change; the start is held to 1e-8 of it
    np.testing.assert_allclose(run["a.angle"] - rest.joints["a"][0], expected, atol=1e-4 * size)


def test_mechanism_without_support_is_named():
    system = parallelogram(spring=0.0)
    hanging = mp.static_equilibrium(system)
    assert np.sin(hanging.joints["a"][0]) == pytest.approx(-1, abs=1e-9)
    system = pushed_slider(spring=0.0)
    straight = mp.static_equilibrium(system)  # pushed to a dead centre
    assert np.sin(straight.joints["crank"][0]) == pytest.approx(0, abs=1e-9)
    drawn = system.with_(loads=(), gravity=np.zeros(3))
    assert not mp.static_equilibrium(drawn).stable  # indifferent
    driven = Coupler(name="drive", factors={"crank": 1.0}, value=0.7)
    held = mp.static_equilibrium(system.with_(closures=(*system.closures, driven)))
    assert held.joints["crank"][0] == pytest.approx(0.7, abs=1e-12)
    lever = np.sin(0.7) + np.sin(0.7) * np.cos(0.7) / np.sqrt(2.5**2 - np.sin(0.7) ** 2)
    assert held.closures["drive.multiplier"] == pytest.approx(-8 * lever, rel=1e-9)


def test_singular_position_is_said():
    with pytest.raises(mp.SimulationError, match="singular position"):
        mp.linearise(parallelogram(angle=0.0))


def test_loops_that_move_are_no_steady_motion():
    system = parallelogram()
    drive = system.joints[0].with_(angle=0.0, keep_start=False, elements=(), motion="0.4 + t")
    with pytest.raises(mp.SimulationError, match="'pin' closes"):
        mp.static_equilibrium(system.with_(joints=(drive, *system.joints[1:])), steady=True)


def test_torque_that_drives_a_parallelogram():
    """One pendulum: inertia, weight, spring; the torque of any of its cranks does."""
    times, law = np.linspace(0, 1, 5), "0.4 + 0.3*t**2"
    for joint in ("a", "c"):
        found = mp.multibody.inverse_dynamics(parallelogram(damping=2.0), {joint: law}, times)
        a, rate = 0.4 + 0.3 * times**2, 0.6 * times
        expected = INERTIA * 0.6 + WEIGHT * np.cos(a) + 60 * (a - 0.3) + 2 * rate
        np.testing.assert_allclose(found.force[joint][:, 0], expected, rtol=1e-8)  # the loops are held to 1e-11
    at_rest = mp.multibody.inverse_dynamics(parallelogram(), {"a": 0.4}, np.zeros(1))
    assert at_rest.force["a"][0, 0] == pytest.approx(WEIGHT * np.cos(0.4) + 6, rel=1e-9)


def test_force_found_in_a_flexible_loop_moves_it_as_wanted():
    """Applied as a load, the torque of inverse dynamics gives the history back."""
    rigid, times = parallelogram(spring=0.0), np.linspace(0, 0.5, 251)
    first, second, third = rigid.joints
    joints = (first, second.with_(parent="crank.tip"), third.with_(position=np.array([10.0, 0, 0])))
    pin = rigid.closures[0].with_(a="rocker.tip", b="coupler.tip")
    system = mp.System(
        bodies=dict.fromkeys(rigid.bodies, uniform_beam(modes=2)), joints=joints, closures=(pin,), gravity=DOWN
    )
    found = mp.multibody.inverse_dynamics(system, {"a": "0.4 + 0.2*(1 - cos(3*t))"}, times)
    torque = mp.multibody.TimeFunction.table(times, found.force["a"][:, 0], spline=True)
    driven = first.with_(elements=mp.multibody.HingeElement(drive=torque))
    run = mp.simulate(system.with_(joints=(driven, *joints[1:])), t_end=0.5, output_step=0.1, rtol=1e-8)
    wanted = 0.4 + 0.2 * (1 - np.cos(3 * run.time))
    np.testing.assert_allclose(run["a.angle"], wanted, atol=1e-5)  # splines through 251 torques


def test_histories_that_loops_cannot_follow_are_refused():
    with pytest.raises(mp.InputError, match="only 1 of the 2 coordinates.*independent"):
        mp.multibody.inverse_dynamics(parallelogram(), {"a": 0.4, "c": 0.4}, np.zeros(1))
    with pytest.raises(mp.InputError, match="cannot be closed"):
        mp.multibody.inverse_dynamics(parallelogram(), {"a": 0.4, "c": 0.6}, np.zeros(1))
    with pytest.raises(mp.InputError, match="'pin' closes a loop; quasi-static"):
        mp.multibody.inverse_dynamics(parallelogram(), {"a": 0.4}, np.zeros(1), modes="quasi_static")
    with pytest.raises(mp.InputError, match="begin at 0"):
        mp.multibody.inverse_dynamics(parallelogram(), {"a": 0.4}, np.ones(1))
    with pytest.raises(mp.InputError, match="'pin' closes a loop"):
        mp.multibody.hinge_forces(parallelogram(), np.zeros(6), np.zeros(3))


def squeezer():
    return shipped("squeezer", Path())[0]  # rigid bodies: no folder is used


@pytest.mark.parametrize("mechanism", [parallelogram, pushed_slider, squeezer, lambda: slider_crank()[0]])
def test_independent_speeds_accelerate_as_multipliers_do(mechanism):
    """Book section 9.4 against the multiplier form, dense both, and against the order-n kernel."""
    system = mechanism()
    evaluator = Evaluator(system)
    chart = Chart(evaluator, evaluator.start)
    y = chart.moved(np.zeros(len(chart.independent)), 0.5 + np.arange(len(chart.independent), dtype=float))
    evaluator.load(y)
    kernel, motion = evaluator.accelerations(np.zeros(evaluator.nu)), evaluator.loading.motion
    reduced = reduced_accelerations(system, evaluator.loops, y, motion, 0.0)
    multiplier, _ = closed_accelerations(system, evaluator.loops, y, motion, 0.0)
    scale = np.abs(multiplier).max()
    np.testing.assert_allclose(reduced, multiplier, atol=1e-10 * scale)
    np.testing.assert_allclose(reduced, kernel, atol=1e-10 * scale)
    rows = dense_constraints(system, evaluator.packed, evaluator.loops, y, motion, 0.0)
    np.testing.assert_allclose(rows.G @ chart.R, 0, atol=1e-12 * np.abs(rows.G).max())


def test_loops_that_are_all_open_leave_every_coordinate():
    """A closure that does not act yet: linear equations as of the tree alone."""
    body = link("bob", 2.0, (0.5, 0), 1.0)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="bob")
    tree = mp.System(bodies={"bob": body}, joints=(hinge,), gravity=np.array([9.81, 0, 0]))
    latch = Closure(name="latch", type="weld", a="ground", b="bob.root", active=False)
    np.testing.assert_allclose(mp.linearise(tree.with_(closures=(latch,))).A, mp.linearise(tree).A, rtol=1e-14)
