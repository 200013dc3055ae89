"""Many modes slice by slice: repeated roots across the ends, shifts on modes, modes that a slice has missed."""

import tracemalloc
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.sparse import block_diag, csr_array, diags_array, eye_array, kron

from modalprep.errors import AccuracyError
from modalprep.linalg import modes, slices
from modalprep.linalg.factor import factorise
from modalprep.linalg.lanczos import block_lanczos
from modalprep.linalg.modes import lowest_modes
from modalprep.linalg.pardiso import library
from modalprep.linalg.pencil import Pencil
from modalprep.linalg.slices import sliced_modes

pytestmark = pytest.mark.skipif(library() is None, reason="PARDISO has no wheel here")

N, SIZE = 34, 30  # nodes a side of the square; modes of a slice


def square(n=N):
    """Membrane of n^2 points, mass between neighbours too: the closed form of its matrices' eigenvalues, ascending."""
    line = diags_array([np.full(n, 2.0), np.full(n - 1, -1.0), np.full(n - 1, -1.0)], offsets=[0, 1, -1])
    K = kron(line, eye_array(n)) + kron(eye_array(n), line)
    M = eye_array(n * n) - K / 12.0
    single = 4 * np.sin(np.arange(1, n + 1) * np.pi / (2 * (n + 1))) ** 2
    k = np.add.outer(single, single).ravel()
    return csr_array(K), csr_array(M), np.sort(k / (1 - k / 12))


def check(found, exact, n):
    w2, phi, M = *found, square()[1]
    np.testing.assert_allclose(w2, exact[:n], rtol=1e-10)  # residuals of 1e-10 enter squared; round-off of K
    np.testing.assert_allclose(phi.T @ (M @ phi), np.eye(n), atol=1e-10)


def by_slices(n, size=SIZE):
    K, M, _ = square()
    return sliced_modes(K, M, n, factorise(K), 0.0, size)


def test_closed_form_with_pairs_of_equal_roots():
    check(by_slices(200), square()[2], 200)


def test_equal_parts_repeat_each_root_more_often_than_slices_overlap():
    """Each root fourteen times or twice that: no slice ends between two roots, and the inertia counts all copies."""
    K, M, exact = square(12)
    copies = 14
    K, M = (csr_array(block_diag([A] * copies)) for A in (K, M))
    w2, phi = sliced_modes(K, M, 140, factorise(K), 0.0, 42)
    np.testing.assert_allclose(w2, np.repeat(exact, copies)[:140], rtol=1e-10)
    np.testing.assert_allclose(phi.T @ (M @ phi), np.eye(140), atol=1e-10)


def test_a_shift_on_a_mode_is_moved(monkeypatch):
    exact = square()[2]
    tried, used, place = [], [], slices.Slices._placed

    def onto_a_mode(self, half):
        places = place(self, half)
        if self.found not in tried:
            places = [(exact[factor.negative], factor) for _, factor in places]
            places = [(shift, pencil.at(shift)) for (shift, _), pencil in zip(places, self.pencils, strict=True)]
        tried.append(self.found)
        return places

    def far_from_modes(*arguments, **options):
        used.append(options["shift"])
        return block_lanczos(*arguments, **options)

    monkeypatch.setattr(slices.Slices, "_placed", onto_a_mode)
    monkeypatch.setattr(slices, "block_lanczos", far_from_modes)
    check(by_slices(150), exact, 150)
    assert np.abs(np.subtract.outer(used, exact)).min() > 5e-6  # modes are some 0.01 apart, `CLOSE` is 1e-3 of that


@pytest.mark.parametrize("place", [2, SIZE // 2 - 2])  # far below the overlap, and inside
def test_a_mode_that_a_slice_has_missed_is_found_by_the_next(monkeypatch, place):
    _, _, exact = square()
    runs = []

    def skip_one(*arguments, **options):
        runs.append(1)
        found = block_lanczos(*arguments, **options)
        return found if len(runs) > 1 else tuple(np.delete(part, place, axis=-1) for part in found)

    monkeypatch.setattr(slices, "block_lanczos", skip_one)
    check(by_slices(150), exact, 150)


def test_a_slice_does_not_join_one_below_it_that_lacks_a_mode(monkeypatch):
    missed = []

    def skip_one(*arguments, **options):
        found = block_lanczos(*arguments, **options)
        if missed or options.get("known") is None:  # only the lower of two slices knows modes
            return found
        missed.append(found[0][options["below"] + 3])  # above its shift, whose inertia does not count it
        return tuple(np.delete(part, options["below"] + 3, axis=-1) for part in found)

    monkeypatch.setattr(slices, "block_lanczos", skip_one)
    check(by_slices(200), square()[2], 200)
    assert missed


def test_slices_that_never_agree_with_their_count(monkeypatch):
    def skip_one(*arguments, **options):
        return tuple(part[..., 1:] for part in block_lanczos(*arguments, **options))

    monkeypatch.setattr(slices, "block_lanczos", skip_one)
    with pytest.raises(AccuracyError, match="not as many modes as its inertia counts"):
        by_slices(150)
    K, M, exact = square()
    monkeypatch.setattr(slices, "SMALLEST", SIZE)
    np.testing.assert_allclose(lowest_modes(K, M, 200).w2, exact[:200], rtol=1e-10)  # one run of Lanczos then


def test_lowest_modes_takes_slices_for_many(monkeypatch):
    K, M, exact = square()
    taken = []  # six slices are many
    monkeypatch.setattr(slices, "SMALLEST", SIZE)
    monkeypatch.setattr(modes, "sliced_modes", lambda *given: taken.append(sliced_modes(*given)) or taken[-1])
    for n in (70, 225):
        found = lowest_modes(K, M, n)
        np.testing.assert_allclose(found.w2, exact[:n], rtol=1e-10)
        assert found.counted == "counted by the inertia of K - w^2 M"
    assert taken[0] is None
    assert len(taken[1][0]) == 225


def test_a_body_with_rigid_motions(monkeypatch):
    """Fourteen free squares have fourteen constant vectors without strain, below the first shift."""
    n, copies = 12, 14
    K, _, _ = square(n)
    K = K - diags_array(np.asarray(K.sum(axis=1)).ravel())
    single = 4 * np.sin(np.arange(n) * np.pi / (2 * n)) ** 2  # free ends
    exact = np.repeat(np.sort(np.add.outer(single, single).ravel()), copies)
    K, M = csr_array(block_diag([K] * copies)), csr_array(eye_array(copies * n * n))
    w2, _ = sliced_modes(K, M, 105, factorise((K + 0.01 * M).tocsr()), -0.01, 42)
    np.testing.assert_allclose(w2, exact[:105], rtol=1e-10, atol=1e-12)


class Counted:
    """In place of a pencil: the number of modes ``w_k = k^(1/power)`` below a shift."""

    def __init__(self, power, shifts):
        self.power, self.shifts = power, shifts

    def at(self, shift):
        self.shifts.append(shift)
        self.negative = int(np.ceil(np.sqrt(shift) ** self.power)) - 1
        return self


@pytest.mark.parametrize(("power", "factors"), [(1.0, 2), (2.0, 4)])  # of plates and membranes
def test_shifts_lie_amid_their_slices_in_w2(power, factors):
    """Those of a plate are right at once, those of a membrane when they have been set once more."""
    found, half, exact, shifts = 100, 30, np.arange(1.0, 401.0) ** (2 / power), []
    with ThreadPoolExecutor(1) as pool:
        part = slices.Slices(csr_array((1, 1)), [Counted(power, shifts) for _ in range(2)], 400, 60, pool)
        part.put(0, exact[:found], np.zeros((1, found)))
        first, second = part._planned(half, found)
    assert len(shifts) == factors
    border = np.mean(exact[[99, 219]] ** (slices.GROWTH / 2)) ** (2 / slices.GROWTH)  # of one width in that power of w
    for one, ends in ((first, (exact[99], border)), (second, (border, exact[219]))):
        assert abs(one.shift - np.mean(ends)) < slices.ASTRAY * np.ptp(ends) / 2
    assert abs(first.last - slices.OVERLAP // 2 - np.sum(exact < border)) <= 1
    assert second.first == first.last - slices.OVERLAP
    assert second.last == 220


def test_less_memory_than_one_basis():
    """One basis has some 2 n vectors beside the n modes; slices have the modes and 4 to 6 of their own size."""
    K, M, _ = square()
    factor, n = factorise(K), 240
    peak = {}
    for name, call in (
        ("slices", lambda: sliced_modes(K, M, n, factor, 0.0, 30)),
        ("one", lambda: block_lanczos(factor, M, n, shift=0.0)),
    ):
        tracemalloc.start()
        call()
        peak[name] = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak["slices"] < 0.5 * peak["one"]


def test_factors_of_a_pencil_are_those_of_the_matrices():
    K, M, exact = square()
    pencil, b = Pencil(K, M, factorise(K).order), np.random.default_rng(0).standard_normal(len(exact))
    for shift in (exact[:2].mean(), 0.3, 0.0):
        x = factorise((K - shift * M).tocsr(), definite=False).solve(b)
        factor = pencil.at(shift)
        np.testing.assert_allclose(factor.solve(b), x, atol=1e-9 * np.abs(x).max())
        assert factor.negative == np.sum(exact < shift)


def test_another_pencil_keeps_its_own_factor():
    K, M, exact = square()
    one = Pencil(K, M, factorise(K).order)
    low, high = one.at(0.05), one.another().at(1.0)
    b = np.ones(len(exact))
    for shift, factor in ((0.05, low), (1.0, high)):
        assert factor.negative == np.sum(exact < shift)
        x = factor.solve(b)
        np.testing.assert_allclose((K - shift * M) @ x, b, atol=1e-9)  # solutions have sizes up to some 1e2
