"""Hundreds of modes slice by slice: a short Lanczos run around each of many shifts, counted by the inertia there.

A Lanczos basis for n modes has more than 2 n vectors, and keeping it orthogonal costs n^2 operations a DOF and
reads it from memory at each step. A slice costs a factorisation and a basis of its own. Two slices are found at a
time, each in a thread of its own, which two cores do faster than both of them one slice.

Grimes, Lewis, Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228, sections 3 and 4.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError
from modalprep.linalg.blas import inner, share_threads, subtract
from modalprep.linalg.factor import Factor
from modalprep.linalg.lanczos import block_lanczos
from modalprep.linalg.pencil import Pencil

AT_ONCE = 2  # slices: each has a factor and a basis
SMALLEST = 320  # modes of a slice: fewer leave Lanczos too short a run, of which some 20 blocks only get it going
BLOCK = 12  # right-hand sides at once: more take less time each, but more vectors a mode
VECTOR = 7.0  # operations a DOF and mode of a slice that keep one mode orthogonal
MANY = 2.5  # slices from which on they cost less than one run (50 000 DOFs of shell: the same CPU time near 800 modes)
OVERLAP = 12  # modes that neighbouring slices share: a repeated root may lie across the end of one
CROWDED = 3.0  # modes below a shift over those expected: more bring it back
ASTRAY = 0.25  # of half a slice: a shift further from its place is set once more
CLOSE = 1e-3  # distance of a shift from a mode over the mean distance of modes: nearer, a factor has few digits
AGAIN = 1e-6  # product of modes found twice: new ones have 1e-10
TRIES = 4
BACK = 0.15  # of the way to the shift: what a next try goes less far


def slice_size(pencil: Pencil, n_dof: int) -> int:
    """Return the modes of a slice that cost as much to keep orthogonal as a factorisation."""
    return max(SMALLEST, int(np.sqrt(pencil.operations / (VECTOR * n_dof))))


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
        Of the slices that are found at once.
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
    w2: np.ndarray = field(init=False)
    phi: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Reserve the arrays."""
        self.w2, self.phi = np.empty(self.n), np.empty((self.M.shape[0], self.n), order="F")

    def put(self, first: int, w2: np.ndarray, phi: np.ndarray) -> None:
        """Put modes from number `first` (counted from 0) on, in place of those that are there."""
        self.found = min(first + len(w2), self.n)
        self.w2[first : self.found] = w2[: self.found - first]
        self.phi[:, first : self.found] = phi[:, : self.found - first]

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
        known = self.w2[first : self.found].copy(), self.phi[:, first : self.found]
        runs = [self.pool.submit(self._modes, part, None if k else known) for k, part in enumerate(slices)]
        found = [run.result() for run in runs]
        for k, (part, modes) in enumerate(zip(slices, found, strict=True)):
            if modes is None or not self._join(part, *modes, bool(k)):
                return k > 0
            self.proven = part.factor.negative
        return True

    def _planned(self, half: float, first: int) -> list[Slice]:
        """Return slices of some twice `half` unknown modes each."""
        starts = (2 * half * np.arange(AT_ONCE)).tolist()
        places, ends = list(self.pool.map(self._next_shift, self.pencils, starts, [half] * AT_ONCE)), []
        for (_, one), (_, next_one) in pairwise(places):
            if not OVERLAP < next_one.negative - one.negative <= CROWDED * 2 * half or next_one.negative > self.n:
                break
            ends.append((one.negative + next_one.negative) // 2)
        last = self._last(places[len(ends)][1].negative, self.found + round(2 * half * (len(ends) + 1)), half)
        starts = [first, *(end - OVERLAP // 2 for end in ends)]
        ends = [*(end + OVERLAP // 2 for end in ends), last]
        return [Slice(*place, *of) for place, *of in zip(places, starts, ends, strict=False)]

    def _last(self, below: int, end: int, half: float) -> int:
        """Return the number of modes up to the end of a slice with so many below its shift, where `end` is planned."""
        if self.n - end <= OVERLAP:
            end = self.n
        above = np.clip(end - below, np.ceil(half / 2), max(np.ceil(1.5 * half), OVERLAP))
        return max(below, min(below + int(above), self.n))

    def _modes(self, part: Slice, known: tuple | None) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the modes of a slice, None where they are not as many as must be."""
        shift, factor, first, last = part
        if self._touches(shift, factor):
            return None
        below = factor.negative - first
        try:
            w2, phi = block_lanczos(factor, self.M, last - first, shift=shift, below=below, known=known, block=BLOCK)
        except AccuracyError:
            return None
        return (w2, phi) if np.sum(w2 < shift) == below else None

    def _join(self, part: Slice, w2: np.ndarray, phi: np.ndarray, apart: bool) -> bool:
        """Put the modes of a slice, if they are orthogonal to those before; return whether.

        Where the slice before lacks a mode, all its numbers above are too low, and one is found again. Modes of a
        slice that was found apart from the one before are taken from the widest gap on in what both have.
        """
        cut = 1 + int(np.argmax(np.diff(w2[: self.found - part.first]))) if apart else 0
        first, w2, phi = part.first + cut, w2[cut:], phi[:, cut:]
        before = self.phi[:, max(first - self.size, 0) : first]
        common = inner(before, self.M @ phi)
        if not np.all(np.abs(common) < AGAIN):
            return False
        self.put(first, w2, subtract(phi, before, common))
        return True

    def _next_shift(self, pencil: Pencil, start: float, half: float) -> tuple[float, Factor]:
        """Return a shift amid a slice that begins `start` unknown modes up, and the factor there.

        It is amid in w^2, so that modes at both ends converge at once. Their number is taken to grow with w as it did
        last.
        """
        w = np.sqrt(np.abs(self.w2[: self.found]))
        back = max(1, min(self.size // 2, self.found - 1))
        rate = (w[-1] - w[-1 - back]) / back
        step = np.sqrt(np.mean((w[-1] + rate * np.array([start, start + 2 * half])) ** 2)) - w[-1]
        ahead = step / rate
        for attempt in range(TRIES):
            shift = (w[-1] + step) ** 2
            factor = pencil.at(shift)
            unknown = factor.negative - self.found
            if unknown <= CROWDED * ahead and (attempt or abs(unknown - ahead) <= ASTRAY * half):
                break
            step *= min(ahead / max(unknown, 1), 2.0)
        return shift, factor

    @property
    def _distance(self) -> float:
        """Mean distance of the last modes."""
        back = min(self.size, self.found - 1)
        return (self.w2[self.found - 1] - self.w2[self.found - 1 - back]) / back

    def _touches(self, shift: float, factor: Factor) -> bool:
        """Whether a mode is too near to the shift, by inverse iteration."""
        x = factor.solve(self.M @ np.random.default_rng(0).standard_normal(len(self.phi)))
        return not np.linalg.norm(x) > CLOSE * self._distance * np.linalg.norm(factor.solve(self.M @ x))


def sliced_modes(
    K: csr_array, M: csr_array, n: int, factor: Factor, shift: float, size: int = 0
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the n lowest ``w^2`` and M-orthonormal modes ``(n_dof, n)``; None where one run of Lanczos costs less.

    Parameters
    ----------
    K, M : csr
    n : int
    factor : Factor
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
    if not size and n < MANY * SMALLEST:
        return None
    with share_threads(AT_ONCE) as pool:
        pencils = [pool.submit(Pencil, K, M, shift)]  # with as many threads as will use it: PARDISO relies on that
        if not size and n < MANY * (size := slice_size(pencils[0].result(), K.shape[0])):
            return None
        pencils += [pool.submit(Pencil, K, M, shift) for _ in range(AT_ONCE - 1)]
        slices = Slices(M, [pencil.result() for pencil in pencils], n, size, pool)
        begin = block_lanczos(factor, M, size // 2, shift=shift, block=BLOCK)  # alone: it tells how dense they lie
        slices.put(0, *begin)
        while slices.found < n:
            slices.advance()
    return slices.w2, slices.phi
