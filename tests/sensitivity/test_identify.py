"""Parameters from noisy histories: Fisher's information of a linear oscillator, a bracket pendulum, a satellite."""

import numpy as np
import pytest
from size import FULL

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.sensitivity import Parameter

TIME = np.linspace(0.1, 4.0, 40)
STIFFNESS, DAMPING = 9.0, 0.6


def oscillator(stiffness=STIFFNESS, damping=DAMPING, **element):
    """A disc of 1 kg m2 on a spring, struck to 1 rad/s."""
    disc = mp.rigid_body("disc", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    spring = HingeElement(stiffness=stiffness, damping=damping, **element)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="disc", rate=1.0, elements=spring)
    return mp.System(bodies={"disc": disc}, joints=(hinge,))


def exact(stiffness, damping, time=TIME):
    """The angle of the oscillator, in closed form."""
    w = np.sqrt(stiffness - damping**2 / 4 + 0j)
    return np.exp(-damping / 2 * time) * np.sin(w * time) / w


def slopes(step=1e-20):
    """Derivatives (nt, 2) of the closed form by complex steps; the sine of a complex argument is analytic."""

    def along(k):
        value = [STIFFNESS + 0j, DAMPING + 0j]
        value[k] += 1j * step
        w = np.sqrt(value[0] - value[1] ** 2 / 4)
        return (np.exp(-value[1] / 2 * TIME) * np.sin(w * TIME) / w).imag / step

    return np.column_stack([along(0), along(1)])


def test_errors_are_those_of_fishers_information():
    """Of data without noise, with noise given: estimates are exact, deviations the inverse of J' J / noise^2.

    To the tolerance of the run, 1e-8, over the sensitivity of the estimates.
    """
    measured = {"time": TIME, "hinge.angle": exact(STIFFNESS, DAMPING).real}
    found = mp.identify(
        oscillator(5.0, 0.2), measured, ["hinge.stiffness", "hinge.damping"], noise={"hinge.angle": 1e-2}
    )
    np.testing.assert_allclose(found.values, [STIFFNESS, DAMPING], rtol=1e-6)
    J = slopes() / 1e-2
    covariance = np.linalg.inv(J.T @ J)
    deviation = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(found.deviation, deviation, rtol=1e-5)
    np.testing.assert_allclose(found.correlation, covariance / np.outer(deviation, deviation), atol=1e-5)
    np.testing.assert_allclose(np.diff(found.interval)[:, 0], 2 * 1.959964 * deviation, rtol=1e-5)
    assert found.system.joints[0].elements[0].stiffness == found["hinge.stiffness"]
    assert found.notes == ()


def test_noise_is_found_from_residuals():
    """Of 30 samples the deviation of the noise is known to 13 %; three of them, and estimates within 3.5 deviations."""
    rng = np.random.default_rng(3)
    angle = exact(STIFFNESS, DAMPING).real + 5e-3 * rng.normal(size=len(TIME))
    angle[10:20] = np.nan
    found = mp.identify(
        oscillator(5.0, 0.2), {"time": TIME, "hinge.angle": angle}, ["hinge.stiffness", "hinge.damping"]
    )
    assert found.noise["hinge.angle"] == pytest.approx(5e-3, rel=0.4)
    assert np.all(np.abs(found.values - [STIFFNESS, DAMPING]) < 3.5 * found.deviation)
    assert np.isnan(found.residuals["hinge.angle"][10:20]).all()
    ratio = np.ptp(found.interval, axis=1) / 2 / found.deviation
    np.testing.assert_allclose(ratio, 2.0484, rtol=1e-4)  # Student's distribution with 28 degrees of freedom


def test_notes_tell_what_weakens_the_estimates():
    """A parameter without effect, two that act alike, one at its bound, a model that misses damping."""
    damped = {"time": TIME, "hinge.angle": exact(STIFFNESS, DAMPING).real}
    lost = mp.identify(oscillator(8.0, 0.2), damped, ["hinge.stiffness", "hinge.damping", "gravity.z"])
    assert any("gravity.z is not determined by the measurement" in note for note in lost.notes)
    assert np.isinf(lost.deviation[2])
    assert np.all(np.isfinite(lost.deviation[:2]))
    bound = mp.identify(
        oscillator(8.0, 0.2),
        damped,
        {"hinge.stiffness": (0, 20), "hinge.damping": (0, 0.4)},
        noise={"hinge.angle": 1e-3},
    )
    assert bound["hinge.damping"] == pytest.approx(0.4, abs=1e-6)
    assert any("hinge.damping is at its upper bound, 0.4" in note for note in bound.notes)
    assert any("times the noise given: the model misses something" in note for note in bound.notes)
    assert any("residuals of hinge.angle are no white noise" in note for note in bound.notes)
    short = np.linspace(0.02, 0.4, 20)
    early = {"time": short, "hinge.angle": exact(STIFFNESS, DAMPING, short).real}
    alike = mp.identify(oscillator(), early, ["hinge.rate", "hinge.damping"], noise={"hinge.angle": 1e-4})
    assert any("hinge.rate and hinge.damping are correlated by 0.96" in note for note in alike.notes)


@pytest.mark.skipif(not FULL, reason="a minute of processor time: MODALPREP_FULL")
def test_the_elbow_of_the_bracket_pendulum_is_found(bracket_model):
    """Stiffness and damping of a sleeve between two flexible brackets, of angles with noise of 2 mrad."""
    free = mp.craig_bampton(bracket_model, modes=0)
    body = mp.flexible_body(bracket_model, free, name="bracket", damping=0.01)

    def pendulum(stiffness, damping):
        sleeve = HingeElement(stiffness=stiffness, damping=damping)
        shoulder = mp.Joint(name="shoulder", type="revolute", parent="ground", child="upper.bolt_a", axis=(0, 0, 1))
        elbow = mp.Joint(
            name="elbow", type="revolute", parent="upper.bolt_b", child="lower.bolt_a", axis=(0, 0, 1), elements=sleeve
        )
        bodies = {"upper": body, "lower": body}
        return mp.System(bodies=bodies, joints=(shoulder, elbow), gravity=(0, -9.81, 0))

    true = [0.1, 0.002]
    run = mp.simulate(pendulum(*true), t_end=0.3, output_step=0.005, method="rosenbrock", rtol=1e-7)
    rng = np.random.default_rng(0)
    measured = {name: run[name] + 2e-3 * rng.normal(size=len(run.time)) for name in ("shoulder.angle", "elbow.angle")}
    found = mp.identify(
        pendulum(0.2, 0.001),
        {"time": run.time} | measured,
        ["elbow.stiffness", "elbow.damping"],
        noise=dict.fromkeys(measured, 2e-3),
        method="rosenbrock",
        rtol=1e-4,
    )
    assert np.all((found.interval[:, 0] < true) & (true < found.interval[:, 1]))
    assert np.all(found.deviation < [0.1 * true[0], 0.2 * true[1]])


def test_the_panels_of_a_slewing_satellite_are_found():
    """Stiffness and damping of the first mode of both panels, of the rate of the bus that its wheel turns."""
    panel = uniform_beam(modes=1, elements=8)
    torque = HingeElement(drive=[(1.0, 400.0), (2.0, -400.0), (np.inf, 0.0)])

    def satellite(stiffness, damping):
        bus = mp.rigid_body(
            "bus", mass=100.0, centre=(0, 0, 0), inertia=np.diag([200.0, 200.0, 200.0]),
            interfaces={"mid": (0, 0, 0), "right": (0.5, 0, 0), "left": (-0.5, 0, 0)},
        )  # fmt: skip
        own = panel.with_(K=np.array([stiffness]), D=np.array([damping]))
        turned = ((0, 0, 1), np.pi)
        joints = (
            mp.Joint(name="bearing", type="revolute", parent="ground", child="bus.mid", elements=torque),
            mp.Joint(name="right", type="weld", parent="bus.right", child="east"),
            mp.Joint(name="left", type="weld", parent="bus.left", child="west", rotation=turned),
        )
        return mp.System(bodies={"bus": bus, "east": own, "west": own}, joints=joints)

    def both(name, field, value):
        def change(system, x):
            own = system.bodies["east"].with_(**{field: np.array([x])})
            return system.with_(bodies=system.bodies | {"east": own, "west": own})

        return Parameter(name=name, value=value, change=change, is_linear=True)

    true = [float(panel.K[0]), 0.15]
    run = mp.simulate(satellite(*true), t_end=4.0, output_step=0.1, rtol=1e-8)
    rng = np.random.default_rng(5)
    rate = run["bearing.rate"] + 2e-3 * rng.normal(size=len(run.time))
    found = mp.identify(
        satellite(0.8 * true[0], 0.1),
        {"time": run.time, "bearing.rate": rate},
        [both("stiffness", "K", 0.8 * true[0]), both("damping", "D", 0.1)],
        noise={"bearing.rate": 2e-3},
        method="explicit",
        rtol=1e-5,
    )
    assert np.all((found.interval[:, 0] < true) & (true < found.interval[:, 1]))
    assert np.all(found.deviation < [0.02 * true[0], 0.2 * true[1]])


def test_what_cannot_be_is_refused():
    def refused(pattern, measured=None, parameters=("hinge.stiffness",), **options):
        data = {"time": TIME, "hinge.angle": TIME} if measured is None else measured
        with pytest.raises(mp.InputError, match=pattern):
            mp.identify(oscillator(), data, parameters, **options)

    refused('needs "time" and channels', {"hinge.angle": TIME})
    refused("times must ascend, from 0 or later", {"time": -TIME, "hinge.angle": TIME})
    refused("channel 'hinge.angle' has 3 numbers, and there are 40 times", {"time": TIME, "hinge.angle": [1, 2, 3]})
    refused("no channel|channel 'hinge.angel'", {"time": TIME, "hinge.angel": TIME})
    refused("do not determine 2 parameters", {"time": [1.0, 2.0], "hinge.angle": [1.0, 2.0]},
            ("hinge.stiffness", "hinge.damping"))  # fmt: skip
    refused(
        "'hinge.stiffness' is 9 in the system, outside of its bounds 10 and 20", None, {"hinge.stiffness": (10, 20)}
    )
    refused("bounds of 'hinge.stiffness' are", None, {"hinge.stiffness": (20, 10)})
    refused("noise is given, but not that of 'hinge.angle'", noise={})
    refused("noise of 'hinge.angle' is 0.0", noise={"hinge.angle": 0.0})
    refused("confidence = 95", confidence=95)
