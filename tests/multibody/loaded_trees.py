"""Random trees under every kind of load, and their accelerations by the kernel."""

import numpy as np
from multibody.trees import random_tree
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.model.joint_types import SPEEDS
from modalprep.multibody.packing.tree import pack

WAVE = mp.multibody.TimeFunction([(0.4, "2 + sin(3*t)"), (float("inf"), "t")])


def element(rng, by_place):
    """Everything a hinge can have; its limits are narrow, so that random states are beyond them."""
    place = dict(stiffness=rng.uniform(), free_position=rng.normal(), lower=-0.05, upper=0.05, limit_stiffness=5.0,
                 limit_damping=0.7) if by_place else {}  # fmt: skip
    return mp.multibody.HingeElement(
        damping=rng.uniform(), friction=rng.uniform(), transition_velocity=0.3, drive=WAVE, **place
    )


def braked(joint, rng):
    if joint.motion is not None or joint.type == "weld":
        return joint
    by_place = joint.type not in ("spherical", "free")
    return joint.with_(elements=tuple(element(rng, by_place) for _ in range(SPEEDS[joint.type])))


def every_load(system, rng):
    """Each kind of load between random ends, the ground included."""
    names = list(system.bodies)
    one, two, three = (f"{rng.choice(names)}.{k}" for k in ("a", "b", "root"))
    turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix
    six = dict(stiffness=rng.uniform(0, 2, 6), damping=rng.uniform(0, 1, 6))
    points = system.bodies["b0"].points.shape
    ground = dict(position=rng.normal(size=3), rotation=turn())
    rest = dict(free_position=rng.normal(size=3), free_rotation=turn())
    forces = [
        mp.PointForce(name=axes, at=at, force=("sin(t)", WAVE, 0), torque=(0, "t", 2), axes=axes)
        for axes, at in (("inertial", one), ("body", two))
    ]
    spread = [
        mp.multibody.DistributedForce(name=axes, body="b0", force=rng.normal(size=points), factor=WAVE, axes=axes)
        for axes in ("inertial", "body")
    ]
    springs = [
        mp.multibody.AxialSpring(
            name="s1", between=(one, two), stiffness=2.0, damping=0.3, free_length=0.5, actuator_force=WAVE
        ),
        mp.multibody.AxialSpring(name="s2", between=("ground", three), stiffness=1.0, position=rng.normal(size=3)),
        mp.multibody.AxialSpring(
            name="slack", between=(two, three), stiffness=1.0, damping=0.4, free_length=9.0, tension_only=True
        ),
        mp.multibody.AxialSpring(
            name="taut", between=(one, "ground"), stiffness=1.0, damping=0.4, free_length=0.1, tension_only=True
        ),
        mp.multibody.AxialSpring(name="s3", between=(one, "ground"), damping=1.0, position=rng.normal(size=3)),
    ]
    bushings = [
        mp.multibody.Bushing(name="k1", between=(one, three) if one != three else (one, two), **six, **rest),
        mp.multibody.Bushing(name="k2", between=("ground", two), **six, **rest, **ground),
        mp.multibody.Bushing(name="k3", between=(three, "ground"), **six, **rest, **ground),
    ]
    stop = (np.array([-1.0, -0.2, 0.3, 1.5]), np.array([-2.0, -0.1, 0.0, 4.0]))
    rotational = [
        mp.multibody.RotationalSpring(
            name="r1", between=(one, three) if one != three else (one, two), axis=rng.normal(size=3),
            characteristic=stop, damping=0.3,
        ),
        mp.multibody.RotationalSpring(
            name="r2", between=("ground", two), axis=rng.normal(size=3), rotation=turn(), stiffness=0.7, free_angle=0.2,
            damping_characteristic=([-0.5, 0.0, 0.5], [-1.0, 0.0, 0.2]),
        ),
    ]  # fmt: skip
    planet = mp.multibody.CentralGravity(mu=40.0, centre=np.array([9.0, -4.0, 6.0]))
    pulled = names[-1] + ".b"
    control = mp.multibody.Callback(
        name="control",
        function=lambda t, state: {
            pulled: np.append(-state[one].velocity, state[two].rotation[0] + state[two].angular_velocity)
        },
    )
    return (*forces, *spread, *springs, *bushings, *rotational, planet, control)


def loaded_tree(seed):
    rng = np.random.default_rng(seed + 1000)
    system = random_tree(seed, root=["free", "revolute", "weld", "prescribed"][seed % 4])
    joints = tuple(braked(joint, rng) for joint in system.joints)
    return system.with_(joints=joints, loads=every_load(system, rng))


def order_n(system, y, t):
    """Accelerations and energies by the kernel."""
    packed = pack(system)
    data = packed.data()
    loading = Loading(system, packed, 1.0)
    kernel.outward(packed.model, data, y, loading.prescribe(t, data))
    energies = loading.apply(data, y, t)
    udot = np.zeros(packed.nu)
    assert kernel.inward(packed.model, data, loading.tau, None, 0.0, 0.0) == -1
    kernel.forward(packed.model, data, loading.tau, udot)
    return udot, energies, loading
