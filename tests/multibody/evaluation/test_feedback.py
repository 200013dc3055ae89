"""Control laws as expressions: against springs and dampers of the same law, and bad input."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.errors import InputError


def bar(**more):
    ends = {"root": np.zeros(3), "tip": np.array([2.0, 0, 0])}
    body = mp.rigid_body("bar", mass=3.0, centre=np.array([1.0, 0, 0]), inertia=np.eye(3), interfaces=ends)
    joint = mp.Joint(
        name="u", type="universal", parent="ground", child="bar", axis=np.array([0, 0, 1.0]),
        second_axis=np.array([0, 1.0, 0]), angle=np.array([0.3, -0.2]), **more.pop("joint", {}),
    )  # fmt: skip
    return mp.System(bodies={"bar": body}, joints=(joint,), **more)


def test_law_of_a_joint_is_its_spring_and_damper():
    """Also a change with time."""
    pull = mp.multibody.HingeElement(stiffness=20.0, damping=1.5, drive="sin(3*t)")
    law = mp.multibody.feedback("law", "u", [f"-20*u.angle.{k} - 1.5*u.rate.{k} + sin(3*t)" for k in (1, 2)])
    options = {"t_end": 1.0, "rtol": 1e-10, "atol": 1e-12, "method": "explicit"}
    one = mp.simulate(bar(loads=(law,)), **options)
    two = mp.simulate(bar(joint={"elements": (pull, pull)}), **options)
    np.testing.assert_allclose(one["u.angle"], two["u.angle"], atol=1e-9)
    assert one.stats["energy_error"] < 1e-9


def test_body_axes_turn_with_the_interface():
    law = mp.multibody.feedback("jet", "bar.tip", [0.0, "1 + t", "2*t", "t", 0, 0], axes="body")
    force = mp.PointForce(name="jet", at="bar.tip", force=(0, "1 + t", "2*t"), torque=("t", 0, 0), axes="body")
    one, two = (mp.simulate(bar(loads=(load,)), t_end=1.0, rtol=1e-10, method="explicit") for load in (law, force))
    np.testing.assert_allclose(one["bar.tip.position"], two["bar.tip.position"], atol=1e-8)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (["u.angle.3", 0], "control 'law': no channel 'u.angle.3'"),
        (["u.angle", 0], "no channel 'u.angle'"),
        (["q", 0], "unknown name q"),
        (["2*(", 0], "is not an expression"),
        ([1.0], "has 1 numbers; give 2"),
    ],
)
def test_bad_laws_are_refused(law, said):
    with pytest.raises(InputError, match=said):
        mp.simulate(bar(loads=(mp.multibody.feedback("law", "u", law),)), t_end=0.1)


def test_body_axes_of_a_joint_are_refused():
    with pytest.raises(InputError, match="body axes need a force"):
        mp.multibody.feedback("law", "u", ["t", 0], axes="body")
