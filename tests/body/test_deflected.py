"""The mass matrix of a deflected body: particles that move as it assumes, first order, positive at every deflection."""

import numpy as np
import pytest
from body.solids import horn
from formats.lumped import modal_integrals
from multibody.trees import random_body

import modalprep as mp
from modalprep.body.line import shortening, swing
from modalprep.body.mass import affine_part, cross_moment, deflected_points, mass_matrix, rigid_mass_matrix
from modalprep.examples import uniform_beam
from modalprep.multibody.reference.equations import body_equations
from modalprep.pipeline.building.model import assemble_pipeline
from modalprep.pipeline.schema.load import load_pipeline

LEVELS = (0.001, 0.01, 0.05, 0.2)  # of the body's size


def particles(rng, n=5, count=30, grows=False):
    """Masses, places, modes, displacements of second order (affine, along the rest of the modes); their modal body."""
    mass, x, shape = rng.uniform(0.5, 1, count), rng.standard_normal((count, 3)), rng.standard_normal((count, 3, n))
    gram = np.einsum("p,pai,paj->ij", mass, shape, shape)
    shape = shape @ np.linalg.inv(np.linalg.cholesky(gram)).T
    c = rng.standard_normal((3, 4, n, n))
    u2 = np.einsum("pr,arij->paij", np.column_stack([np.ones(count), x]), c + c.swapaxes(-1, -2))
    affine = np.column_stack([np.ones(count), x])
    weighted = affine.T * mass
    rest = shape - np.einsum("pr,rai->pai", affine, np.tensordot(np.linalg.inv(weighted @ affine) @ weighted, shape, 1))
    c = grows * rng.standard_normal((n, n, n))
    u3 = np.einsum("pal,ljk->pajk", rest, c + c.swapaxes(1, 2))
    T = np.einsum("p,pai,pajk->ijk", mass, shape, u2 + u3) if grows else None
    body = random_body(rng, n).with_(m=mass.sum(), **modal_integrals(mass, x, shape, u2), T=T)
    return (mass, x, shape, u2, u3), body


@pytest.mark.parametrize("grows", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_equations_are_those_of_particles(seed, grows):
    """Kane's equations summed over particles, at deflections of the size of the body."""
    rng = np.random.default_rng(seed)
    (mass, x, shape, u2, u3), body = particles(rng, grows=grows)
    q, qd, w = rng.standard_normal(5), rng.standard_normal(5), rng.standard_normal(3)
    t, bent = 0.5 * (u2 @ q) @ q, u2 @ q
    arm = x - mass @ x / mass.sum()
    strain = mass[:, None] * arm / (mass @ (arm**2).sum(axis=1))
    tau = np.sum(strain * t)
    (g, g_slope, g_curve), (h, h_slope, h_curve) = shortening(tau), swing(tau)
    strains, affine = np.einsum("pa,pai->i", strain, bent), np.column_stack([np.ones(len(x)), x])
    by_mass = affine.T * mass
    turning = np.einsum("pr,rai->pai", affine, np.tensordot(np.linalg.solve(by_mass @ affine, by_mass), shape, 1))
    aside, rest = turning @ q, shape - turning
    r, along = x + rest @ q + h * aside + g * t, h_slope * aside + g_slope * t
    partial = rest + h * turning + g * bent + np.multiply.outer(along, strains)
    r, partial = r + (u3 @ q) @ q / 2, partial + u3 @ q
    turn = np.stack([np.cross(unit, r) for unit in np.eye(3)], axis=-1)
    J = np.concatenate([np.broadcast_to(np.eye(3), turn.shape), turn, partial], axis=2)
    rate = partial @ qd
    speed, second = strains @ qd, (u2 @ qd) @ qd
    elastic = g * second + 2 * speed * (g_slope * (bent @ qd) + h_slope * (turning @ qd)) + (u3 @ qd) @ qd
    elastic += speed**2 * (g_curve * t + h_curve * aside) + np.sum(strain * second) * along
    a = np.cross(w, np.cross(w, r)) + 2 * np.cross(w, rate) + elastic
    M, bias = body_equations(body, np.concatenate([np.zeros(3), w]), q, qd)
    bias[6:] -= body.K * q + body.D * qd
    wanted = np.einsum("p,pai,paj->ij", mass, J, J)
    np.testing.assert_allclose(M, wanted, atol=1e-12 * np.abs(wanted).max())
    wanted = np.einsum("p,pai,pa->i", mass, J, a)
    np.testing.assert_allclose(bias, wanted, atol=1e-12 * np.abs(wanted).max())


def section_four(body, q):
    """M(q) as theory 4 prints it."""
    PW = body.P + body.Kg_W
    half = body.H @ q + 0.5 * (PW @ q) @ q
    s = body.s0 + body.S @ q + 0.5 * (body.Kg_A @ q) @ q
    cross = np.vstack([body.S + body.Kg_A @ q, cross_moment(body.H + PW @ q)])
    return np.block([[rigid_mass_matrix(body.m, s, body.E0 + half + half.T), cross], [cross.T, np.eye(body.n)]])


@pytest.fixture(scope="module", params=["beam", "beam with static responses", "panel", "bracket", "horn"])
def body(request, project, bracket_body):
    if request.param == "bracket":
        return bracket_body
    if request.param == "horn":
        return horn(modes=0)
    if request.param == "panel":
        mesh = mp.read_mesh(project / "meshes" / "panel.msh")
        model = assemble_pipeline(load_pipeline(project / "pipelines" / "panel.toml"), mesh)
        return mp.flexible_body(model, mp.craig_bampton(model, modes=12), name="panel")
    given = {"modes": 12} if request.param == "beam" else {"modes": 6, "truncation": ("interfaces", "inertia")}
    return uniform_beam(**given)


def deflections(body, level, count=60):
    """Random deflections whose largest displacement is `level` of the size; half of them soft modes foremost."""
    rng, size = np.random.default_rng(3), np.ptp(body.points, axis=0).max()
    q = rng.standard_normal((count, body.n))
    q[::2] /= np.sqrt(body.K)
    reach = np.linalg.norm(body.shape @ q.T, axis=1).max(axis=0)
    return level * size * q / reach[:, None]


@pytest.mark.parametrize("level", LEVELS)
def test_mass_matrix_is_positive_at_every_deflection(body, level):
    for q in deflections(body, level):
        M = mass_matrix(body, q)
        scale = 1 / np.sqrt(M.diagonal())
        assert np.linalg.eigvalsh(M * scale * scale[:, None])[0] > 1e-8  # round-off is 1e-14, M(0) has 1e-6 to 1e-3
        np.linalg.cholesky(M)


def test_section_four_as_printed_is_not(bracket_body):
    """Its modal block is constant: at 1 % of the size M(q) is indefinite."""
    assert all(np.linalg.eigvalsh(section_four(bracket_body, q))[0] < 0 for q in deflections(bracket_body, 0.01))


def test_first_order_is_that_of_section_four(body):
    """All but the modal block: rigid rows to first order, moments of mass to second."""
    q = deflections(body, 0.05)[0]
    sizes = np.array([0.25, 0.125])
    gaps = [mass_matrix(body, h * q) - section_four(body, h * q) for h in sizes]
    for rows, order in ((np.s_[:6, :6], 3), (np.s_[:6, 6:], 2), (np.s_[6:, 6:], 1)):
        first, second = (np.linalg.norm(gap[rows]) for gap in gaps)
        # the next order's share, or nothing but round-off where u2 has no part
        assert first < 1e-12 * body.m or np.log2(first / second) > order - 0.2


def test_without_geometric_stiffness_it_is_that_of_section_four(body):
    linear = body.conventional()
    for q in deflections(body, 0.2)[:5]:
        wanted = section_four(linear, q)
        np.testing.assert_allclose(mass_matrix(linear, q), wanted, atol=1e-12 * np.abs(wanted).max())


def test_a_line_has_no_moments_across_it():
    """Particles on a line, as of trusses: three of the four functions remain, or one of a single particle."""
    body = uniform_beam(modes=3)
    line = np.diag([1.0, 0, 0])
    thin = body.with_(E0=line * body.E0, Kg_W=body.Kg_W * [[[[1.0]], [[0.0]], [[0.0]]]])
    part = affine_part(thin)
    assert np.sum(np.abs(part.p0).max(axis=0) > 0) == 2
    np.testing.assert_allclose(part.p0 @ part.p0.T, thin.E0, atol=1e-9)
    assert np.all(np.isfinite(mass_matrix(thin, np.ones(3))))


def chain(body, count):
    """Bodies on hinges whose axes alternate, falling from the horizontal."""
    tip = body.interface_name[1]
    joints = tuple(
        mp.Joint(
            name=f"hinge{i}",
            type="revolute",
            parent=f"b{i - 1}.{tip}" if i else "ground",
            child=f"b{i}",
            axis=np.eye(3)[2 - i % 2],
        )
        for i in range(count)
    )
    return mp.System(bodies={f"b{i}": body for i in range(count)}, joints=joints, gravity=np.array([0, -5.0, -9.81]))


@pytest.mark.parametrize(("modes", "count", "t_end"), [(6, 1, 0.5), (3, 10, 0.5)])
def test_soft_bodies_on_hinges_run(modes, count, t_end):
    """A beam that sags by a tenth of its length under its own weight; energy balances to the integrator's tolerance."""
    run = mp.simulate(chain(uniform_beam(modes=modes), count), t_end=t_end, output_step=t_end / 10, rtol=1e-6)
    assert run.status == "done"
    assert run.stats["energy_error"] < 1e-4


def test_points_of_a_bent_beam_keep_its_length():
    """A tenth of the length to the side shortens the line by .6 per cent, which a linear displacement does not know."""
    body = uniform_beam(modes=6)
    q = 1.0 / body.shape[-1:, 1, 0][:, None] * np.eye(6)[:1]  # the tip 1 m to the side of 10 m
    line = deflected_points(body, q)[0]
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    linear = np.linalg.norm(np.diff(body.points + body.shape @ q[0], axis=0), axis=1).sum()
    assert linear - 10 > 0.05
    assert abs(length - 10) < 0.1 * (linear - 10)  # only the affine part of the shortening is known
    np.testing.assert_allclose(deflected_points(body.conventional(), q)[0], body.points + body.shape @ q[0], atol=1e-9)


def test_points_have_the_moments_of_the_body(bracket_body):
    """Mean of the particles: centre of mass and displacement of a body with T, to the density of its points."""
    q = deflections(bracket_body, 0.02)[0]
    place = deflected_points(bracket_body, q[None])[0]
    order = [np.abs(deflected_points(bracket_body, h * q[None])[0] - bracket_body.points
                    - h * bracket_body.shape @ q).max() for h in (1.0, 0.5)]  # fmt: skip
    assert np.log2(order[0] / order[1]) == pytest.approx(2, abs=0.1)  # of the second order
    assert np.all(np.isfinite(place))
