"""The equations of motion as one compiled call."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody import Callback, Closure, EquationsOfMotion, HingeElement
from modalprep.multibody.evaluation.evaluator import Evaluator


def two_arms(**more):
    elements = HingeElement(stiffness=40.0, damping=3.0)
    joints = (
        mp.Joint(name="shoulder", type="revolute", parent="ground", child="upper", angle=0.3, elements=elements),
        mp.Joint(name="elbow", type="revolute", parent="upper.tip", child="lower", angle=-0.6),
    )
    beam = uniform_beam(modes=2)
    return mp.System(bodies={"upper": beam, "lower": beam}, joints=joints, gravity=np.array([0, -9.81, 0]), **more)


SLIDE = Closure(name="slide", type="point_on_line", a="ground", b="lower.tip", axis=np.array([1.0, 0, 0]))


@pytest.mark.parametrize("closures", [(), (SLIDE,)])
def test_forces_given_are_those_that_the_accelerations_need(closures):
    """Inverse dynamics, a recursion of its own, returns the forces; on loops, with those that the closures exert."""
    system, rng = two_arms(closures=closures), np.random.default_rng(3)
    equations, inverse = EquationsOfMotion(system), Evaluator(system)
    nx = equations.packed.nx
    equations.y[nx:] = inverse.closed(np.append(equations.y[:nx], 1e-2 * rng.standard_normal(inverse.nu)))[nx:]
    equations.tau[:] = rng.standard_normal(inverse.nu)
    equations.update()
    udot = equations.ydot[nx:].copy()
    left = inverse.required(equations.y, udot) - equations.tau
    if closures:
        G = inverse.jacobian(equations.y)
        left -= G.T @ np.linalg.lstsq(G.T, left)[0]
    scale = np.abs(inverse.required(equations.y, np.zeros(inverse.nu))).max()
    np.testing.assert_allclose(left, 0.0, atol=1e-9 * scale)  # stiff modes take 1e4 times the round-off of a hinge
    np.testing.assert_array_equal(equations.ydot[:nx], equations(0.0, equations.y)[:nx])


def test_other_integrators_follow_the_same_motion():
    system = two_arms()
    equations = EquationsOfMotion(system, t_end=0.2)
    found = solve_ivp(equations, (0.0, 0.2), equations.y.copy(), method="DOP853", rtol=1e-9, atol=1e-11)
    run = mp.simulate(system, t_end=0.2, output_step=0.2, method="explicit", rtol=1e-9)
    (place,) = equations.packed.coordinates_of("elbow")
    assert found.y[place, -1] == pytest.approx(run["elbow.angle"][-1], rel=1e-6)  # of all steps together


def test_nothing_is_known_beyond_the_end():
    equations = EquationsOfMotion(two_arms(), t_end=0.5)
    assert np.isfinite(equations(0.5, equations.y)).all()
    assert np.isnan(equations(0.6, equations.y)).all()


def test_states_of_other_lengths_are_refused():
    with pytest.raises(mp.InputError, match="the state has 3 numbers, not 12"):
        EquationsOfMotion(two_arms())(0.0, np.zeros(3))


def test_callbacks_are_refused():
    pull = Callback(name="pull", function=lambda t, state: {"elbow": np.zeros(1)})
    with pytest.raises(mp.InputError, match="callback 'pull' is Python; add what it does to `tau`"):
        EquationsOfMotion(two_arms(loads=(pull,)))
