"""Hundreds of modes slice by slice: a short Lanczos run around each of many shifts, counted by the inertia there.

A Lanczos basis for n modes has more than 2 n vectors, and keeping it orthogonal costs n^2 operations a DOF and
reads it from memory at each step. A slice costs a factorisation and a basis of its own. Two slices are found at a
time, each in a thread of its own, which two cores do faster than both of them one slice.

Grimes, Lewis, Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228, sections 3 and 4.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError
from modalprep.linalg.blas import deduct, inner, share_threads
from modalprep.linalg.factor import Factor
from modalprep.linalg.lanczos import block_lanczos, columns
from modalprep.linalg.pardiso import PardisoFactor
from modalprep.linalg.pencil import Pencil
from modalprep.linalg.sparse import times

AT_ONCE = 2  # slices: each has a factor and a basis
SMALLEST = 340  # modes of a slice: fewer leave Lanczos too short a run, of which some 20 blocks only get it going
BEGIN = 40  # modes of the first slice: it tells how dense they lie, and those far below a shift lose digits
BLOCK = 12  # right-hand sides at once: more take less time each, but more vectors a mode
VECTOR = 7.0  # operations a DOF and mode of a slice that keep one mode orthogonal
MANY = 2.4  # slices from which on they cost less than one run (50 000 DOFs of shell: the same CPU time near 800 modes)
OVERLAP = 12  # modes that neighbouring slices share: a repeated root may lie across the end of one
CROWDED = 3.0  # modes below a shift over those expected: more bring it back
ASTRAY = 0.08  # of half a slice: a shift further from its place is set once more
FLAT = 0.2  # of the mean distance of all modes in w: what a root that is repeated often counts as
CLOSE = 1e-3  # distance of a shift from a mode over the mean distance of modes: nearer, a factor has few digits
AGAIN = 1e-6  # product of modes found twice: new ones have 1e-10
NEIGHBOURS = 100  # modes above the end of the slice before that are made orthogonal to as many below it
WIDTH = 32  # modes that join at a time
TRIES = 4
# The slices of a pair have the same width in this power of w, so that both need about as many vectors: for 1000 modes
# of a shell 1140 and 1116. The lower one then has more modes.
GROWTH = 1.45
PLACES = 3  # of a shift: where a root is repeated often, more would bring it ever nearer to that
BACK = 0.15  # of the way to the shift: what a next try goes less far


def slice_size(factor: PardisoFactor, n_dof: int) -> int:
    """Return the modes of a slice that cost as much to keep orthogonal as a factorisation."""
    return max(SMALLEST, int(np.sqrt(factor.operations / (VECTOR * n_dof))))


class Slice(NamedTuple):
    """Modes of number `first` to `last` (counted from 0, without it), around a shift with its factor."""

    shift: float
    factor: Factor
    first: int
    last: int


@dataclass
class Slices:
    """Modes found so far, ascending and without a gap.

    Parameters
    ----------
    M : (n_dof, n_dof) csr
    pencils : list of Pencil
        Of the slices that are found at once; the first modes need none.
    n : int
        Modes wanted.
    size : int
        Modes of a slice.
    pool : Executor
    """

    M: csr_array
    pencils: list[Pencil]
    n: int
    size: int
    pool: ThreadPoolExecutor
    found: int = 0
    proven: int = 0  # so many lie below the last shift, by its inertia
    counted: dict = field(default_factory=dict)  # number of modes below a shift: the shift
    w2: np.ndarray = field(init=False)
    phi: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Reserve the arrays."""
        size = self.M.shape[0]
        width = columns(size, 2 * self.size, BLOCK)
        self.w2, self._store = np.empty(self.n), np.empty((self.n + width, size))
        self.phi = self._store.T[:, : self.n]
        self._apart = [np.empty((size, width), order="F") for _ in range(AT_ONCE - 1)]

    def rooms(self, first: int) -> list[np.ndarray]:
        """Return memory for bases (n_dof, columns) of slices, the lowest of which starts with mode number `first`.

        Its modes are found in their final place: they need not be copied, and less memory is used for the first time.
        """
        return [self._store.T[:, first:], *self._apart]

    def result(self) -> tuple[np.ndarray, np.ndarray]:
        """Return ``w^2`` and all modes (n_dof, n), and give back the memory of bases."""
        del self.phi, self._apart
        self._store.resize((self.n, self.M.shape[0]), refcheck=False)
        return self.w2, self._store.T

    def put(self, first: int, w2: np.ndarray, phi: np.ndarray) -> None:
        """Put modes from number `first` (counted from 0) on, in place of those that are there."""
        self.found = min(first + len(w2), self.n)
        self.w2[first : self.found] = w2[: self.found - first]
        if np.may_share_memory(phi, self.phi):
            return
        middle = (first + self.found) // 2
        halves = slice(first, middle), slice(middle, self.found)
        list(self.pool.map(lambda k: np.copyto(self.phi[:, k], phi[:, k.start - first : k.stop - first]), halves))

    def advance(self) -> None:
        """Find the modes around the next shifts.

        Raises
        ------
        AccuracyError
            When no shift nearby gives as many as its inertia counts.
        """
        left = self.n - self.found
        half = left / max(1, round(left / (AT_ONCE * self.size))) / AT_ONCE / 2
        for attempt in range(TRIES):
            first = self.proven if attempt else max(self.found - OVERLAP, self.proven)
            if self._around(half * (1 - BACK * attempt), first):
                return
            self.counted.clear()  # they have led there
        raise AccuracyError("a slice of the spectrum has not as many modes as its inertia counts")

    def _around(self, half: float, first: int) -> bool:
        """Find all modes from number `first` to `half` above the last of the next shifts.

        Return whether those of the first shift are as many as must be; others go in as long as they join. Known modes
        from `first` on are found again, so that a repeated root is not cut in two.
        """
        try:
            slices = self._planned(half, first)
        except AccuracyError:
            return False
        known = self.w2[first : self.found].copy(), self.phi[:, first : self.found].copy(order="F")
        runs = [
            self.pool.submit(self._modes, part, None if k else known, room)
            for k, (part, room) in enumerate(zip(slices, self.rooms(first), strict=False))
        ]
        found = [run.result() for run in runs]
        for k, (part, modes) in enumerate(zip(slices, found, strict=True)):
            if modes is None or not self._join(part, *modes, bool(k)):
                if not k:
                    self.phi[:, first : self.found] = known[1]
                return k > 0
            self.proven = part.factor.negative
        return True

    def _planned(self, half: float, first: int) -> list[Slice]:
        """Return slices of some twice `half` unknown modes each."""
        places = self._placed(half)
        ends = []
        borders = self._borders(half)[1:]
        for (_, one), (_, next_one), border in zip(places, places[1:], borders, strict=False):
            if not OVERLAP < next_one.negative - one.negative <= CROWDED * 2 * half or next_one.negative > self.n:
                break
            ends.append(int(np.clip(self._number_at(border), one.negative, next_one.negative)))
        last = self._last(places[len(ends)][1].negative, self.found + round(2 * half * (len(ends) + 1)), half)
        starts = [first, *(end - OVERLAP // 2 for end in ends)]
        ends = [*(end + OVERLAP // 2 for end in ends), last]
        return [Slice(*place, *of) for place, *of in zip(places, starts, ends, strict=False)]

    def _placed(self, half: float) -> list[tuple[float, Factor]]:
        """Return shifts amid the next slices of `2 half` unknown modes each, and the factors there.

        They are amid in w^2, so that modes at both ends converge at once.
        """
        shifts = np.zeros(AT_ONCE)
        factors = {}
        for _ in range(PLACES):
            ends = self._borders(half)
            middle = (ends[1:] + ends[:-1]) / 2
            astray = np.flatnonzero(np.abs(middle - shifts) > ASTRAY * np.diff(ends) / 2)
            shifts[astray] = middle[astray]
            for k, factor in zip(astray, self.pool.map(lambda k: self.pencils[k].at(shifts[k]), astray), strict=True):
                factors[k] = factor
                self.counted[factor.negative] = shifts[k]
            if not len(astray):
                break
        return [(float(shifts[k]), factors[k]) for k in range(AT_ONCE)]

    def _known(self) -> tuple[np.ndarray, np.ndarray]:
        """Return numbers of modes, ascending, and the w below which there are so many."""
        above = sorted((number, shift) for number, shift in self.counted.items() if number > self.found)
        numbers = np.concatenate([np.arange(1, self.found + 1), [number for number, _ in above]])
        return numbers, np.sqrt(np.abs(np.concatenate([self.w2[: self.found], [shift for _, shift in above]])))

    def _borders(self, half: float) -> np.ndarray:
        """Return where the next slices begin and end, as far as counts tell.

        The number of modes is taken to grow with w as it did last.
        """
        known, w = self._known()
        back = max(1, min(self.size // 2, known[-1] - 1))
        rate = max((w[-1] - np.interp(known[-1] - back, known, w)) / back, FLAT * w[-1] / known[-1])
        end = self.found + 2 * half * AT_ONCE
        top = np.interp(end, known, w) + rate * max(end - known[-1], 0)
        return np.linspace(w[self.found - 1] ** GROWTH, top**GROWTH, AT_ONCE + 1) ** (2 / GROWTH)

    def _number_at(self, w2: float) -> int:
        """Return how many modes are below `w2`, about."""
        known, w = self._known()
        return round(float(np.interp(np.sqrt(w2), w, known)))

    def _last(self, below: int, end: int, half: float) -> int:
        """Return the number of modes up to the end of a slice with so many below its shift, where `end` is planned."""
        if self.n - end <= OVERLAP:
            end = self.n
        above = np.clip(end - below, np.ceil(half / 2), max(np.ceil(1.5 * half), OVERLAP))
        return max(below, min(below + int(above), self.n))

    def _modes(self, part: Slice, known: tuple | None, room: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the modes of a slice, None where they are not as many as must be."""
        shift, factor, first, last = part
        if self._touches(shift, factor):
            return None
        below = factor.negative - first
        try:
            w2, phi = block_lanczos(
                factor, self.M, last - first, shift=shift, below=below, known=known, block=BLOCK, room=room
            )
        except AccuracyError:
            return None
        return (w2, phi) if np.sum(w2 < shift) == below else None

    def _join(self, part: Slice, w2: np.ndarray, phi: np.ndarray, apart: bool) -> bool:
        """Put the modes of a slice, if they are orthogonal to those before; return whether.

        Where the slice before lacks a mode, all its numbers above are too low, and one is found again. Modes of a
        slice that was found apart from the one before are taken from the widest gap on in what both have.
        """
        cut = 1 + int(np.argmax(np.diff(w2[: self.found - part.first]))) if apart else 0
        first = part.first + cut
        w2 = w2[cut:]
        phi = phi[:, cut:]
        before = self.phi[:, max(first - NEIGHBOURS, 0) : first]
        parts = [phi[:, start : start + WIDTH] for start in range(0, min(len(w2), NEIGHBOURS), WIDTH)]
        if not all(self.pool.map(self._joins, [before] * len(parts), parts)):
            return False
        self.put(first, w2, phi)
        return True

    def _joins(self, before: np.ndarray, phi: np.ndarray) -> bool:
        """Make modes orthogonal to those before; return whether they nearly were."""
        common = inner(before, times(self.M, phi))
        deduct(phi, before, common)
        return bool(np.all(np.abs(common) < AGAIN))

    @property
    def _distance(self) -> float:
        """Mean distance of the last modes."""
        back = min(self.size, self.found - 1)
        return (self.w2[self.found - 1] - self.w2[self.found - 1 - back]) / back

    def _touches(self, shift: float, factor: Factor) -> bool:
        """Whether a mode is too near to the shift, by inverse iteration."""
        x = factor.solve(self.M @ np.random.default_rng(0).standard_normal(len(self.phi)))
        return not np.linalg.norm(x) > CLOSE * self._distance * np.linalg.norm(factor.solve(self.M @ x))


def _pencils(K: csr_array, M: csr_array, factor: PardisoFactor) -> list[Pencil]:
    """Return one for each slice of a pair, analysed with as many threads as will use it: PARDISO relies on that."""
    pencil = Pencil(K, M, factor.order)
    return [pencil, *(pencil.another() for _ in range(AT_ONCE - 1))]


def sliced_modes(
    K: csr_array, M: csr_array, n: int, factor: PardisoFactor, shift: float, size: int = 0
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the n lowest ``w^2`` and M-orthonormal modes ``(n_dof, n)``; None where one run of Lanczos costs less.

    Parameters
    ----------
    K, M : csr
    n : int
    factor : PardisoFactor
        Of ``K - shift M``.
    shift : float
        (rad/s)^2, below all modes.
    size : int
        Modes of a slice; 0 chooses by the cost of a factorisation.

    Raises
    ------
    AccuracyError
        When a slice does not agree with its count.
    MemoryError
        When factors of the slices do not fit into the memory.
    """
    if not size and n < MANY * (size := slice_size(factor, K.shape[0])):
        return None
    with share_threads(AT_ONCE) as pool:
        pencils = pool.submit(_pencils, K, M, factor)
        slices = Slices(M, [], n, size, pool)
        # alone: it tells how dense they lie
        begin = min(n, BEGIN)
        room = slices.rooms(0)[0]
        slices.put(0, *block_lanczos(factor, M, begin, shift=shift, block=BLOCK, room=room))
        slices.pencils.extend(pencils.result())
        while slices.found < n:
            slices.advance()
    return slices.result()
