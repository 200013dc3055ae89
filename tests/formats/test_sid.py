"""SID_FEM: every term against sums over particles, the equations of motion against our own dense ones."""

import numpy as np
import pytest
from compare import assert_close
from formats.lumped import modal_body, particles, shape_to_first_order
from formats.sid_parser import read_sid
from formats.sid_readers import read_as_embslib, read_as_pymbs
from shared_data import DATA

import modalprep as mp
from modalprep.body.frames import in_mean_axes
from modalprep.examples import uniform_beam
from modalprep.formats.sid import DIALECTS, write_sid
from modalprep.multibody.reference.equations import body_equations

DIGITS = 2e-11  # the format has 12 digits; a few such errors add up
PRODUCTS = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]


@pytest.fixture(scope="module", params=DIALECTS)
def dialect(request):
    return request.param


@pytest.fixture(scope="module")
def lump():
    return particles()


@pytest.fixture(scope="module")
def sid(lump, dialect, tmp_path_factory):
    return read_sid(write_sid(modal_body(lump), tmp_path_factory.mktemp("sid") / "lump.sid_fem", dialect))


def wedge(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def spin_square(first, second):
    """The coefficient matrix of ``w_first w_second`` in ``w~ w~``."""
    a, b = wedge(np.eye(3)[first]), wedge(np.eye(3)[second])
    return a @ a if first == second else a @ b + b @ a


def test_layout_is_that_of_the_dialect(sid, dialect):
    mixed = {"fembs": ("axis", "axis"), "pysid": ("mode", "axis")}
    by = mixed.get(dialect, ("mode", "mode"))
    assert (sid.layout["Gr"], sid.layout["Ge"]) == by
    assert sid.mode_last == (dialect == "fembeam")
    assert sid.body["J"].M0.shape == ((3, 3) if dialect == "fembeam" else (6, 1))
    assert sid.counts == (3, 4)
    assert len(sid.modes) == 4
    assert list(sid.nodes) == ["1", "2", "3"]


@pytest.mark.parametrize("read", [read_as_embslib, read_as_pymbs])
@pytest.mark.parametrize("name", ["lump", "Jib of the Demo frame, Messrs Ct"])
def test_embslib_and_pymbs_read_the_terms(read, name, lump, tmp_path):
    """By their published rules: every matrix that their equations of motion use, at a state; names are no trap."""
    found = read(write_sid(modal_body(lump).with_(name=name), tmp_path / "lump.sid_fem", "embs"))
    q, qd = np.random.default_rng(0).standard_normal((2, 4))
    wedges = [(wedge(x), wedge(phi @ q), wedge(phi @ qd), m) for m, x, phi, _ in lump]
    J = sum(m * (-X @ X - X @ U - U @ X) for X, U, _, m in wedges)
    assert_close(found.mass, lump.m.sum(), DIGITS)
    assert_close(found.at("mdCM", q)[:, 0], sum(m * (x + phi @ q) for m, x, phi, _ in lump), DIGITS)
    assert_close(found.inertia(q), J, DIGITS)
    assert_close(found.gyroscopic("Gr", qd), sum(-2 * m * X @ V for X, _, V, m in wedges), DIGITS)
    Ge = sum(2 * m * np.cross(phi @ qd, phi.T) for m, _, phi, _ in lump)
    assert_close(found.gyroscopic("Ge", qd), Ge, 10 * DIGITS)  # sums over modes cancel
    assert_close(found.at("Ct", 0 * q), sum(m * phi.T for m, _, phi, _ in lump), DIGITS)
    assert_close(found.at("Ke", q), np.diag(lump.K), DIGITS)
    assert_close(found.nodes[1]["phi"][0], lump.phi[1], DIGITS)
    assert_close(found.nodes[1]["origin"][0][:, 0], lump.x[1], DIGITS)


@pytest.mark.parametrize("dialect", ["fembs", "pysid"])
def test_other_dialects_are_misread_by_embslib(dialect, lump, tmp_path):
    """Why there is a dialect for it."""
    found = read_as_embslib(write_sid(modal_body(lump), tmp_path / "lump.sid_fem", dialect))
    qd = np.random.default_rng(0).standard_normal(4)
    Ge = sum(2 * m * np.cross(phi @ qd, phi.T) for m, _, phi, _ in lump)
    assert np.abs(found.gyroscopic("Ge", qd) - Ge).max() > 0.1 * np.abs(Ge).max()


def test_rigid_terms(sid, lump):
    assert_close(sid.mass, lump.m.sum(), DIGITS)
    assert_close(sid.body["mdCM"].M0[:, 0], sum(m * x for m, x, _, _ in lump), DIGITS)
    J = sum(m * (-wedge(x) @ wedge(x)) for m, x, _, _ in lump)
    found = sid.body["J"].M0
    assert_close(found if found.shape == (3, 3) else found[[0, 3, 4, 3, 1, 5, 4, 5, 2], 0].reshape(3, 3), J, DIGITS)


def test_first_order_of_rigid_terms(sid, lump):
    for j in range(4):
        assert_close(sid.body["mdCM"].M1[:, j, 0], sum(m * phi[:, j] for m, _, phi, _ in lump), DIGITS)
        dJ = sum(m * (-wedge(x) @ wedge(phi[:, j]) - wedge(phi[:, j]) @ wedge(x)) for m, x, phi, _ in lump)
        found = sid.body["J"].M1[:, j]
        full = found if found.shape == (3, 3) else found[[0, 3, 4, 3, 1, 5, 4, 5, 2], 0].reshape(3, 3)
        assert_close(full, dJ, DIGITS)


def test_coupling_terms(sid, lump):
    Ct, Cr = sid.body["Ct"], sid.body["Cr"]
    for j in range(4):
        assert_close(Ct.M0[j], sum(m * phi[:, j] for m, _, phi, _ in lump), DIGITS)
        assert_close(Cr.M0[j], sum(m * np.cross(x, phi[:, j]) for m, x, phi, _ in lump), DIGITS)
        for k in range(4):
            assert_close(Ct.M1[j, k], sum(m * g[:, j, k] for m, _, _, g in lump), DIGITS)
            field = sum(m * (np.cross(phi[:, k], phi[:, j]) + np.cross(x, g[:, j, k])) for m, x, phi, g in lump)
            assert_close(Cr.M1[j, k], field, DIGITS)


def test_gyroscopic_terms(sid, lump):
    for j in range(4):
        assert_close(sid.Gr[:, j], sum(m * (-2 * wedge(x) @ wedge(phi[:, j])) for m, x, phi, _ in lump), DIGITS)
        for i in range(4):
            Ge = sum(m * 2 * np.cross(phi[:, j], phi[:, i]) for m, _, phi, _ in lump)
            assert_close(sid.Ge[i, j], Ge, DIGITS, scale=np.abs(sid.Ge).max())  # zero for i = j


def test_centrifugal_terms(sid, lump):
    Oe = sid.body["Oe"]
    for c, pair in enumerate(PRODUCTS):
        W = spin_square(*pair)
        for j in range(4):
            assert_close(Oe.M0[j, c], sum(m * (phi[:, j] @ W @ x) for m, x, phi, _ in lump), DIGITS)
            for k in range(4):
                expected = sum(m * (phi[:, j] @ W @ phi[:, k] + g[:, j, k] @ W @ x) for m, x, phi, g in lump)
                assert_close(Oe.M1[j, k, c], expected, DIGITS, scale=np.abs(Oe.M1).max())


def test_modal_terms(sid, lump):
    gram = sum(m * (phi.T @ phi) for m, _, phi, _ in lump)
    assert_close(sid.body["Me"].M0, gram, DIGITS)
    assert_close(sid.body["Ke"].M0, np.diag(lump.K), DIGITS)
    assert_close(sid.body["De"].M0, np.diag(lump.D), DIGITS)
    assert not sid.body["ksigma"].M0.any()


def test_nodes(sid, lump):
    """A node is where its particle is to first order; a force works on the derivative of its second order."""
    for k, node in enumerate(list(sid.nodes.values())[1:], start=1):
        assert_close(node["origin"].M0[:, 0], lump.x[k], DIGITS)
        assert_close(node["origin"].M1[:, :, 0], lump.phi[k], DIGITS)
        assert_close(node["phi"].M0, lump.phi[k], DIGITS)
        assert_close(node["phi"].M1, lump.g[k], DIGITS)  # symmetric in its modes
        assert_close(node["psi"].M0, lump.psi[k], DIGITS)
        assert_close(node["psi"].M1, -lump.Kg_T[k], DIGITS)
        for j in range(4):
            assert_close(node["AP"].M1[:, j], wedge(lump.psi[k][:, j]), DIGITS)
    for node in sid.nodes.values():
        assert_close(node["AP"].M0, np.eye(3), DIGITS)
    root = next(iter(sid.nodes.values()))
    assert not any(root[name].M0.any() or root[name].M1.any() for name in ("origin", "phi", "psi"))


def sid_forces(sid, a, alpha, w, q, qd, qdd):
    """Inertia, damping and elastic forces of the format's equation of motion: (6 + n,)."""
    body = sid.body
    c, Ct, Cr = body["mdCM"].at(q)[:, 0], body["Ct"].at(q), body["Cr"].at(q)
    J = body["J"].at(q)
    J = J if J.shape == (3, 3) else J[[0, 3, 4, 3, 1, 5, 4, 5, 2], 0].reshape(3, 3)
    Gr, Ge = np.einsum("rjc,j->rc", sid.Gr, qd), np.einsum("ija,j->ia", sid.Ge, qd)
    wq = np.array([w[i] * w[j] for i, j in PRODUCTS])
    spin = wedge(w)
    force = sid.mass * a - wedge(c) @ alpha + Ct.T @ qdd + 2 * spin @ body["Ct"].M0.T @ qd + spin @ spin @ c
    torque = wedge(c) @ a + J @ alpha + Cr.T @ qdd + Gr @ w + spin @ J @ w
    modal = Ct @ a + Cr @ alpha + body["Me"].M0 @ qdd + Ge @ w + body["Oe"].at(q) @ wq
    modal += body["Ke"].M0 @ q + body["De"].M0 @ qd
    return np.concatenate([force, torque, modal])


def dense_forces(body, a, alpha, w, q, qd, qdd):
    """Of the dense equations, but without the growth of M_ff with q, which times q'' is of second order."""
    M, bias = body_equations(body, np.concatenate([np.zeros(3), w]), q, qd)
    M[6:, 6:] = np.eye(body.n)
    return M @ np.concatenate([a, alpha, qdd]) + bias


def first_order(body, a, alpha, w, q, qd, qdd):
    """Value and derivative of the dense forces at q = q' = 0 along (q, q'), by central differences.

    What they leave out are terms of second order that SID does not have: q Kg_A q / 2 in the static moment,
    q (P + Kg_W) q in the inertia, Kg_A q in the Coriolis force, (P + Kg_W) q in the gyroscopic one, q' Kg q', and
    those that keep the mass matrix positive.
    """
    h = 1e-5
    rest, plus, minus = (dense_forces(body, a, alpha, w, s * q, s * qd, qdd) for s in (0, h, -h))
    return rest + (plus - minus) / (2 * h)


BODIES = {
    "particles": lambda: modal_body(particles(seed=3, n=6, count=20)),
    "beam": lambda: uniform_beam(modes=4, truncation=("interfaces", "inertia")),
    "free beam": lambda: in_mean_axes(uniform_beam(modes=8)),
}


@pytest.fixture(scope="module", params=[*BODIES, "bracket"])
def body(request, bracket_body):
    return bracket_body if request.param == "bracket" else BODIES[request.param]()


def test_equations_of_motion_are_ours(body, dialect, tmp_path):
    """Random motions with geometric stiffness: to first order in q and q'."""
    assert body.has_geometric_stiffness
    sid = read_sid(write_sid(body, tmp_path / "body.sid_fem", dialect))
    size = np.concatenate([np.full(6, 1.0), 1 / np.sqrt(1 + body.K)])  # modal forces of comparable size
    rng = np.random.default_rng(1)
    for _ in range(20):
        a, alpha, w = rng.standard_normal((3, 3))
        q, qd, qdd = rng.standard_normal((3, body.n)) / np.sqrt(1 + body.K)
        found = size * sid_forces(sid, a, alpha, w, q, qd, qdd)
        linear = size * first_order(body, a, alpha, w, q, qd, qdd)
        assert np.abs(found - linear).max() < 1e-9 * np.abs(found).max()  # round-off over the step, step squared


def test_geometric_stiffness_is_in_the_file(tmp_path):
    """Without it the modal row of a spinning beam would differ by the stiffness of its centrifugal force."""
    body = uniform_beam(modes=2)
    w, q = np.array([0, 0, 3.0]), np.array([1e-5, 2e-5])  # second order is 1e-5 of it and more
    rest = [np.zeros(3)] * 2
    motion = (*rest, w, q, 0 * q, 0 * q)
    conventional = read_sid(write_sid(body.conventional(), tmp_path / "c.sid_fem"))
    assert conventional.body["Ct"].keys["order"] == 0
    difference = dense_forces(body, *motion) - sid_forces(conventional, *motion)
    wanted = np.einsum("ab,abij,j->i", wedge(w) @ wedge(w), body.Kg_W, q)
    assert_close(difference[6:], wanted, 1e-3)
    assert np.abs(wanted).max() > 0.1 * np.abs(body.K * q).max()


def test_work_of_a_force_and_moment(body, tmp_path):
    """Generalised forces of an interface force; of a moment to zeroth order in the rotation map of the interface."""
    sid = read_sid(write_sid(body, tmp_path / "body.sid_fem", "fembeam"))
    q = 0.1 * np.random.default_rng(2).standard_normal(body.n) / np.sqrt(1 + body.K)
    for k, node in enumerate(sid.nodes.values()):
        Phi = shape_to_first_order(body, k, q)
        assert Phi.any() == (k > 0 or not body.at_root)
        assert_close(node["phi"].at(q), Phi, 1e-6)
        assert_close(node["psi"].at(q), body.psi[k] - body.Kg_T[k] @ q, 1e-12)


def test_mesh_nodes_follow_the_interfaces(body, tmp_path):
    last = len(body.points) - 1
    sid = read_sid(write_sid(body, tmp_path / "body.sid_fem", mesh_nodes=[last]))
    node = sid.nodes[str(len(body.interface_name) + 1)]
    assert_close(node["origin"].M0[:, 0], body.points[last], DIGITS)
    assert_close(node["phi"].M0, body.shape[last], DIGITS)
    assert node["phi"].keys["order"] == 0
    assert not node["psi"].M0.any()


def test_equal_values_in_all_dialects(lump, tmp_path):
    body = modal_body(lump)
    read = {name: read_sid(write_sid(body, tmp_path / name, name)) for name in DIALECTS}
    for name in ("pysid", "fembeam"):
        assert_close(read[name].Gr, read["fembs"].Gr, DIGITS)
        assert_close(read[name].Ge, read["fembs"].Ge, DIGITS)
        assert_close(read[name].body["Oe"].M1, read["fembs"].body["Oe"].M1, DIGITS)


def test_parser_and_signs_on_a_file_of_fembs():
    """A file of FEMBS (femb_example.sid, examples/sid of sevoigt/pymbs) passes the same identities."""
    file = DATA / "sid" / "femb_example.sid"
    if not file.exists():
        pytest.skip("no FEMBS file here")
    sid = read_sid(file)
    assert sid.layout == {"Gr": "axis", "Ge": "axis"}
    assert not sid.mode_last
    body = sid.body
    assert_close(body["mdCM"].M1[:, :, 0], body["Ct"].M0.T, 1e-9)
    # all of it: its part that is symmetric in the modes is geometric stiffness
    assert_close(sid.Ge, 2 * body["Cr"].M1, 1e-9)
    assert np.abs(sid.Ge + sid.Ge.swapaxes(0, 1)).max() > 0.01 * np.abs(sid.Ge).max()
    for node in sid.nodes.values():
        assert_close(node["origin"].M1[:, :, 0], node["phi"].M0, 1e-9)
        assert np.abs(node["AP"].M1 - np.array([wedge(p) for p in node["psi"].M0.T]).swapaxes(0, 1)).max() < 1e-9


@pytest.mark.parametrize("name", ["origin", "m0", "end node", "m1", "nqn", "end De"])
def test_lines_look_like_those_of_fembs(name, tmp_path):
    """Same columns of key, '=' and value as in the file of FEMBS."""
    file = DATA / "sid" / "femb_example.sid"
    if not file.exists():
        pytest.skip("no FEMBS file here")
    ours = write_sid(uniform_beam(modes=2), tmp_path / "beam.sid_fem").read_text().splitlines()
    theirs = file.read_text().splitlines()

    def shape(lines):
        line = next(x for x in lines if x.strip().startswith(name)).rstrip()
        return len(line) - len(line.lstrip()), line.find("="), len(line) if "=" in line else name

    assert shape(ours) == shape(theirs)


def test_input_errors(tmp_path):
    beam = uniform_beam(modes=2)
    with pytest.raises(mp.InputError, match="SID dialect 'fems' does not exist; did you mean 'fembs'\\? known are"):
        write_sid(beam, tmp_path / "a", "fems")
    with pytest.raises(mp.InputError, match="mesh node 99 does not exist; 'beam' has 0 to 40"):
        write_sid(beam, tmp_path / "a", mesh_nodes=[99])
    rigid = mp.rigid_body("rod", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    with pytest.raises(mp.InputError, match="body 'rod' has no modes; enter it as a rigid body of 1 kg"):
        write_sid(rigid, tmp_path / "a")
    assert list(tmp_path.iterdir()) == []
