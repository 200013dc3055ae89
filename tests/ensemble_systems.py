"""Systems of the tests of ensembles."""

import os

import numpy as np

import modalprep as mp

MASS, STIFFNESS = 2.0, 50.0  # kg, N/m: 5 rad/s


def block():
    return mp.rigid_body(
        "block", mass=MASS, centre=np.zeros(3), inertia=np.eye(3),
        interfaces={"root": np.zeros(3), "side": np.array([1.0, 0, 0])},
    )  # fmt: skip


def oscillator(**options):
    """A block on a spring, which slides along z."""
    spring = mp.multibody.HingeElement(stiffness=STIFFNESS)
    slide = mp.Joint(name="slide", type="prismatic", parent="ground", child="block", elements=spring, displacement=0.1)
    return mp.System(bodies={"block": block()}, joints=(slide,), **options)


def pendulums():
    """A double pendulum with a spring between its ends and a torque, gravity along -y."""
    rod = mp.rigid_body(
        "rod", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([0, 1 / 12, 1 / 12]),
        interfaces={"root": np.zeros(3), "tip": np.array([1.0, 0, 0])},
    )  # fmt: skip
    joints = (
        mp.Joint(name="shoulder", type="revolute", parent="ground", child="upper", angle=-0.5),
        mp.Joint(name="elbow", type="revolute", parent="upper.tip", child="lower"),
    )
    stay = mp.multibody.AxialSpring(name="stay", between=("ground", "lower.tip"), stiffness=5.0, free_length=1.0)
    push = mp.PointForce(name="push", at="lower.tip", force=("sin(3*t)", 0, 0))
    return mp.System(
        bodies={"upper": rod, "lower": rod.with_(name="lower")}, joints=joints, loads=(stay, push),
        gravity=np.array([0, -9.81, 0]),
    )  # fmt: skip


def end_process(t, state):
    """A callback that ends its process, as a fault of a library does, where the block starts beyond 0.5 m."""
    if state.joint("slide").position > 0.5:
        os._exit(3)
    return {}
