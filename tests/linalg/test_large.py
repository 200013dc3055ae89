"""Large factors: their forecast, their refusal, single precision, and what is claimed of the number of modes."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from bad.good import SOLID
from scipy.sparse import csr_array, diags_array, eye_array, kron
from structured import box

import modalprep as mp
from modalprep.cli import main
from modalprep.errors import InputError
from modalprep.linalg import congruent, factor, forecast, pardiso
from modalprep.linalg.factor import factorise
from modalprep.linalg.forecast import GIB, forecasts_to
from modalprep.linalg.memory import BUDGET, available_memory
from modalprep.linalg.mixed import MixedFactor
from modalprep.linalg.mumps import module
from modalprep.linalg.onemkl import library
from modalprep.linalg.pardiso import PardisoFactor
from modalprep.pipeline.building.build import build_body
from modalprep.pipeline.building.cache import Cache
from modalprep.pipeline.console import Reporter
from modalprep.reduction import clamped
from modalprep.reduction.clamped import clamp
from modalprep.reduction.craig_bampton import craig_bampton
from modalprep.verdicts.notes import kind_of

ON_DISK = pytest.mark.skipif(module() is None, reason="python-mumps is not installed")
pytestmark = pytest.mark.skipif(library() is None, reason="PARDISO has no wheel here")


def grid(n: int) -> csr_array:
    """A cube of n^3 nodes of unit springs between walls."""
    line, one = diags_array([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1]), eye_array(n)
    plane = kron(line, one) + kron(one, line)
    return csr_array(kron(plane, one) + kron(kron(one, one), line))


@pytest.fixture(scope="module")
def beam() -> mp.fe.FEModel:
    """A beam of bricks between two interfaces, 4 x 4 x 12."""
    points, cells = box("hexahedron", (4, 4, 12), (0.1, 0.13, 0.6))
    ends = [np.flatnonzero(np.isclose(points[:, 2], z)) for z in (0.0, 0.6)]
    groups = {"body": {"hexahedron": np.arange(len(cells))}}
    groups |= {name: {"vertex": np.arange(25) + 25 * k} for k, name in enumerate(("root", "tip"))}
    cells = {"hexahedron": cells, "vertex": np.concatenate(ends)[:, None]}
    mesh = mp.fe.Mesh(points=points, cells=cells, groups=groups)
    steel = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
    interfaces = {name: mp.Interface(group=name) for name in ("root", "tip")}
    return mp.assemble(mesh, {"body": mp.Solid(material=steel)}, interfaces)


@pytest.mark.parametrize("solver", ["in_memory", "single", pytest.param("out_of_core", marks=ON_DISK)])
@pytest.mark.parametrize("twice", [clamped.TWICE, 0], ids=["stored", "not stored"])
def test_a_reduction_is_the_same_however_it_is_computed(beam, monkeypatch, solver, twice):
    """In double and single precision; with interior matrices that are stored and that are not."""
    exact = craig_bampton(beam, modes=8, solver="superlu")
    monkeypatch.setattr(clamped, "TWICE", twice)
    monkeypatch.setattr(clamped, "BYTES", 1.0)  # right-hand sides a few at a time
    found = craig_bampton(beam, modes=8, solver=solver)
    np.testing.assert_allclose(found.frequency, exact.frequency, rtol=1e-9)  # residuals of 1e-9, as verified
    for name in ("static", "inertial", "loads"):
        one = getattr(found, name)
        other = getattr(exact, name)
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-8 * np.abs(other).max(), err_msg=name)
    assert [note for note in found.notes if "counted by the inertia" in note] == list(exact.notes)[:1]
    assert any("in single precision" in note for note in found.notes) == (solver == "single")


def test_modes_that_no_factor_counts_are_not_claimed(beam, monkeypatch):
    """Memory for the factor in single precision only: the modes are the same, and a warning says what is open."""
    K = clamp(beam).K_ii
    exact = craig_bampton(beam, modes=8).frequency
    between = 0.75 * PardisoFactor(K).forecast.memory / GIB
    monkeypatch.setattr("modalprep.reduction.craig_bampton.COPIES", 0)  # memory that is kept for the basis
    monkeypatch.setenv(BUDGET, str(between))
    monkeypatch.setattr(factor, "module", lambda: None)  # MUMPS would count them on disk
    found = craig_bampton(beam, modes=8)
    np.testing.assert_allclose(found.frequency, exact, rtol=1e-9)
    assert not any("were found" in note for note in found.notes)
    warnings = [note for note in found.notes if kind_of(note) == "warnings"]
    assert any("none is missing is not proven" in warning for warning in warnings)


def test_a_factor_that_was_released_is_computed_again(monkeypatch):
    """And refused by a sentence where other work has taken its memory meanwhile."""
    A = grid(12)
    b = np.random.default_rng(0).standard_normal((12**3, 3))
    for kind in (PardisoFactor, MixedFactor):
        found = kind(A)
        found.release()
        np.testing.assert_allclose(A @ found.solve(b), b, rtol=0, atol=1e-11)  # round-off of a condition of 100
        found.release()
        with monkeypatch.context() as patch:
            patch.setenv(BUDGET, "1e-5")
            with pytest.raises(InputError, match="1728 x 1728 matrix needs .* and 1e-05 GiB may be used: take"):
                found.solve(b)


def test_two_factors_with_inertia():
    """w^2 of the cube are sums of ``4 sin^2(k pi / 2 (n + 1))``."""
    n = 12
    own = 4 * np.sin(np.arange(1, n + 1) * np.pi / (2 * (n + 1))) ** 2
    below = np.sum(own[:, None, None] + own[:, None] + own < 2.0)
    for shift, exact in ((0.0, 0), (2.0, below)):
        assert factorise((grid(n) - shift * eye_array(n**3)).tocsr(), "in_memory", definite=False).negative == exact


@pytest.mark.parametrize("n", [16, 24])
def test_the_operations_of_the_forecast(n):
    """Those of a dense factor of the largest separator, of n^2 unknowns, are fewer; a hundred of them are more."""
    forecast = PardisoFactor(grid(n)).forecast
    assert n**6 / 3 < forecast.operations < 100 * n**6
    assert 0 < forecast.seconds < 60


def test_a_large_factor_is_announced_before_it_is_computed(monkeypatch):
    """With numbers; a small one is not."""
    said = []
    with forecasts_to(said.append):
        factorise(grid(8))
        assert not said
        monkeypatch.setattr(forecast, "LARGE", -1.0)
        monkeypatch.setattr(pardiso.PardisoFactor, "_call", before_factorisation(said))
        factorise(grid(8))
    assert re.fullmatch(
        r"the factor needs [\d.e+-]+ of the .* GiB of memory that are free: in double .*, about \d+ s", said[0]
    )


def before_factorisation(said):
    """The calls of a factor, of which the factorisation itself must find the forecast said."""
    call = PardisoFactor._call

    def checked(self, phase, *arguments):
        assert phase != pardiso.FACTORISE or len(said) == 1
        return call(self, phase, *arguments)

    return checked


def test_memory_forecast_of_a_factor_in_memory():
    """Resident memory grows by what was said, in a process of its own."""
    code = (
        "import psutil, numpy as np, test_large\n"
        "from modalprep.linalg.pardiso import PardisoFactor\n"
        "PardisoFactor(test_large.grid(6))\n"
        "A = test_large.grid(30)\n"
        "before = psutil.Process().memory_info().rss\n"
        "F = PardisoFactor(A)\n"
        "print((psutil.Process().memory_info().rss - before) / F.forecast.memory)\n"
    )
    paths = os.pathsep.join([str(Path(__file__).parent), str(Path(__file__).parents[1]), *sys.path])
    done = subprocess.run([sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": paths}, capture_output=True)
    assert 0.6 < float(done.stdout) < 1.4, done.stderr  # the matrix besides; arrays that the library keeps for later


def test_the_refusal_names_what_is_missing(monkeypatch):
    monkeypatch.setenv(BUDGET, "1e-4")
    with pytest.raises(InputError) as caught:
        factorise(grid(12))
    for part in ("1728 x 1728", "in double precision", "in single precision", "0.0001 GiB may be used", "coarser"):
        assert part in str(caught.value)


def test_pipeline_refuses_a_factor_without_room(tmp_path, project, monkeypatch, capsys):
    """Exit code 2, one sentence with numbers and what to do, and no body."""
    file = bracket(tmp_path, project, "auto")
    monkeypatch.setenv(BUDGET, "0.02")  # GiB; in single precision 0.03 are needed
    monkeypatch.setattr(factor, "module", lambda: None)
    assert main(["run", str(file)]) == 2
    error = capsys.readouterr().err
    for part in ("in double precision", "in single precision", "GiB may be used: take a coarser mesh", BUDGET):
        assert part in " ".join(error.split())
    assert "Traceback" not in error
    assert not list(tmp_path.rglob("*.h5"))


@pytest.mark.parametrize("solver", ["single", "superlu"])
def test_pipeline_takes_the_solver(tmp_path, project, monkeypatch, capsys, solver):
    """With the cache of its stages, and matrices that are not stored; what is not proven is said then too."""
    monkeypatch.setattr(clamped, "TWICE", 0)
    monkeypatch.setattr(forecast, "LARGE", 1e8)
    monkeypatch.setattr(factor, "module", lambda: None)  # MUMPS would count the modes on disk
    file = bracket(tmp_path, project, solver)
    if solver == "single":
        monkeypatch.setenv(BUDGET, "0.045")  # GiB: 0.01 for the basis, 0.03 in single precision; 0.046 in double
    cache = Cache(tmp_path / "cache")
    first, again = (build_body(file, tmp_path / str(k), Reporter(), cache).body for k in range(2))
    np.testing.assert_array_equal(first.frequency, again.frequency)
    assert ("GiB of memory that are free" in capsys.readouterr().out) == (solver != "superlu")
    for body in (first, again):
        assert any("not proven" in note for note in body.notes) == (solver == "single")


def bracket(folder: Path, project: Path, solver: str) -> Path:
    """The pipeline file of the solid bracket."""
    mesh = (project / "meshes" / "bracket.msh").as_posix()
    text = SOLID.replace("bracket.msh", mesh).replace("modes = 2", f'modes = 2\nsolver = "{solver}"')
    (folder / "bracket.toml").write_text(text)
    return folder / "bracket.toml"


def test_limits_of_control_groups_count(monkeypatch, tmp_path):
    """A container with 300 of its 1000 MB used, of which 100 are files that it has read."""
    from modalprep.linalg import memory

    for name, text in (("max", "1000000000"), ("current", "300000000"), ("stat", "inactive_file 100000000\n")):
        (tmp_path / f"memory.{name}").write_text(text)
    assert list(memory._left(tmp_path, tmp_path, "memory.max", "memory.current")) == [8e8]
    monkeypatch.setattr(memory, "_left_to_groups", lambda: iter([1000.0]))
    assert available_memory() == 900.0


@pytest.mark.parametrize("s", [0.0, 0.7])
def test_matrix_that_is_not_stored_is_the_one_stored(monkeypatch, s):
    """C^T (A - s B) C, made of a few rows at a time, against dense products; |A| |x| bounds A x row by row."""
    monkeypatch.setattr(congruent, "ROWS", 3)
    rng = np.random.default_rng(0)
    A, B = (csr_array(G + G.T) for G in rng.standard_normal((2, 11, 11)))
    C = csr_array(rng.standard_normal((11, 8)) * (rng.random((11, 8)) < 0.3))
    X = rng.standard_normal((8, 5))
    found = congruent.shifted(congruent.Congruent(A, C), congruent.Congruent(B, C), s)
    dense = C.T @ (A.toarray() - s * B.toarray()) @ C
    close = {"rtol": 0, "atol": 1e-13}  # sums of some hundred terms of order 1
    np.testing.assert_allclose(found.tocsr().toarray(), dense, **close)
    np.testing.assert_allclose(found.diagonal(), np.diag(dense), **close)
    np.testing.assert_allclose(found @ X, dense @ X, **close)
    np.testing.assert_allclose(congruent.bound(found, X), np.abs(dense) @ np.abs(X), **close)
