"""Equilibrium, linearisation, modes, inverse dynamics: closed forms and identities."""

import numpy as np
import pytest
from multibody.single_bodies import DOWN, carried, rigid
from multibody.trees import random_state, random_tree
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody.analysis.equilibrium import static_equilibrium
from modalprep.multibody.analysis.inverse_dynamics import hinge_forces, inverse_dynamics
from modalprep.multibody.analysis.linearise import linearise, transport
from modalprep.multibody.analysis.state_space import frequency_response
from modalprep.multibody.analysis.system_modes import system_modes
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.kernels import articulated_body
from modalprep.multibody.kernels.time_tables import table
from modalprep.multibody.model.joint_types import FREE, SPHERICAL
from modalprep.multibody.reference.equations import mass_and_force, quaternion_matrix

L, EI, WEIGHT = 10.0, 1.4e4, 12.0  # the spin-up beam
STATE = "array(float64, 1d, C)"


def weld(child="beam"):
    return mp.Joint(name="wall", type="weld", parent="ground", child=child)


# ---- equilibrium ----


@pytest.mark.parametrize("start", [0.0, 1.0, -2.5])
def test_pendulum_with_a_torsion_spring_rests_where_moments_balance(start):
    spring = mp.multibody.HingeElement(stiffness=30.0, free_position=0.2)
    found = static_equilibrium(carried(rigid(), type="revolute", angle=start, elements=spring))
    angle = found.joints["joint"][0]
    assert 30 * (angle - 0.2) + 10 * np.cos(angle) == pytest.approx(0, abs=1e-11)  # 2 kg at 0.5 m; of 10 N m
    assert found.stable


@pytest.mark.parametrize("start", [0.0, 1.57, -3.0])
def test_heavy_pendulum_hangs(start):
    angle = static_equilibrium(carried(rigid(), type="revolute", angle=start)).joints["joint"][0]
    assert np.cos(angle) == pytest.approx(0, abs=1e-12)
    assert np.sin(angle) == pytest.approx(-1, abs=1e-12)


def test_cantilever_sags_by_its_weight():
    beam, g = uniform_beam(modes=3, truncation=("inertia",)), 1e-4
    found = static_equilibrium(mp.System(bodies={"beam": beam}, joints=(weld(),), gravity=g * DOWN))
    sag = WEIGHT * g * L**3 / (8 * EI)
    shear = WEIGHT * g * L / (2 * 1e7)  # the elements are Timoshenko's
    # second order is (sag / L)^2 = 1e-12
    assert -beam.phi[1, 1] @ found.modal["beam"] == pytest.approx(sag + shear, rel=1e-6)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_column_below_buckling_magnifies_a_side_force(share):
    P, Q = share * np.pi**2 * EI / (4 * L**2), 1e-6
    k = np.sqrt(P / EI)
    beam = uniform_beam(modes=8, truncation=("interfaces",))
    force = mp.PointForce(name="load", at="beam.tip", force=(-P, Q, 0))
    found = static_equilibrium(mp.System(bodies={"beam": beam}, joints=(weld(),), loads=(force,)))
    side = Q * (np.tan(k * L) - k * L) / (k * P)
    # shear lowers the critical load by 3.5e-5, modes and elements err by 1e-5 of it; magnified by 1 / (1 - share)
    assert beam.phi[1, 1] @ found.modal["beam"] == pytest.approx(side, rel=1e-4 / (1 - share))
    assert found.stable


def test_column_beyond_buckling_is_not_stable():
    P = 1.05 * np.pi**2 * EI / (4 * L**2)
    force = mp.PointForce(name="load", at="beam.tip", force=(-P, 0, 0))
    body = uniform_beam(modes=3)  # bending alone: the straight column is in equilibrium
    system = mp.System(bodies={"beam": body}, joints=(weld(),), loads=(force,))
    roots = system_modes(system).eigenvalue
    away = roots[roots.real > 1e-6]
    omega = 2 * np.pi * body.frequency[0]
    # the first mode as that of the column: omega^2 (1 - P / critical); mode shape and shear change it by a few percent
    np.testing.assert_allclose(away, [omega * np.sqrt(0.05)], rtol=0.05)


@pytest.mark.parametrize(
    ("joint", "words"),
    [
        ({"type": "prismatic", "axis": -DOWN}, "20 N in joint 'joint'"),
        (
            {"type": "revolute", "axis": DOWN, "elements": mp.multibody.HingeElement(drive=3.0)},
            "3 N m in joint 'joint'",
        ),
        ({"type": "free"}, r"(20|19\.\d) N in joint 'joint'"),  # in its own axes, before it hangs straight
    ],
)
def test_mechanism_under_load_is_named(joint, words):
    with pytest.raises(mp.SimulationError, match=f"no static equilibrium: residual of {words}"):
        static_equilibrium(carried(rigid(), **joint))


# ---- linearisation ----


@pytest.mark.parametrize("spin", [(0, 0, 0.0), (0, 0, 6.0), (0, 2.0, 0), (1.0, 0, 0)])
def test_modes_about_a_steady_spin_are_those_of_the_body(spin):
    body, rate = uniform_beam(modes=6), float(np.linalg.norm(spin))
    axis = np.array(spin) / rate if rate else np.array([0, 0, 1.0])
    hub = mp.Joint(name="hub", type="revolute", parent="ground", child="beam", axis=axis,
                   motion=mp.multibody.TimeFunction(f"{rate}*t"))  # fmt: skip
    system = mp.System(bodies={"beam": body}, joints=(hub,))
    rest = static_equilibrium(system, steady=True)
    expected = mp.multibody.spin_modes(body, np.array(spin))
    np.testing.assert_allclose(rest.modal["beam"], expected.q0, rtol=1e-9, atol=1e-12)
    # round-off of the highest root, which is 60 times the lowest, squared
    np.testing.assert_allclose(system_modes(system, rest.y).frequency, expected.frequency, rtol=1e-9)


def test_linear_equations_are_the_derivative_on_random_trees():
    """Along a random direction the nonlinear equations change by A times the direction, to second order."""
    for seed in range(4):
        system = random_tree(seed, root=["free", "spherical", "revolute", "universal"][seed])
        evaluator, y = Evaluator(system, 0.3), random_state(system, seed)
        for row in evaluator.packed.model.links:  # unit quaternions
            x = row["x"] + (3 if row["joint"] == FREE else 0)
            if row["joint"] in (SPHERICAL, FREE):
                y[x : x + 4] /= np.linalg.norm(y[x : x + 4])
        linear, rng = linearise(system, y, 0.3), np.random.default_rng(seed)
        z, nu = rng.standard_normal(2 * evaluator.nu), evaluator.nu
        h = 1e-5

        def rates(size, evaluator=evaluator, y=y, z=z, nu=nu):
            state = evaluator.moved(y, size * z[:nu])
            state[evaluator.nx :] += size * z[nu:]
            evaluator.load(state)
            return evaluator.accelerations(np.zeros(nu))

        slope = (rates(h) - rates(-h)) / (2 * h)
        assert np.abs(linear.A[nu:] @ z - slope).max() < 1e-7 * np.abs(slope).max()  # h^2 and round-off / h
        assert linear.error < 1e-9


@pytest.mark.parametrize("kind", ["spherical", "free"])
def test_torque_free_spin_has_eulers_frequency(kind):
    """A body spinning about its largest axis: sqrt((C - A) (C - B) / (A B)) times the spin."""
    A, B, C, spin = 2.0, 2.4, 3.0, 1.7
    body = rigid(centre=(0, 0, 0), inertia=(A, B, C))
    system = carried(body, type=kind, angular_velocity=np.array([0, 0, spin])).with_(gravity=np.zeros(3))
    roots = system_modes(system).eigenvalue.imag
    wanted = spin * np.sqrt((C - A) * (C - B) / (A * B))
    assert np.abs(roots - wanted).min() < 1e-9
    assert np.abs(roots - spin).min() < 1e-9  # the axis fixed in space, seen from the turning body


@pytest.mark.parametrize("kind", ["spherical", "free"])
def test_changes_of_pose_are_carried_by_the_reference(kind):
    """Two motions of equal body speeds from neighbouring poses: their relative pose, seen from the first, changes."""
    evaluator = Evaluator(carried(rigid(), type=kind))
    y, h = random_state(evaluator.system, 3), 1e-4
    y[evaluator.nx - 4 : evaluator.nx] /= np.linalg.norm(y[evaluator.nx - 4 : evaluator.nx])
    change = 1e-4 * np.random.default_rng(1).standard_normal(evaluator.nu)
    other, u = evaluator.moved(y, change), y[evaluator.nx :]

    def apart(t):
        a, b = evaluator.moved(y, t * u), evaluator.moved(other, t * u)
        Ra, Rb = (quaternion_matrix(state[evaluator.nx - 4 : evaluator.nx]) for state in (a, b))
        turn = Rotation.from_matrix(Ra.T @ Rb).as_rotvec()
        return np.concatenate([Ra.T @ (b - a)[:3], turn]) if kind == "free" else turn

    rate = (apart(h) - apart(-h)) / (2 * h)
    wanted = transport(evaluator, y) @ change
    assert np.abs(rate - wanted).max() < 1e-3 * np.abs(wanted).max()  # second order of the change


def test_two_masses_answer_as_in_the_book():
    """Two sliders with springs k1 to the wall, k2 and c2 between: the closed form of their response."""
    m1, m2, k1, k2, c1, c2 = 2.0, 1.0, 50.0, 30.0, 0.7, 0.3
    x = np.array([1.0, 0, 0])
    joints = (
        mp.Joint(name="one", type="prismatic", parent="ground", child="a", axis=x,
                 elements=mp.multibody.HingeElement(stiffness=k1, damping=c1)),
        mp.Joint(name="two", type="prismatic", parent="a.root", child="b", axis=x,
                 elements=mp.multibody.HingeElement(stiffness=k2, damping=c2)),
    )  # fmt: skip
    system = mp.System(bodies={"a": rigid(m1), "b": rigid(m2)}, joints=joints)
    outputs = ["a.root.position.x", "b.root.position.x", "b.root.acceleration.x", "two.displacement"]
    linear = linearise(system, inputs=["b.root.force.x", "two"], outputs=outputs)
    f = np.linspace(0.1, 3.0, 40)
    H = frequency_response(linear, f)
    for k, w in enumerate(2 * np.pi * f):
        d1, d2 = k1 + 1j * w * c1, k2 + 1j * w * c2
        Z = np.array([[d1 + d2 - w**2 * m1, -d2], [-d2, d2 - w**2 * m2]])
        pull, between = np.linalg.solve(Z, [0, 1]), np.linalg.solve(Z, [-1, 1])
        expected = [[p[0], p[1], -(w**2) * p[1], p[1] - p[0]] for p in (pull, between)]
        np.testing.assert_allclose(H[k].T, expected, rtol=1e-9)
    found = system_modes(system)
    roots = np.roots(
        [m1 * m2, m2 * (c1 + c2) + m1 * c2, m1 * k2 + m2 * (k1 + k2) + c1 * c2, c1 * k2 + c2 * k1, k1 * k2]
    )
    roots = roots[roots.imag > 0][np.argsort(np.abs(roots[roots.imag > 0]))]
    np.testing.assert_allclose(found.frequency, np.abs(roots) / (2 * np.pi), rtol=1e-9)
    np.testing.assert_allclose(found.damping, -roots.real / np.abs(roots), rtol=1e-8)


def test_flexible_beam_answers_as_its_modes():
    beam = uniform_beam(modes=4)
    beam = beam.with_(D=2 * 0.01 * np.sqrt(beam.K))
    system = mp.System(bodies={"beam": beam}, joints=(weld(),))
    outputs = ["beam.tip.position.y", "beam.tip.rotation.z", "beam.tip.velocity.y"]
    linear = linearise(system, inputs=["beam.tip.force.y", "beam.tip.torque.z"], outputs=outputs)
    f = np.geomspace(0.1, 20, 30)
    w = 2 * np.pi * f[:, None]
    gain = 1 / (beam.K + 1j * w * beam.D - w**2)
    up, turn = beam.phi[1, 1], beam.psi[1, 2]
    H = frequency_response(linear, f)
    scale = np.abs(H).max(axis=0)
    np.testing.assert_allclose(H[:, 0, 0], gain @ (up * up), atol=1e-10 * scale[0, 0])
    np.testing.assert_allclose(H[:, 1, 0], gain @ (up * turn), atol=1e-10 * scale[1, 0])
    np.testing.assert_allclose(H[:, 0, 1], gain @ (up * turn), atol=1e-10 * scale[0, 1])
    np.testing.assert_allclose(H[:, 2, 0], (1j * w * gain) @ (up * up), atol=1e-10 * scale[2, 0])
    shape = system_modes(system).motion["beam.tip"][1]
    np.testing.assert_allclose(np.abs(shape[np.abs(up) > 1e-9] / up[np.abs(up) > 1e-9]).std(), 0, atol=1e-6)


def test_rigid_motions_of_a_free_satellite_are_zero():
    bus = rigid(40.0, (0.1, 0, 0), (5, 9, 9), edge=(2, 0, 0))
    joints = (
        mp.Joint(name="flight", type="free", parent="ground", child="bus"),
        weld("panel").with_(parent="bus.edge"),
    )
    modes = system_modes(mp.System(bodies={"bus": bus, "panel": uniform_beam(modes=3)}, joints=joints))
    assert np.count_nonzero(modes.frequency == 0) == 6
    assert len(modes.frequency) == 9
    assert np.abs(modes.damping[6:]).max() < 1e-9


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ({"inputs": ["jiont"]}, "name a joint"),
        ({"inputs": ["joint.7"]}, "has 1 speeds"),
        ({"outputs": ["joint.angel"]}, "joint has"),
        ({"outputs": ["part.modal.1"]}, "name 'joint.angle'"),
        ({"outputs": ["part.nose.position.x"]}, "names no interface"),
        ({"outputs": ["ground.position.x"]}, "ground does not move"),
    ],
)
def test_unknown_names_are_refused(names, words):
    with pytest.raises(mp.InputError, match=words):
        linearise(carried(rigid(), type="revolute"), **names)


@pytest.mark.parametrize("g", [10.0, 1e-5])
def test_a_stiff_body_swings_as_a_rigid_one(g):
    """Its highest mode is 1e8 to 1e11 times as fast, at rest it is stable, and its swing is no rigid motion."""
    beam = uniform_beam(modes=3)
    stiff = beam.with_(K=1e16 * beam.K)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="beam", angle=-1.0)
    system = mp.System(bodies={"beam": stiff}, joints=(hinge,), gravity=g * DOWN)
    rest = static_equilibrium(system)
    assert rest.stable
    inertia = np.trace(beam.E0) - beam.E0[2, 2]
    swing = np.sqrt(g * beam.s0[0] / inertia) / (2 * np.pi)
    # the sections' own inertia; round-off of the modes' rows
    assert system_modes(system, rest.y).frequency[0] == pytest.approx(swing, rel=1e-4)


# ---- inverse dynamics ----


@pytest.mark.parametrize("seed", range(12))
def test_inverse_dynamics_inverts_forward_dynamics(seed):
    system = random_tree(seed, root=["free", "revolute", "planar", "universal"][seed % 4])
    evaluator, y = Evaluator(system, 0.3), random_state(system, seed)
    hinges = np.array([kind == "joint" for kind, _ in evaluator.owner])
    tau = np.where(hinges, np.random.default_rng(seed).standard_normal(evaluator.nu), 0.0)
    evaluator.load(y)
    udot = evaluator.accelerations(tau)
    M, f = mass_and_force(system, y, evaluator.loading.motion)
    scale = (np.abs(M) @ np.abs(udot)).max() + np.abs(f).max()  # what cancels to tau
    assert np.abs(hinge_forces(system, y, udot, 0.3) - tau).max() < 1e-10 * scale


def test_prescribed_history_needs_the_torque_that_simulation_reports():
    law = "0.5*(1 - cos(2*t))"
    joint = mp.Joint(name="joint", type="revolute", parent="ground", child="beam")
    system = mp.System(bodies={"beam": uniform_beam(modes=1)}, joints=(joint,), gravity=DOWN)
    times = np.linspace(0, 1, 6)
    found = inverse_dynamics(system, {"joint": law}, times)
    driven = system.with_(joints=(joint.with_(motion=mp.multibody.TimeFunction(law)),))
    run = mp.simulate(driven, t_end=1.0, output_step=0.2, rtol=1e-10, atol=1e-13, method="explicit")
    # both integrate the mode at 1e-9; the torque holds its acceleration, 1e2 times larger
    np.testing.assert_allclose(found.force["joint"][:, 0], run["joint.drive"], rtol=1e-6)
    np.testing.assert_allclose(found.modal["beam"], run["beam.modal"], atol=1e-7)
    # quasi-static: for a slow motion, what is left out is of the order of (2 / omega)^2 = 0.28; at rest it is exact
    still = inverse_dynamics(system, {"joint": "0.3"}, np.array([0.0]), modes="quasi_static")
    rest = static_equilibrium(system.with_(joints=(joint.with_(motion=mp.multibody.TimeFunction(0.3)),)))
    np.testing.assert_allclose(still.modal["beam"][0], rest.modal["beam"], rtol=1e-9, atol=1e-12)


def test_frozen_states_whole_times_and_histories_need_no_other_kernels():
    """A kernel is compiled for each type of its arguments, which here takes longer than the analysis itself."""
    pytest.importorskip("numba", reason="asks numba which kernels it has compiled")
    states, times = list(articulated_body.outward.dispatcher.signatures), list(table.dispatcher.signatures)
    system = carried(uniform_beam(modes=1), type="revolute", motion=mp.multibody.TimeFunction("t**2 / 2"))
    rest = static_equilibrium(system, t=1)
    assert not rest.y.flags.writeable
    system_modes(system, rest.y, t=1)
    inverse_dynamics(system.with_(joints=(system.joints[0].with_(motion=None),)), {"joint": "t"}, np.array([0, 1]))
    assert {str(taken[2]) for taken in articulated_body.outward.dispatcher.signatures if taken not in states} <= {STATE}
    assert {str(taken[2]) for taken in table.dispatcher.signatures if taken not in times} <= {"float64"}


def test_histories_that_cannot_be_are_refused():
    system = carried(rigid(), type="spherical")
    with pytest.raises(mp.InputError, match="leave it out"):
        inverse_dynamics(system, {"joint": "t"}, np.array([0.0]))
    with pytest.raises(mp.InputError, match="joint 'knee' does not exist"):
        inverse_dynamics(system, {"knee": "t"}, np.array([0.0]))
    with pytest.raises(mp.InputError, match="has no history; give it one"):
        inverse_dynamics(system, {}, np.array([0.0]), modes="quasi_static")
