"""The stated error of a reduction against the true one, from dense matrices with every mode (benchmarks)."""

import runpy

import numpy as np
import pytest
from size import FULL, some

import modalprep as mp
from modalprep.linalg.harmonic import compliance, damped_response


@pytest.fixture(scope="module")
def benchmark(project):
    return runpy.run_path(str(project / "benchmarks" / "reduction_error.py"))


def test_the_true_error_is_within_twice_the_stated_one(benchmark, project):
    """Over a fine grid and at every resonance; halfway between resonances the cap seemed 20 times as accurate."""
    names = some(["cap between two held edges", "plate held at a corner", *benchmark["BODIES"]], 2)
    page = (project / "docs" / "reference" / "measured.md").read_text()
    for row in benchmark["rows"](list(dict.fromkeys(names)), 4000 if FULL else 400):
        *_, stated, true = row
        assert 0.5 < true / stated < 2, row
        if FULL:
            assert benchmark["line"](*row) in page


def test_the_cap_is_as_wrong_as_it_is(benchmark):
    """Eight modes of a cap between held edges: 0.40 at 620 Hz, of which points between resonances saw 0.018."""
    share, reduce = benchmark["REDUCTIONS"]["8 modes"]
    model = benchmark["BODIES"]["cap between two held edges"]()
    reduction = reduce(model)
    found = mp.reduction.reduction_error(model, reduction, share * reduction.table.frequency[7])
    assert found.dynamic.max() == pytest.approx(0.40, abs=0.01)
    assert found.worst_at == pytest.approx(620, abs=2)


def test_the_series_is_the_direct_solution(benchmark):
    """With modes to 1.5 times the frequency, against a dense complex solution; 1e-8 is round-off."""
    model = benchmark["BODIES"]["plate"]()
    rows = np.setdiff1d(np.arange(len(model.free)), np.searchsorted(model.free, model.interfaces[0].dofs))
    C = model.C[:, rows].tocsr()
    K, M = ((C.T @ A @ C).tocsr() for A in (model.K, model.M))
    factor, loss = mp.linalg.factorise(K), 0.02
    w2, Phi, _ = mp.linalg.lowest_modes(K, M, 12)
    F = np.random.default_rng(1).normal(size=(K.shape[0], 3))
    omega = np.sqrt(w2[-1]) / 1.5
    exact = np.linalg.solve(K.toarray() * (1 + 1j * loss) - omega**2 * M.toarray(), F.astype(complex))
    found = damped_response(M, w2, Phi, F, factor.solve, omega, loss)
    assert np.abs(found - exact).max() < 1e-8 * np.abs(exact).max()
    whole = compliance(K, M, w2, Phi, F, factor.solve, omega)
    assert whole.values(np.array([omega]), loss)[0] == pytest.approx(F.T @ exact, rel=1e-8)
    few = whole.rest[:2]
    short = type(whole)(whole.w2, whole.a, few)
    off = np.abs(np.diag(short.values(np.array([omega]), 0.0)[0] - whole.values(np.array([omega]), 0.0)[0]))
    assert np.all(off <= short.remainder(np.array([omega]))[0])


def test_the_damping_must_be_positive(benchmark):
    model = benchmark["BODIES"]["beam"]()
    with pytest.raises(mp.InputError, match="must be positive"):
        mp.reduction.reduction_error(model, mp.craig_bampton(model, modes=4), 10.0, damping=0.0)
