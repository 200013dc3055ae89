"""The mass matrix of a deflected body: particles that move as it assumes, first order, positive at every deflection."""

import numpy as np
import pytest
from body.solids import horn
from multibody.trees import random_body

import modalprep as mp
from modalprep.body.mass import affine_part, cross_moment, mass_matrix, rigid_mass_matrix
from modalprep.examples import uniform_beam
from modalprep.multibody.dense import body_equations

LEVELS = (0.001, 0.01, 0.05, 0.2)  # of the body's size


def particles(rng, n=5, count=30):
    """Masses, places, modes and an affine displacement of second order; and the modal body that they make."""
    mass, x, shape = rng.uniform(0.5, 1, count), rng.standard_normal((count, 3)), rng.standard_normal((count, 3, n))
    gram = np.einsum("p,pai,paj->ij", mass, shape, shape)
    shape = shape @ np.linalg.inv(np.linalg.cholesky(gram)).T
    c = rng.standard_normal((3, 4, n, n))
    u2 = np.einsum("pr,arij->paij", np.column_stack([np.ones(count), x]), c + c.swapaxes(-1, -2))
    return (mass, x, shape, u2), random_body(rng, n).with_(
        m=mass.sum(),
        s0=mass @ x,
        E0=np.einsum("p,pa,pb->ab", mass, x, x),
        S=np.einsum("p,pai->ai", mass, shape),
        H=np.einsum("p,pb,pai->abi", mass, x, shape),
        P=np.einsum("p,pai,pbj->abij", mass, shape, shape),
        Kg_A=np.einsum("p,paij->aij", mass, u2),
        Kg_W=np.einsum("p,pb,paij->abij", mass, x, u2),
    )


@pytest.mark.parametrize("seed", range(5))
def test_equations_are_those_of_particles(seed):
    """Kane's equations summed over particles, at deflections of the size of the body."""
    rng = np.random.default_rng(seed)
    (mass, x, shape, u2), body = particles(rng)
    q, qd, w = rng.standard_normal(5), rng.standard_normal(5), rng.standard_normal(3)
    r, partial = x + shape @ q + 0.5 * (u2 @ q) @ q, shape + u2 @ q
    turn = np.stack([np.cross(unit, r) for unit in np.eye(3)], axis=-1)
    J = np.concatenate([np.broadcast_to(np.eye(3), turn.shape), turn, partial], axis=2)
    rate = partial @ qd
    a = np.cross(w, np.cross(w, r)) + 2 * np.cross(w, rate) + (u2 @ qd) @ qd
    M, bias = body_equations(body, np.concatenate([np.zeros(3), w]), q, qd)
    bias[6:] -= body.K * q + body.D * qd
    wanted = np.einsum("p,pai,paj->ij", mass, J, J)
    np.testing.assert_allclose(M, wanted, atol=1e-12 * np.abs(wanted).max())
    wanted = np.einsum("p,pai,pa->i", mass, J, a)
    np.testing.assert_allclose(bias, wanted, atol=1e-12 * np.abs(wanted).max())


def section_four(body, q):
    """M(q) as FORMULATION section 4 prints it."""
    PW = body.P + body.Kg_W
    half = body.H @ q + 0.5 * (PW @ q) @ q
    s = body.s0 + body.S @ q + 0.5 * (body.Kg_A @ q) @ q
    cross = np.vstack([body.S + body.Kg_A @ q, cross_moment(body.H + PW @ q)])
    return np.block([[rigid_mass_matrix(body.m, s, body.E0 + half + half.T), cross], [cross.T, np.eye(body.n)]])


@pytest.fixture(scope="module")
def bodies(bracket_body):
    panel = _panel()
    return {
        "beam": uniform_beam(modes=12),
        "beam with inertia vectors": uniform_beam(modes=6, truncation=("interfaces", "inertia")),
        "panel": panel,
        "bracket": bracket_body,
        "horn": horn(modes=0),
    }


def _panel():
    from structured import rectangle  # noqa: F401
