"""Readers of matrix files: peers that wrote them, their descriptions, damaged and foreign files."""

import io
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from compare import assert_close
from fe import matrix_writers as write
from fe.matrix_cases import (
    BEAM,
    LABELS,
    beam,
    nodes_csv,
    put_archive,
    put_market,
    put_matrix_input,
    put_output4,
    put_substructure,
    random_symmetric,
)
from scipy.io import mmwrite

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import cantilever_model
from modalprep.fe.external.files import read_matrices
from modalprep.fe.external.matrix_market import read_market
from modalprep.fe.readers.abaqus.matrices import read_abaqus_matrix
from modalprep.fe.readers.nastran.dmig import read_dmig
from modalprep.fe.readers.output4 import read_output4


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


def test_output4_of_nastran():
    """Files of Nastran that pyyeti brings: text and binary of both byte orders, integers of 32 and 64 bits, complex."""
    pyyeti = pytest.importorskip("pyyeti")
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    files = sorted((Path(pyyeti.__file__).parent / "tests" / "nastran_op4_data").glob("[ds]*le_*.op4"))
    if not files:
        pytest.skip("this pyyeti comes without its files of Nastran")
    assert any("i64" in file.name for file in files)
    for file in files:
        found = {name.lower(): A.toarray() for name, A in read_output4(file).items()}
        expected = op4.read(str(file), sparse=False) if "badname" not in file.name else {}
        for name, A in expected.items():
            assert np.array_equal(found[name], A), (file.name, name)


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


def turned_deck(folder, K, M, points):
    """The matrices of a deck whose grid 11 has its components along y, z, x of the basic system."""
    K, M = K.toarray(), M.toarray()
    turn = np.eye(len(K))
    turn[:6, :6] = np.kron(np.eye(2), [[0, 1.0, 0], [0, 0, 1], [1, 0, 0]])
    both = {"K": sp.csr_array(turn @ K @ turn.T), "M": sp.csr_array(turn @ M @ turn.T)}
    write.dmig(folder / "model.bdf", both, LABELS, points)
    text = (folder / "model.bdf").read_text()
    plain = "GRID,11,,0.000000000000,0.000000000000,0.000000000000"
    assert plain in text
    text = text.replace(plain, "GRID,11,,0.,0.,0.,3", 1)
    (folder / "model.bdf").write_text("CORD2R,3,0,0.,0.,0.,1.,0.,0.,\n,0.,1.,0.\n" + text)  # z along x, x along y


def test_matrices_in_other_displacement_systems_are_turned(tmp_path):
    """The deck has twelve digits."""
    K, M, points = beam()
    write.dmig(tmp_path / "basic.bdf", {"K": K, "M": M}, LABELS, points)
    turned_deck(tmp_path, K, M, points)
    basic, turned = (read_matrices(file=tmp_path / name) for name in ("basic.bdf", "model.bdf"))
    assert np.array_equal(turned.dof, basic.dof)
    for name in ("K", "M"):
        expected = getattr(basic, name).toarray()
        assert_close(getattr(turned, name).toarray(), expected, 1e-11, scale=np.abs(expected).max())


def test_nodes_alone_of_another_displacement_system_are_refused(tmp_path):
    K, M, points = beam()
    turned_deck(tmp_path, K, M, points)
    write.output4(tmp_path / "a.op4", {"KGG": K, "MGG": M})
    with pytest.raises(mp.InputError, match="GRID 11: its displacement system .CD. is not the basic one"):
        read_matrices(file=tmp_path / "a.op4", nodes=tmp_path / "model.bdf")


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
