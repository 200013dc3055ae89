"""Models of matrices against the direct assembly of the same structure, and what matrices must satisfy."""

import json
import re

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial.transform import Rotation
from structured import box, surface

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import beam_mesh, cantilever_model, spinup_section
from modalprep.reduction.dropped import complete_response

ALLOY = mp.Material(E=70e9, nu=0.33, rho=2700.0)
EXACT = 1e-10  # sums of a few hundred to some thousand terms lose three to four of sixteen digits
INTEGRALS = ("m", "s0", "E0", "S", "H", "P", "K", "phi", "psi")


def own(model):
    """K, M and DOF table of the mesh nodes, without the frames of interfaces."""
    n = model.dof[: len(model.points)].max() + 1
    return model.K[:n, :n], model.M[:n, :n], model.dof[: len(model.points)]


def from_own(model, interfaces, **options):
    """The same structure by its matrices and its cells, in mesh coordinates."""
    K, M, dof = own(model)
    nodes = mp.fe.Mesh(points=model.points + model.origin, cells=model.cells, groups={})
    return mp.fe.model_from_matrices(K, M, nodes, dof, interfaces=interfaces, **options)


def body(model, modes=6, truncation=()):
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes, truncation=truncation), name="body")


def difference(a, b, name):
    x, y = (np.asarray(getattr(body, name)) for body in (a, b))
    return np.abs(x - y).max() / max(np.abs(y).max(), 1e-30)  # zero everywhere: the root does not move


SOLIDS = {
    "hexahedron": dict(kind="hexahedron", n=(4, 2, 2)),
    "hexahedron20": dict(kind="hexahedron20", n=(3, 1, 1)),
    "tetra10": dict(kind="tetra10", n=(2, 1, 1)),
    "wedge": dict(kind="wedge", n=(3, 2, 2)),
}
FACES = {
    "root": mp.Interface(plane=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))),
    "tip": mp.Interface(plane=((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), kind="rbe3"),
}


def solid(kind="hexahedron", n=(4, 2, 2), interfaces=FACES):
    points, cells = box(kind, n, (1.0, 0.2, 0.1), distort=0.2)
    mesh = mp.fe.Mesh(points=points, cells={kind: cells}, groups={"body": {kind: np.arange(len(cells))}})
    return mp.assemble(mesh, {"body": mp.Solid(material=ALLOY)}, interfaces)


@pytest.mark.parametrize("case", SOLIDS.values(), ids=SOLIDS)
def test_solids_agree_in_every_integral(case):
    direct = solid(**case)
    other = from_own(direct, FACES)
    a, b = body(other), body(direct)
    for name in INTEGRALS:
        assert difference(a, b, name) < EXACT, name
    for got, wanted in ((other.g, direct.g), (other.h, direct.h)):
        assert np.abs(got - wanted).max() < EXACT * np.abs(wanted).max()
    for i in range(3):
        for j in range(3):
            assert abs(other.M_ab[i, j] - direct.M_ab[i, j]).max() < EXACT * abs(direct.M).max()


def test_means_of_nodes_without_faces_are_said():
    direct = solid()
    K, M, dof = own(direct)
    other = mp.fe.model_from_matrices(K, M, direct.points + direct.origin, dof, interfaces=FACES)
    assert sum("every node of an rbe3 counts alike" in note for note in other.notes) == 1
    assert not any("counts alike" in note for note in from_own(direct, FACES).notes)


def skin(nx):
    """A curved sheet of nx times 2/3 nx quads with its edge as root."""
    points, cells = surface(nx, 2 * nx // 3, "quad", lambda s, t: (1.2 * s, 0.8 * t, 0.1 * s * s))
    mesh = mp.fe.Mesh(points=points, cells={"quad": cells}, groups={"skin": {"quad": np.arange(len(cells))}})
    edge = {"root": mp.Interface(plane=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))}
    return mp.assemble(mesh, {"skin": mp.Shell(material=ALLOY, thickness=0.01)}, edge), edge


def frame(kind):
    """Thin structures whose nodes have rotations: (model, interfaces)."""
    ends = {"root": mp.Interface(node=1, kind="node"), "tip": mp.Interface(node=21, kind="node", boundary="free")}
    if kind == "beam":
        return cantilever_model(20), ends
    if kind == "oblique beam":
        mesh = beam_mesh(20)
        turn = Rotation.from_rotvec([0.3, 0.5, 0.7]).as_matrix()
        return mp.assemble(mesh.with_(points=mesh.points @ turn.T), {"beam": spinup_section()}, ends), ends
    return skin(12)


# What M does not tell: twice what is measured. The six modes bend; P counts unit modal mass, H its largest entry.
APPROXIMATE = {"beam": (1e-5, 2e-3), "oblique beam": (2e-5, 2e-3), "shell": (1.3e-2, 2e-3)}


@pytest.mark.parametrize("kind", APPROXIMATE)
def test_thin_structures_agree_but_for_rotary_inertia(kind):
    direct, interfaces = frame(kind)
    other = from_own(direct, interfaces)
    a, b = body(other), body(direct)
    for name in ("m", "s0", "E0", "S", "K", "phi", "psi"):
        assert difference(a, b, name) < EXACT, name
    turning = [x.H - x.H.transpose(1, 0, 2) for x in (a, b)]
    assert np.abs(turning[0] - turning[1]).max() < EXACT * np.abs(b.H).max()
    assert np.allclose(np.einsum("aanm->nm", a.P), np.eye(a.n), atol=EXACT)
    limits = APPROXIMATE[kind]
    assert difference(a, b, "H") < limits[0]
    assert difference(a, b, "P") < limits[1]
    assert all(check.passed for check in mp.body.check_model(other) + mp.check_body(a))


def test_shells_converge_with_the_square_of_the_element():
    """The deflection of a plate follows its rotations: one half of the element gives one quarter of the error."""
    errors = []
    for nx in (6, 12, 24):
        direct, interfaces = skin(nx)
        errors.append(difference(body(from_own(direct, interfaces)), body(direct), "H"))
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(order - 2) < 0.2), errors


def test_offset_lumped_masses_are_exact():
    """A rigid arm with a point mass obeys the assumption of the field exactly: the integrals are sums over masses."""
    rng = np.random.default_rng(3)
    n, arm, mass = 5, rng.standard_normal((5, 3)), rng.uniform(1, 2, 5)
    base = cantilever_model(4)
    K, _, dof = own(base)
    M = np.zeros(K.shape)
    N = np.zeros((n, 3, K.shape[0]))
    for i in range(n):
        N[i, :, dof[i, :3]] = np.eye(3)
        for c in range(3):
            N[i, :, dof[i, 3 + c]] = np.cross(np.eye(3)[c], arm[i])
        M += mass[i] * N[i].T @ N[i]
    model = mp.fe.model_from_matrices(K, M, base.points, dof, interfaces={"root": mp.Interface(node=1, kind="node")})
    x = base.points + arm
    assert np.allclose(model.h, np.einsum("k,kb,kad->dab", mass, x, N), atol=1e-12)
    assert np.allclose(model.rigid.E0, np.einsum("k,ka,kb->ab", mass, x, x), atol=1e-12)
    for a in range(3):
        for b in range(3):
            wanted = np.einsum("k,ki,kj->ij", mass, N[:, a], N[:, b])
            assert np.allclose(model.M_ab[a, b].toarray(), wanted, atol=1e-12)


def test_order_of_rows_and_form_of_dof_do_not_matter():
    direct = cantilever_model(6)
    K, M, dof = own(direct)
    interfaces = {"root": mp.Interface(node=1, kind="node"), "tip": mp.Interface(node=7, kind="node")}
    order = np.random.default_rng(0).permutation(len(K.toarray()))
    place = np.argsort(order)
    pairs = np.array([np.argwhere(dof == row)[0] for row in order])
    for table in (place[dof], pairs):
        mixed = mp.fe.model_from_matrices(
            K[order][:, order], M[order][:, order], direct.points, table, interfaces=interfaces
        )
        a, b = body(mixed), body(from_own(direct, interfaces))
        assert np.allclose(a.frequency, b.frequency, rtol=1e-9)
        assert np.allclose(np.abs(a.S), np.abs(b.S), atol=1e-7)  # nearly double modes may mix within round-off


def test_units():
    """Matrices in t, mm, s give the same body as in kg, m, s."""
    direct, interfaces = frame("beam")
    K, M, dof = own(direct)
    si = body(from_own(direct, interfaces))
    size = np.where(
        np.isin(np.arange(len(K.toarray())), dof[:, 3:]), 1e3, 1.0
    )  # a moment in N mm is 1000 times one in N m
    in_mm = [(A * size * size[:, None] * 1e-3).tocsr() for A in (K, M)]
    mm = body(
        mp.fe.model_from_matrices(
            *in_mm, 1e3 * direct.points, dof, interfaces=interfaces, length_unit="mm", mass_unit="t"
        )
    )
    for name in INTEGRALS:
        assert difference(mm, si, name) < 1e-9, name
    with pytest.raises(mp.InputError, match="say in which mass_unit"):
        mp.fe.model_from_matrices(*in_mm, 1e3 * direct.points, dof, interfaces=interfaces, length_unit="mm")


def test_without_geometric_stiffness_it_is_reported(tmp_path):
    direct, interfaces = frame("beam")
    model = from_own(direct, interfaces)
    made = body(model)
    assert not made.has_geometric_stiffness
    assert any("no geometric stiffness: built from matrices" in note for note in model.notes)
    assert "small speeds of rotation" in mp.read_body(mp.write_body(made, tmp_path / "b.h5")).provenance["notes"]
    with pytest.raises(mp.InputError, match="has no geometric stiffness, so that buckling"):
        mp.reduction.buckling(model, mp.reduction.interface_load(model, "tip", force=(-1.0, 0, 0)))


def test_supplied_geometric_stiffness():
    """The elements' own, handed in: axial acceleration and tip forces as in the direct road; the euler load too."""
    direct, interfaces = frame("beam")
    model = from_own(direct, interfaces, geometric_stiffness=lambda d: direct.geometric_stiffness(d, direct.K @ d))
    a, b = body(model), body(direct)
    for name in ("Kg_A", "Kg_F", "Kg_T"):
        assert difference(a, b, name) < 1e-8, name
    assert difference(a, b, "Kg_W") < 2e-3  # its loads are the approximate h
    push = mp.reduction.interface_load(model, "tip", force=(-1.0, 0, 0))
    euler = np.pi**2 * 1.4e4 / 400
    assert mp.reduction.buckling(model, push).value[0] == pytest.approx(euler, rel=1e-3)  # shear softens by EI/(GA L^2)


def test_supplied_geometric_stiffness_with_frames():
    """A rigid frame half a metre beyond its nodes adds the work of their forces, as in the direct road."""
    far = {"root": FACES["root"], "tip": mp.Interface(plane=FACES["tip"].plane, position=(1.5, 0.0, 0.0))}
    direct = solid(interfaces=far)
    n = own(direct)[0].shape[0]

    def elements(d):
        full = np.concatenate([d, np.zeros(direct.n_dof - n)])
        return direct.geometric_stiffness(full, direct.K @ full)[:n, :n]

    a, b = body(from_own(direct, far, geometric_stiffness=elements)), body(direct)
    for name in ("Kg_A", "Kg_W", "Kg_F", "Kg_T"):
        assert difference(a, b, name) < 1e-8, name


def test_inputs_stay_as_they_were():
    direct, interfaces = frame("beam")
    K, M, dof = own(direct)
    before = [x.copy() for x in (K.data, M.data, dof, direct.points)]
    mp.fe.model_from_matrices(K, M, direct.points, dof, interfaces=interfaces)
    for x, y in zip((K.data, M.data, dof, direct.points), before, strict=True):
        assert np.array_equal(x, y)


# --- what is refused -----------------------------------------------------------------------------------------------


def beam_matrices():
    direct = cantilever_model(4)
    return direct.K.toarray(), direct.M.toarray(), np.array(direct.points)


def changed(A, value, *at):
    A = np.array(A)
    A[at] = value
    return A


def apart(A):
    """Two copies of a structure, side by side."""
    return sp.block_diag([A, A]).tocsr()


K, M, POINTS = beam_matrices()
BAD = {
    "unsymmetric": (
        (changed(K, 5e6, 0, 6), M, POINTS),
        ["stiffness matrix is not symmetric", "ux of node 1", "ux of node 2"],
    ),
    "one triangle": ((np.tril(K), M, POINTS), ["not symmetric (it holds one triangle only)", "both triangles"]),
    "not square": ((K[:, :-1], M, POINTS), ["stiffness matrix is 30 x 29"]),
    "two sizes": ((K, M[:-6, :-6], POINTS), ["stiffness has 30 rows, mass 24"]),
    "nan": (
        (K, changed(M, np.nan, 3, 3), POINTS),
        ["mass matrix has 1 entries that are not numbers", "row 4, column 4"],
    ),
    "complex": ((K + 1j, M, POINTS), ["stiffness matrix does not hold real numbers"]),
    "negative diagonal": ((changed(K, -1.0, 8, 8), M, POINTS), ["1 negative diagonal", "-1 for uz of node 2"]),
    "indefinite": (
        (K, M + 40 * (np.eye(30, k=6) + np.eye(30, k=-6)), POINTS),
        ["mass matrix is not positive", "couples"],
    ),
    "no mass": ((K, 0 * M, POINTS), ["carries no mass: 0, 0, 0 kg"]),
    "mass along x only": ((K, np.diag(np.arange(30) % 6 == 0) * 1.0, POINTS), ["5, 0, 0 kg along x, y, z"]),
    "too few nodes": ((K, M, POINTS[:-1]), ["30 DOFs, 4 nodes have 12", "24", "some nodes or DOFs are missing"]),
    "flat nodes": ((K, M, POINTS[:, :2]), ["nodes has shape (5, 2)"]),
    "nan nodes": ((K, M, changed(POINTS, np.nan, 2, 1)), ["coordinates that are not numbers, the first is in row 3"]),
    "wrong unit of nodes": ((K, M, 1e3 * POINTS), ["does not move every direction alike|resists a rigid"]),
    "supports": (
        (K + np.diag(np.arange(30) < 6) * 1e6, M, POINTS),
        ["stiffness matrix resists a rigid", "node 1"],
    ),
    "supports taken out": (
        (K[1:, 1:], M[1:, 1:], POINTS, np.concatenate([[[-1, 0, 1, 2, 3, 4]], np.arange(5, 29).reshape(4, 6)])),
        ["node 1 lacks some of its translations", "unsupported structure"],
    ),
    "two parts": ((apart(K), apart(M), np.vstack([POINTS, POINTS + 5])), ["2 disconnected parts", "node 1"]),
    "dof of a shape": ((K, M, POINTS, np.zeros((7, 3), dtype=int)), ["shape (7, 3)", "(5, 6) or (30, 2)"]),
    "dof twice": ((K, M, POINTS, np.zeros((5, 6), dtype=int)), ["each of the 30 rows", "exactly once"]),
    "dof of no node": ((K, M, POINTS, np.array([[k // 6 + 1, k % 6] for k in range(30)])), ["node row 5", "5 nodes"]),
    "dof of no component": ((K, M, POINTS, np.array([[k // 6, k % 6 + 1] for k in range(30)])), ["other than 0 to 5"]),
}


@pytest.mark.parametrize(("arguments", "words"), BAD.values(), ids=BAD)
def test_one_thing_wrong(arguments, words):
    with pytest.raises(mp.InputError) as caught:
        mp.fe.model_from_matrices(*arguments, interfaces={"root": mp.Interface(node=1, kind="node")})
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert re.search(word if "|" in word else re.escape(word), message), message


def test_supplied_geometric_stiffness_of_another_size():
    direct, interfaces = frame("beam")
    model = from_own(direct, interfaces, geometric_stiffness=lambda d: np.eye(3))
    with pytest.raises(mp.InputError, match="returned 3 rows; return one for each of 126 DOFs"):
        body(model)


def test_recoveries_that_need_no_elements():
    """Reactions, accelerations and displacements of a model from matrices are those of the direct assembly."""
    direct, interfaces = frame("beam")
    rebuilt = from_own(direct, interfaces)
    kinds = {
        "base": mp.fe.Recover(kind="reaction"),
        "feel": mp.fe.Recover(kind="acceleration", node=3),
        "move": mp.fe.Recover(kind="displacement", node=3),
        "seen": mp.fe.Recover(kind="displacement", node=3, method="displacement"),
    }
    nodes = mp.fe.Mesh(points=direct.points + direct.origin, cells={}, groups={})
    found = []
    for model in (direct, rebuilt):
        recovery = mp.fe.model_recovery(model, nodes, kinds)
        reduction = mp.craig_bampton(model, modes=4, truncation=())
        found.append(mp.flexible_body(model, reduction, name="beam", recovery=recovery))
    for name in kinds:
        a, b = (np.delete(complete_response(x, x.recovery[name]), np.s_[3:12], axis=2) for x in found)
        assert b == pytest.approx(a, abs=1e-8 * np.abs(a).max())  # of two eigensolutions; M has not all of W
    assert np.array_equal(found[0].recovery["seen"].q[0], found[0].shape[2])
    with pytest.raises(mp.InputError, match="a model from matrices knows no elements; its reactions, accelerations"):
        mp.fe.model_recovery(rebuilt, nodes, {"x": mp.fe.Recover(kind="section_force")})
    with pytest.raises(mp.InputError, match="knows no links of its nodes"):
        mp.fe.model_recovery(rebuilt, nodes, {"x": mp.fe.Recover(kind="mpc_force")})


# --- through a pipeline file ----------------------------------------------------------------------------------------

JOB = """
[matrices]
file = "model.npz"

[interfaces.root]
node = 1

[interfaces.tip]
node = 5
boundary = "free"

[reduction]
modes = 3
truncation_vectors = []

[output]
pictures = "none"
"""


@pytest.fixture
def job(tmp_path):
    np.savez(tmp_path / "model.npz", K=K, M=M, nodes=POINTS)
    (tmp_path / "job.toml").write_text(JOB)
    return tmp_path / "job.toml"


def test_pipeline_run(job, capsys):
    assert main(["run", str(job), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert any("no geometric stiffness: built from matrices" in note for note in said["notes"])
    made = mp.read_body(job.parent / "output/job/job.h5")
    direct = mp.craig_bampton(cantilever_model(4), modes=3, truncation=())
    assert np.allclose(made.frequency, direct.frequency, rtol=1e-9)
    assert made.cells["line"].shape == (4, 2)
    assert not made.has_geometric_stiffness
    assert "built from matrices" in (job.parent / "output/job/job.html").read_text()
    assert main(["check", str(job)]) == 0


def test_pipeline_builds_again_when_a_matrix_changes(job):
    from modalprep.pipeline.building.inputs import inputs
    from modalprep.pipeline.schema.load import load

    before = inputs(load(job))
    np.savez(job.parent / "model.npz", K=K, M=2 * M, nodes=POINTS)
    after = inputs(load(job))
    assert before["mesh_sha256"] != after["mesh_sha256"]


WITH_DOF = {name for name in BAD if "dof" in name or "taken out" in name or name == "complex"}


@pytest.mark.parametrize("name", sorted(BAD.keys() - WITH_DOF))
def test_one_thing_wrong_in_a_pipeline(job, capsys, name):
    names = ("K", "M", "nodes")
    np.savez(
        job.parent / "model.npz",
        **{n: a.toarray() if sp.issparse(a) else a for n, a in zip(names, BAD[name][0], strict=True)},
    )
    assert main(["run", str(job)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("modalprep: ")
    assert error.count("\n") == 1
    assert "job.toml" in error or "model.npz" in error
    assert not (job.parent / "output").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('file = "model.npz"', 'file = "no.npz"'), ["no.npz does not exist"]),
        (('file = "model.npz"', 'file = "job.toml"'), [".toml is not known"]),
        (('file = "model.npz"', ""), ["needs either 'file'", "'stiffness' and 'mass'"]),
        (('file = "model.npz"', 'stiffness = "k.mtx"'), ["needs either 'file'"]),
        (('file = "model.npz"', 'file = "model.npz"\ndofs_per_node = 3'), ["30 rows", "3 for each of 5 nodes"]),
        (('file = "model.npz"', 'file = "model.npz"\ndofs_per_node = 4'), ["[matrices.dofs_per_node]"]),
        (('file = "model.npz"', 'file = "model.npz"\nlength_unit = "mm"'), ["mass_unit"]),
        (('file = "model.npz"', 'file = "model.npz"\nnodes = "no.csv"'), ["no.csv does not exist"]),
        (("[matrices]", '[mesh]\nfile = "a.msh"\n[matrices]'), ["[mesh] cannot be combined with [matrices]"]),
        (("[matrices]", '[connections.a]\nnode = 1\n[matrices]'), ["[connections] cannot be combined with [matrices]"]),
        (("node = 5", "node = 6"), ["no node lies at node 6"]),
    ],
)  # fmt: skip
def test_one_thing_wrong_in_the_table(job, capsys, change, words):
    assert change[0] in JOB
    job.write_text(JOB.replace(*change))
    assert main(["run", str(job)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    for word in words:
        assert word in error, error


def test_quality_of_matrices_is_refused(job, capsys):
    assert main(["quality", str(job)]) == 2
    assert "[matrices] have no elements" in capsys.readouterr().err
