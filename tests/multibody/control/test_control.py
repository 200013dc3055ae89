"""Regulators, estimators and truncation: closed forms, duality, bounds, and the closed loop of the nonlinear system."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody import (
    LinearSystem,
    balanced_truncation,
    compensator,
    control_laws,
    feedback,
    frequency_response,
    kalman,
    lqr,
    state_feedback,
)

STATES = ("slide.displacement", "slide.speed")


def plain(A, B, C=None, D=None, **names):
    """A linear system of matrices."""
    A, B = np.array(A, dtype=float), np.array(B, dtype=float)
    C = np.eye(len(A)) if C is None else np.array(C, dtype=float)
    given = {
        "states": [f"z{k}" for k in range(len(A))],
        "inputs": [f"i{k}" for k in range(B.shape[1])],
        "outputs": [f"o{k}" for k in range(len(C))],
    } | names
    D = np.zeros((len(C), B.shape[1])) if D is None else np.array(D, dtype=float)
    return LinearSystem(A=A, B=B, C=C, D=D, **{key: tuple(value) for key, value in given.items()})


@pytest.fixture(scope="module")
def mass():
    return plain([[0, 1], [0, 0]], [[0], [1]], [[1, 0]], states=STATES, inputs=["slide"], outputs=[STATES[0]])


@pytest.fixture(scope="module")
def hub():
    """A rigid hub that a motor turns, with a flexible arm of three modes, damped, welded on."""
    arm = uniform_beam(modes=3, elements=8)
    arm = replace(arm, D=0.02 * np.sqrt(arm.K))
    return mp.System(
        bodies={"arm": arm}, joints=(mp.Joint(name="hinge", type="revolute", parent="ground", child="arm"),)
    )


@pytest.fixture(scope="module")
def plant(hub):
    return mp.linearise(hub, inputs=["hinge"], outputs=["hinge.angle", "arm.tip.position.y"])


def free_bus(turn):
    """A free bus, turned at the start, with one flexible panel; forces and torques act at its centre."""
    bus = mp.rigid_body(
        "bus", mass=9.0, centre=(0.1, 0, 0), inertia=np.diag([2.0, 3.0, 4.0]), interfaces={"mid": (0, 0, 0)}
    )
    panel = replace(uniform_beam(modes=1, elements=8), D=np.array([0.1]))
    flight = mp.Joint(
        name="flight", type="free", parent="ground", child="bus", position=(1, 2, 3), rotation=turn.as_matrix()
    )
    weld = mp.Joint(name="root", type="weld", parent="bus.mid", child="panel")
    return mp.System(bodies={"bus": bus, "panel": panel}, joints=(flight, weld))


def test_gains_of_a_mass(mass):
    """Of weights 1 they are 1 and sqrt(3) (Anderson and Moore); of the effort r^4 in place of 1, 1 / r^2 and so on.

    With w on the displacement alone they are w and sqrt(2 w), the poles at 45 degrees.
    """
    found = lqr(mass, dict.fromkeys(STATES, 1.0), {"slide": 1.0})
    np.testing.assert_allclose(found.K, [[1.0, np.sqrt(3)]], rtol=1e-12)
    cheap = lqr(mass, {STATES[0]: 16.0}, {"slide": 1.0})
    np.testing.assert_allclose(cheap.K, [[4.0, np.sqrt(8)]], rtol=1e-12)
    np.testing.assert_allclose(np.sort_complex(cheap.poles), np.sqrt(2) * np.array([-1 - 1j, -1 + 1j]), rtol=1e-12)
    np.testing.assert_allclose(np.sort_complex(cheap.closed_loop.poles), np.sort_complex(cheap.poles), rtol=1e-12)
    np.testing.assert_allclose(cheap.cost[1], [4.0, np.sqrt(8)], rtol=1e-12)


def test_no_other_gain_costs_less(plant):
    """The cost of a state under any gain is a Lyapunov equation; that of the regulator is least, and stationary."""
    weights, effort = {"hinge.angle": 1e4, "arm.tip.position.y": 100.0}, 0.1
    found = lqr(plant, weights, {"hinge": effort})
    Q = plant.C.T @ np.diag([1e4, 100.0]) @ plant.C

    def cost(K):
        A = plant.A - plant.B @ K
        return np.trace(solve_continuous_lyapunov(A.T, -Q - effort * K.T @ K))

    least = cost(found.K)
    np.testing.assert_allclose(np.trace(found.cost), least, rtol=1e-7)  # two solvers, condition of A 1e8
    for k in range(found.K.shape[1]):
        step = 0.02 * np.abs(found.K[0, k]) * np.eye(found.K.shape[1])[k]
        assert min(cost(found.K + step), cost(found.K - step)) >= least * (1 - 1e-9)


def test_weights_of_an_output_with_feedthrough():
    """o = z + i: the integral of o^2 + i^2 of z' = -z + i, by its quadratic 2 (-P) - (P + 1)^2 / 2 + 1 = 0."""
    one = plain([[-1]], [[1]], [[1]], [[1]])
    P = -3 + np.sqrt(10.0)
    found = lqr(one, {"o0": 1.0}, {"i0": 1.0})
    np.testing.assert_allclose(found.cost, [[P]], rtol=1e-12)
    np.testing.assert_allclose(found.K, [[(P + 1) / 2]], rtol=1e-12)


def test_the_filter_is_dual_to_the_regulator(plant):
    """Its gains are those of the regulator of the transposed system."""
    found = kalman(plant, {"hinge": 0.3, "arm.modal_rate.1": 0.02}, {"hinge.angle": 1e-4, "arm.tip.position.y": 1e-3})
    moved = np.column_stack([plant.B, np.eye(len(plant.A))[plant.states.index("arm.modal_rate.1")]])
    dual = plain(plant.A.T, plant.C.T, moved.T)
    gains = lqr(dual, {"o0": 0.3, "o1": 0.02}, {"i0": 1e-4, "i1": 1e-3})
    np.testing.assert_allclose(found.L, gains.K.T, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(found.poles, gains.poles, rtol=1e-9)


def test_the_error_of_the_filter_is_its_covariance():
    """Of z' = w, o = z + v: deviation^4 = product of the densities; a simulated error has it too.

    10^5 steps of a hundredth of the time constant: 500 independent samples, 3 deviations of the mean square are 20 %.
    """
    found = kalman(plain([[0]], [[1]]), {"i0": 4.0}, {"o0": 9.0})
    np.testing.assert_allclose(found.L, [[2 / 3]], rtol=1e-12)
    assert found.deviation["z0"] == pytest.approx(np.sqrt(6), rel=1e-12)
    rng, dt = np.random.default_rng(1), 0.015
    w, v = rng.normal(size=(2, 100_000)) * np.sqrt([[4.0 * dt], [9.0 / dt]])
    error, errors = 0.0, []
    for k in range(100_000):
        error += w[k] - found.L[0, 0] * (error + v[k]) * dt
        errors.append(error)
    assert np.mean(np.square(errors)) == pytest.approx(6.0, rel=0.2)


def test_a_measured_acceleration_shares_the_noise_of_the_force():
    """Of a mass: the acceleration a = w + v, whose noise is that of the force too: the gain of the speed is

    Q / (Q + R), as in least squares; both poles stay where the displacement, measured too, puts them.
    """
    mass = plain([[0, 1], [0, 0]], [[0], [1]], [[1, 0], [0, 0]], [[0], [1]])
    found = kalman(mass, {"i0": 3.0}, {"o0": 1e-2, "o1": 1.0})
    assert found.L[1, 1] == pytest.approx(3 / 4, rel=1e-10)
    assert found.L[0, 1] == pytest.approx(0.0, abs=1e-12)
    left = 3.0 * 1.0 / 4.0  # what the acceleration leaves of the noise
    np.testing.assert_allclose(found.L[:, 0], [np.sqrt(2) * (left / 1e-2) ** 0.25, (left / 1e-2) ** 0.5], rtol=1e-9)


def test_regulator_and_filter_keep_their_poles_together(plant):
    """Separation: the plant with the compensator has the poles of both."""
    gains = lqr(plant, {"hinge.angle": 1e5}, {"hinge": 1.0})
    estimator = kalman(plant, {"hinge": 1.0}, {"hinge.angle": 1e-6})
    controller = compensator(gains, estimator)
    C = plant.C[:1]
    whole = np.block([[plant.A, plant.B @ controller.C], [controller.B @ C, controller.A]])
    both = np.concatenate([gains.poles, estimator.poles])
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(whole)), np.sort_complex(both), rtol=1e-6
    )  # eigenvalues of a matrix with entries up to 1e6
    steady = estimator.filter
    assert steady.inputs == ("hinge", "hinge.angle")
    np.testing.assert_allclose(np.sort_complex(steady.poles), np.sort_complex(estimator.poles), rtol=1e-9)


@pytest.mark.parametrize("order", [2, 4, 6, 8])
def test_the_error_of_truncation_is_within_its_bound(plant, order):
    """Largest singular value of the difference on a fine grid of frequencies, against twice the tail."""
    reduced = balanced_truncation(plant, order)
    frequency = np.geomspace(1e-2, 50, 4000)
    error = frequency_response(plant, frequency) - frequency_response(reduced, frequency)
    peak = np.linalg.norm(error, axis=(1, 2), ord=2).max()
    assert peak <= reduced.error_bound * (1 + 1e-6) + 1e-9
    assert peak >= reduced.error_bound / 20 - 1e-9  # and the bound is no idle one
    assert reduced.kept == 2  # the hinge turns freely
    assert (reduced.inputs, reduced.outputs) == (plant.inputs, plant.outputs)
    assert reduced.error_bound == pytest.approx(2 * reduced.hankel[order - 2 :].sum())


def test_hankel_values_of_a_light_mode():
    """A mode of damping z at w: both are b c / (4 z w^2) to first order in z (Gregory 1984)."""
    w, z = 3.0, 1e-4
    mode = plain([[0, 1], [-(w**2), -2 * z * w]], [[0], [1]], [[1, 0]])
    np.testing.assert_allclose(balanced_truncation(mode, 1).hankel, 1 / (4 * z * w**2), rtol=5 * z)


def test_truncation_tells_the_steady_gain():
    two = plain(np.diag([-1.0, -10.0]), np.ones((2, 1)), [[1.0, 5.0]])
    assert any(
        re.fullmatch(r"the steady gain changes by \d+\.\d% of the largest", n)
        for n in balanced_truncation(two, 1).notes
    )
    assert balanced_truncation(two, 2).notes == ()


def test_a_regulator_of_the_reduced_system_is_one_of_the_whole(plant):
    """By names of its states; the poles are those of the whole, and near those of the gains of the whole."""
    weights, effort = {"hinge.angle": 1e4, "hinge.rate": 1e3}, {"hinge": 1.0}
    gains = lqr(balanced_truncation(plant, 6), weights, effort)
    assert gains.states == plant.states
    assert gains.plant is plant
    np.testing.assert_allclose(np.sort_complex(gains.closed_loop.poles), np.sort_complex(gains.poles), rtol=1e-9)
    whole = lqr(plant, weights, effort)
    np.testing.assert_allclose(gains.poles[0], whole.poles[0], rtol=1e-3)


@pytest.mark.parametrize("through", [state_feedback, control_laws])
def test_the_closed_loop_of_the_system_is_that_of_the_gains(hub, plant, through):
    """The nonlinear system with the law, linearised again, has the poles of the regulator."""
    gains = lqr(plant, {"hinge.angle": 1e5, "hinge.rate": 1e4}, {"hinge": 1.0})
    law = through(hub, gains)
    load = law if through is state_feedback else feedback("motor", "hinge", [law["hinge"]])
    closed = mp.linearise(hub.with_(loads=(load,)))
    np.testing.assert_allclose(np.sort_complex(closed.poles), np.sort_complex(gains.poles), rtol=1e-7)


def test_a_free_body_is_held_where_its_reference_is():
    """Six inputs at the centre of a turned free bus: shift and rotation are those of its linear equations."""
    system = free_bus(Rotation.from_rotvec([0.4, -0.8, 1.1]))
    inputs = [f"bus.mid.{what}.{axis}" for what in ("force", "torque") for axis in "xyz"]
    linear = mp.linearise(system, inputs=inputs)
    gains = lqr(linear, dict.fromkeys(linear.states, 1e3), dict.fromkeys(inputs, 1.0))
    held = system.with_(loads=(state_feedback(system, gains),))
    poles = mp.linearise(held).poles
    # a sum over pairs: round-off turns a pair into its conjugate in the order of sort_complex
    np.testing.assert_allclose(np.sort(np.abs(poles)), np.sort(np.abs(gains.poles)), rtol=1e-6)
    with pytest.raises(mp.InputError, match=r"no channel of a run is 'flight\.shift\.1'.* use state_feedback"):
        control_laws(system, gains)
    pushed = system.joints[0].with_(velocity=np.array([0.1, 0, -0.1]), angular_velocity=np.array([0.0, 0.2, 0.1]))
    run = mp.simulate(held.with_(joints=(pushed, *system.joints[1:])), t_end=15.0, output_step=0.5, rtol=1e-7)
    away = np.abs(run["flight.displacement"] - [1, 2, 3]).max(axis=1)
    assert away.max() > 0.02
    assert away[-1] < 0.1 * away.max()


def test_a_target_is_reached(hub, plant):
    """Nothing holds the hinge: the regulator brings it to the angle given, modes to rest."""
    gains = lqr(plant, {"hinge.angle": 1e6, "hinge.rate": 1e5}, {"hinge": 1.0})
    law = state_feedback(hub, gains, target={"hinge.angle": 0.2})
    run = mp.simulate(hub.with_(loads=(law,)), t_end=12.0, output_step=0.1, rtol=1e-6)
    assert run["hinge.angle"][-1] == pytest.approx(0.2, abs=1e-3)
    assert np.abs(run["arm.modal"][-1]).max() < 0.01 * np.abs(run["arm.modal"]).max()


def test_python_control_has_the_same_system(plant):
    """Its response is ours; its names are ours with underscores."""
    pytest.importorskip("control")
    theirs = plant.to_control()
    assert theirs.state_labels[:2] == ["hinge_angle", "arm_modal_1"]
    assert theirs.input_labels == ["hinge"]
    assert theirs.output_labels == ["hinge_angle", "arm_tip_position_y"]
    frequency = np.array([0.1, 1.0, 10.0])
    ours = frequency_response(plant, frequency)
    np.testing.assert_allclose([theirs(2j * np.pi * f) for f in frequency], ours, rtol=1e-9)


def refused(call, pattern, error=mp.InputError):
    with pytest.raises(error, match=pattern):
        call()


def test_what_cannot_be_is_refused(mass, plant, hub):
    two = plain(np.diag([0.5, 0.25]), [[1], [0]], [[1, 0]])
    refused(
        lambda: lqr(two, {"z0": 1.0}, {"i0": 1.0}),
        r"'i0' cannot stabilise .*the motion of 'z1' without vibration does not",
    )
    refused(lambda: kalman(two, {"i0": 1.0}, {"o0": 1.0}), "'o0' do not see the motion of 'z1'")
    refused(lambda: kalman(mass, {}, {STATES[0]: 1.0}), "no noise moves the motion of 'slide.* without vibration")
    refused(
        lambda: lqr(mass, {STATES[1]: 1.0}, {"slide": 1.0}), r"do not see the motion of 'slide\.displacement' without"
    )
    refused(
        lambda: lqr(mass, {"slide.speeed": 1.0}, {"slide": 1.0}), "weight 'slide.speeed' is not known; did you mean"
    )
    refused(lambda: lqr(mass, {STATES[0]: -1.0}, {"slide": 1.0}), "weight 'slide.displacement': -1.0 is no positive")
    refused(lambda: lqr(mass, {STATES[0]: 1.0}, {"slide": 0.0}), "weight of input 'slide': 0.0 is no positive")
    refused(lambda: lqr(mass, {STATES[0]: 1.0}, {}), "give a weight for each input that the regulator drives")
    refused(lambda: kalman(mass, {"slide": 1.0}, {}), "name the measured outputs with their noise")
    refused(
        lambda: balanced_truncation(plant, 1), "order = 1 must be a whole number from 2 to 8: 2 of the states do not"
    )
    gains = lqr(mass, {STATES[0]: 1.0}, {"slide": 1.0})
    refused(lambda: state_feedback(hub, gains), "not of linear equations by linearise")
    other = hub.joints[0].with_(name="other")
    moving = hub.joints[0].with_(rate=1.0)
    own = lqr(plant, {"hinge.angle": 1.0}, {"hinge": 1.0})
    refused(lambda: state_feedback(hub.with_(joints=(other,)), own), "its states are other ones")
    turning = mp.linearise(hub.with_(joints=(moving,)), inputs=["hinge"])
    about = lqr(turning, {"hinge.angle": 1.0}, {"hinge": 1.0})
    refused(lambda: state_feedback(hub, about), "about a motion, whose reference moves")
    refused(
        lambda: compensator(gains, kalman(plant, {"hinge": 1.0}, {"hinge.angle": 1.0})), "systems with other states"
    )


def test_truncation_that_leaves_the_system_unstable_is_refused():
    """A cheap effort on one of two modes drives the other, which the reduced system has lost (spill-over)."""
    w, z = np.array([1.0, 1.5]), 0.01
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.diag(w**2), -np.diag(2 * z * w)]])
    reduced = balanced_truncation(plain(A, [[0], [0], [1], [1]], [[1, 1, 0, 0]]), 2)
    refused(
        lambda: lqr(reduced, {"o0": 1e4}, {"i0": 1.0}),
        r"do not stabilise the whole one, whose slowest pole then is at 0\.0018 1/s; take a higher order",
        mp.SimulationError,
    )
