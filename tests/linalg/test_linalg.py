"""Factorization and modes: two solvers, one answer; results that verify themselves."""

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array

from modalprep.errors import AccuracyError
from modalprep.linalg import modes
from modalprep.linalg.factor import factorize
from modalprep.linalg.modes import lowest_modes

pytest.importorskip("pypardiso", reason="PARDISO has no wheel here")


def chain(n: int) -> tuple[csr_array, csr_array]:
    """Unit springs and masses between walls: w_k = 2 sin(k pi / (2 (n + 1)))."""
    K = diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1]).tocsr()
    return csr_array(K), csr_array(diags_array(np.ones(n)).tocsr())


def test_pardiso_and_superlu_agree(bracket_model):
    C = bracket_model.C
    A = (C.T @ (bracket_model.K + 1e9 * bracket_model.M) @ C).tocsr()
    b = np.random.default_rng(0).standard_normal((A.shape[0], 3))
    x, y = (factorize(A, solver).solve(b) for solver in ("pardiso", "superlu"))
    np.testing.assert_allclose(x, y, atol=1e-8 * np.abs(y).max())  # condition 1e8 of round-off 1e-16


def test_inertia_counts_negative_eigenvalues():
    K, M = chain(50)
    w2 = 4 * np.sin(np.arange(1, 51) * np.pi / 102) ** 2
    assert factorize((K - 0.5 * (w2[6] + w2[7]) * M).tocsr(), "pardiso").negative == 7


@pytest.mark.parametrize("n", [100, 2000])  # dense and Lanczos
def test_modes_of_a_chain(n):
    w2, phi = lowest_modes(*chain(n), 5)
    exact = 4 * np.sin(np.arange(1, 6) * np.pi / (2 * (n + 1))) ** 2
    np.testing.assert_allclose(w2, exact, rtol=1e-9)  # round-off 1e-16 of the largest, 4: 1e-10 of the smallest
    np.testing.assert_allclose(phi.T @ phi, np.eye(5), atol=1e-10)


def test_result_does_not_depend_on_the_run():
    first, second = (lowest_modes(*chain(1500), 4)[1] for _ in range(2))
    np.testing.assert_allclose(first, second, atol=1e-9)


def test_singular_matrix_is_named():
    with pytest.raises(AccuracyError, match="2 x 2 matrix is singular"):
        factorize(csr_array(np.array([[1.0, 1.0], [1.0, 1.0]])), "superlu")


def test_a_wrong_mode_does_not_pass(monkeypatch):
    monkeypatch.setattr(modes, "block_lanczos", lambda f, M, n, shift: (np.ones(n), np.eye(M.shape[0], n)))
    monkeypatch.setattr(modes, "_ritz", lambda K, M, X: (np.ones(X.shape[1]), np.eye(*X.shape)))
    monkeypatch.setattr(modes, "_refuse_missed", lambda *args: None)
    with pytest.raises(AccuracyError, match="is not accurate"):
        lowest_modes(*chain(1500), 3)
