"""Block Lanczos: repeated roots, massless DOFs, restarts, rigid motions, and the count of what must be there."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import block_diag, csr_array, diags_array, eye_array, kron
from stiffened import Stiffened, assembled, skin_and_beams

from modalprep.errors import AccuracyError
from modalprep.examples import cantilever_model
from modalprep.linalg import modes
from modalprep.linalg.factor import factorise
from modalprep.linalg.lanczos import block_lanczos
from modalprep.linalg.modes import count_below, lowest_modes
from modalprep.linalg.unique import unique_modes
from modalprep.reduction.clamped import clamp

N = 12


def membrane(n=N, dimension=3):
    """Laplacian of a cube of n^3 points: eigenvalues ``sum 4 sin^2(i pi / 2(n+1))``, many of them repeated."""
    line = diags_array([np.full(n, 2.0), np.full(n - 1, -1.0), np.full(n - 1, -1.0)], offsets=[0, 1, -1])
    one = eye_array(n)
    factors = [[line if k == d else one for k in range(dimension)] for d in range(dimension)]
    K = sum(kron(kron(*f[:2]), f[2]) if dimension == 3 else kron(*f) for f in factors)
    single = 4 * np.sin(np.arange(1, n + 1) * np.pi / (2 * (n + 1))) ** 2
    exact = np.sort(np.add.outer(np.add.outer(single, single), single).ravel())
    return csr_array(K), csr_array(eye_array(n**dimension)), exact


@pytest.mark.parametrize("solver", ["auto", "superlu"])
def test_repeated_roots_are_all_found(solver):
    K, M, exact = membrane()
    w2, phi, _ = lowest_modes(K, M, 40, solver=solver)  # groups of 1, 3, 6: cut within one
    np.testing.assert_allclose(w2, exact[:40], rtol=1e-10)
    np.testing.assert_allclose(phi.T @ phi, np.eye(40), atol=1e-10)


@pytest.mark.parametrize("block", [3, 7])
def test_a_block_narrower_than_a_repeated_root(block):
    """Round-off brings the copies in, later: the answer must not depend on the block."""
    K, M, exact = membrane()
    w2, _ = block_lanczos(factorise(K), M, 20, shift=0.0, block=block)
    np.testing.assert_allclose(w2, exact[:20], rtol=1e-9)


def test_thick_restart_gives_the_same():
    K, M, exact = membrane()
    w2, phi = block_lanczos(factorise(K), M, 20, shift=0.0, block=4, capacity=44)
    np.testing.assert_allclose(w2, exact[:20], rtol=1e-10)
    np.testing.assert_allclose(phi.T @ phi, np.eye(20), atol=1e-10)


def test_massless_dofs():
    """Static condensation of the massless half is the exact answer."""
    rng = np.random.default_rng(1)
    n = 700
    A = diags_array([np.full(n, 4.0), np.full(n - 1, -1.0), np.full(n - 1, -1.0)], offsets=[0, 1, -1]).tocsr()
    mass = np.zeros(n)
    heavy = np.sort(rng.permutation(n)[:60])
    mass[heavy] = rng.uniform(1, 2, 60)
    w2, _, _ = lowest_modes(csr_array(A), csr_array(diags_array(mass)), 30)
    light = np.setdiff1d(np.arange(n), heavy)
    full = A.toarray()
    condensed = full[np.ix_(heavy, heavy)] - full[np.ix_(heavy, light)] @ np.linalg.solve(
        full[np.ix_(light, light)], full[np.ix_(light, heavy)]
    )
    np.testing.assert_allclose(w2, eigh(condensed, np.diag(mass[heavy]), eigvals_only=True)[:30], rtol=1e-9)
    every, _, _ = lowest_modes(csr_array(A), csr_array(diags_array(mass)), 500)  # no more than have mass
    assert len(every) == 60


def test_rigid_motions_by_a_shift():
    K, M, _ = membrane()
    laplacian = K - diags_array(np.asarray(K.sum(axis=1)).ravel())  # free: one constant vector without strain
    w2, phi, _ = lowest_modes(csr_array(laplacian), M, 4, shift=-0.1)
    assert abs(w2[0]) < 1e-12
    np.testing.assert_allclose(phi[:, 0], N ** (-1.5), rtol=1e-9)
    np.testing.assert_allclose(w2[1:], 4 * np.sin(np.pi / (2 * N)) ** 2, rtol=1e-9)  # free ends: i pi / 2n, three ways


def test_count_below_is_that_of_the_closed_form():
    K, M, exact = membrane()
    for cut in (0.1, 0.5, 3.1, 6.01):
        assert count_below(K, M, cut) == np.sum(exact < cut)
        assert count_below(K, M, cut, "superlu") == np.sum(exact < cut)


def test_superlu_counts_the_modes_of_a_beam():
    """Its rotations are so stiff that SuperLU exchanges rows near most frequencies."""
    held = clamp(cantilever_model(20))
    exact = eigh(held.K_ii.toarray(), held.M_ii.toarray(), eigvals_only=True)
    for k in range(0, len(exact), 7):
        assert count_below(held.K_ii, held.M_ii, 0.9999999 * exact[k], "superlu") == k
        assert count_below(held.K_ii, held.M_ii, 1.0000001 * exact[k], "superlu") == k + 1


def test_signs_are_not_counted_where_pivots_are_inaccurate():
    """Without exchanges the second pivot is round-off over 1e-20: of the four signs that it may have none is told."""
    A = csr_array(np.array([[1e-20, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]))
    assert factorise(A, "superlu", definite=False).negative is None


def test_a_missed_mode_is_noticed(monkeypatch):
    K, M, _ = membrane()
    skip = lambda f, M, n, shift, **_: tuple(a[..., 1:] for a in block_lanczos(f, M, n + 1, shift=shift))  # noqa: E731
    monkeypatch.setattr(modes, "block_lanczos", skip)
    with pytest.raises(AccuracyError, match=r"modes were found below .* Hz, where there are"):
        lowest_modes(K, M, 10)


def test_a_missed_mode_is_fetched(monkeypatch):
    """The second run starts orthogonal to the modes of the first and brings what the count says is missing."""
    K, M, exact = membrane()
    whole = block_lanczos(factorise(K), M, 11, shift=0.0)
    first = [tuple(np.delete(a, 4, axis=-1) for a in whole)]
    real = lambda f, M, n, shift, known, block: (  # noqa: E731
        first.pop() if known is None else block_lanczos(f, M, n, shift=shift, known=known)
    )
    monkeypatch.setattr(modes, "block_lanczos", real)
    w2, phi, _ = lowest_modes(K, M, 10)
    np.testing.assert_allclose(w2, exact[:10], rtol=1e-10)
    np.testing.assert_allclose(phi.T @ phi, np.eye(10), atol=1e-10)


def test_fewer_modes_than_asked():
    """A singular M with less rank than its diagonal shows is said, not looped over."""
    K, _, _ = membrane()
    two = np.zeros((N**3, 2))
    two[::3, 0] = two[1::3, 1] = 1.0
    M = csr_array(two @ two.T)
    with pytest.raises(AccuracyError, match="modes were found"):
        lowest_modes(K, M, 10)


def test_parts_of_very_different_stiffness():
    """A soft spring beside a part 1e10 times as stiff: pivots must not be perturbed."""
    K, _, exact = membrane()
    both = csr_array(block_diag([K * 1e10, K]))
    w2, _, _ = lowest_modes(both, csr_array(eye_array(2 * N**3)), 10)
    np.testing.assert_allclose(w2, exact[:10], rtol=1e-9)


def test_modes_of_a_repeated_root_do_not_depend_on_the_way():
    """Two solvers with other start vectors give one basis of each six-fold root, whose rotation is open."""
    K, M, exact = membrane()
    n = 20  # groups of 1, 3, 3, 3, 1, 6, 3
    assert np.sum(np.diff(exact[: n + 1]) < 1e-9) > 10
    _, phi, _ = lowest_modes(K, M, n)
    w2, dense = eigh(K.toarray(), subset_by_index=(0, n - 1))
    np.testing.assert_allclose(unique_modes(w2, dense, K), phi, atol=1e-8)  # the spaces agree to the residual's 1e-10
    rotation = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    turned = dense.copy()
    turned[:, 1:4] = dense[:, 1:4] @ rotation
    np.testing.assert_allclose(unique_modes(w2, turned, K), phi, atol=1e-8)


@pytest.mark.parametrize(("share", "seen"), [(2e-8, True), (1e-10, False)])
def test_two_modes_that_are_not_orthogonal_are_noticed(share, seen):
    K, M, _ = membrane()
    w2, phi = eigh(K.toarray(), subset_by_index=(0, 39))
    phi[:, 30] += share * phi[:, 3]
    ratio, _, gram = modes._worst(K, M, w2, phi)
    assert ratio < modes.POOR
    assert (gram > modes.ORTHOGONALITY) == seen
    assert not seen or gram == pytest.approx(share, rel=1e-6)  # by all products then, not by combinations


@pytest.mark.parametrize(("kind", "membrane", "end"), [("triangle", "cst", "rbe2"), ("quad", "opt", "rbe3")])
def test_a_light_bar_with_a_heavy_end(kind, membrane, end):
    """Of the first block next to nothing is left beside the six motions of the mass: modes had errors of 6e-5."""
    bar = Stiffened(along="", width=0.04, thickness=0.005)
    model = assembled(bar, *skin_and_beams(bar, kind, (32, 4), membrane), end)
    K, M = ((model.C.T @ A @ model.C).tocsr() for A in (model.K, model.M))
    inner = np.setdiff1d(np.arange(K.shape[0]), np.searchsorted(model.free, model.interfaces[0].dofs))
    K, M = K[inner][:, inner], M[inner][:, inner]
    flexibility = eigh(M.toarray(), K.toarray(), eigvals_only=True)[::-1][:12]
    for block in (2, 6, 12):
        w2, phi = block_lanczos(factorise(K), M, 12, shift=0.0, block=block)
        np.testing.assert_allclose(w2, 1 / flexibility, rtol=1e-9)  # the round-off of both
        rest = np.abs(K @ phi - (M @ phi) * w2).max() / np.abs(K @ phi).max()
        assert rest < 1e-8
