"""Runs of a body whose dampers couple its modes: the exponential of its linear equations, and its energy."""

import numpy as np
import pytest
from compare import assert_close
from multibody.trees import with_dampers
from scipy.linalg import expm

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody.packing.tree import pack

GRAVITY = np.array([1.0, 2.0, -9.81])
END = 0.4


def welded(*bodies):
    joints = tuple(mp.Joint(name=f"w{k}", type="weld", parent="ground", child=f"b{k}") for k in range(len(bodies)))
    named = {f"b{k}": body for k, body in enumerate(bodies)}
    return mp.System(bodies=named, joints=joints, gravity=GRAVITY)


@pytest.fixture(scope="module")
def beam():
    """Linear: without geometric stiffness the modal rows of a welded body are ``q'' + C q' + K q = S^T g``."""
    return with_dampers(uniform_beam(modes=3).conventional(), 0.2)


def exact(body):
    """Modal coordinates after `END` from rest."""
    n = body.n
    A = np.zeros((2 * n + 1, 2 * n + 1))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n] = np.hstack([-np.diag(body.K), -body.damping_matrix, (body.S.T @ GRAVITY)[:, None]])
    return expm(END * A)[:n, -1]


METHODS = {  # options, and what each leaves of its tolerance over some vibrations
    "explicit": ({"rtol": 1e-10}, 1e-8),
    "rosenbrock": ({"rtol": 1e-8}, 1e-6),
    "generalised_alpha": ({"rtol": 1e-6}, 1e-4),
}


@pytest.mark.parametrize("method", METHODS)
def test_a_run_is_the_exponential_of_its_matrix(method, beam):
    options, rtol = METHODS[method]
    run = mp.simulate(welded(beam), END, output_step=END, method=method, **options)
    expected = exact(beam)
    assert_close(run["b0.modal"][-1], expected, rtol)
    diagonal = exact(beam.with_(D=beam.D))
    assert np.abs(diagonal - expected).max() > 1e-2 * np.abs(expected).max()  # without the coupling it is another run
    assert run.stats["energy_error"] < 10 * rtol
    assert run["energy.work"][-1] < -1e-3 * np.abs(run["energy.strain"]).max()  # dampers take it


def test_bodies_without_such_dampers_have_no_matrix(beam):
    packed = pack(welded(uniform_beam(modes=2), beam, uniform_beam(modes=4), beam))
    assert packed.model.modal.dampers.shape[0] == 1
    assert packed.model.links["dampers"].tolist() == [-1, 0, -1, 0]
    assert pack(welded(uniform_beam(modes=2))).model.modal.dampers.size == 0
    own = packed.dampers[packed.flexible[1][2], packed.flexible[1][2]]
    np.testing.assert_array_equal(own, beam.damping_matrix - np.diag(beam.D))
