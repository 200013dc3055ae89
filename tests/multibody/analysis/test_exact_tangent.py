"""Exact derivatives of the inverse dynamics, against high-order differences of the reference implementation."""

import numpy as np
import pytest
from closures import closure_of
from compare import assert_close
from multibody.closed_trees import TYPES
from multibody.depleted_trees import depleted_tree
from multibody.loaded_trees import loaded_tree
from multibody.station_trees import station_tree
from multibody.trees import ROOTS, random_body, random_tree
from size import seeds

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody.analysis.differences import jacobian
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.tangent import GivenAccelerations, SystemTangent
from modalprep.multibody.elements.registry import KINDS as ELEMENTS
from modalprep.multibody.elements.registry import pack_loads
from modalprep.multibody.evaluation.evaluator import LAST, Evaluator
from modalprep.multibody.kernels.tangents.inward import inward_tangents
from modalprep.multibody.kernels.tangents.outward import outward_tangents
from modalprep.multibody.kernels.tangents.pulled_back import new_pulled, pull_inward, pull_outward
from modalprep.multibody.model.joint_types import JOINT_TYPES
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.equations import mass_and_force
from modalprep.multibody.reference.loads import dense_loads

T = 0.3
EXACT = 1e-9  # of the largest entry: the differences have 1e-11
ORBIT = mp.multibody.Orbit(rate=0.7, radius=12.0, inclination=0.9, argument_of_latitude=0.4, planet_spin=0.3,
                           dipole=mp.multibody.Dipole(strength=2.0, radius=11.0, tilt=0.5, longitude=1.1))  # fmt: skip


def random_motion(system, seed):
    """A state with rates and accelerations, the coordinates away from the start."""
    evaluator, rng = Evaluator(system, T), np.random.default_rng(seed)
    y = evaluator.moved(evaluator.start, 0.3 * rng.standard_normal(evaluator.nu))
    y[evaluator.nx :] = rng.standard_normal(evaluator.nu)
    return evaluator, y, rng.standard_normal(evaluator.nu), rng


def without_callbacks(system):
    return system.with_(loads=tuple(x for x in system.loads if not isinstance(x, mp.multibody.Callback)))


def assert_exact(system, seed):
    """Along a random direction of the coordinates, and one of the speeds; the mass matrix entry by entry."""
    evaluator, y, udot, rng = random_motion(system, seed)
    found, motion = SystemTangent(Chart(evaluator, y), udot).found, evaluator.loading.motion.copy()
    heavy = system.with_masses_at(T)

    def equations(state):
        M, f = mass_and_force(heavy, state, motion)
        loads = dense_loads(system, evaluator.packed, state, motion, T)
        return M + loads.mass, f + loads.f

    def required(z):
        state = evaluator.moved(y, z[0] * turn)
        state[evaluator.nx :] = y[evaluator.nx :] + z[1] * rate
        M, f = equations(state)
        return M @ udot - f

    turn, rate = rng.standard_normal((2, evaluator.nu))
    J, _ = jacobian(required, np.array([0.02, 0.5]))
    assert_close(found.K @ turn, J[:, 0], EXACT, name="K")
    assert_close(found.D @ rate, J[:, 1], EXACT, name="D")
    assert_close(found.M, equations(y)[0], 1e-12, name="M")


def rooted_tree(root):
    return random_tree(12 + ROOTS.index(root), root=root)


@pytest.mark.parametrize("root", ROOTS)
def test_trees_with_every_joint(root):
    """Rigid and modal bodies with Kg and T, every kind of joint in motion."""
    assert_exact(rooted_tree(root), 3)


@pytest.mark.parametrize("seed", seeds(3))
def test_bodies_with_stations(seed):
    """Chains with branches, other bodies at their ends, and loads there."""
    tree = station_tree(seed)
    rng = np.random.default_rng(seed)
    loads = tuple(
        mp.PointForce(name=end, at=end, force=rng.standard_normal(3), torque=rng.standard_normal(3))
        for end in ("arm.a", "more.b", "plain.tip")
    )
    assert_exact(tree.with_(loads=loads), seed)


def test_loads_on_a_body_without_second_order_beside_one_with_it():
    """Both write the motion of their interfaces to the same place of the work."""
    rng = np.random.default_rng(0)
    bodies = {"bent": random_body(rng, 4), "plain": random_body(rng, 3, geometric=False)}
    joints = tuple(
        mp.Joint(name=name, type="revolute", parent="ground", child=name, axis=rng.standard_normal(3))
        for name in bodies
    )
    loads = tuple(
        mp.PointForce(name=name, at=f"{name}.a", force=rng.standard_normal(3), torque=rng.standard_normal(3))
        for name in bodies
    )
    assert_exact(mp.System(bodies=bodies, joints=joints, loads=loads), 1)


def elements_of(system):
    """Return the kinds of force elements that a system has."""
    found = pack_loads(system, pack(system), 1.0).elements
    rows = {name: getattr(found, name) for name in ELEMENTS}
    return {name for name, packed in rows.items() if len(getattr(packed, "rows", packed))}


def test_no_kind_is_left_out():
    """Joints and force elements of these tests are all that are registered; closures are (`TYPES`)."""
    assert {joint.type for root in ROOTS for joint in rooted_tree(root).joints} == set(JOINT_TYPES)
    systems = [loaded_tree(0), wired_tree(0), depleted_tree(0, rate=0.1), immersed_tree(0)]
    assert set().union(*map(elements_of, systems)) == set(ELEMENTS)
    assert all(kind.tangent is not None for kind in ELEMENTS.values())


def test_work_and_results_are_used_again():
    """Sweeps at another state leave nothing behind: bit for bit as in new arrays, which they write themselves."""
    system = random_tree(12, root=ROOTS[0])
    packed = pack(system)
    model, nu = packed.model, packed.nu

    def swept(seed, work, K, D, M):
        evaluator, y, udot, _ = random_motion(system, seed)
        required = evaluator.required(y, udot)
        outward_tangents(model, evaluator.data, work)
        force, size = np.empty((2, nu))
        inward_tangents(model, evaluator.data, work, K, D, M, force, size)
        assert_close(force, required, 1e-12)
        return K, D, M

    again = packed.sweep(), *np.zeros((3, nu, nu))
    swept(1, *again)
    for found, expected in zip(swept(2, *again), swept(2, packed.sweep(), *np.zeros((3, nu, nu))), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_nothing_is_left_of_calls_before():
    """The evaluator of the last call is used again for the same system and time: bit for bit as a new one."""
    systems = [without_callbacks(loaded_tree(seed)) for seed in (1, 2)]
    cases = [(each, random_motion(each, 1)[1], t) for each in systems for t in (0.0, T)]

    def matrices(system, y, t):
        linear = mp.linearise(system, y, t, inputs=["b0.a.force.x"])
        return np.hstack([linear.A, linear.B])

    expected = []
    for case in cases:
        LAST.clear()
        expected.append(matrices(*case))
    for k in (0, 2, 1, 1, 3, 2, 0):
        np.testing.assert_array_equal(matrices(*cases[k]), expected[k])


@pytest.mark.parametrize("branches", [False, True])
def test_all_that_speeds_of_a_branch_do_is_written(branches):
    """Matrices of chains need no zeros; those of trees with branches do."""
    places = ("free", "ground"), ("revolute", "b0.tip"), ("spherical", "b0.root" if branches else "b1.tip")
    joints = [
        mp.Joint(name=f"j{k}", type=kind, parent=parent, child=f"b{k}") for k, (kind, parent) in enumerate(places)
    ]
    bodies = {f"b{k}": uniform_beam(modes=modes) for k, modes in enumerate((5, 2, 3))}
    system = mp.System(bodies=bodies, joints=tuple(joints))
    packed = pack(system)
    evaluator, y, udot, _ = random_motion(system, 1)
    matrices = np.full((3, packed.nu, packed.nu), np.nan)
    evaluator.required(y, udot)
    work = packed.sweep()
    outward_tangents(packed.model, evaluator.data, work)
    inward_tangents(packed.model, evaluator.data, work, *matrices, *np.empty((2, packed.nu)))
    assert packed.branches == branches == np.isnan(matrices).any()


@pytest.mark.parametrize("system", [*map(rooted_tree, ROOTS), station_tree(1)], ids=[*ROOTS, "stations"])
def test_products_with_one_vector(system):
    """``w' K`` and ``w' D`` in O(n), of the matrices of the inward sweep: to round-off, twice in the same work."""
    packed = pack(system)
    model, nu = packed.model, packed.nu
    work, pulled = packed.sweep(), new_pulled(model)
    for seed in (1, 2):
        evaluator, y, udot, rng = random_motion(system, seed)
        w, by_x, by_u, force, size = rng.standard_normal((5, nu))
        K, D, M = np.zeros((3, nu, nu))
        evaluator.required(y, udot)
        outward_tangents(model, evaluator.data, work)
        inward_tangents(model, evaluator.data, work, K, D, M, force, size)
        outward_tangents(model, evaluator.data, work)
        pull_outward(model, evaluator.data, work, pulled, w)
        pull_inward(model, evaluator.data, work, pulled, by_x, by_u)
        for product, matrix in ((by_x, K), (by_u, D)):
            assert np.all(np.abs(product - w @ matrix) <= 1e-12 * (np.abs(w) @ np.abs(matrix)))


@pytest.mark.parametrize("seed", seeds(6))
def test_every_force_element(seed):
    """Springs, bushings, forces on points and bodies, elements of joints beyond their limits, a planet."""
    assert_exact(without_callbacks(loaded_tree(seed)), seed)


def wired_tree(seed):
    system = without_callbacks(loaded_tree(seed))
    loads = [load for load in system.loads if not isinstance(load, mp.multibody.CentralGravity)]
    wire = mp.multibody.Conductor(name="line", through=("b0.a", "b1.b", "b0.root"), current="1 + t")
    return system.with_(gravity=np.zeros(3), orbit=ORBIT, loads=(*loads, wire))


@pytest.mark.parametrize("seed", seeds(4))
def test_in_an_orbit_with_a_current(seed):
    assert_exact(wired_tree(seed), seed)


@pytest.mark.parametrize("seed", seeds(4))
def test_with_masses_that_leave(seed):
    assert_exact(depleted_tree(seed, rate=0.1), seed)


def immersed_tree(seed):
    system = random_tree(seed, root=["free", "revolute", "prescribed"][seed % 3], most=1)
    water = mp.multibody.Water(current=np.array([[1.0, 0.3, 0], [0.2, 0.5, -0.4], [0.0, 0.1, 0.7]]),
                               depths=np.array([-9.0, 0.3, 9.0]), up=np.array([0.2, 0.9, -0.3]))  # fmt: skip
    rods = [
        mp.multibody.ImmersedRod(name=name, body=name, ends=ends, diameter=0.6, tangential_drag=0.3, water=water)
        for name, ends in (("b0", ("a", "b")), ("b1", ("root", "a")))
    ]
    return system.with_(loads=tuple(rods))


@pytest.mark.parametrize("seed", seeds(4))
def test_rods_in_sheared_water(seed):
    assert_exact(immersed_tree(seed), seed)


def moving_loop(kind, seed):
    """Two flexible arms that turn and slide on three axes each, closed at their ends by a closure of a type."""
    rng = np.random.default_rng(seed)
    arms = {name: random_body(rng, n) for name, n in (("left", 3), ("right", 2))}
    joints = tuple(
        mp.Joint(name=name, type="free", parent="ground", child=name, rate=0.0, position=rng.standard_normal(3))
        for name in arms
    )
    options = {"second_axis": rng.standard_normal(3)} if kind == "universal" else {}
    options |= {"length": "2 + sin(t)/3"} if kind == "distance" else {}
    options |= {"path": ("1 + t", None, "cos(t)")} if kind == "position" else {}
    closure = closure_of(name="close", type=kind, a="left.a", b="right.b", axis=rng.standard_normal(3), **options)
    return mp.System(bodies=arms, joints=joints, closures=(closure,), gravity=np.array([1.0, -2.0, 3.0]))


def assert_exact_closed(system, place=0.1, rate=1.0):
    """Against differences of the forces of closed states by the compiled equations, accelerations given."""
    evaluator = Evaluator(system, T)
    chart, rng = Chart(evaluator, evaluator.start), np.random.default_rng(7)
    n = len(chart.independent)
    y = chart.moved(place * rng.standard_normal(n), rate * rng.standard_normal(n))
    chart = Chart(evaluator, y)
    evaluator.load(y)
    udot = evaluator.accelerations(np.zeros(evaluator.nu)).copy()
    given, turn, rate = GivenAccelerations(chart, udot), *rng.standard_normal((2, n))
    J, _ = jacobian(lambda z: given.force(chart.moved(z[0] * turn, z[1] * rate), given.own), np.array([0.01, 0.3]))
    found = SystemTangent(chart, udot).equations(np.zeros((n, n)))
    assert_close(found.K @ turn, J[:, 0], EXACT, name="K")
    assert_close(found.D @ rate, J[:, 1], EXACT, name="D")


@pytest.mark.parametrize("kind", TYPES)
def test_every_closure_in_motion(kind):
    assert_exact_closed(moving_loop(kind, TYPES.index(kind)))


def test_a_flexible_four_bar_in_motion():
    """Three elastic beams of 10 m that turn in gravity, the last one on a second pivot of the ground."""
    beam = uniform_beam(modes=3)
    starts = {"crank": (0.9, 2.0), "coupler": (-0.8, -1.0), "rocker": (-1.2, 1.0)}
    parents = ("ground", "crank.tip", "coupler.tip")
    joints = tuple(
        mp.Joint(name=name, type="revolute", parent=parent, child=name, angle=angle, rate=rate)
        for parent, (name, (angle, rate)) in zip(parents, starts.items(), strict=True)
    )
    pivot = mp.multibody.Closure(
        name="pivot", type="point_on_line", a="ground", b="rocker.tip", position=(20.0, -1.0, 0)
    )
    system = mp.System(bodies=dict.fromkeys(starts, beam), joints=joints, gravity=(0, -9.81, 0))
    assert_exact_closed(system.with_(closures=(pivot,)), place=0.02)


@pytest.mark.parametrize("kind", ["weld", "revolute", "distance"])
def test_stiffness_is_symmetric_where_forces_have_a_potential(kind):
    """At rest on bushings, in gravity and with a loop, away from any symmetry."""
    system = moving_loop(kind, 5)
    if kind == "distance":
        system = system.with_(closures=(system.closures[0].with_(length=2.0),))
    soft = {"stiffness": np.full(6, 4000.0)}
    held = tuple(mp.multibody.Bushing(name=name, between=("ground", f"{name}.root"), position=joint.position, **soft)
                 for name, joint in zip(system.bodies, system.joints, strict=True))  # fmt: skip
    bodies = {name: body.with_(K=1000 * body.K) for name, body in system.bodies.items()}
    K = mp.static_equilibrium(system.with_(bodies=bodies, loads=held)).stiffness
    assert_close(K, K.T, 1e-10)  # forces balance to 1e-12 of a scaled step


def spun(law, element=()):
    """A rod that turns fast on a hinge, with a law of its own."""
    rod = mp.rigid_body("rod", mass=2.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([0.1, 0.3, 0.3]),
                        interfaces={"root": np.zeros(3), "tip": np.array([1.0, 0, 0])})  # fmt: skip
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="rod", angle=0.4, elements=element)
    return mp.System(bodies={"rod": rod}, joints=(hinge,), gravity=np.array([0, -9.81, 0]), loads=law)


def test_callbacks_alone_are_differences_and_said():
    """A spring and damper as a callback, and as an element of the joint."""

    def spring(t, state):
        hinge = state.joint("hinge")
        return {"hinge": -30.0 * hinge.position - 0.7 * hinge.rate}

    called = mp.linearise(spun((mp.multibody.Callback(name="spring", function=spring),)))
    exact = mp.linearise(spun((), mp.multibody.HingeElement(stiffness=30.0, damping=0.7)))
    np.testing.assert_allclose(called.A, exact.A, rtol=1e-10)
    assert called.notes == ("by differences, all else exactly: callback 'spring'",)
    assert exact.notes == ()


def test_motions_of_interfaces_are_outputs_to_all_digits():
    """Position, velocity and acceleration of a tip on a circle, and their derivatives, by hand."""
    system = spun((), mp.multibody.HingeElement(stiffness=30.0))
    names = [f"rod.tip.{what}.{axis}" for what in ("position", "velocity", "acceleration") for axis in "xy"]
    names += ["rod.tip.rotation.z", "rod.tip.angular_velocity.z", "rod.tip.angular_acceleration.z"]
    y = np.array([0.4, 3.0])
    linear = mp.linearise(system, y, inputs=["hinge"], outputs=names)
    c, s, w = np.cos(0.4), np.sin(0.4), 3.0
    inertia = 1 / linear.B[1, 0]
    a = -(30 * 0.4 + 2 * 9.81 * 0.5 * c) / inertia
    by_x = -(30 - 2 * 9.81 * 0.5 * s) / inertia
    expected = [
        [-s, 0], [c, 0], [-w * c, -s], [-w * s, c],
        [-a * c + w**2 * s - s * by_x, -2 * w * c], [-a * s - w**2 * c + c * by_x, -2 * w * s],
        [1, 0], [0, 1], [by_x, 0],
    ]  # fmt: skip
    np.testing.assert_allclose(linear.C, expected, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(linear.D[:, 0], np.array([0, 0, 0, 0, -s, c, 0, 0, 1]) / inertia, atol=1e-12)


def test_forces_that_cancel_are_linearised():
    """A spring from the hinge itself to the tip pulls along the rod wherever it turns."""
    wire = mp.multibody.AxialSpring(name="wire", between=("ground", "rod.tip"), stiffness=1e3)
    linear = mp.linearise(spun((wire,)).with_(gravity=np.zeros(3)))
    assert abs(linear.A[1, 0]) < 1e-12 * 1e3
