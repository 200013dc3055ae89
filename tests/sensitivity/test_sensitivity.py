"""Derivatives of runs against differences of runs, the adjoint against forward sensitivities, and what is refused."""

import numpy as np
import pytest
from differentiated import CASES, bouncing_rod, chain, satellite
from size import FULL

import modalprep as mp
from modalprep.errors import InputError, SimulationError
from modalprep.examples import large_cantilever
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.loads import AxialSpring
from modalprep.sensitivity import Objective, Parameter, changed, course, last, squares
from modalprep.sensitivity.parameters import find

AGAIN = (  # systems by a method of which other systems are tried
    "satellite by rosenbrock",
    "elastic slider crank by rosenbrock",
    "four bar by generalised-alpha",
    "chain by generalised-alpha",
)
DIFFERENCES = 1e-6  # what differences of runs leave, relative to the largest derivative of a channel


@pytest.mark.parametrize("name", [name for name in CASES if FULL or name not in AGAIN])
def test_derivatives_agree_with_differences_of_runs(name):
    """Fourth-order differences of runs with tight tolerances, or of the same fixed steps, of each channel.

    The adjoint takes the same linear maps from the other side: it agrees with the forward sensitivities to round-off
    and to what differences of channels leave. A derivative counts as large at least as a thousandth of the channel over
    the parameter: runs to 1e-12 leave 1e-9 of a difference.
    """
    case = CASES[name]()
    found, expected = case.forward(), case.differences()
    sizes = np.array([each.step for each in find(case.system, case.parameters)])
    least = 1e-3 * np.abs(found.values).max(axis=0) / sizes[:, None]
    largest = np.maximum(np.abs(expected).max(axis=1), least)
    error = np.abs(found.derivatives - expected).max(axis=1) / largest
    p, c = np.unravel_index(np.argmax(error), error.shape)
    assert error[p, c] <= DIFFERENCES, (found.parameters[p], found.channels[c], error[p, c])
    weights = np.random.default_rng(0).normal(size=found.values.shape)
    by_size = (np.maximum(np.abs(found.derivatives), least[:, None]) * np.abs(weights)).sum(axis=(1, 2))
    forward = np.tensordot(found.derivatives, weights, 2)
    assert np.all(np.abs(case.gradient(weights).vector - forward) <= 1e-8 * by_size)


@pytest.mark.parametrize("name", CASES if FULL else ["prescribed turn", "from equilibrium", "satellite"])
def test_compiled_steps_are_those_of_python(name, monkeypatch):
    """To the round-off of accelerations, which the tangent and the way back find by sums in another order."""
    case = CASES[name]()
    assert course.FEW > 0
    found = case.forward().derivatives
    monkeypatch.setattr(course, "FEW", 0)
    python = case.forward().derivatives
    np.testing.assert_allclose(found, python, rtol=1e-9, atol=1e-9 * np.abs(python).max())


def test_another_stiffness_of_a_mode_leaves_the_shapes():
    """Stations, the second order of the modal mass and the modal mass itself are those of the shapes."""
    beam = large_cantilever(modes=1, stations=4)
    beam = beam.with_(T=np.zeros(3 * (beam.n,)), modal_mass=2 * np.eye(beam.n))
    joint = mp.Joint(name="joint", type="weld", parent="ground", child="beam")
    system = mp.System(bodies={"beam": beam}, joints=(joint,))
    found = changed(system, ["beam.mode_stiffness.1"], [5.0]).bodies["beam"]
    assert found.K[0] == 5.0
    assert found.stations is beam.stations
    assert found.T is not None
    np.testing.assert_array_equal(found.modal_mass, beam.modal_mass)


def oscillator(**elements):
    """4 kg on a spring of 100 N/m, from 0.5 m: x = cos(5 t) / 2."""
    ball = mp.rigid_body("ball", mass=4.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    spring = HingeElement(stiffness=100.0, **elements)
    slide = mp.Joint(name="slide", type="prismatic", parent="ground", child="ball", displacement=0.5, elements=spring)
    return mp.System(bodies={"ball": ball}, joints=(slide,))


def test_a_fit_has_no_slope_where_it_is_exact():
    """Half the sum of squares: its gradient is the Jacobian of the residuals times them; zero for the true values."""
    times = np.linspace(0.0, 0.5, 6)
    measured = {"slide.displacement": 0.5 * np.cos(5 * times)}
    found = mp.gradient(oscillator(), squares(measured), ["slide.stiffness"], 0.5, times=times)
    off = mp.gradient(oscillator(), squares({"slide.displacement": np.zeros(6)}), ["slide.stiffness"], 0.5, times=times)
    slope = -0.5 * times * np.sin(5 * times) * 5 / 200  # of x by k
    assert abs(found.vector[0]) < 1e-9 * abs(off.vector[0])
    assert off.vector[0] == pytest.approx(measured["slide.displacement"] @ slope, rel=1e-7)


def test_a_parameter_of_a_user_is_any_change():
    """The square root of a stiffness: x = cos(p w t) / 2, dx/dp = -w t sin(w t) / 2."""

    def stiffer(system, p):
        elements = HingeElement(stiffness=100.0 * p**2)
        return system.with_(joints=(system.joints[0].with_(elements=elements),))

    p = Parameter(name="p", value=1.0, change=stiffer)
    found = mp.run_sensitivities(oscillator(), ["slide.displacement"], [p], 0.4, times=[0.1, 0.4])
    assert found.of("slide.displacement", "p") == pytest.approx(-2.5 * found.time * np.sin(5 * found.time), rel=1e-7)


def test_stiffness_does_not_count_where_a_damper_holds_a_spring_slack():
    """The damper of 60 N of a rope of 50 N would push: nothing pulls, but 40 N would at twice the stiffness."""
    ball = mp.rigid_body("ball", mass=4.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    slide = mp.Joint(name="slide", type="prismatic", parent="ground", child="ball", displacement=2.0, speed=-6.0)
    given = {"stiffness": 100.0, "damping": 10.0, "free_length": 1.5, "tension_only": True}
    rope = AxialSpring(name="rope", between=("ground", "ball.root"), **given)
    system = mp.System(bodies={"ball": ball}, joints=(slide,), loads=(rope,))
    found = mp.gradient(system, last("slide.displacement"), ["rope.stiffness", "slide.speed"], 1e-3, output_step=1e-3)
    assert found.vector == pytest.approx([0.0, 1e-3], rel=1e-9)


def test_knots_of_a_drive_count_at_rest():
    """A torque that is zero at all knots: the speed of the end changes by a knot by the area of its triangle."""
    times, knots = np.linspace(0.0, 1.0, 11), range(1, 10)

    def driven(values):
        drive = mp.multibody.TimeFunction.table(times, values)
        ball = mp.rigid_body("ball", mass=4.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
        slide = mp.Joint(
            name="slide", type="prismatic", parent="ground", child="ball", elements=HingeElement(drive=drive)
        )
        return mp.System(bodies={"ball": ball}, joints=(slide,))

    def knot(k):
        return Parameter(name=f"knot {k}", value=0.0, change=lambda system, value: driven(value * np.eye(11)[k]))

    given = driven(np.zeros(11)), ["slide.speed"], [knot(k) for k in knots], 1.0
    found = mp.run_sensitivities(*given, times=[1.0])
    assert found.derivatives[:, 0, 0] == pytest.approx(np.full(9, 0.1 / 4), rel=1e-12)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: mp.gradient(oscillator(), last("slide.angle"), ["slide.stiffness"], 0.1), "channel 'slide.angle'"),
        (lambda: mp.gradient(oscillator(), last("slide.speed"), ["slide.stifness"], 0.1), "stiffness"),
        (lambda: mp.gradient(oscillator(), last("slide.speed"), [], 0.1), "give a list of names"),
        (lambda: mp.gradient(oscillator(), last("slide.speed"), ["gravity.x", "gravity.x"], 0.1), "given 2 times"),
        (
            lambda: mp.gradient(oscillator(drive="sin(t)"), last("slide.speed"), ["slide.drive"], 0.1),
            "differentiate by its amplitude, slide.amplitude",
        ),
        (
            lambda: mp.gradient(
                oscillator(), Objective(channels=("slide.speed",), value=lambda t, h: (1.0, h[1:])), ["gravity.x"], 0.1
            ),
            "its derivatives (11, 1), one for each output time",
        ),
        (
            lambda: mp.gradient(oscillator(), squares({"slide.speed": np.zeros(3)}), ["gravity.x"], 0.1),
            "3 measured values of a channel, but 11 output times",
        ),
        (
            lambda: mp.run_sensitivities(oscillator(), ["slide.speed"], ["gravity.x"], 0.1, times=[0.2]),
            "between 0 and the duration, 0.1 s",
        ),
        (
            lambda: mp.run_sensitivities(
                bouncing_rod().system, ["fall.rate"], ["gravity.x"], 0.1, method="rosenbrock",
                events=bouncing_rod().options["events"],
            ),
            "with events by 'rosenbrock' are not known; give method = 'explicit'",
        ),
        (
            lambda: mp.run_sensitivities(
                bouncing_rod().system, ["fall.rate"], ["gravity.x"], 0.1,
                events=[mp.Event(name="hit", when="fall.rate", activates=("floor",))],
            ),
            "event 'hit' begins or ends closures",
        ),
        (
            lambda: mp.run_sensitivities(chain().system, ["root.angle"], ["block.mass", "arm.mass"], 0.1),
            "of a flexible body give a Parameter that makes the body anew",
        ),
        (
            lambda: mp.run_sensitivities(
                satellite().system, ["wing.angle"], ["arm.modal.1"], 0.1, start="quasi_static"
            ),
            "start values of modes are known where",
        ),
        (
            lambda: mp.run_sensitivities(
                oscillator(), ["slide.speed"], ["slide.speed"], 0.1, start={}
            ),
            "the start is a given state",
        ),
    ],
)  # fmt: skip
def test_what_has_no_derivatives_is_refused_in_a_sentence(call, sentence):
    with pytest.raises(InputError) as error:
        call()
    assert sentence in str(error.value)


def test_a_run_that_only_touches_an_event_has_no_derivatives():
    """The function of the event and its rate vanish at once."""
    case = bouncing_rod()
    joint = case.system.joints[0].with_(displacement=(0, 0.0), speed=(0, 0.0), rate=0.0, angle=0.0)
    system = case.system.with_(joints=(joint,), gravity=(0, 0, 0))
    touch = mp.Event(name="touch", when=lambda t, state: (t - 0.05) ** 3, impacts=("floor",))
    with pytest.raises(SimulationError, match="event 'touch' only touches zero at t = 0.05 s"):
        mp.run_sensitivities(system, ["fall.rate"], ["rod.mass"], 0.1, events=[touch])
