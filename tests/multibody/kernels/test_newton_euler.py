"""Inverse dynamics of random trees against the dense equations, and accelerations without biases."""

import numpy as np
import pytest
from compare import assert_close
from multibody.kernels.test_kernel import Evaluation
from size import seeds

from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.kernels.interfaces import node_acceleration, world
from modalprep.multibody.kernels.newton_euler import required_forces


@pytest.mark.parametrize("seed", seeds(20))
def test_required_forces_are_those_of_the_dense_equations(seed):
    """M u' - f for any u'; both sum the same terms, so only round-off of the largest is left."""
    e = Evaluation(seed, most=6)
    udot, out = np.random.default_rng(seed).standard_normal(e.packed.nu), np.zeros(e.packed.nu)
    kernel.outward(e.model, e.data, e.y, e.motion)
    world(e.model, e.data)
    required_forces(e.model, e.data, udot, out)
    M, f = e.dense()
    assert_close(out, M @ udot - (f - e.tau), 1e-11, scale=np.abs(M).sum(axis=1).max() + np.abs(f).max())


@pytest.mark.parametrize("seed", seeds(20))
def test_spread_accelerations_are_partial_velocities(seed):
    """J u' of an interface of the last body, by its partial velocities in the dense equations."""
    e = Evaluation(seed, most=6)
    udot, body = np.random.default_rng(seed).standard_normal(e.packed.nu), e.system.order[-1]
    kernel.outward(e.model, e.data, e.y, e.motion)
    world(e.model, e.data)
    kernel.spread(e.model, e.data, udot)
    linear, angular = node_acceleration(e.model, e.data, e.packed.link_of(body), 1, 0.0)
    J, _ = e.interface_partials(body, 1)
    assert_close(np.array([*linear, *angular]), J @ udot, 1e-10, scale=(np.abs(J) @ np.abs(udot)).max())
