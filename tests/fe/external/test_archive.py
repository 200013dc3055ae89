"""Untrusted archives: pickles that would run something, indices outside the matrix."""

import io
import pickle
import zipfile

import numpy as np
import pytest
import scipy.sparse as sp
from fe import matrix_writers as write
from fe.matrix_cases import SOLID, beam, random_symmetric, solid

import modalprep as mp
from modalprep.cli import main
from modalprep.fe.external.archive import _Unpickler, read_archive


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
