"""The reference implementation against Newton and Euler, which it shares nothing with."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.multibody.reference.equations import body_equations
from modalprep.vectors import skew


@pytest.mark.parametrize("seed", range(3))
def test_a_rigid_body_obeys_newton_and_euler(seed):
    """About a point of the body: m a + alpha x s + w x (w x s), s x a + J alpha + w x J w, with s = m c."""
    rng = np.random.default_rng(seed)
    m, c, w, acceleration = 2.5, rng.normal(size=3), rng.normal(size=3), rng.normal(size=6)
    about_centre = np.diag([1.0, 1.5, 2.0])
    block = mp.rigid_body("block", mass=m, centre=c, inertia=about_centre, interfaces={"root": np.zeros(3)})
    J = about_centre + m * (c @ c * np.eye(3) - np.outer(c, c))
    M, bias = body_equations(block, np.concatenate([rng.normal(size=3), w]), np.zeros(0), np.zeros(0))
    a, alpha = acceleration[:3], acceleration[3:]
    force = m * (a + np.cross(alpha, c) + np.cross(w, np.cross(w, c)))
    torque = m * np.cross(c, a) + J @ alpha + np.cross(w, J @ w)
    np.testing.assert_allclose(M @ acceleration + bias, np.concatenate([force, torque]), atol=1e-12)
    np.testing.assert_allclose(M[:3, 3:], -m * skew(c), atol=1e-12)
