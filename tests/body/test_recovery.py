"""Recovery matrices as data: at a motion, in other bases and frames, in the modal file."""

import h5py
import numpy as np
import pytest

import modalprep as mp
from modalprep.body.recovery import BodyMotion, Recovery, at_rest
from modalprep.examples import uniform_beam
from modalprep.vectors import skew


def block(body, kind="force", seed=0, **changes):
    """Random matrices at two places of a body."""
    random, n = np.random.default_rng(seed), body.n
    arrays = {"q": random.standard_normal((2, 3, n)), "qdd": random.standard_normal((2, 3, n))}
    arrays["loads"] = random.standard_normal((2, 3, 12 + 6 * len(body.interface_name)))
    names = {"places": ("a", "b"), "components": ("x", "y", "z"), "units": ("N",) * 3}
    return Recovery(kind=kind, **names, **arrays | changes)


def motion(body, seed=1, nt=4):
    random = np.random.default_rng(seed)
    q, qd, qdd = random.standard_normal((3, nt, body.n))
    A, omega, alpha = random.standard_normal((3, nt, 3))
    return BodyMotion(q, qd, qdd, A, omega, alpha, random.standard_normal((nt, len(body.interface_name), 6)))


@pytest.fixture(scope="module")
def body():
    return uniform_beam(modes=3)


def test_values_are_those_of_the_matrices_row_by_row(body):
    x, at = block(body), motion(body)
    found = x.values(at)
    for t, p, c in np.ndindex(found.shape):
        W = skew(at.alpha[t]) + skew(at.omega[t]) @ skew(at.omega[t])
        drives = [*at.A[t], *W.ravel(), *at.interface_loads[t].ravel()]
        expected = x.q[p, c] @ at.q[t] + x.qdd[p, c] @ at.qdd[t] + x.loads[p, c] @ drives
        assert found[t, p, c] == pytest.approx(expected, rel=1e-12)  # round-off of some thirty products


def test_an_accelerometer_on_a_turning_body_feels_the_second_derivative_of_its_position(body):
    """x(t) = R(t) (r + phi q(t)) differentiated twice by differences, in the axes of the body."""
    shape, r, w = np.array([[0.1, 0.2, 0], [0.3, -0.1, 0.4], [0, 0.5, 0.2]]), np.array([1.0, 2, 3]), 0.7
    loads = np.zeros((1, 3, 24))
    loads[0, :, :3], loads[0, :, 3:12] = np.eye(3), np.kron(np.eye(3), r)
    names = {"places": ("tip",), "components": ("x", "y", "z"), "units": ("m/s^2",) * 3}
    tip = Recovery(kind="acceleration", **names, q=np.zeros((1, 3, 3)), qdd=shape[None], loads=loads)

    def q(t):
        return np.array([np.sin(t), np.cos(2 * t), t**2])

    def turn(t):
        c, s = np.cos(w * t), np.sin(w * t)
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    def place(t):
        return turn(t) @ (r + shape @ q(t))

    t, h = 0.3, 1e-3
    expected = turn(t).T @ (
        -place(t - 2 * h) + 16 * place(t - h) - 30 * place(t) + 16 * place(t + h) - place(t + 2 * h)
    )
    expected /= 12 * h**2
    rates = np.array([np.cos(t), -2 * np.sin(2 * t), 2 * t])
    seconds = np.array([-np.sin(t), -4 * np.cos(2 * t), 2.0])
    still = np.zeros((1, 3))
    at = BodyMotion(q(t)[None], rates[None], seconds[None], still, np.array([[0, 0, w]]), still, np.zeros((1, 2, 6)))
    # differences of fourth order: h^4 of the sixth derivative (about 100), and round-off 1e-15 / h^2
    assert tip.values(at)[0, 0] == pytest.approx(expected, abs=1e-8)


def test_another_basis_is_the_same_at_the_same_motion(body):
    Y = np.random.default_rng(2).standard_normal((body.n, 2))
    x = block(body)
    p = motion(uniform_beam(modes=2))
    same = p._replace(q=p.q @ Y.T, qd=p.qd @ Y.T, qdd=p.qdd @ Y.T)
    assert x.in_basis(Y).values(p) == pytest.approx(x.values(same), rel=1e-12)  # round-off


def test_another_frame_is_the_same_at_the_same_motion(body):
    """The origin moves to c, the axes turn by Q: the acceleration there and the loads in those axes."""
    c, Q = np.array([1.0, -2, 0.5]), np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    Q *= np.sign(np.linalg.det(Q))
    x, at = block(body), motion(body)
    moved = mp.body.in_frame(body.with_(recovery={"x": x}), origin=c, axes=Q).recovery["x"]
    w = skew(at.omega)
    A = at.A + np.einsum("tij,j->ti", skew(at.alpha) + w @ w, c)
    loads = (at.interface_loads.reshape(len(A), -1, 2, 3) @ Q).reshape(at.interface_loads.shape)
    there = at._replace(A=A @ Q, omega=at.omega @ Q, alpha=at.alpha @ Q, interface_loads=loads)
    assert moved.values(there) == pytest.approx(x.values(at), rel=1e-11)  # round-off of some thirty products
    assert moved.axes == pytest.approx(Q)


def test_the_frame_of_another_root_is_the_same_at_the_same_motion(body):
    """To first order: both frames at rest momentarily, the second accelerated by the modes of the first."""
    x = block(body)
    other = mp.body.reroot(body.with_(recovery={"x": x}), "tip")
    p = motion(other)._replace(omega=np.zeros((4, 3)))
    # the frame moves by the tip: its modes Y follow from K and the mass about the new root, as in frames.py
    a = -np.concatenate([body.phi[1] - np.cross(body.psi[1].T, body.interface_position[1]).T, body.psi[1]])
    following = x.following(a)
    Y = np.linalg.lstsq(x.q.reshape(6, -1), other.recovery["x"].q.reshape(6, -1), rcond=None)[0]
    qdd = p.qdd @ Y.T
    c = body.interface_position[1]
    A0 = p.A - np.cross(p.alpha, c)  # of the new frame's point that is at the old origin
    old = p._replace(q=p.q @ Y.T, qdd=qdd, A=A0 + qdd @ a[:3].T, alpha=p.alpha + qdd @ a[3:].T)
    assert following.loads is x.loads
    assert other.recovery["x"].values(p) == pytest.approx(x.values(old), rel=1e-9)  # Y from a least-squares solution


def test_new_modes_lose_it(body):
    assert not body.with_(recovery={"x": block(body)}).with_(K=2 * body.K).recovery


def test_the_modal_file_keeps_it(body, tmp_path):
    full = block(
        body, kind="stress", position=np.ones((2, 3)), node=np.array([0, 3]), cell=np.array([1, 39]), allowable=2e8
    )
    lean = block(body, qdd=None, loads=None)
    file = mp.write_body(body.with_(recovery={"full": full, "lean": lean}), tmp_path / "beam.h5")
    found = mp.read_body(file).recovery
    for name, x in {"full": full, "lean": lean}.items():
        for key in ("kind", "places", "components", "units", "allowable"):
            assert getattr(found[name], key) == getattr(x, key)
        for key in ("q", "qdd", "loads", "axes", "position", "node", "cell"):
            a, b = getattr(found[name], key), getattr(x, key)
            assert (a is None) == (b is None)
            assert a is None or np.array_equal(a, b)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("q", np.zeros((2, 3, 9)), "has shape"),
        ("node", np.array([0, 9999]), "nodes that are not there"),
        ("axes", np.ones((3, 3)), "not orthogonal unit vectors"),
        ("loads", np.full((2, 3, 24), np.nan), "not numbers"),
    ],
)
def test_damaged_matrices_are_refused(body, tmp_path, name, value, words):
    x = block(body, node=np.array([0, 1]))
    file = mp.write_body(body.with_(recovery={"x": x}), tmp_path / "beam.h5")
    with h5py.File(file, "r+") as data:
        del data[f"recovery/x/{name}"]
        data[f"recovery/x/{name}"] = value
    with pytest.raises(mp.InputError, match=words):
        mp.read_body(file)


def test_wrong_shapes_and_names_are_refused(body):
    with pytest.raises(mp.InputError, match="different names"):
        block(body).with_(places=("a", "a"))
    with pytest.raises(mp.InputError, match="as many names"):
        block(body).with_(units=("N",))
    with pytest.raises(mp.InputError, match="loads of a recovery"):
        block(body).with_(loads=np.zeros((2, 3, 6)))


def test_rows_of_a_supplier_have_their_own_names_and_units(body, tmp_path):
    """A hundred and more rows, units that differ: in histories, in the file, in an envelope."""
    rows = np.random.default_rng(4).standard_normal((150, body.n))
    labels = tuple(f"CBAR_{k}.axial" for k in range(150))
    given = Recovery.of_rows(kind="force", labels=labels, units=("N", "N m") * 75, rows=rows)
    (block,) = mp.read_body(mp.write_body(body.with_(recovery={"MEF1": given}), tmp_path / "beam.h5")).recovery.values()
    q = np.random.default_rng(5).standard_normal((2, body.n))
    found = body.with_(recovery={"MEF1": block}).recovered(at_rest(q, 2))
    assert found["MEF1.CBAR_7.axial"] == pytest.approx(q @ rows[7], rel=1e-12)
    run = mp.Result(time=np.arange(2.0), channels={"arm.modal": q}, status="done", message="")
    (envelope,) = mp.multibody.envelopes(run, {"arm": body.with_(recovery={"MEF1": block})})
    assert [envelope.rows()[k]["unit"] for k in (0, 1)] == ["N", "N m"]
    assert [envelope.rows()[7][key] for key in ("place", "component")] == ["CBAR_7.axial", ""]


def test_histories_have_von_mises_of_stress(body):
    x = block(body, kind="stress", qdd=None, loads=None).with_(components=("xx", "yy", "xy"))
    found = body.with_(recovery={"skin": x}).recovered(at_rest(np.ones((1, body.n)), 2))
    xx, yy, xy = (found[f"skin.a.{c}"] for c in x.components)
    assert found["skin.a.von_mises"] == pytest.approx(np.sqrt(xx**2 - xx * yy + yy**2 + 3 * xy**2), rel=1e-12)


def test_displacements_that_a_frame_leaves_out_are_said(body):
    kept = {"x": block(body), "feet": block(body, kind="displacement", qdd=None, loads=None)}
    other = mp.body.reroot(body.with_(recovery=kept), "tip")
    assert list(other.recovery) == ["x"]
    assert other.provenance["recoveries left out"] == "feet: displacements relative to another frame"
    assert "recoveries left out" not in mp.body.reroot(body.with_(recovery={"x": kept["x"]}), "tip").provenance
