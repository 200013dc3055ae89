"""Parameters from histories: the closed form of a linear oscillator, with Fisher's information."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.multibody.model.joint_element import HingeElement

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
