"""Gimbal: three turns in a row, with springs and start values for each."""

import numpy as np
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.multibody.analysis.equilibrium import static_equilibrium


def test_orientation_is_the_product_of_the_rotations():
    """About z, then y, then their normal z x y = -x, each in the axes that the turns before have left."""
    body = mp.rigid_body("top", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    turns = np.array([0.3, -0.5, 0.7])
    gimbal = mp.Joint(
        name="g", type="gimbal", parent="ground", child="top", second_axis=np.array([0, 1.0, 0]), angle=turns
    )
    run = mp.simulate(mp.System(bodies={"top": body}, joints=(gimbal,)), t_end=0.1, output_step=0.1)
    expected = Rotation.from_euler("ZYX", turns * [1, 1, -1])
    found = Rotation.from_quat(run["top.orientation"][0], scalar_first=True)
    np.testing.assert_allclose((expected.inv() * found).magnitude(), 0, atol=1e-14)
    np.testing.assert_allclose(run["g.angle"][0], turns, rtol=1e-15)


def test_springs_return_each_rotation_to_its_free_angle():
    body = mp.rigid_body("top", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    springs = tuple(
        mp.multibody.HingeElement(stiffness=k, free_position=rest) for k, rest in ((2.0, 0.1), (3.0, -0.2), (5.0, 0.4))
    )
    gimbal = mp.Joint(
        name="g", type="gimbal", parent="ground", child="top", second_axis=np.array([0, 1.0, 0]), elements=springs
    )
    found = static_equilibrium(mp.System(bodies={"top": body}, joints=(gimbal,)))
    np.testing.assert_allclose(found.joints["g"], [0.1, -0.2, 0.4], rtol=1e-9)
