"""Bodies from matrices on their boundary alone, against the body that our own mesh of the same structure gives.

The pipe has three interfaces, a pump with an offset, and 8 modes with all interfaces held; its matrices are made by
plain formulas (superelements.py). Nothing of its mesh reaches the reader.
"""

import numpy as np
import pytest
from scipy.linalg import eigh
from structured import box
from superelements import craig_bampton_matrices, pipe

import modalprep as mp
from modalprep.body.mass import cross_moment
from modalprep.errors import InputError
from modalprep.examples import cantilever_model
from modalprep.supplied.reduced import MISSING, body_from_reduced
from modalprep.supplied.rows import Points, Rows
from modalprep.supplied.uncertainty import check_spin, knowledge, spin_error

MODES = 8


def full_body(model, modes=MODES):
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes, truncation=()), name="b")


def supplied(model, modes=MODES, **options):
    M, K = craig_bampton_matrices(model, modes)
    names = [frame.name for frame in model.interfaces]
    positions = np.array([frame.position for frame in model.interfaces])
    return body_from_reduced("b", K, M, positions, names=names, **options)


@pytest.fixture(scope="module")
def model():
    return pipe()


@pytest.fixture(scope="module")
def full(model):
    return full_body(model)


@pytest.fixture(scope="module")
def body(model):
    return supplied(model)


def coupling(body):
    """What is linear in the modes and known exactly, each row over its largest entry."""
    rows = np.concatenate([x.reshape(-1, body.n) for x in (body.S, cross_moment(body.H), body.phi, body.psi)])
    return rows / np.maximum(np.abs(rows).max(axis=1, keepdims=True), 1e-12)


def signs(body, full):
    return np.sign(np.sum(coupling(body) * coupling(full), axis=0))


def same_where_known(body, full, rtol=1e-9):
    np.testing.assert_allclose(body.m, full.m, rtol=rtol)
    np.testing.assert_allclose(body.s0, full.s0, rtol=0, atol=rtol * full.m)
    np.testing.assert_allclose(body.E0, full.E0, rtol=0, atol=rtol * np.abs(full.E0).max())
    np.testing.assert_allclose(body.frequency, full.frequency, rtol=rtol)
    np.testing.assert_allclose(coupling(body) * signs(body, full), coupling(full), rtol=0, atol=10 * rtol)
    np.testing.assert_allclose(body.interface_position, full.interface_position, rtol=0, atol=rtol)


def test_exact_parts(body, full):
    """Mass, first moment, inertia, frequencies, momentum of the modes and motion of the interfaces."""
    same_where_known(body, full)
    assert body.interface_name == full.interface_name
    assert [check.name for check in mp.check_body(body) if not check.passed] == []


def test_straight_beam_without_modes():
    """Guyan's matrices; a beam is thin: two of its moments of inertia are 1e-5 of the third."""
    beam = cantilever_model(tip="fixed")
    same_where_known(supplied(beam, 0), full_body(beam, 0))


def test_mass_table_has_the_effective_masses_with_all_interfaces_held(body, full):
    own, exact = (x.modes.effective_mass[[k == "fixed-interface" for k in x.modes.kind]] for x in (body, full))
    np.testing.assert_allclose(own, exact, rtol=1e-8, atol=1e-9 * full.m)
    assert body.modes.kind == full.modes.kind


def test_symmetric_part_of_H_is_near(body, full):
    """Over ``sqrt(tr E)``, which the modal mass allows: of the two lowest modes seen 0.009, of all 0.09."""
    off = np.abs(body.H * signs(body, full) - full.H).max(axis=(0, 1)) / np.sqrt(np.trace(full.E0))
    assert off[:2].max() < 0.01
    assert off.max() < 0.1


def test_growth_of_the_inertia_under_static_loads(body, full):
    """The change of E in the answers to the twelve inertia loads is known to 3 % (seen 2.3 %)."""
    s = signs(body, full)
    for load in np.concatenate([full.S, full.H.reshape(9, -1)]):
        own, exact = (np.einsum("abn,n", H, -load / full.K) for H in (body.H * s, full.H))
        assert np.abs(own + own.T - exact - exact.T).max() < 0.03 * np.abs(exact + exact.T).max()


def test_stretch_of_a_beam_follows_its_ends():
    """Guyan's axial motion is x / L: ``H_xx = m L^2 / 3`` of it, which a rigid motion would make 1/4; seen 2e-3."""
    beam = cantilever_model(tip="fixed")
    body, full = supplied(beam, 0), full_body(beam, 0)
    assert np.abs(body.H[0, 0] * signs(body, full) - full.H[0, 0]).max() < 5e-3 * np.abs(full.H[0, 0]).max()


def test_mass_tensor_is_one_and_nearly_right(body, full):
    """Its sum is the modal mass; it is positive; of the lowest modes each part is known to 0.03 (seen 0.027)."""
    flat = body.P.transpose(0, 2, 1, 3).reshape(3 * body.n, -1)
    np.testing.assert_allclose(np.einsum("aaij->ij", body.P), np.eye(body.n), atol=1e-12)
    assert np.linalg.eigvalsh(flat).min() > -1e-12
    s = signs(body, full)[:2]
    assert np.abs(body.P[:, :, :2, :2] * s * s[:, None] - full.P[:, :, :2, :2]).max() < 0.03


def cantilever_stiffening(body):
    """Geometric stiffness of the first bending in a beam turning about an axis across, in w^2."""
    return -(body.Kg_W[0, 0, 0, 0] + body.Kg_W[1, 1, 0, 0])


def test_mean_rotation_gives_most_of_the_stiffening_of_a_beam():
    """A rigid blade on a hinge has 1, the bending blade 1.19 (Southwell), its mean rotation alone 0.91."""
    beam = cantilever_model(40, tip="fixed")
    assert cantilever_stiffening(full_body(beam, 4)) == pytest.approx(1.193, abs=1e-3)
    assert 0.9 < cantilever_stiffening(supplied(beam, 4)) < 1.193


def rigid_on_spring():
    """A body of 2 kg with its centre at (0.6, 0, 0) and 0.1 kg m^2, on a spring to a massless root at the origin."""
    R = np.eye(6)
    R[:3, 3:] = [[0, 0, 0], [0, 0, 0.6], [0, -0.6, 0]]
    M, K = np.zeros((12, 12)), np.zeros((12, 12))
    M[6:, 6:] = np.diag([2.0] * 3 + [0.1] * 3)
    G = np.hstack([-R, np.eye(6)])  # the body's motion less that of the root
    turned = np.linalg.solve(R, G)  # at the root
    K += turned.T @ np.diag([1e6, 1e6, 1e6, 1e6, 1e6, 50.0]) @ turned
    return K, M


def test_rigid_body_on_a_soft_mounting_is_exact():
    """Turned by q about z, a mass in the field A = -1 along x falls by m x q^2 / 2 of its moment: a pendulum."""
    K, M = rigid_on_spring()
    body = body_from_reduced("p", K, M, [[0.0, 0, 0], [0.6, 0, 0]])
    inertia = 0.1 + 2 * 0.36
    assert body.frequency[0] == pytest.approx(np.sqrt(50 / inertia) / (2 * np.pi), rel=1e-3)  # 1e6 for rigid
    turn = body.psi[1, 2, 0] ** 2
    assert turn == pytest.approx(1 / inertia, rel=1e-3)
    assert body.Kg_A[0, 0, 0] == pytest.approx(-2 * 0.6 * turn, rel=1e-3)
    assert body.Kg_F[1, 0, 0, 0] == pytest.approx(0.6 * turn, rel=1e-3)


def test_units(model, body):
    """The same pipe in inches and slinches, its rotations in rad."""
    inch, slinch = 0.0254, 0.45359237 * 9.80665 / 0.0254
    M, K = craig_bampton_matrices(pipe((inch, slinch)), MODES)
    at = np.array([frame.position for frame in model.interfaces]) / inch
    names = body.interface_name
    other = body_from_reduced("b", K, M, at, names=names, length_unit="in", mass_unit="slinch")
    same_where_known(other, body, rtol=1e-8)
    np.testing.assert_allclose(other.Kg_W[0, 0].diagonal(), body.Kg_W[0, 0].diagonal(), rtol=1e-5, atol=1e-6)


def turned_matrices(model, seed=0):
    """Matrices with the components of each node in axes of its own, and the axes."""
    M, K = craig_bampton_matrices(model, MODES)
    rng, T, axes = np.random.default_rng(seed), np.eye(len(M)), []
    for k in range(len(model.interfaces)):
        Q = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        axes.append(Q * np.sign(np.linalg.det(Q)))
        T[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = np.kron(np.eye(2), axes[-1])
    return T.T @ K @ T, T.T @ M @ T, np.array(axes)


def test_axes_of_nodes(model, body):
    K, M, axes = turned_matrices(model)
    at = np.array([frame.position for frame in model.interfaces])
    other = body_from_reduced("b", K, M, at, axes=axes, names=body.interface_name)
    same_where_known(other, body)
    np.testing.assert_allclose(other.H * signs(other, body), body.H, atol=1e-9)
    np.testing.assert_allclose(other.shape * signs(other, body), body.shape, atol=1e-8)


def test_order_of_rows_and_root(model, full):
    """Rows in any order, and another root than the first node: as `reroot` of the whole body."""
    M, K = craig_bampton_matrices(model, MODES)
    order = np.random.default_rng(1).permutation(len(M))
    dof = np.argsort(order)[: 6 * len(model.interfaces)].reshape(-1, 6)
    at = np.array([frame.position for frame in model.interfaces])
    K, M = (A[np.ix_(order, order)] for A in (K, M))
    body = body_from_reduced("b", K, M, at, dof=dof, names=full.interface_name, root="tip")
    same_where_known(body, mp.body.reroot(full, "tip"))


def test_generalised_coordinates_that_follow_the_boundary(model, body):
    """Modes relative to anything else than the held boundary, as free-interface ones: the same space, K_bq is full."""
    M, K = craig_bampton_matrices(model, MODES)
    n = len(M) - MODES
    T = np.eye(len(M))
    T[n:, :n] = np.random.default_rng(2).standard_normal((MODES, n))
    T[n:, n:] += 0.3 * np.random.default_rng(3).standard_normal((MODES, MODES))
    at = np.array([frame.position for frame in model.interfaces])
    other = body_from_reduced("b", T.T @ K @ T, T.T @ M @ T, at, names=body.interface_name)
    same_where_known(other, body, rtol=1e-8)


def test_boundary_of_displacements_alone():
    """All nodes of a solid, without rotations: the root is the mean motion of one face; free modes as of K and M."""
    points, cells = box("hexahedron", (2, 1, 1), (2.0, 0.7, 0.5))
    mesh = mp.fe.Mesh(points=points, cells={"hexahedron": cells}, groups={"all": {"hexahedron": np.arange(len(cells))}})
    steel = mp.Solid(material=mp.Material(E=2e11, nu=0.3, rho=7800.0))
    corner = np.flatnonzero(points[:, 0] == 0)
    mesh = mesh.with_(cells=mesh.cells | {"vertex": corner[:, None]})
    mesh = mesh.with_(groups=mesh.groups | {"face": {"vertex": np.arange(len(corner))}})
    model = mp.assemble(mesh, {"all": steel}, {"root": mp.Interface(group="face", kind="rbe3")})
    used = model.dof[: len(mesh.points), :3].ravel()
    K, M = (A.toarray()[np.ix_(used, used)] for A in (model.K, model.M))
    names = [f"n{k}" for k in range(len(mesh.points))]
    face = [name for name, x in zip(names, mesh.points[:, 0], strict=True) if x == mesh.points[:, 0].min()]
    dof = np.pad(np.arange(len(K)).reshape(-1, 3), ((0, 0), (0, 3)), constant_values=-1)
    end = {"face": face, "corner": names[-1:]}
    body = body_from_reduced("block", K, M, mesh.points, dof=dof, names=names, interfaces=end)
    assert body.interface_name == ("face", "corner")
    assert body.n == len(K) - 6
    np.testing.assert_allclose(body.E0, model.rigid.E0, rtol=0, atol=1e-10 * np.abs(model.rigid.E0).max())
    free = np.sqrt(np.maximum(eigh(K, M, eigvals_only=True)[6:], 0)) / (2 * np.pi)
    np.testing.assert_allclose(mp.body.in_mean_axes(body).frequency, free, rtol=1e-9)
    assert "follow the root" in body.provenance[MISSING]


def test_rows_without_mass_and_rows_without_anything(model, body):
    """A massless spring beside the pipe adds a static coordinate only, an empty row nothing."""
    M, K = (np.pad(A, (0, 2)) for A in craig_bampton_matrices(model, MODES))
    K[-1, -1] = 1e3
    at = np.array([frame.position for frame in model.interfaces])
    same_where_known(body_from_reduced("b", K, M, at, names=body.interface_name), body)


def test_damping(model, body):
    """Proportional damping is that of each mode: viscous 2 K / 1000, structural g K with D = g w."""
    M, K = craig_bampton_matrices(model, MODES)
    at = np.array([frame.position for frame in model.interfaces])
    damped = body_from_reduced("b", K, M, at, damping=2e-3 * K, structural_damping=0.04 * K)
    np.testing.assert_allclose(damped.D, 2e-3 * body.K + 0.04 * np.sqrt(body.K), rtol=1e-9)


def test_points_and_recovery(model, full, body):
    """A point and a row that the boundary determines: the node of the tip, and its displacement in mm."""
    M, K = craig_bampton_matrices(model, MODES)
    at = np.array([frame.position for frame in model.interfaces])
    tip = np.zeros((3, len(M)))
    tip[:, 12:15] = np.eye(3)
    rows = Rows("displacement", ("x", "y", "z"), ("mm",) * 3, np.full(3, 1e3), tip)
    found = body_from_reduced("b", K, M, at, points=Points(at[2:], tip[None]), recovery={"OTM": rows})
    np.testing.assert_allclose(found.points[-1], found.interface_position[2], atol=1e-12)
    np.testing.assert_allclose(found.shape[-1], found.phi[2], atol=1e-9)
    q = np.arange(float(found.n))[None]
    moved = found.recovered(mp.body.at_rest(q, interfaces=3))["OTM.y"]
    np.testing.assert_allclose(moved, 1e3 * q @ found.phi[2, 1], rtol=1e-9)


def test_recovery_follows_the_modes_and_the_file(body, tmp_path):
    """In the modal file, and with another root: ``r K^-1 r`` of a row r is the same in every basis of deflections."""
    values = np.arange(1.0, body.n + 1)[None]
    rows = mp.body.Recovery.of_rows(kind="force", labels=("axial",), units=("N",), rows=values)
    whole = body.with_(recovery={"MEF1": rows})
    again = mp.read_body(mp.write_body(whole, tmp_path / "b.h5"))
    np.testing.assert_array_equal(again.recovery["MEF1"].q, rows.q)
    assert (again.recovery["MEF1"].places, again.recovery["MEF1"].units) == (("axial",), ("N",))
    moved = mp.body.reroot(whole, "tip")
    found, exact = (np.sum(x.recovery["MEF1"].q ** 2 / x.K) for x in (moved, whole))
    np.testing.assert_allclose(found, exact, rtol=1e-8)


def worst_change(full, body, speed):
    """Largest relative change of the lowest stiffness at a speed about x, y or z, by the full body's terms."""
    found = []
    for axis in np.eye(3):
        W = speed**2 * (np.outer(axis, axis) - np.eye(3))
        low = [np.linalg.eigvalsh(np.diag(x.K) + np.einsum("ab,abij->ij", W, x.P + x.Kg_W))[0] for x in (full, body)]
        found.append(abs(low[0] - low[1]) / full.K[0])
    return max(found)


@pytest.mark.parametrize("ratio", [0.05, 0.2, 0.5])
def test_estimate_of_the_error_at_a_speed_bounds_it(model, full, body, ratio):
    """Pipe and beam: the estimate is three to ten times the error of the lowest stiffness, never below it."""
    beam = cantilever_model(40, tip="fixed")
    for whole, own in ((full, body), (full_body(beam, 4), supplied(beam, 4))):
        speed = ratio * np.sqrt(whole.K[0])
        error, estimate = worst_change(whole, own, speed), spin_error(own, speed)
        assert error < estimate < 12 * error


def test_estimate_is_said_by_check(body, full):
    (check,) = check_spin(body, 2.0)
    assert check.value == pytest.approx(spin_error(body, 2.0))
    assert not check.required
    assert check_spin(full, 2.0) == []
    assert knowledge(full) == ()
    assert [text.split(":")[0] for text in knowledge(body)] == ["known exactly", "rebuilt", "not known"]


def bad(**changes):
    M, K = craig_bampton_matrices(pipe(), 2)
    at = np.array([frame.position for frame in pipe().interfaces])
    return {"stiffness": K, "mass": M, "nodes": at} | {key: change(K, M, at) for key, change in changes.items()}


def with_entry(A, value, i=0, j=1):
    A = A.copy()
    A[i, j] = value
    return A


REFUSED = {
    "stiffness is not square": (dict(stiffness=lambda K, M, x: K[:3]), "must be square"),
    "no square at all": (dict(stiffness=lambda K, M, x: 3.0), "must be square"),
    "mass of another size": (dict(mass=lambda K, M, x: M[:9, :9]), "the mass matrix has 9 rows, the stiffness 20"),
    "not a number": (dict(mass=lambda K, M, x: with_entry(M, np.nan)), "not numbers"),
    "one triangle": (dict(stiffness=lambda K, M, x: np.triu(K)), "it holds one triangle only"),
    "not symmetric": (dict(mass=lambda K, M, x: with_entry(M, M.max())), "ux of node node_1 and uy of node node_1"),
    "negative mass": (dict(mass=lambda K, M, x: -M), "negative diagonal entries"),
    "indefinite mass": (dict(mass=lambda K, M, x: M - 0.5 * np.diag(np.diag(M))), "not positive"),
    "no mass": (dict(mass=lambda K, M, x: 0 * M), "carries no mass"),
    "supported": (dict(stiffness=lambda K, M, x: K + np.diag(np.diag(K))), "resists a rigid translation along"),
    "wrong place": (dict(nodes=lambda K, M, x: x * [1, 2, 1]), "resists a rigid rotation"),
    "too many nodes": (dict(nodes=lambda K, M, x: np.vstack([x, x])), "6 nodes with six components each 36"),
    "flat nodes": (dict(nodes=lambda K, M, x: x[:, :2]), "give three finite coordinates"),
    "mirrored axes": (dict(axes=lambda K, M, x: np.stack([np.diag([1.0, 1, -1])] * 3)), "not those of a rotation"),
    "row twice": (dict(dof=lambda K, M, x: np.tile(np.arange(6), (3, 1))), "dof names row 0 twice"),
    "row beyond": (dict(dof=lambda K, M, x: np.arange(18).reshape(3, 6) + 5), "from -1 (none) to 19"),
    "same names": (dict(names=lambda K, M, x: "aab"), "2 different names"),
    "unknown root": (dict(root=lambda K, M, x: "node_9"), "'node_9' does not exist"),
    "unknown node": (dict(interfaces=lambda K, M, x: {"a": ["node_9"]}), "'node_9' does not exist"),
    "empty interface": (dict(interfaces=lambda K, M, x: {"a": []}), "needs a list of nodes"),
    "no interface": (dict(interfaces=lambda K, M, x: {}), "give at least one"),
    "unit": (dict(length_unit=lambda K, M, x: "mm"), "mass_unit"),
    "damping": (dict(damping=lambda K, M, x: -K), "viscous damping matrix has 20 negative"),
    "recovery": (
        dict(recovery=lambda K, M, x: {"OTM": Rows("force", ("a",), ("N",), np.ones(1), np.ones((1, 5)))}),
        "recovery matrix OTM has shape (1, 5)",
    ),
    "points": (dict(points=lambda K, M, x: Points(np.zeros((1, 3)), np.zeros((1, 3, 4)))), "do not match"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_bad_input_is_one_sentence(case):
    changes, said = REFUSED[case]
    with pytest.raises(InputError) as caught:
        body_from_reduced("b", **bad(**changes))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_pendulum_of_the_supplied_body_moves_as_that_of_the_mesh(full, body):
    """The pipe on a hinge under gravity, from rest at its place: 1 s, in which its tip moves by 4 m and bends by 3 mm.

    The growth of the inertia with the deflection is known to 2 % only: seen 1e-4 of the way.
    """
    paths = []
    for each in (full, body):
        hinge = mp.Joint(name="hinge", type="revolute", axis=(0, 0, 1), parent="ground", child="pipe.root")
        system = mp.System(bodies={"pipe": each}, joints=(hinge,), gravity=(0.0, -9.81, 0.0))
        paths.append(mp.simulate(system, t_end=1.0, output_step=0.05)["pipe.tip.position"])
    way = np.linalg.norm(paths[0] - paths[0][0], axis=1).max()
    assert way > 1
    assert np.abs(paths[1] - paths[0]).max() < 1.2e-4 * way
