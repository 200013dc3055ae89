"""Factorization and modes: two solvers, one answer; results that verify themselves."""

import gc
import os
import subprocess
import sys

import numpy as np
import pytest
from compare import assert_close
from scipy.sparse import csr_array, diags_array

import modalprep as mp
from modalprep.errors import AccuracyError, InputError
from modalprep.linalg import blas, factor, modes
from modalprep.linalg.blas import add_inner_alone, inner, product, subtract
from modalprep.linalg.factor import factorise
from modalprep.linalg.memory import available_memory
from modalprep.linalg.mixed import MixedFactor
from modalprep.linalg.modes import count_below, lowest_modes
from modalprep.linalg.onemkl import library
from modalprep.linalg.pardiso import PardisoFactor
from modalprep.reduction.clamped import clamp

pytestmark = pytest.mark.skipif(library() is None, reason="PARDISO has no wheel here")


def chain(n: int) -> tuple[csr_array, csr_array]:
    """Unit springs and masses between walls: w_k = 2 sin(k pi / (2 (n + 1)))."""
    K = diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1]).tocsr()
    return csr_array(K), csr_array(diags_array(np.ones(n)).tocsr())


def test_pardiso_and_superlu_agree(bracket_model):
    C = bracket_model.C
    A = (C.T @ (bracket_model.K + 1e9 * bracket_model.M) @ C).tocsr()
    b = np.random.default_rng(0).standard_normal((A.shape[0], 3))
    x, y = (factorise(A, solver).solve(b) for solver in ("in_memory", "superlu"))
    np.testing.assert_allclose(x, y, atol=1e-8 * np.abs(y).max())  # condition 1e8 of round-off 1e-16


@pytest.mark.parametrize("solver", ["in_memory", "superlu"])
def test_no_right_hand_side(solver):
    """Reductions without static responses have none, which ended in PARDISO error -1."""
    assert factorise(chain(3)[0], solver).solve(np.zeros((3, 0))).shape == (3, 0)


@pytest.mark.parametrize("solver", ["in_memory", "superlu"])
@pytest.mark.parametrize("soft", [1e-6, 1e-9, 1e-12])
def test_a_stiff_spring_on_a_soft_one(solver, soft):
    """``[[1, -1], [-1, 1 + soft]]``: the second pivot is `soft`, the inverse ``[[1 + soft, 1], [1, 1]] / soft``.

    PARDISO's default raises pivots below 1e-8 to that: the spring of 1e-9 would have 1e-8.
    """
    A = csr_array(np.array([[1.0, -1.0], [-1.0, 1.0 + soft]]))
    exact = np.ones(2) / (A[1, 1] - 1.0)  # the sum itself is rounded
    np.testing.assert_allclose(factorise(A, solver).solve(np.array([0.0, 1.0])), exact, rtol=1e-3)  # eps / soft = 2e-4


def test_thin_shells_between_thick_ones():
    """Cells of 0.1 mm and 200 mm at random: their bending stiffness differs by 8e9. Both solvers find the same modes.

    Residuals of PARDISO were 1e3 to 7e4 times what is allowed, and the lowest mode was missing.
    """
    x, y = np.meshgrid(np.linspace(0, 20.0, 25), np.linspace(0, 10.0, 17), indexing="ij")
    n = np.arange(x.size).reshape(x.shape)
    quads = np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], axis=-1).reshape(-1, 4)
    thick = np.random.default_rng(0).integers(0, 2, len(quads))
    groups = {name: {"quad": np.flatnonzero(thick == k)} for k, name in enumerate(("thin", "thick"))}
    mesh = mp.fe.Mesh(
        points=np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), cells={"quad": quads}, groups=groups
    )
    alloy = mp.Material(E=7e10, nu=0.3, rho=2700.0)
    sections = {name: mp.Shell(material=alloy, thickness=t) for name, t in (("thin", 1e-4), ("thick", 0.2))}
    edge = mp.Interface(box=((0, 0, 0), (0, 10, 0)))
    held = clamp(mp.assemble(mesh, sections, {"root": edge}))
    for modes_wanted in (2, 6, 10):
        found = lowest_modes(held.K_ii, held.M_ii, modes_wanted, solver="in_memory").w2
        exact = lowest_modes(held.K_ii, held.M_ii, modes_wanted, solver="superlu").w2
        np.testing.assert_allclose(found, exact, rtol=1e-3)  # round-off of K over that of the soft cells, 8e9 eps


def test_inertia_counts_negative_eigenvalues():
    K, M = chain(50)
    w2 = 4 * np.sin(np.arange(1, 51) * np.pi / 102) ** 2
    assert factorise((K - 0.5 * (w2[6] + w2[7]) * M).tocsr(), "in_memory").negative == 7


@pytest.mark.parametrize("n", [100, 2000])  # dense and Lanczos
def test_modes_of_a_chain(n):
    w2, phi, _ = lowest_modes(*chain(n), 5)
    exact = 4 * np.sin(np.arange(1, 6) * np.pi / (2 * (n + 1))) ** 2
    np.testing.assert_allclose(w2, exact, rtol=1e-9)  # round-off 1e-16 of the largest, 4: 1e-10 of the smallest
    np.testing.assert_allclose(phi.T @ phi, np.eye(5), atol=1e-10)


def test_result_does_not_depend_on_the_run():
    first, second = (lowest_modes(*chain(1500), 4)[1] for _ in range(2))
    np.testing.assert_allclose(first, second, atol=1e-9)


def test_singular_matrix_is_named():
    with pytest.raises(AccuracyError, match="2 x 2 matrix is singular"):
        factorise(csr_array(np.array([[1.0, 1.0], [1.0, 1.0]])), "superlu")


def test_a_wrong_mode_does_not_pass(monkeypatch):
    monkeypatch.setattr(modes, "block_lanczos", lambda f, M, n, shift, **_: (np.ones(n), np.eye(M.shape[0], n)))
    monkeypatch.setattr(modes, "_ritz", lambda K, M, X: (np.ones(X.shape[1]), np.eye(*X.shape)))
    monkeypatch.setattr(modes, "count_below", lambda *args: None)
    with pytest.raises(AccuracyError, match="is not accurate"):
        lowest_modes(*chain(1500), 3)


@pytest.fixture
def small_memory(monkeypatch):
    """Memory for a factor in single precision, not for one in double; and no MUMPS, which would take the disk."""
    monkeypatch.setattr(factor, "module", lambda: None)

    def set_to(gigabytes: float) -> None:
        monkeypatch.setenv("MODALPREP_MEMORY", str(gigabytes))

    return set_to


def test_single_precision_where_double_does_not_fit(bracket_model, small_memory):
    """The memory that double precision needs is known before it is taken; the answers keep their digits."""
    C = bracket_model.C
    A = (C.T @ (bracket_model.K + 1e9 * bracket_model.M) @ C).tocsr()
    b = np.random.default_rng(0).standard_normal((A.shape[0], 3))
    b[:, 1] = 0.0
    exact = factorise(A).solve(b)
    small_memory(_needed(A) * 0.9)
    mixed = factorise(A)
    assert isinstance(mixed, MixedFactor)
    np.testing.assert_allclose(mixed.solve(b), exact, atol=1e-8 * np.abs(exact).max())  # as between two factors
    np.testing.assert_allclose(mixed.solve(b[:, 0]), exact[:, 0], atol=1e-8 * np.abs(exact).max())


def test_modes_in_single_precision(bracket_model, small_memory):
    held = clamp(bracket_model)
    exact, _, _ = lowest_modes(held.K_ii, held.M_ii, 12)
    small_memory(_needed(held.K_ii) * 0.9)
    w2, _, counted = lowest_modes(held.K_ii, held.M_ii, 12)
    np.testing.assert_allclose(w2, exact, rtol=1e-9)  # both verified to residuals of 1e-7, squared in w2
    assert counted == ""
    assert count_below(held.K_ii, held.M_ii, 2 * w2[-1]) is None


def test_a_factor_beyond_all_memory_is_refused_before_it_starts(small_memory):
    small_memory(1e-5)
    with pytest.raises(
        InputError, match=r"GiB of memory in double precision and 1e-05 GiB may be used.*: take a coarser mesh"
    ):
        factorise(chain(2000)[0])


def test_a_memory_that_is_no_number(monkeypatch):
    monkeypatch.setenv("MODALPREP_MEMORY", "lots")
    with pytest.raises(InputError, match="MODALPREP_MEMORY = 'lots' must be a positive number"):
        available_memory()


def _needed(A) -> float:
    """GiB of the factor in double precision."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MODALPREP_MEMORY", "1e-9")
        with pytest.raises(MemoryError) as caught:
            PardisoFactor(A)
    return caught.value.args[0] / 2**30


@pytest.mark.parametrize("seed", range(10))
def test_all_modes_over_nine_decades_of_stiffness(seed):
    """The eigenvalues that the matrices were made of, to the round-off of K relative to the lowest."""
    rng = np.random.default_rng(seed)
    w2 = np.sort(10.0 ** rng.uniform(2, 11, 30))
    inverse = np.linalg.inv(rng.standard_normal((30, 30)) * 10.0 ** rng.uniform(-1, 1, 30)[:, None])
    K, M = (inverse.T @ np.diag(values) @ inverse for values in (w2, np.ones(30)))
    modes = lowest_modes(csr_array((K + K.T) / 2), csr_array((M + M.T) / 2), 30)
    assert_close(modes.w2, w2, 1e-4)  # the matrices themselves are known to 1e-16 of their largest entries


def test_library_is_found_without_a_search_of_the_disk():
    code = (
        "import glob\ndef search(*args, **options): raise SystemExit('searched')\nglob.glob = search\n"
        "from modalprep.linalg.onemkl import library\nprint(library()._name)"
    )
    clean = {name: value for name, value in os.environ.items() if name != "PYPARDISO_MKL_RT"}
    done = subprocess.run([sys.executable, "-c", code], env=clean, capture_output=True, text=True)
    assert "mkl_rt" in done.stdout, done.stderr


@pytest.mark.skipif(not os.path.isfile("/proc/self/maps"), reason="the list of loaded libraries is elsewhere here")
@pytest.mark.parametrize(("asked", "milliseconds"), [(None, "5"), ("77", "77")])
def test_idle_threads_of_openmp_leave_the_cores_soon_unless_the_user_asks_otherwise(asked, milliseconds):
    code = (
        "import ctypes, numpy as np\nfrom scipy.sparse import csr_array\n"
        "from modalprep.linalg.pardiso import PardisoFactor\n"
        "PardisoFactor(csr_array(np.diag([2.0, 4.0]))).solve(np.ones(2))\n"
        "[path] = {line.split()[-1] for line in open('/proc/self/maps') if 'libiomp5' in line}\n"
        "print(ctypes.CDLL(path).kmp_get_blocktime())"
    )
    clean = {name: value for name, value in os.environ.items() if name != "KMP_BLOCKTIME"}
    wanted = {} if asked is None else {"KMP_BLOCKTIME": asked}
    done = subprocess.run([sys.executable, "-c", code], env=clean | wanted, capture_output=True, text=True)
    assert done.stdout.strip() == milliseconds, done.stderr


@pytest.mark.skipif(not os.path.isdir("/dev/shm"), reason="shared memory is elsewhere here")
def test_an_ended_process_of_the_same_number_left_an_empty_registration():
    """OpenMP reads the file that is there: a bus error."""
    code = (
        "import os\nopen(f'/dev/shm/__KMP_REGISTERED_LIB_{os.getpid()}_{os.getuid()}', 'w').close()\n"
        "import numpy as np\nfrom scipy.sparse import csr_array\nfrom modalprep.linalg.pardiso import PardisoFactor\n"
        "print(PardisoFactor(csr_array(np.diag([2.0, 4.0]))).solve(np.ones(2)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "[0.5  0.25]\n", (done.returncode, done.stderr)


def _stored(rng: np.random.Generator, rows: int, columns: int) -> list[np.ndarray]:
    """One matrix by rows, by columns, as parts of larger ones, backwards and without a stride."""
    A, large = rng.standard_normal((rows, columns)), np.zeros((rows + 3, columns + 2))
    large[1:-2, 1:-1] = A
    by_columns = np.asfortranarray(large)
    same = np.broadcast_to(A[:1], A.shape)
    return [A, np.asfortranarray(A), large[1:-2, 1:-1], by_columns[1:-2, 1:-1], A[:, ::-1], same]


@pytest.mark.parametrize(("n", "m", "k"), [(7, 3, 2), (7, 1, 1), (1, 2, 3), (1, 1, 1), (5, 0, 2), (5, 2, 0)])
def test_products_of_matrices_however_they_are_stored(n, m, k):
    """Second implementation: NumPy's products. Sums of up to seven terms of size one keep 14 digits."""
    rng = np.random.default_rng(0)
    for A in _stored(rng, n, m):
        for B in _stored(rng, n, k):
            np.testing.assert_allclose(inner(A, B), A.T @ B, rtol=0, atol=1e-14)
            total = np.ones((m, k))
            add_inner_alone(A, B, total)
            np.testing.assert_allclose(total, 1 + A.T @ B, rtol=0, atol=1e-14)
        for B in _stored(rng, m, k) if m else [np.zeros((0, k))]:
            np.testing.assert_allclose(product(A, B), A @ B, rtol=0, atol=1e-14)
            for W in _stored(rng, n, k):
                np.testing.assert_allclose(subtract(W, A, B), W - A @ B, rtol=0, atol=1e-14)


def test_deductions_piece_by_piece(monkeypatch):
    """Second implementation: NumPy's product. Sums of seventy terms of size one keep 13 digits."""
    monkeypatch.setattr(blas, "ROWS", 100)
    rng = np.random.default_rng(0)
    B = rng.standard_normal((70, 5))
    for A in _stored(rng, 250, 70):
        for W in _stored(rng, 250, 5):
            np.testing.assert_allclose(subtract(W, A, B), W - A @ B, rtol=0, atol=1e-13)


def test_arrays_are_free_as_soon_as_the_library_has_used_them():
    K, _ = chain(50)
    factorise(K)  # which imports what it needs
    gc.disable()  # it would free what refers to itself
    try:
        before = len(gc.get_objects())
        for _ in range(100):
            product(np.ones((50, 20)), factorise(K).solve(np.ones((50, 20))).T @ np.ones((50, 3)))
        assert len(gc.get_objects()) < before + 100
    finally:
        gc.enable()
