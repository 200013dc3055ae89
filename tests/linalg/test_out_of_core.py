"""Factors on disk: right, checked, forecast, refused where they have no room, and gone with their files."""

import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import psutil
import pytest
from scipy.sparse import csr_array, diags_array, eye_array, kron, random_array

from modalprep.errors import AccuracyError, InputError, NotInstalledError
from modalprep.linalg import factor, mumps, out_of_core
from modalprep.linalg.factor import factorise
from modalprep.linalg.forecast import GIB
from modalprep.linalg.memory import BUDGET
from modalprep.linalg.modes import lowest_modes
from modalprep.linalg.out_of_core import OutOfCoreFactor
from modalprep.linalg.pardiso import PardisoFactor

installed = pytest.mark.skipif(mumps.module() is None, reason="python-mumps is not installed")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch) -> Path:
    """The temporary files of a test."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def springs(n: int, seed: int) -> csr_array:
    """A random network of springs of five decades, each node held by a soft one."""
    rng = np.random.default_rng(seed)
    net = random_array((n, n), density=4 / n, rng=rng, data_sampler=lambda size: 10 ** rng.uniform(-3, 2, size))
    net = net + net.T
    return csr_array(diags_array(net.sum(axis=0) + 10 ** rng.uniform(-4, 0, n)) - net)


def grid(n: int) -> csr_array:
    """A cube of n^3 nodes of unit springs between walls."""
    line, one = diags_array([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1]), eye_array(n)
    plane = kron(line, one) + kron(one, line)
    return csr_array(kron(plane, one) + kron(kron(one, one), line))


@installed
@pytest.mark.parametrize("seed", range(12))
def test_solutions_and_inertia(seed):
    """By LAPACK, of definite and of shifted matrices."""
    A = springs(300, seed)
    if seed % 2:
        A = (A - 10.0 ** (seed / 4 - 2) * eye_array(300)).tocsr()
    found = OutOfCoreFactor(A)
    b = np.random.default_rng(seed).standard_normal((300, 1 + 7 * seed))  # more than are solved for at a time
    assert found.negative == np.sum(np.linalg.eigvalsh(A.toarray()) < 0)
    x = np.linalg.solve(A.toarray(), b)
    np.testing.assert_allclose(found.solve(b), x, rtol=0, atol=1e-9 * np.abs(x).max())  # condition up to 1e6
    np.testing.assert_allclose(found.solve(b[:, 0]), x[:, 0], rtol=0, atol=1e-9 * np.abs(x).max())


@installed
def test_a_large_factor_is_that_of_pardiso(folder):
    """The cube: solutions, inertia, the forecast of its file, and no file when it is released."""
    A = (grid(20) - 1.0 * eye_array(8000)).tocsr()
    found, other = OutOfCoreFactor(A), PardisoFactor(A)
    assert found.negative == other.negative > 0
    b = np.random.default_rng(0).standard_normal((8000, 3))
    x = other.solve(b)
    np.testing.assert_allclose(found.solve(b), x, rtol=0, atol=1e-9 * np.abs(x).max())
    written = sum(file.stat().st_size for file in folder.rglob("mumps*"))
    assert 0.7 < written / found.forecast.disk < 1.1  # the lower triangle of the diagonal blocks alone
    found.release()
    assert not list(folder.iterdir())
    np.testing.assert_allclose(found.solve(b), x, rtol=0, atol=1e-9 * np.abs(x).max())
    del found
    assert not list(folder.iterdir())


@installed
def test_a_wrong_solution_is_refused(monkeypatch):
    """A number of a solution of 8000 off by a thousandth of the largest."""
    solve = mumps.Mumps.solve

    def wrong(self, X):
        solve(self, X)
        X[77] += 1e-3 * np.abs(X).max()

    monkeypatch.setattr(mumps.Mumps, "solve", wrong)
    with pytest.raises(AccuracyError, match="the factor on disk does not solve its equations"):
        factorise(grid(20), "out_of_core")


@installed
def test_a_singular_matrix():
    with pytest.raises(AccuracyError, match="the 3 x 3 matrix is singular"):
        factorise(csr_array(np.ones((3, 3))), "out_of_core")


@installed
def test_it_is_chosen_where_memory_has_no_room(monkeypatch):
    """And counts the modes of the cube, ``4 sin^2(k pi / 2 (n + 1))`` summed over three k."""
    n = 24
    A = grid(n)
    double = PardisoFactor(A).forecast.memory / GIB
    monkeypatch.setattr(factor, "PARDISO", {"in_memory": PardisoFactor})
    monkeypatch.setenv(BUDGET, str(0.8 * double))
    found = factorise(A)
    assert isinstance(found, OutOfCoreFactor)
    assert "GiB of disk that are free: in double precision, on disk" in str(found.forecast)
    w2, _, counted = lowest_modes(A, csr_array(eye_array(n**3)), 7, factor=found)
    own = 4 * np.sin(np.arange(1, 4) * np.pi / (2 * (n + 1))) ** 2
    exact = np.sort((own[:, None, None] + own[:, None] + own).ravel())[:7]
    np.testing.assert_allclose(w2, exact, rtol=1e-9)
    assert "inertia" in counted


@installed
@pytest.mark.parametrize(("name", "value", "said"), [
    ("room", lambda: 1e3, "GiB of disk and .* GiB may be used .TMPDIR sets the folder.: take a coarser mesh"),
    ("available_memory", lambda: 1e3, "GiB of memory and .* GiB of disk and 9.3e-07 and"),
])  # fmt: skip
def test_no_room_is_refused_before_anything_is_written(monkeypatch, folder, name, value, said):
    monkeypatch.setattr(out_of_core, name, value)
    with pytest.raises(InputError, match=said):
        factorise(grid(12), "out_of_core")
    assert not list(folder.iterdir())


@installed
def test_a_folder_in_memory_is_refused(monkeypatch, folder):
    disks = [SimpleNamespace(mountpoint="/", fstype="ext4"), SimpleNamespace(mountpoint=str(folder), fstype="tmpfs")]
    monkeypatch.setattr(psutil, "disk_partitions", lambda **_: disks)
    with pytest.raises(InputError, match=f"has no disk: files of {folder} lie in memory, TMPDIR sets another folder"):
        factorise(grid(4), "out_of_core")


def test_without_mumps_its_name_is_said(monkeypatch):
    monkeypatch.setattr(factor, "module", lambda: None)
    with pytest.raises(NotInstalledError, match="MUMPS is not installed here: apt-get install libmumps-seq-dev"):
        factorise(grid(4), "out_of_core")


@pytest.mark.skipif(factor.library() is None, reason="SuperLU has no forecast")
def test_a_refusal_says_that_mumps_would_help(monkeypatch):
    monkeypatch.setattr(factor, "module", lambda: None)
    monkeypatch.setenv(BUDGET, "1e-4")
    with pytest.raises(InputError, match="install MUMPS, which factorises on disk .*, or give it more memory"):
        factorise(grid(12))
