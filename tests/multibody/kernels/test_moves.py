"""Finite moves of joints against matrix exponentials."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.multibody.kernels.joints import move
from modalprep.multibody.packing.tree import pack
from modalprep.vectors import skew


def floating():
    """A block that nothing holds."""
    block = mp.rigid_body(
        "block", mass=2.0, centre=np.zeros(3), inertia=np.diag([0.1, 0.2, 0.25]), interfaces={"root": np.zeros(3)}
    )
    return mp.System(bodies={"b": block}, joints=(mp.Joint(name="j", type="free", parent="ground", child="b"),))


@pytest.mark.parametrize("angle", [1e-5, 9e-4, 0.7, 2.5])  # series below 1e-3
def test_a_free_joint_moves_along_its_twist(angle):
    """d is in the axes of the body: R exp(w~), and the translation of exp of the (4, 4) twist."""
    system = floating()
    rng = np.random.default_rng(1)
    y = np.concatenate([rng.normal(size=3), Rotation.random(random_state=2).as_quat(scalar_first=True), np.zeros(6)])
    d, out = rng.normal(size=6), y.copy()
    d[3:] *= angle / np.linalg.norm(d[3:])
    move(pack(system).model, y, d, out)
    turned, before = (Rotation.from_quat(x[3:7], scalar_first=True).as_matrix() for x in (out, y))
    step = expm(np.block([[skew(d[3:]), d[:3, None]], [np.zeros((1, 4))]]))
    np.testing.assert_allclose(turned, before @ step[:3, :3], atol=1e-14)
    np.testing.assert_allclose(out[:3], y[:3] + before @ step[:3, 3], atol=1e-14)
