"""MBDyn's modal element: every record against sums over particles, its equations of motion against our dense ones."""

import re

import numpy as np
import pytest
from compare import assert_close
from formats.lumped import modal_body, particles, shape_to_first_order
from formats.mbdyn_parser import read_mbdyn

import modalprep as mp
from modalprep.body.frames import in_mean_axes
from modalprep.examples import uniform_beam
from modalprep.formats.mbdyn import write_mbdyn
from modalprep.multibody.reference.equations import body_equations

DIGITS = 1e-13  # the file has 17 digits; sums of a dozen particles
PRODUCTS = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]


@pytest.fixture(scope="module")
def lump():
    return particles()


@pytest.fixture(scope="module")
def fem(lump, tmp_path_factory):
    return read_mbdyn(write_mbdyn(modal_body(lump), tmp_path_factory.mktemp("mbdyn") / "lump.fem"))


def wedge(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def test_nodes_and_shapes(fem, lump):
    assert fem[1] == (3, 4)
    assert fem[2] == ["root", "n1", "n2"]
    position = np.array([fem[5], fem[6], fem[7]]).T
    assert_close(position, [np.zeros(3), lump.x[1], lump.x[2]], DIGITS)
    assert not fem[8][:, 0].any()
    for k in (1, 2):
        assert_close(fem[8][:, k], np.vstack([lump.phi[k], lump.psi[k]]).T, DIGITS)


def test_matrices(fem, lump):
    """Mass, stiffness and damping are exactly diagonal: MBDyn compares with zero."""
    assert np.array_equal(fem[9], np.eye(4))
    assert np.array_equal(fem[10], np.diag(lump.K))
    assert np.array_equal(fem[13], np.diag(lump.D))
    assert_close(fem[9], sum(m * phi.T @ phi for m, _, phi, _ in lump), DIGITS)


def test_rigid_inertia_is_about_the_centre_of_mass(fem, lump):
    mass, centre, J = fem[12]
    assert_close(mass, sum(m for m, *_ in lump), DIGITS)
    assert_close(centre, sum(m * x for m, x, *_ in lump) / mass, DIGITS)
    assert_close(J, sum(-m * wedge(x - centre) @ wedge(x - centre) for m, x, *_ in lump), DIGITS)


def test_invariants(fem, lump):
    for j in range(4):
        assert_close(fem[14][:, j], sum(m * phi[:, j] for m, _, phi, _ in lump), DIGITS)
        assert_close(fem[15][:, j], sum(m * np.cross(x, phi[:, j]) for m, x, phi, _ in lump), DIGITS)
        assert_close(fem[16][:, j], sum(-m * wedge(x) @ wedge(phi[:, j]) for m, x, phi, _ in lump), DIGITS)
        for k in range(4):
            moment = sum(m * np.cross(phi[:, j], phi[:, k]) for m, _, phi, _ in lump)
            assert_close(fem[17][:, j, k], moment, DIGITS, scale=np.abs(fem[17]).max())  # zero for j = k
            inertia = sum(m * wedge(phi[:, j]) @ wedge(phi[:, k]) for m, _, phi, _ in lump)
            assert_close(fem[18][:, j, k], inertia, DIGITS)


def test_stiffening(fem, lump):
    """A unit inertia load ``f = -load m`` on the second-order displacement: ``K = -sum f . g``."""
    found = fem[19]
    assert sorted(found) == list(range(1, 25))  # complete: 12, and 6 of each interface but the root
    for index, (a, b) in enumerate(PRODUCTS, start=1):
        one, two = wedge(np.eye(3)[a]), wedge(np.eye(3)[b])
        W = one @ one if a == b else one @ two + two @ one
        assert_close(found[index], sum(m * np.einsum("a,ajk->jk", W @ x, g) for m, x, _, g in lump), DIGITS)
    for a in range(3):
        spin = wedge(np.eye(3)[a])
        assert_close(found[7 + a], sum(m * np.einsum("a,ajk->jk", spin @ x, g) for m, x, _, g in lump), DIGITS)
        assert_close(found[10 + a], sum(m * g[a] for m, *_, g in lump), DIGITS)
        for itf in (1, 2):
            assert_close(found[13 + 6 * (itf - 1) + a], -lump.g[itf][a], DIGITS)
            assert_close(found[16 + 6 * (itf - 1) + a], lump.Kg_T[itf][a], DIGITS)


def mbdyn_forces(fem, a, alpha, w, q, qd, qdd):
    """Inertia, damping and elastic forces as MBDyn's modal element assembles them: (6 + n,)."""
    m, centre, J = fem[12]
    inv3, inv4, inv8, inv5, inv9 = (fem[group] for group in range(14, 19))
    s = m * centre + inv3 @ q
    inv8q, inv8qd = np.einsum("rjc,j->rc", inv8, q), np.einsum("rjc,j->rc", inv8, qd)
    inv9q = np.einsum("rjkc,j->rkc", inv9, q)
    J = J - m * wedge(centre) @ wedge(centre) + inv8q + inv8q.T - np.einsum("rkc,k->rc", inv9q, q)
    gyroscopic = inv8qd - np.einsum("rkc,k->rc", inv9q, qd)
    C = inv4 + np.einsum("rjk,j->rk", inv5, q)
    spin = wedge(w)
    force = m * a - np.cross(s, alpha) + spin @ spin @ s + inv3 @ qdd + 2 * spin @ inv3 @ qd
    torque = np.cross(s, a) + J @ alpha + spin @ J @ w + C @ qdd + 2 * gyroscopic @ w
    loads = np.array([w[i] * w[j] for i, j in PRODUCTS] + [*alpha, *a])
    Kg = sum(load * fem[19][index] for index, load in enumerate(loads, start=1))
    modal = fem[9] @ qdd + fem[13] @ qd + (fem[10] + Kg) @ q + inv3.T @ a + C.T @ alpha
    modal += 2 * np.einsum("rjk,j,r->k", inv5, qd, w)
    modal -= np.einsum("r,rjc,c->j", w, inv8, w) - np.einsum("r,rjkc,k,c->j", w, inv9, q, w)
    return np.concatenate([force, torque, modal])


def dense_forces(body, a, alpha, w, q, qd, qdd):
    M, bias = body_equations(body, np.concatenate([np.zeros(3), w]), q, qd)
    return M @ np.concatenate([a, alpha, qdd]) + bias


BODIES = {
    "particles": lambda: modal_body(particles(seed=3, n=6, count=20)),
    "beam": lambda: uniform_beam(modes=4, truncation=("interfaces", "inertia")),
    "free beam": lambda: in_mean_axes(uniform_beam(modes=8)),
}


@pytest.fixture(scope="module", params=[*BODIES, "bracket"])
def body(request, bracket_body):
    return bracket_body if request.param == "bracket" else BODIES[request.param]()


def test_equations_of_motion_are_ours(body, tmp_path):
    """MBDyn has all orders of the inertia but its geometric stiffness in the modal row only.

    So the conventional theories agree everywhere; with geometric stiffness the modal rows do to first order in q
    and q', and the rigid rows lack what its transpose puts there: Kg_A q in S, Kg_W q in C.
    """
    assert body.has_geometric_stiffness
    fem = read_mbdyn(write_mbdyn(body, tmp_path / "body.fem"))
    plain = read_mbdyn(write_mbdyn(body.conventional(), tmp_path / "conventional.fem"))
    size = np.concatenate([np.full(6, 1.0), 1 / np.sqrt(1 + body.K)])  # modal forces of comparable size
    rng = np.random.default_rng(1)
    for _ in range(20):
        frame, modes = rng.standard_normal((3, 3)), rng.standard_normal((3, body.n)) / np.sqrt(1 + body.K)
        ours, conventional = (size * dense_forces(b, *frame, *modes) for b in (body, body.conventional()))
        assert np.abs(size * mbdyn_forces(plain, *frame, *modes) - conventional).max() < 1e-12 * np.abs(ours).max()
        assert np.abs(ours - conventional)[6:].max() > 1e-9 * np.abs(ours).max()  # the comparison can see Kg
        gap = [size * (mbdyn_forces(fem, *frame, *x) - dense_forces(body, *frame, *x)) for x in (modes, modes / 10)]
        first, second = (np.abs(x[6:]).max() for x in gap)
        assert second < first / 50 + 1e-13 * np.abs(ours).max()  # of second order: 1 / 100


def test_interface_loads(body, tmp_path):
    """Group 19 times a force on the body adds to the stiffness: ``phi^T F - F_a K_a q = (phi - Kg_F q)^T F``."""
    fem = read_mbdyn(write_mbdyn(body, tmp_path / "body.fem"))
    rng = np.random.default_rng(2)
    q, F, M = 0.1 * rng.standard_normal(body.n) / np.sqrt(1 + body.K), *rng.standard_normal((2, 3))
    carried = range(1 if body.at_root else 0, len(body.interface_name))
    assert len(fem[19]) == 12 + 6 * len(carried)
    for first, k in zip(range(13, 1000, 6), carried, strict=False):
        Kg = sum(load * fem[19][first + i] for i, load in enumerate([*F, *M]))
        wanted = shape_to_first_order(body, k, q).T @ F + (body.psi[k] - body.Kg_T[k] @ q).T @ M
        assert_close(fem[8][:, k] @ np.concatenate([F, M]) - Kg @ q, wanted, 1e-6)


def test_classic_version_is_read_by_an_older_reader(body, tmp_path):
    file = write_mbdyn(body, tmp_path / "body.fem", "classic")
    groups = read_mbdyn(file, last=13)
    assert sorted(groups) == [1, 2, 5, 6, 7, 8, 9, 10, 12, 13]
    with pytest.raises(AssertionError, match="RECORD GROUP 14 unhandled"):
        read_mbdyn(write_mbdyn(body, tmp_path / "full.fem"), last=13)


def test_joint_card(bracket_body, tmp_path):
    """The comment holds a whole card: labels of group 2, the count of interfaces, one semicolon at its end."""
    body = bracket_body.with_(interface_name=("bolt a", "bolt b"))
    file = write_mbdyn(body, tmp_path / "bracket.fem")
    head = file.read_text().split("** RECORD GROUP")[0]
    card = " ".join(line.removeprefix("**").strip() for line in head.splitlines() if line.startswith("**   "))
    fields = [field.strip() for field in card.split(",")]
    assert fields[:3] == ["joint: LABEL", "modal", "NODE"]
    assert int(fields[3]) == body.n
    assert fields[4:8] == ["from file", "damping from file", '"bracket.fem"', "1"]
    assert fields[8:] == ['"bolt_b"', "NODE_1", "null;"]
    assert read_mbdyn(file)[2] == ["bolt_a", "bolt_b"]
    alone = body.with_(
        interface_name=("a",), interface_position=np.zeros((1, 3)), phi=body.phi[:1], psi=body.psi[:1],
        Kg_F=body.Kg_F[:1], Kg_T=body.Kg_T[:1],
    )  # fmt: skip
    file = write_mbdyn(alone, tmp_path / "alone.fem")
    assert re.search(r'"alone.fem", 0;$', file.read_text(), re.MULTILINE)
    assert len(read_mbdyn(file)[19]) == 12
    free = write_mbdyn(in_mean_axes(body), tmp_path / "free.fem").read_text()  # no interface is the modal node
    assert re.search(r'"free.fem", 2,\n\*\* +"bolt_a", NODE_1, null,\n\*\* +"bolt_b", NODE_2, null;\n', free)


def test_mesh_nodes_follow_the_interfaces(body, tmp_path):
    last = len(body.points) - 1
    fem = read_mbdyn(write_mbdyn(body, tmp_path / "body.fem", mesh_nodes=[last]))
    assert fem[2][-1] == f"node_{last}"
    assert_close([fem[5][-1], fem[6][-1], fem[7][-1]], body.points[last], DIGITS)
    assert_close(fem[8][:, -1, :3], body.shape[last].T, DIGITS)
    assert not fem[8][:, -1, 3:].any()


def test_input_errors(bracket_body, tmp_path):
    with pytest.raises(mp.InputError, match="MBDyn version 'ful' does not exist; did you mean 'full'\\?"):
        write_mbdyn(bracket_body, tmp_path / "a", "ful")
    twins = bracket_body.with_(interface_name=("a b", "a_b"))
    with pytest.raises(mp.InputError, match="two nodes would have the label 'a_b'"):
        write_mbdyn(twins, tmp_path / "a")
    rigid = mp.rigid_body("rod", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    with pytest.raises(mp.InputError, match="body 'rod' has no modes"):
        write_mbdyn(rigid, tmp_path / "a")
    assert list(tmp_path.iterdir()) == []
