"""Reading SID_FEM: bodies that were written, a file of FEMBS by what it says itself, and damaged files."""

from contextlib import suppress

import numpy as np
import pytest
from compare import assert_close
from formats.lumped import modal_body, particles
from scipy.linalg import eigh
from shared_data import DATA
from size import seeds

import modalprep as mp
from modalprep.body.difference import compare_bodies
from modalprep.body.frames import in_mean_axes
from modalprep.body.mass import mass_matrix
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.formats import import_body, notes_of, write_sid
from modalprep.formats.bodies.sid_blocks import read_contents
from modalprep.formats.sid import DIALECTS
from modalprep.multibody.reference.equations import body_equations

FEMBS = DATA / "sid" / "femb_example.sid"
DIGITS = 2e-11  # the format has 12 digits; a few such errors add up
SPLIT = {"mass integrals", "geometric stiffness of accelerations", "second order of the modal mass"}
BODIES = {
    "particles": lambda: modal_body(particles(seed=3, n=6, count=20)),
    "beam": lambda: uniform_beam(modes=4, truncation=("interfaces", "inertia")),
    "free beam": lambda: in_mean_axes(uniform_beam(modes=8)),
    "conventional beam": lambda: uniform_beam(modes=3).conventional(),
}


@pytest.fixture(scope="module", params=BODIES)
def body(request):
    return BODIES[request.param]()


@pytest.fixture(scope="module", params=DIALECTS)
def both(request, body, tmp_path_factory):
    """A body, and the same read from its file in each dialect."""
    file = write_sid(body, tmp_path_factory.mktemp("sid") / "body.sid_fem", request.param)
    return body, import_body(file)


def test_what_the_file_holds_is_read(both):
    body, found = both
    assert found.interface_name == body.interface_name
    assert found.at_root == body.at_root
    for name in ("m", "s0", "E0", "K", "D", "phi", "psi", "Kg_F", "Kg_T", "Kg_A", "S", "H"):
        largest = max(np.abs(getattr(body, name)).max(), 1e-3)  # of what is zero, round-off was written
        assert_close(getattr(found, name), getattr(body, name), DIGITS, scale=largest, name=name)
    assert_close(found.P + found.Kg_W, body.P + body.Kg_W, 10 * DIGITS, name="P + Kg_W")


def test_bodies_are_the_same_system(both):
    body, found = both
    for check in compare_bodies(body, found, 1e-9):
        assert check.passed or check.name in SPLIT, check


def test_mass_tensor_is_one_that_mass_can_have(both):
    body, found = both
    n = body.n
    assert_close(found.P[0, 0] + found.P[1, 1] + found.P[2, 2], np.eye(n), 1e-9)
    gram = found.P.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)
    assert np.linalg.eigvalsh(gram)[0] > -1e-3  # 1e-4 of a modal mass with truncation vectors
    odd = (body.P - body.P.transpose(1, 0, 2, 3)) / 2  # geometric stiffness is symmetric in its modes
    odd, new = (odd - odd.transpose(0, 1, 3, 2)) / 2, (found.P - found.P.transpose(0, 1, 3, 2)) / 2
    assert_close((new - new.transpose(1, 0, 2, 3)) / 2, odd, 1e-9, scale=1.0)


def test_equations_of_motion_differ_in_the_third_order(body, tmp_path):
    """Without T: ten times smaller deflections, a thousandth of the difference; round-off is 1e-12."""
    found = import_body(write_sid(body.with_(T=None), tmp_path / "body.sid_fem", "fembeam"))
    rng = np.random.default_rng(1)
    w, q, qd = rng.standard_normal(3), *(rng.standard_normal((2, body.n)) / np.sqrt(1 + body.K))

    def difference(size):
        states = [(np.concatenate([np.zeros(3), w]), size * q, size * qd)] * 2
        (M, f), (N, g) = (body_equations(b, *state) for b, state in zip((body, found), states, strict=True))
        rigid = np.abs(M - N)[:6, :6].max() / np.abs(M[:6, :6]).max()
        return max(rigid, np.abs((f - g)[:6]).max() / np.abs(f[:6]).max())

    assert difference(1e-3) < 2e-3 * difference(1e-2) + 1e-10


def test_spinning_up_is_the_same_motion(tmp_path):
    """To 1 rad/s with a tip that lags by a twentieth of the length; the split of P and Kg_W is of third order."""
    body = uniform_beam(modes=3)
    found = import_body(write_sid(body, tmp_path / "beam.sid"))
    motion = mp.multibody.TimeFunction("6 / 15 * (t^2 / 2 + (15 / (2 * pi))^2 * (cos(2 * pi * t / 15) - 1))")
    hub = mp.Joint(name="hub", type="revolute", parent="ground", child="beam", motion=motion)
    one, other = (mp.simulate(mp.System(bodies={"beam": b}, joints=(hub,)), 5.0, rtol=1e-8) for b in (body, found))
    lag = one.channels["beam.tip.deflection"]
    assert np.abs(lag).max() > 0.4
    assert_close(other.channels["beam.tip.deflection"], lag, 1e-6)
    assert_close(other.channels["hub.torque"], one.channels["hub.torque"], 1e-6)


def test_without_geometric_stiffness_there_is_none(tmp_path):
    body = uniform_beam(modes=3).conventional()
    found = import_body(write_sid(body, tmp_path / "body.sid_fem", "fembeam"))
    assert not found.has_geometric_stiffness
    assert_close(found.P, body.P, 1e-12)
    assert any("there is none" in note for note in notes_of(found))


def rewritten(file, changes):
    text = file.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file.write_text(text)
    return file


def test_modes_that_are_not_orthogonal_become_so(tmp_path):
    """A coupling in Me: the frequencies are those of Ke and Me; the body moves alike."""
    body = modal_body(particles())
    file = write_sid(body, tmp_path / "body.sid_fem", "fembeam")
    one = next(line for line in file.read_text().split("  Me\n")[1].splitlines() if "m0( 1, 1)" in line)
    coupled = one.replace("m0( 1, 1)", "m0( 2, 1)").replace("1.0000000000000000E+00", "5.0000000000000000E-02")
    head, tail = file.read_text().split("  Me\n")
    file.write_text(head + "  Me\n" + tail.replace(one, one + "\n" + coupled, 1))
    found = import_body(file)
    M = np.eye(4)
    M[0, 1] = M[1, 0] = 0.05
    assert_close(found.K, eigh(np.diag(body.K), M, eigvals_only=True), 1e-12)
    assert np.abs(found.K - np.sort(body.K)).max() > 1e-5 * body.K.max()
    assert_close(found.P[0, 0] + found.P[1, 1] + found.P[2, 2], np.eye(4), 1e-9)
    assert_close(found.S @ found.S.T, body.S @ np.linalg.solve(M, body.S.T), 1e-12)
    assert any("orthogonal" in note for note in notes_of(found))


@pytest.fixture
def fembs():
    if not FEMBS.exists():
        pytest.skip("no file of FEMBS")
    return FEMBS


def test_fembs_file_is_explained_by_itself(fembs):
    """A bar of 0.3925, 500 long and 10 x 10 thick, that moves in a plane; the frequency of its third mode is in it."""
    body = import_body(fembs)
    assert_close(body.m, 0.3925, 1e-12)
    assert_close(body.s0, [0.3925 * 250, 0, 0], 1e-12)
    assert_close(np.trace(body.E0), 0.3925 * (500**2 / 3 + 10**2 / 12), 2e-6)  # of J it has six digits
    assert_close(body.interface_position[:, 0], [0, 250, 500], 1e-12)
    assert body.interface_name == ("node_1", "node_2", "node_3")
    assert_close(body.frequency[2], 360699.520, 1e-8)  # "Eigen Mode    9 :   360699.520 Hz"
    assert not body.at_root
    assert any("free joint" in note for note in notes_of(body))
    assert any("plane" in note for note in notes_of(body))


def test_what_a_plane_file_leaves_open_is_least_about_the_centre_of_mass(fembs):
    """There H has its moment and its trace alone, which are the plane's: no part that only a place could explain."""
    body = import_body(fembs)
    about = body.H - np.einsum("ai,b->abi", body.S, body.s0 / body.m)
    scale = np.abs(about).max()
    assert_close(about[0, 0], about[1, 1], 1e-12, scale=scale)
    assert_close(about[0, 1], -about[1, 0], 1e-12, scale=scale)


def bar_of_two_elements(E, rho, A, inertia, length):
    """Stiffness and mass (6, 6) of deflection and slope at three nodes: cubic elements with rotary inertia."""
    L = length
    bent = np.array([[12, 6 * L, -12, 6 * L], [0, 4 * L**2, -6 * L, 2 * L**2], [0, 0, 12, -6 * L], [0, 0, 0, 4 * L**2]])
    moved = [[156, 22 * L, 54, -13 * L], [0, 4 * L**2, 13 * L, -3 * L**2], [0, 0, 156, -22 * L], [0, 0, 0, 4 * L**2]]
    turned = np.array(
        [[36, 3 * L, -36, 3 * L], [0, 4 * L**2, -3 * L, -(L**2)], [0, 0, 36, -3 * L], [0, 0, 0, 4 * L**2]]
    )
    bent, moved, turned = (np.array(X) + np.triu(X, 1).T for X in (bent, moved, turned))
    K, M = np.zeros((2, 6, 6))
    for at in (0, 2):
        K[at : at + 4, at : at + 4] += E * inertia / L**3 * bent
        M[at : at + 4, at : at + 4] += rho * A * L / 420 * moved + rho * inertia / (30 * L) * turned
    return K, M


def test_fembs_file_is_a_bar_of_two_elements(fembs):
    """Motions of its nodes, in elements of a steel bar of 10 x 10 x 500 (E = 2.1e11 in its units), give the rest.

    Textbook matrices (Przemieniecki, Theory of Matrix Structural Analysis, 1968, section 11). The file's mass has six
    digits; its bending stiffness is smaller by one factor, 1.0004, in all entries.
    """
    file = read_contents(fembs)
    nodes, Ke, Me = list(file.nodes.values()), file.body["Ke"].M0[:2, :2], file.body["Me"].M0[:2, :2]
    v = np.array([[node["phi"].M0[1], node["psi"].M0[2]] for node in nodes]).reshape(6, 3)[:, :2]
    K, M = bar_of_two_elements(2.1e11, 7.85e-6, 100.0, 1e4 / 12, 250.0)
    assert_close(v.T @ M @ v, Me, 1e-6)
    assert_close(np.array([1, 0, 1, 0, 1, 0]) @ M @ v, file.body["Ct"].M0[:2, 1], 1e-6)
    assert_close(np.array([0, 1, 250, 1, 500, 1]) @ M @ v, file.body["Cr"].M0[:2, 2], 1e-6)
    ratio = (v.T @ K @ v) / Ke
    assert_close(ratio, ratio[0, 0] * np.ones((2, 2)), 1e-6)
    assert_close(ratio, np.ones((2, 2)), 5e-4)
    axial = np.sqrt(12 * 2.1e11 / 7.85e-6) / 250 / (2 * np.pi)  # of two linear elements, the middle against the ends
    assert_close(import_body(fembs).frequency[2], axial, 1e-8)


def test_fembs_file_is_a_pendulum(fembs):
    """Its bar is so stiff that it swings as a rigid one: w^2 = m g c / J."""
    body = import_body(fembs, root="node_1")
    assert body.at_root
    M = mass_matrix(body, np.zeros(body.n))
    load = np.array([0.0, 1.0, 0, 0, 0, 0]) @ M[:6]  # of unit gravity
    keep = [5, *range(6, 6 + body.n)]
    stiffness = np.zeros((len(keep), len(keep)))
    stiffness[0, 0] = 9.81 * M[5, 1]
    stiffness[1:, 1:] = np.diag(body.K)
    stiffness[0, 1:] = stiffness[1:, 0] = 9.81 * load[6:]
    w2 = eigh(stiffness, M[np.ix_(keep, keep)], eigvals_only=True)[0]
    assert_close(w2, 9.81 * 98.125 / 32711.6, 1e-6)


def test_fembs_pendulum_swings_down(fembs):
    """From rest to the vertical: w^2 = 2 m g c / J of the rigid bar, whose units of length the file's numbers are."""
    body = import_body(fembs, root="node_1")
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="bar")
    system = mp.System(bodies={"bar": body}, joints=(hinge,), gravity=(0, -9.81, 0))
    result = mp.simulate(system, 20.0, output_step=0.01)
    angle, rate = result.channels["hinge.angle"].ravel(), result.channels["hinge.rate"].ravel()
    assert angle.min() < -3.1  # to the other side
    expected = np.sqrt(-2 * 9.81 * 98.125 / 32711.6 * np.sin(angle))
    assert_close(np.abs(rate)[1:], expected[1:], 1e-4)


def test_command_imports(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    body = uniform_beam(modes=2)
    write_sid(body, "beam.sid")
    assert main(["import", "beam.sid"]) == 0
    printed = capsys.readouterr().out
    assert "wrote beam.h5" in printed
    assert "the file does not hold units" in " ".join(printed.split())
    assert_close(mp.read_body("beam.h5").K, body.K, DIGITS)
    assert main(["import", "beam.sid", "--root", "tip", "-o", "tip.h5"]) == 0
    assert mp.read_body("tip.h5").interface_name == ("tip", "root")
    assert main(["import", "beam.sid", "-o", "beam.sid"]) == 2
    assert main(["import", "beam.h5"]) == 2
    assert main(["import", "none.sid"]) == 2


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("nelastq                         =    2", "nelastq                         = 9999", "nelastq is 9999"),
        ("end mdCM", "end mdCN", "ends a section that has not begun"),
        ("m0( 1, 1)             = 1.0", "m0( 7, 1)             = 1.0", "lies outside"),
        ("mass                            = ", "mass                            =-", "no positive mass"),
        ("mass                            = ", "mass                            = x", "is not a number"),
        ("     Ct", "     Cz", "ends a section"),
        (" end part", "", "truncated"),
        ("new node                        =        2", "new node                        =        1", "two nodes"),
    ],
)
def test_damaged_files_are_one_sentence(old, new, said, tmp_path):
    file = rewritten(write_sid(uniform_beam(modes=2), tmp_path / "beam.sid"), [(old, new)])
    with pytest.raises(mp.InputError, match=said) as error:
        import_body(file)
    assert str(file) in str(error.value)
    assert "\n" not in str(error.value)


def test_blocks_that_contradict_each_other_are_refused(tmp_path):
    file = write_sid(uniform_beam(modes=2), tmp_path / "beam.sid", "fembeam")
    lines = file.read_text().splitlines()
    at = next(k for k in range(lines.index(" " * 11 + "Ct"), len(lines)) if "m0(" in lines[k])
    lines[at] = lines[at].split("=")[0] + "= 9.9000000000000000E+00"
    file.write_text("\n".join(lines))
    with pytest.raises(mp.InputError, match="do not agree"):
        import_body(file)


@pytest.mark.parametrize("seed", seeds(40))
def test_random_damage_is_refused_or_read(seed, tmp_path):
    """Cut files, lost and changed bytes: an InputError of one line, or a body of finite numbers."""
    rng = np.random.default_rng(seed)
    content = bytearray(write_sid(uniform_beam(modes=2), tmp_path / "beam.sid").read_bytes())
    if seed % 4 == 0:
        del content[rng.integers(len(content)) :]
    for _ in range(0 if seed % 4 == 0 else 3):
        at = rng.integers(len(content))
        content[at : at + rng.integers(0, 3)] = bytes(rng.choice([*b"0123456789-=.(),DE \n\xff"], rng.integers(0, 4)))
    file = tmp_path / "bad.sid"
    file.write_bytes(content)
    with suppress(mp.InputError):  # every other exception fails
        assert np.all(np.isfinite(import_body(file).P))
