"""Matrices of a beam and a solid written in each format, read back and reduced: the same body as the direct road."""

import io
import pickle
import shutil
import zipfile

import numpy as np
import pytest
import scipy.sparse as sp
from fe import matrix_writers as write
from scipy.io import mmwrite
from structured import box

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import cantilever_model
from modalprep.fe.abaqus_matrix import read_abaqus_matrix
from modalprep.fe.archive import _Unpickler, read_archive
from modalprep.fe.dmig import read_dmig
from modalprep.fe.matrix_files import read_matrices
from modalprep.fe.matrix_market import read_market
from modalprep.fe.output4 import read_output4

FULL, TEN_DIGITS = (
    1e-10,
    1e-7,
)  # ten digits of K: 5e-11 of its terms, which are 1e3 times a bending mode's own stiffness
BEAM = """
[interfaces.root]
node = 11

[interfaces.tip]
node = 71
boundary = "free"

[reduction]
modes = 3
truncation_vectors = []

[output]
pictures = "none"
"""
LABELS = np.arange(11, 81, 10)  # node numbers of the file


def beam():
    """K, M, nodes of a beam of six elements."""
    model = cantilever_model(6)
    return model.K, model.M, np.array(model.points)


def nodes_csv(path, points, labels=LABELS):
    rows = "".join(f"{g}, {x:.12g}, {y:.12g}, {z:.12g}\n" for g, (x, y, z) in zip(labels, points, strict=True))
    path.write_text("node, x, y, z\n" + rows)


def put_market(at):
    K, M, points = beam()
    write.market(at / "k.mtx", K)
    write.market(at / "m.mtx", M)
    nodes_csv(at / "nodes.csv", points)
    return 'stiffness = "k.mtx"\nmass = "m.mtx"\nnodes = "nodes.csv"\ndofs_per_node = 6'


def put_scipy(at):
    K, M, points = beam()
    sp.save_npz(at / "k.npz", sp.csc_matrix(K))
    sp.save_npz(at / "m.npz", sp.coo_array(M))
    nodes_csv(at / "nodes.csv", points)
    return 'stiffness = "k.npz"\nmass = "m.npz"\nnodes = "nodes.csv"'


def put_npy_nodes(at):
    K, M, points = beam()
    sp.save_npz(at / "k.npz", K)
    sp.save_npz(at / "m.npz", M)
    np.save(at / "nodes.npy", np.column_stack([LABELS, points]))
    return 'stiffness = "k.npz"\nmass = "m.npz"\nnodes = "nodes.npy"'


def put_archive(at):
    K, M, points = beam()
    np.savez(at / "model.npz", K=np.array(sp.csr_matrix(K), dtype=object), M=M.toarray(), nodes=points)
    nodes_csv(at / "nodes.csv", points)
    return 'file = "model.npz"\nnodes = "nodes.csv"'


def put_output4(at):
    K, M, points = beam()
    write.output4(at / "model.op4", {"KGG": K, "MGG": M})
    nodes_csv(at / "nodes.csv", points)
    return 'file = "model.op4"\nnodes = "nodes.csv"'


def put_dmig(at):
    K, M, points = beam()
    write.dmig(at / "model.bdf", {"KAAX": K, "MAAX": M}, LABELS, points)
    return 'file = "model.bdf"'


def put_dmig_and_deck(at):
    K, M, points = beam()
    write.dmig(at / "k.pch", {"K2GG": K}, LABELS)
    write.dmig(at / "m.pch", {"M2GG": M}, LABELS)
    write.dmig(at / "nodes.bdf", {}, LABELS, points)
    return 'stiffness = "k.pch"\nmass = "m.pch"\nnodes = "nodes.bdf"'


def put_substructure(at):
    K, M, points = beam()
    write.substructure(at / "z1.mtx", K, M, LABELS)
    nodes_csv(at / "nodes.csv", points)
    return 'file = "z1.mtx"\nnodes = "nodes.csv"'


def put_matrix_input(at):
    K, M, points = beam()
    write.matrix_input(at / "job_STIF1.mtx", K, LABELS)
    write.matrix_input(at / "job_MASS1.mtx", M, LABELS)
    nodes_csv(at / "nodes.csv", points)
    return 'stiffness = "job_STIF1.mtx"\nmass = "job_MASS1.mtx"\nnodes = "nodes.csv"'


def put_calculix(at):
    K, M, points = beam()
    order = np.random.default_rng(1).permutation(K.shape[0])
    write.coordinates(at / "job.sti", K[order][:, order])
    write.coordinates(at / "job.mas", M[order][:, order])
    (at / "job.dof").write_text("".join(f"{LABELS[k // 6]}.{k % 6 + 1}\n" for k in order))
    nodes_csv(at / "nodes.csv", points)
    return 'stiffness = "job.sti"\nmass = "job.mas"\nnodes = "nodes.csv"\ndof = "job.dof"'


FORMATS = {
    "MatrixMarket": (put_market, FULL),
    "scipy": (put_scipy, FULL),
    "npy nodes": (put_npy_nodes, FULL),
    "archive": (put_archive, FULL),
    "OUTPUT4": (put_output4, TEN_DIGITS),
    "DMIG": (put_dmig, TEN_DIGITS),
    "DMIG and deck": (put_dmig_and_deck, TEN_DIGITS),
    "substructure": (put_substructure, FULL),
    "matrix input": (put_matrix_input, FULL),
    "CalculiX": (put_calculix, FULL),
}


@pytest.mark.parametrize(("put", "limit"), FORMATS.values(), ids=FORMATS)
def test_each_format_gives_the_direct_body(tmp_path, put, limit):
    (tmp_path / "job.toml").write_text(f"[matrices]\n{put(tmp_path)}\n{BEAM}")
    assert main(["run", str(tmp_path / "job.toml"), "--json"]) == 0
    made = mp.read_body(tmp_path / "output/job/job.h5")
    model = cantilever_model(6)
    reduction = mp.craig_bampton(model, modes=3, truncation=())
    direct = mp.flexible_body(model, reduction, name="direct")
    for name in ("frequency", "m", "s0", "E0", "K"):
        a, b = np.asarray(getattr(made, name)), np.asarray(getattr(direct, name))
        assert np.abs(a - b).max() < limit * np.abs(b).max(), name
    assert np.allclose(made.S, direct.S, atol=limit * np.abs(direct.S).max())
    assert np.allclose(made.phi, direct.phi, atol=limit * np.abs(direct.phi).max())
    assert np.allclose(made.modes.effective_mass, direct.modes.effective_mass, atol=limit * made.m * 100)
    assert np.abs(made.H - direct.H).max() < 2e-5 * np.abs(direct.H).max()  # twice what test_matrices measures
    assert not made.has_geometric_stiffness


# --- solids by Exudyn's FEM file ------------------------------------------------------------------------------------

FACES = {
    "root": mp.Interface(plane=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))),
    "tip": mp.Interface(plane=((1.0, 0.0, 0.0), (1.0, 0.0, 0.0))),
}
SOLID = """
[matrices]
file = "fem.npz"

[interfaces.root]
group = "left"

[interfaces.tip]
group = "right"

[reduction]
modes = 5
truncation_vectors = []

[output]
pictures = "none"
"""


def solid():
    """K, M of the nodes of a distorted bar, its points and cells, and its direct model."""
    points, cells = box("hexahedron", (5, 2, 2), (1.0, 0.2, 0.1), distort=0.2)
    mesh = mp.Mesh(points=points, cells={"hexahedron": cells}, groups={"b": {"hexahedron": np.arange(len(cells))}})
    alloy = mp.Solid(material=mp.Material(E=7e10, nu=0.3, rho=2700.0))
    model = mp.assemble(mesh, {"b": alloy}, FACES)
    n = 3 * len(points)
    sets = {"left": np.flatnonzero(points[:, 0] < 1e-9), "right": np.flatnonzero(points[:, 0] > 1 - 1e-9)}
    return model.K[:n, :n], model.M[:n, :n], points, cells, sets, model


def same_solid(folder, model):
    made = mp.read_body(folder / "output/job/job.h5")
    direct = mp.flexible_body(model, mp.craig_bampton(model, modes=5, truncation=()), name="direct")
    for name in ("frequency", "m", "s0", "E0", "S", "H", "P", "phi", "psi"):
        a, b = np.asarray(getattr(made, name)), np.asarray(getattr(direct, name))
        assert np.abs(a - b).max() < 1e-8 * np.abs(b).max(), name  # centroids of nodes differ by round-off
    return made


def test_fem_archive(tmp_path):
    K, M, points, cells, sets, model = solid()
    write.fem_archive(tmp_path / "fem.npz", K, M, points, {"Name": "bar", "Hex8": cells}, sets)
    (tmp_path / "job.toml").write_text(SOLID)
    assert main(["run", str(tmp_path / "job.toml"), "--json"]) == 0
    made = same_solid(tmp_path, model)
    assert np.array_equal(made.cells["hexahedron"], cells)


def test_fem_archive_by_exudyn(tmp_path):
    FEM = pytest.importorskip("exudyn.FEM")
    K, M, points, cells, sets, model = solid()
    fem = FEM.FEMinterface()
    fem.nodes = {"Position": points}
    fem.elements = [{"Name": "bar", "Hex8": cells}]
    fem.stiffnessMatrix, fem.massMatrix = sp.csr_matrix(K), sp.csr_matrix(M)
    for name, nodes in sets.items():
        fem.nodeSets.append({"Name": name, "NodeNumbers": nodes, "NodeWeights": np.ones(len(nodes)) / len(nodes)})
    fem.SaveToFile(str(tmp_path / "fem.npz"))
    (tmp_path / "job.toml").write_text(SOLID)
    assert main(["run", str(tmp_path / "job.toml"), "--json"]) == 0
    same_solid(tmp_path, model)


def test_nodes_of_a_mesh_file_bring_groups_and_cells(tmp_path, project, bracket_model):
    """Matrices by scipy, nodes and groups by the .msh: as the direct road."""
    shutil.copy(project / "meshes" / "bracket.msh", tmp_path)
    n = 3 * len(bracket_model.points)
    sp.save_npz(tmp_path / "k.npz", bracket_model.K[:n, :n] * 1e-3)  # t, mm, s
    sp.save_npz(tmp_path / "m.npz", bracket_model.M[:n, :n] * 1e-3)
    files = {name: tmp_path / f for name, f in (("stiffness", "k.npz"), ("mass", "m.npz"), ("nodes", "bracket.msh"))}
    read = read_matrices(**files, length_unit="mm", mass_unit="t")
    model = read.model({name: mp.Interface(group=name) for name in ("bolt_a", "bolt_b")})
    assert np.allclose(model.origin, bracket_model.origin, atol=1e-12)
    assert "tetra10" in model.cells
    got, wanted = (mp.craig_bampton(m, modes=4, truncation=()).frequency for m in (model, bracket_model))
    assert np.allclose(got, wanted, rtol=1e-9)


# --- readers alone --------------------------------------------------------------------------------------------------


def random_symmetric(n=60):
    A = sp.random_array((n, n), density=0.08, rng=np.random.default_rng(0)).toarray()
    A = A + A.T
    A[7] = A[:, 7] = 0.0
    return A


@pytest.mark.parametrize("sparse", ["dense", "bigmat", "nonbigmat"])
@pytest.mark.parametrize("how", [{"binary": False}, {"binary": True}, {"binary": True, "endian": ">"}])
def test_output4_by_pyyeti(tmp_path, how, sparse):
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    A, B = random_symmetric(), np.random.default_rng(1).standard_normal((9, 9))
    op4.write(str(tmp_path / "a.op4"), {"KGG": A, "MGG": B}, sparse=sparse, **how)
    found = read_output4(tmp_path / "a.op4")
    assert list(found) == ["KGG", "MGG"]
    assert np.array_equal(found["KGG"].toarray(), A)
    assert np.array_equal(found["MGG"].toarray(), B)


def test_output4_with_exponents_of_fortran(tmp_path):
    put_output4(tmp_path)
    before = read_output4(tmp_path / "model.op4")["KGG"]
    text = (tmp_path / "model.op4").read_text()
    head, rest = text.split("\n", 1)
    (tmp_path / "d.op4").write_text(head + "\n" + rest.split("MGG")[0].rsplit("\n", 1)[0].replace("E", "D") + "\n")
    assert np.array_equal(read_output4(tmp_path / "d.op4")["KGG"].toarray(), before.toarray())


def test_output4_binary_by_its_description(tmp_path):
    """Records of theory 8.2, single precision too."""
    A = np.array([[4.0, -2.0], [-2.0, 5.0]])
    out = io.BytesIO()

    def record(*parts):
        data = b"".join(parts)
        size = np.int32(len(data)).tobytes()
        out.write(size + data + size)

    for name, kind, real in ((b"K       ", 2, np.float64), (b"M       ", 1, np.float32)):
        words = real(0).nbytes // 4
        record(np.array([2, 2, 6, kind], dtype=np.int32).tobytes(), name)
        for j in range(2):
            record(np.array([j + 1, 1, 2 * words], dtype=np.int32).tobytes(), A[:, j].astype(real).tobytes())
        record(np.array([3, 1, words], dtype=np.int32).tobytes(), real(1.5).tobytes())
    (tmp_path / "a.op4").write_bytes(out.getvalue())
    found = read_output4(tmp_path / "a.op4")
    assert np.array_equal(found["K"].toarray(), A)
    assert np.array_equal(found["M"].toarray(), A)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.6, 0.9, 0.99])
@pytest.mark.parametrize("put", [put_output4, put_market, put_archive, put_substructure], ids=lambda put: put.__name__)
def test_truncated(tmp_path, capsys, put, share):
    (tmp_path / "job.toml").write_text(f"[matrices]\n{put(tmp_path)}\n{BEAM}")
    for name in ("model.op4", "k.mtx", "model.npz", "z1.mtx"):
        if (tmp_path / name).is_file():
            content = (tmp_path / name).read_bytes()
            (tmp_path / name).write_bytes(content[: int(share * len(content))])
    assert main(["run", str(tmp_path / "job.toml")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "Traceback" not in error
    assert not (tmp_path / "output").exists()


def test_dmig_by_pyyeti(tmp_path):
    bulk = pytest.importorskip("pyyeti.nastran.bulk")
    pd = pytest.importorskip("pandas")
    A = random_symmetric(12) + np.eye(12)
    index = pd.MultiIndex.from_product([[100, 200], range(1, 7)], names=["id", "dof"])
    bulk.wtdmig(str(tmp_path / "a.dmig"), {"KAAX": pd.DataFrame(A, index=index, columns=index)})
    found = read_dmig(tmp_path / "a.dmig")["KAAX"]
    at = found.rows[:, 0] // 100 * 6 - 6 + found.rows[:, 1]
    assert np.allclose(found.matrix.toarray(), A[np.ix_(at, at)], rtol=1e-9, atol=0)


def test_dmig_in_small_fields_and_both_triangles(tmp_path):
    """Form 1 gives every entry; small fields hold two entries a line."""
    text = (
        "DMIG    K              0       1       2       0\n"
        "DMIG    K              7       1               7       1      4.\n"
        "               7       2     -2.\n"
        "DMIG    K              7       2               7       1     -2.\n"
        "               7       2    5.+1\n"
    )
    (tmp_path / "k.pch").write_text(text)
    assert read_dmig(tmp_path / "k.pch")["K"].matrix.toarray().tolist() == [[4.0, -2.0], [-2.0, 50.0]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("GRID,1\n", ["holds no DMIG"]),
        ("DMIG,K,1,1,,1,1,4.\n", ["line 1", "header", "does not come before it"]),
        ("DMIG,K,0,6,3,0\nDMIG,K,1,1,,1,1,4.,0.\n", ["matrix K is complex"]),
        ("DMIG,K,0,2,2,0\nDMIG,K,1,1,,1,1,4.\n", ["matrix K is rectangular"]),
        ("DMIG,K,0,6,2,0\nDMIG,K,1,0,,1,0,4.\n", ["component 0", "scalar points"]),
        ("DMIG,K,0,6,2,0\nDMIG,K,1,1,,1,1,x\n", ["line 2", "the value is 'X'"]),
    ],
)
def test_bad_dmig(tmp_path, text, words):
    (tmp_path / "k.pch").write_text(text)
    with pytest.raises(mp.InputError) as caught:
        read_dmig(tmp_path / "k.pch")
    for word in words:
        assert word in str(caught.value)


def test_substructure_whose_nodes_have_different_dofs(tmp_path):
    text = """*USER ELEMENT, NODES=      3, LINEAR
** ELEMENT NODES
**     4,     9,    12
 1, 2, 3
 2, 1
*MATRIX,TYPE=STIFFNESS
 1.
 2., 3.
 4., 5., 6.
 7., 8., 9., 10.
 11., 12., 13., 14.,
 15.
"""
    (tmp_path / "z.mtx").write_text(text)
    found = read_abaqus_matrix(tmp_path / "z.mtx")["stiffness"]
    assert found.rows.tolist() == [[4, 0], [4, 1], [4, 2], [9, 0], [12, 0]]
    assert found.matrix.toarray()[3].tolist() == [7.0, 8.0, 9.0, 10.0, 14.0]


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "0 numbers in a line"),
        ("1 2\n", "2 numbers in a line"),
        ("1, 1, 1, 1\n", "4 numbers in a line"),
        ("1,1, 1,1, 4.\n1,2, 1,1\n", "last line is not complete"),
        ("0 1 4.\n", "not a positive whole number"),
        ("1.5 1 4.\n", "not a positive whole number"),
        ("1 1 four\n", "could not convert"),
        ("*USER ELEMENT, NODES=1\n** 1\n1,2,3\n", "no *MATRIX"),
        ("*USER ELEMENT, NODES=1\n1,2,3\n*MATRIX,TYPE=STIFFNESS\n1.\n", "nodes or dofs"),
        ("*USER ELEMENT, NODES=1\n** 1\n1,2,3\n*MATRIX,TYPE=STIFFNESS\n1.\n", "3 dofs has 1 of 6 values"),
    ],
)
def test_bad_abaqus_matrix(tmp_path, text, word):
    (tmp_path / "k.mtx").write_text(text)
    with pytest.raises(mp.InputError, match="is damaged or cut short") as caught:
        read_abaqus_matrix(tmp_path / "k.mtx")
    assert word in str(caught.value)


def test_nodes_of_another_displacement_system_are_refused(tmp_path):
    K, M, points = beam()
    write.dmig(tmp_path / "model.bdf", {"K": K, "M": M}, LABELS, points)
    text = (
        (tmp_path / "model.bdf")
        .read_text()
        .replace("GRID,11,,0.000000000000,0.000000000000,0.000000000000", "GRID,11,,0.,0.,0.,3", 1)
    )
    (tmp_path / "model.bdf").write_text("CORD2R,3,0,0.,0.,0.,1.,0.,0.,\n,0.,1.,0.\n" + text)
    with pytest.raises(mp.InputError, match="GRID 11: its displacement system .CD. is not the basic one"):
        read_matrices(file=tmp_path / "model.bdf")


@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
@pytest.mark.parametrize("kind", [sp.coo_matrix, np.asarray], ids=["coordinate", "array"])
def test_market_by_scipy(tmp_path, kind, symmetry):
    A = random_symmetric(9)
    mmwrite(tmp_path / "a.mtx", kind(A), symmetry=symmetry, precision=17)
    assert np.array_equal(read_market(tmp_path / "a.mtx").toarray(), A)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("%%MatrixMarket\n", "no MatrixMarket heading"),
        ("%%MatrixMarket matrix coordinate real symmetric\n", "damaged or cut short"),
        ("%%MatrixMarket matrix coordinate real symmetric\n2 2 1\n3 3 1.\n", "damaged or cut short"),
        ("%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 1.\n", "3 numbers instead of 6"),
        ("%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1. 0.\n", "is complex and general"),
        ("%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n", "is pattern and general"),
    ],
)
def test_bad_market(tmp_path, text, word):
    (tmp_path / "a.mtx").write_text(text)
    with pytest.raises(mp.InputError, match=word):
        read_market(tmp_path / "a.mtx")


def test_which_matrix_is_which(tmp_path):
    K, M, points = beam()
    write.output4(tmp_path / "a.op4", {"KGG": K, "KAA": K, "MGG": M})
    nodes_csv(tmp_path / "nodes.csv", points)
    with pytest.raises(mp.InputError, match="KGG, KAA, MGG: which is the stiffness cannot be told"):
        read_matrices(file=tmp_path / "a.op4", nodes=tmp_path / "nodes.csv")


NODES = {
    "missing node": ("11 0 0 0\n", ["rows of node 21 (6 such nodes)", "1 nodes given"]),
    "missing node between": ("11 0 0 0\n31 0 0 0\n99 0 0 0", ["rows of node 21 (5 such nodes)", "3 nodes given"]),
    "two numbers": ("11 0\n", ["rows of 2 numbers", "x, y, z"]),
    "ragged": ("11 0 0 0\n21 1 0\n", ["row 2 is '21 1 0'", "not 4 numbers"]),
    "a word": ("11 0 0 0\n21 one 0 0\n", ["row 2", "'21 one 0 0'"]),
    "half a node": ("11.5 0 0 0\n", ["node number is not a whole number"]),
    "nan": ("11 0 0 nan\n", ["coordinates that are not numbers"]),
    "empty": ("", ["rows of"]),
}


@pytest.mark.parametrize(("text", "words"), NODES.values(), ids=NODES)
def test_bad_nodes(tmp_path, capsys, text, words):
    (tmp_path / "job.toml").write_text(f"[matrices]\n{put_matrix_input(tmp_path)}\n{BEAM}")
    (tmp_path / "nodes.csv").write_text(text)
    assert main(["run", str(tmp_path / "job.toml")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    for word in words:
        assert word in error, error


def test_nodes_in_any_order(tmp_path):
    put_matrix_input(tmp_path)
    mixed = np.random.default_rng(2).permutation(len(LABELS))
    nodes_csv(tmp_path / "nodes.csv", beam()[2][mixed], LABELS[mixed])
    files = {name: tmp_path / f"job_{kind}1.mtx" for name, kind in (("stiffness", "STIF"), ("mass", "MASS"))}
    model = read_matrices(**files, nodes=tmp_path / "nodes.csv").model({"root": mp.Interface(node=11, kind="node")})
    direct = mp.craig_bampton(cantilever_model(6), modes=3, truncation=())
    got = mp.craig_bampton(model, modes=3, truncation=())
    assert np.allclose(got.frequency, direct.frequency, rtol=1e-9)


def test_no_nodes(tmp_path):
    put_market(tmp_path)
    with pytest.raises(mp.InputError, match="holds no nodes; say in which file"):
        read_matrices(stiffness=tmp_path / "k.mtx", mass=tmp_path / "m.mtx")


# --- a stranger's archive -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("member", ["nodes", "elements", "stiffnessMatrix", "nodeSets"])
def test_a_pickle_runs_nothing(tmp_path, capsys, member):
    K, M, points, cells, sets, _ = solid()
    write.fem_archive(tmp_path / "good.npz", K, M, points, {"Hex8": cells}, sets)
    stolen = tmp_path / "stolen"
    write.malicious_archive(tmp_path / "fem.npz", tmp_path / "good.npz", member, write.Thief(f"touch {stolen}"))
    (tmp_path / "job.toml").write_text(SOLID)
    assert main(["run", str(tmp_path / "job.toml")]) == 2
    error = capsys.readouterr().err
    assert not stolen.exists()
    assert error.count("\n") == 1
    assert f"{member} is a pickle that is not read, because it wants to load" in error
    assert "save_npz" in error


def test_the_thief_would_have_worked(tmp_path):
    """The payload of the tests above does what it says where nothing holds it."""
    pickle.loads(pickle.dumps(write.Thief(f"touch {tmp_path / 'stolen'}")))
    assert (tmp_path / "stolen").exists()


@pytest.mark.parametrize(
    "name", ["builtins.eval", "builtins.getattr", "numpy.load", "numpy.testing._private.utils.runstring", "os.system",
             "scipy.sparse.load_npz", "scipy.sparse.linalg.eigsh", "subprocess.Popen",
             "numpy._core.multiarray.fromfile"]
)  # fmt: skip
def test_names_that_a_pickle_may_not_load(name):
    module, _, attribute = name.rpartition(".")
    payload = b"\x80\x02c" + f"{module}\n{attribute}\n".encode() + b"."
    with pytest.raises(pickle.UnpicklingError, match="wants to load"):
        _Unpickler(io.BytesIO(payload)).load()


@pytest.mark.parametrize("protocol", range(2, 6))
@pytest.mark.parametrize("kind", ["csr_matrix", "csc_matrix", "coo_matrix", "csr_array"])
def test_honest_pickles_of_every_protocol(tmp_path, kind, protocol):
    A = getattr(sp, kind)(random_symmetric(8))
    out = io.BytesIO()
    np.lib.format.write_array_header_1_0(out, {"descr": "|O", "fortran_order": False, "shape": ()})
    pickle.dump(np.array(A, dtype=object), out, protocol=protocol)
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("K.npy", out.getvalue())
    assert np.array_equal(read_archive(tmp_path / "a.npz").matrices["K"].matrix.toarray(), A.toarray())


def test_indices_outside_the_matrix_are_refused(tmp_path):
    """Scipy does not look at them and would read foreign memory."""
    K, _, _ = beam()
    K = sp.csr_matrix(K)
    K.indices[5] = 10**6
    sp.save_npz(tmp_path / "k.npz", K)
    with pytest.raises(mp.InputError, match="is damaged"):
        read_archive(tmp_path / "k.npz")


def test_archive_of_something_else(tmp_path):
    np.savez(tmp_path / "a.npz", x=np.zeros(3))
    with pytest.raises(mp.InputError, match="holds x; it needs K, M and nodes"):
        read_archive(tmp_path / "a.npz")
