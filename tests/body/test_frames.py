"""One body in several frames: against the mesh with another root, and by what no frame may change."""

import numpy as np
import pytest
from body.solids import horn, horn_model
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation
from structured import free_spectrum

import modalprep as mp
from modalprep.body.frames import at_centre_of_mass, in_frame, in_mean_axes, in_principal_axes, reroot
from modalprep.body.mass import cross_moment, mass_matrix, rigid_mass_matrix
from modalprep.examples import beam_mesh, uniform_beam
from modalprep.multibody.reference.equations import body_equations, node_motion
from modalprep.vectors import skew

LINEAR = ("S", "H", "phi", "psi", "shape")
FORMS = ("P", "Kg_A", "Kg_W", "Kg_F", "Kg_T")
GROWN = ("T",)
OTHERS = ("m", "s0", "E0", "K", "frequency", "interface_position", "points")


@pytest.fixture(scope="module")
def body():
    return horn()


def signs(a, b):
    """Of the modes of b against those of a; torsion of a line of nodes has no translation."""
    motion = [np.concatenate([x.shape, x.phi, 0.1 * x.psi]).reshape(-1, x.n) for x in (a, b)]
    return np.sign(np.einsum("kn,kn->n", *motion))


def difference(a, b, names, modes=None):
    """Largest difference of the named arrays over the largest entry of each, {name: value}."""
    s, found, pick = signs(a, b), {}, slice(modes)
    for name in names:
        x, y = np.asarray(getattr(a, name)), np.asarray(getattr(b, name))
        if name in LINEAR:
            x, y = x[..., pick], (y * s)[..., pick]
        if name in FORMS:
            x, y = x[..., pick, pick], (y * s * s[:, None])[..., pick, pick]
        if name == "T":
            x, y = x[pick, pick, pick], np.einsum("ijk,i,j,k->ijk", y, s, s, s)[pick, pick, pick]
        found[name] = np.abs(x - y).max() / np.abs(x).max()
    return found


# --- another root -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("root", ["right", "side"])
def test_rerooted_body_is_that_of_the_mesh_with_the_other_root(body, root):
    """Same space: constraint modes of all interfaces and the modes with all of them fixed."""
    expected, found = horn(root), reroot(body, root)
    # the modes of both reductions are accurate to 1e-10, stiff ones less; Kg goes with their square
    worst = difference(expected, found, LINEAR + FORMS + GROWN + OTHERS)
    assert max(worst.values()) < 1e-7, worst
    assert found.interface_name == expected.interface_name
    assert found.at_root


def arch(elements, root):
    """Beams bent to 60 degrees, radius 0.8 m."""
    a = np.linspace(0, np.pi / 3, elements + 1)
    line = np.stack([0.8 * np.sin(a), 0 * a, 0.8 * (1 - np.cos(a))], axis=1)
    ends = {name: mp.Interface(group=name, kind="node") for name in ("root", "tip")}
    section = mp.fe.beam_section(
        "rectangle", mp.Material(E=70e9, nu=0.3, rho=2700.0), width=0.06, height=0.03, up=(0, 1, 0)
    )
    model = mp.assemble(beam_mesh(elements).with_(points=line), {"beam": section}, ends, root=root)
    reduction = mp.craig_bampton(model, modes=6, truncation=())
    return mp.flexible_body(model, reduction, name="arch", second_order_mass=True)


def test_rerooted_arch():
    """Forces on the interfaces turn with the elements; inertia inside acts on straight ones, to the order h^2."""
    gaps = {n: difference(arch(n, "tip"), reroot(arch(n, "root"), "tip"), (*FORMS, *GROWN), modes=3) for n in (10, 20)}
    assert max(gaps[20][name] for name in ("P", "Kg_F", "Kg_T")) < 1e-8
    for name in ("Kg_A", "Kg_W", "T"):
        assert gaps[20][name] < 6e-3
        assert gaps[10][name] / gaps[20][name] == pytest.approx(4, rel=0.05)


@pytest.mark.parametrize("bent", [1e-3, 1e-2])
def test_shapes_of_two_roots_differ_by_the_square_of_the_deflection(bent):
    """The same motion of a cantilever under a tip load, in either frame, up to the rigid motion that fits best.

    0.37 of the deflection over the length, as theory 3.5 says (0.4 % at 1 %).
    """
    body = uniform_beam(modes=8)
    other, x = reroot(body, "tip"), body.points
    u = body.shape @ (body.phi[1, 1] / body.K)
    u *= bent * 10 / np.abs(u).max()
    rigid = [np.tile(e, (len(x), 1)).ravel() for e in np.eye(3)] + [np.cross(e, x).ravel() for e in np.eye(3)]
    span = np.column_stack([other.shape.reshape(-1, other.n), *rigid])
    q, *_ = np.linalg.lstsq(span, u.ravel(), rcond=None)
    np.testing.assert_allclose(span @ q, u.ravel(), atol=1e-12 * np.abs(u).max())  # linearly the same motion
    here, there = (at - at.mean(axis=0) for at in (x + u, x + other.shape @ q[: other.n]))
    turn, _ = Rotation.align_vectors(there, here)
    gap = np.linalg.norm(turn.apply(here) - there, axis=1).max() / np.abs(u).max()
    assert gap == pytest.approx(0.37 * bent, rel=0.02)  # two digits of the number in the documents


@pytest.mark.parametrize("away", [lambda b: reroot(b, "right"), in_mean_axes, at_centre_of_mass])
def test_there_and_back(body, away):
    back = reroot(away(body), "left")
    worst = difference(body, back, LINEAR + FORMS + GROWN + OTHERS)
    assert max(worst.values()) < 1e-9, worst  # n = 18 modes over four decades of w^2
    assert back.frame == body.frame


@pytest.mark.parametrize("conventional", [False, True])
@pytest.mark.parametrize("away", [lambda b: b, in_mean_axes, in_principal_axes])
def test_energy_and_centre_of_mass_agree_to_second_order(body, away, conventional):
    """The same motion in two frames: their difference falls with the cube of the deflection.

    Without geometric stiffness the centre of mass misses terms of second order.
    """
    there = away(body)
    here = reroot(there, "side")
    there, here = (x.conventional() for x in (there, here)) if conventional else (there, here)
    rng = np.random.default_rng(1)
    q, qd, V = rng.standard_normal(there.n), rng.standard_normal(there.n), rng.standard_normal(6)
    weight = 1 / np.abs(there.shape).max(axis=(0, 1)) / there.frequency.clip(1) * 10  # small in stiff modes
    sizes, gaps = np.array([1e-1, 5e-2]), []
    for size in sizes:
        gaps.append(_gaps(there, here, V, size * weight * q, size * weight * qd))
    order = np.log(np.array(gaps[0]) / np.array(gaps[1])) / np.log(2)
    np.testing.assert_allclose(order, [2, 2] if conventional else [3, 3], atol=0.2)


def _gaps(there, here, V, q, qd):
    """Differences of kinetic energy and of the centre of mass; `here` is rooted at an interface of `there`."""
    k = there.interface_name.index(here.interface_name[0])
    r, R, _, vel, _ = node_motion(there, k, V[3:], q, qd)
    V_here = np.concatenate([R.T @ (V[:3] + np.cross(V[3:], r) + vel[:3]), R.T @ (V[3:] + vel[3:])])
    q_here, qd_here = (_coordinates(there, here, x) for x in (q, qd))
    energy = [0.5 * v @ mass_matrix(b, x) @ v for b, x, v in (
        (there, q, np.concatenate([V, qd])), (here, q_here, np.concatenate([V_here, qd_here])))]  # fmt: skip
    centre = [_first_moment(b, x) / b.m for b, x in ((there, q), (here, q_here))]
    return abs(energy[0] - energy[1]), np.linalg.norm(centre[0] - r - R @ centre[1])


def _first_moment(body, q):
    M = mass_matrix(body, q)
    return np.array([M[5, 1], M[3, 2], M[4, 0]])


def _coordinates(there, here, q):
    """Coordinates of the same displacement, up to a rigid motion."""
    rigid = np.concatenate([np.broadcast_to(np.eye(3), (len(here.points), 3, 3)), -skew(here.points)], axis=2)
    A = np.concatenate([here.shape, rigid], axis=2).reshape(-1, here.n + 6)
    wanted = (there.shape @ q).ravel()
    found = np.linalg.lstsq(A, wanted, rcond=None)[0]
    assert np.abs(A @ found - wanted).max() < 1e-8 * np.abs(wanted).max()
    return found[: here.n]


# --- frames at rest in the old one ----------------------------------------------------------------------------------


def test_a_rotated_and_shifted_frame_has_the_same_energy(body):
    rng = np.random.default_rng(2)
    axes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    axes *= np.sign(np.linalg.det(axes))
    origin, V = rng.standard_normal(3), rng.standard_normal(6)
    q, qd = 1e-3 * rng.standard_normal((2, body.n))
    moved = in_frame(body, origin=origin, axes=axes)
    V_moved = np.concatenate([axes.T @ (V[:3] + np.cross(V[3:], origin)), axes.T @ V[3:]])
    energy = [0.5 * v @ mass_matrix(b, q) @ v for b, v in (
        (body, np.concatenate([V, qd])), (moved, np.concatenate([V_moved, qd])))]  # fmt: skip
    assert energy[1] == pytest.approx(energy[0], rel=1e-11)
    # the equations of motion too: modal rows without acceleration of the old origin
    bias = body_equations(body, np.concatenate([np.zeros(3), V[3:]]), q, qd)[1][6:]
    M, moved_bias = body_equations(moved, np.concatenate([np.zeros(3), axes.T @ V[3:]]), q, qd)
    at_new = np.cross(V[3:], np.cross(V[3:], origin))  # acceleration of the new origin
    again = moved_bias[6:] + M[6:, :3] @ (axes.T @ at_new)
    np.testing.assert_allclose(again, bias, atol=1e-9 * np.abs(bias).max())
    back = in_frame(moved, origin=-axes.T @ origin, axes=axes.T)
    assert max(difference(body, back, LINEAR + FORMS + OTHERS).values()) < 1e-11


def test_principal_axes(body):
    moved = in_principal_axes(body)
    J = np.trace(moved.E0) * np.eye(3) - moved.E0
    size = np.diag(J).max()
    assert np.abs(moved.s0).max() < 1e-12 * body.m
    assert np.abs(J - np.diag(np.diag(J))).max() < 1e-12 * size
    assert np.all(np.diff(np.diag(J)) > 0)
    assert moved.frame == "origin at the centre of mass, principal axes"
    assert not moved.at_root
    np.testing.assert_allclose(moved.frequency, body.frequency)
    assert [check.name for check in mp.check_body(moved) if not check.passed] == []


# --- mean axes ------------------------------------------------------------------------------------------------------


def test_mean_axes_uncouple_the_mass_matrix(body):
    mean = in_mean_axes(body)
    M = mass_matrix(mean, np.zeros(mean.n))
    uncoupled = np.eye(6 + mean.n)
    uncoupled[:6, :6] = rigid_mass_matrix(mean.m, mean.s0, mean.E0)
    scale = np.sqrt(np.outer(M.diagonal(), M.diagonal()))
    np.testing.assert_allclose(M / scale, uncoupled / scale, atol=1e-10)
    assert np.abs(mean.Kg_A).max() < 1e-9 * np.abs(body.Kg_A).max()  # the centre of mass is at the origin, bent or not
    turning = cross_moment(mean.Kg_W)
    assert np.abs(turning).max() < 1e-9 * np.abs(body.Kg_W).max()
    assert [check.name for check in mp.check_body(mean) if not check.passed] == []


def test_mean_axes_have_the_free_free_modes(body):
    """Of the reduced body in its root frame; a full basis gives those of the mesh."""
    M = mass_matrix(body, np.zeros(body.n))
    K = np.diag(np.concatenate([np.zeros(6), body.K]))
    shift = body.K[0] / 10
    w2 = 1 / eigh(M, K + shift * M, eigvals_only=True)[::-1] - shift
    np.testing.assert_allclose(in_mean_axes(body).K, w2[6:], rtol=1e-6)  # K over four decades, shifted
    model = horn_model(names=("left",), n=(3, 1, 1))
    reduction = mp.craig_bampton(model, modes=10**6, truncation=())
    mean = in_mean_axes(mp.flexible_body(model, reduction, name="horn"))
    assert mean.n == len(model.free) - 6
    K, M = (model.C.T @ A @ model.C for A in (model.K, model.M))
    exact = free_spectrum(model.with_(K=K, M=M), np.arange(K.shape[0]), 16)
    np.testing.assert_allclose(mean.K[:10], exact[6:], rtol=1e-6)  # found with a shift of 1e-3 of the stiffest


def test_mean_axes_of_a_rigid_body_are_its_centre():
    rod = mp.rigid_body("rod", mass=2.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([0.1, 1, 1]),
                        interfaces={"a": np.zeros(3), "b": np.array([1.0, 0, 0])})  # fmt: skip
    mean = in_mean_axes(rod)
    assert mean.n == 0
    np.testing.assert_allclose(mean.interface_position[:, 0], [-0.5, 0.5])
    np.testing.assert_allclose(reroot(rod, "b").s0, [-1.0, 0, 0])


# --- what is refused ------------------------------------------------------------------------------------------------


def test_refusals(body):
    with pytest.raises(mp.InputError, match="body 'horn' has no interface 'top'; it has left, right, side"):
        reroot(body, "top")
    with pytest.raises(mp.InputError, match="axes are not a rotation"):
        in_frame(body, origin=np.zeros(3), axes=np.diag([1.0, 1, -1]))
    line = mp.rigid_body("line", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([0, 1 / 12, 1 / 12]),
                         interfaces={"a": np.zeros(3)})  # fmt: skip
    with pytest.raises(mp.InputError, match="line without rotary inertia"):
        in_mean_axes(line)


@pytest.mark.parametrize("frame", [in_mean_axes, at_centre_of_mass])
def test_only_a_free_joint_carries_a_body_that_is_not_at_its_root(body, frame):
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="horn")
    with pytest.raises(mp.InputError, match="hinge.*centre of mass.*reroot"):
        mp.System(bodies={"horn": frame(body)}, joints=(hinge,))
    floating = mp.Joint(name="float", type="free", parent="ground", child="horn")
    mp.System(bodies={"horn": frame(body)}, joints=(floating,))
