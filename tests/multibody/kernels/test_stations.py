"""Bodies with stations: the compiled equations against their reference, which is checked by Lagrange's equations."""

import numpy as np
import pytest
from body.stations.statics import lagrange
from compare import assert_close
from multibody.station_trees import random_stations, station_tree

from modalprep.examples import large_cantilever
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.equations import body_equations, dense_accelerations, node_motion


def state(body, seed, size=0.5):
    """Spin and velocity, modal coordinates and rates."""
    rng = np.random.default_rng(seed)
    return rng.standard_normal(6), size * rng.standard_normal(body.n), rng.standard_normal(body.n)


@pytest.mark.parametrize("seed", range(3))
def test_bias_is_that_of_lagrange(seed):
    """Differences of the kinetic energy, which has no damping: six digits, of the largest number."""
    body = random_stations(seed, 4).with_(D=np.zeros(4))
    V, q, qd = state(body, seed)
    found = body_equations(body, V, q, qd)[1]
    np.testing.assert_allclose(found, lagrange(body, V, q, qd), atol=1e-6 * np.abs(found).max())


def test_mass_is_positive_at_every_deflection():
    body = random_stations(0, 4)
    for size in (1.0, 10.0, 100.0):
        M, _ = body_equations(body, *state(body, 0, size))
        assert np.linalg.eigvalsh(M)[0] > 0


def test_second_order_is_that_of_the_body():
    """What the linear body has to the second order of q the stations have: the rest is of third order."""
    body = random_stations(1, 4)
    plain = body.with_(stations=None)
    _, q, _ = state(body, 2)
    still = np.zeros(6), np.zeros(body.n)
    gaps, places = [], []
    for h in (1e-2, 1e-3):
        own, other = (body_equations(each, still[0], h * q, still[1])[0] for each in (body, plain))
        gaps.append(np.abs(own[:6, :6] - other[:6, :6]).max())
        own, other = (node_motion(each, 1, np.zeros(3), h * q, still[1])[:2] for each in (body, plain))
        places.append([np.abs(x - y).max() for x, y in zip(own, other, strict=True)])
    assert gaps[1] < 2e-3 * gaps[0]
    assert np.all(np.array(places[1]) < 2e-3 * np.array(places[0]))


@pytest.mark.parametrize("k", [1, 2])
def test_interfaces_move_as_their_places(k):
    """Partial velocities and accelerations by differences of place and rotation."""
    body = random_stations(2, 4)
    _, q, qd = state(body, 3)
    w, h = np.zeros(3), 1e-6
    _, R, Phi, _, acceleration = node_motion(body, k, w, q, qd)
    ends = [node_motion(body, k, w, q + s * h * qd, qd) for s in (1, -1)]
    turn = (ends[0][1] - ends[1][1]) / (2 * h) @ R.T
    np.testing.assert_allclose((ends[0][0] - ends[1][0]) / (2 * h), Phi[:3] @ qd, atol=1e-7)
    np.testing.assert_allclose([turn[2, 1], turn[0, 2], turn[1, 0]], Phi[3:] @ qd, atol=1e-7)
    np.testing.assert_allclose((ends[0][2] - ends[1][2]) @ qd / (2 * h), acceleration, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_kernel_is_the_reference(seed):
    """A body with stations on a skew hinge carries one without and one with them."""
    rng = np.random.default_rng(seed)
    beam = large_cantilever(modes=2, stations=5, elements=10) if seed == 0 else random_stations(seed, 5)
    system = station_tree(seed, beam)
    packed = pack(system)
    y = 0.3 * rng.standard_normal(packed.nx + packed.nu)
    udot, data = np.zeros(packed.nu), packed.data()
    kernel.outward(packed.model, data, y, np.zeros((len(packed.links), 3)))
    assert kernel.inward(packed.model, data, np.zeros(packed.nu), None, 0.0, 0.0) == -1
    kernel.forward(packed.model, data, np.zeros(packed.nu), udot)
    assert_close(udot, dense_accelerations(system, y), 1e-10)  # round-off of the elimination
