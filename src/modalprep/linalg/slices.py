"""Hundreds of modes slice by slice: a short Lanczos run around each of many shifts, counted by the inertia there.

A Lanczos basis for n modes has more than 2 n vectors, and keeping it orthogonal costs n^2 operations a DOF and
reads it from memory at each step. A slice costs a factorisation and a basis of its own.

Grimes, Lewis, Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228, sections 3 and 4.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError
from modalprep.linalg.blas import inner
from modalprep.linalg.factor import Factor
from modalprep.linalg.lanczos import block_lanczos
from modalprep.linalg.pencil import Pencil

SMALLEST = 120  # modes of a slice: fewer leave Lanczos too short a run
VECTOR = 12.0  # operations a DOF and mode of a slice that keep one mode orthogonal
MANY = 3  # slices from which on they are worth while
OVERLAP = 12  # known modes that a slice is orthogonal to: a repeated root may lie across its end
CROWDED = 3.0  # modes below a shift over those expected: more bring it back
CLOSE = 1e-5  # distance of a shift from a mode over the mean distance of modes: nearer, a factor has few digits
AGAIN = 1e-6  # product of modes found twice: new ones have 1e-10
TRIES = 4
BACK = 0.15  # of the way to the shift: what a next try goes less far


def slice_size(pencil: Pencil, n_dof: int) -> int:
    """Return the modes of a slice that cost as much to keep orthogonal as a factorisation."""
    return max(SMALLEST, int(np.sqrt(pencil.operations / (VECTOR * n_dof))))


@dataclass
class Slices:
    """Modes found so far, ascending and without a gap.

    Parameters
    ----------
    M : (n_dof, n_dof) csr
    pencil : Pencil
    n : int
        Modes wanted.
    size : int
        Modes of a slice.
    """

    M: csr_array
    pencil: Pencil
    n: int
    size: int
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
        """Find the modes around the next shift.

        Raises
        ------
        AccuracyError
            When no shift nearby gives as many as its inertia counts.
        """
        left = self.n - self.found
        half = left / np.ceil(left / self.size) / 2
        for attempt in range(TRIES):
            first = self.proven if attempt else max(self.found - OVERLAP, self.proven)
            if self._around(half * (1 - BACK * attempt), first):
                return
        raise AccuracyError("a slice of the spectrum has not as many modes as its inertia counts")

    def _around(self, half: float, first: int) -> bool:
        """Find all modes below the next shift and `half` above it; return whether they are as many as must be.

        Known modes from number `first` on are found again, so that a repeated root is not cut in two.
        """
        try:
            shift, factor = self._next_shift(half)
            if self._touches(shift, factor):
                return False
            below, above = factor.negative - first, np.clip(self.n - factor.negative, 0, int(np.ceil(half)))
            known = self.w2[first : self.found].copy(), self.phi[:, first : self.found]
            w2, phi = block_lanczos(factor, self.M, int(below + above), shift=shift, below=below, known=known)
        except AccuracyError:
            return False
        if np.sum(w2 < shift) != below or not self._are_new(phi, first):
            return False
        self.put(first, w2, phi)
        self.proven = factor.negative
        return True

    def _are_new(self, phi: np.ndarray, first: int) -> bool:
        """Whether modes are orthogonal to those before number `first`, of which one may have been found again."""
        before = self.phi[:, max(first - self.size, 0) : first]
        return bool(np.all(np.abs(inner(before, self.M @ phi)) < AGAIN))

    def _next_shift(self, half: float) -> tuple[float, Factor]:
        """Return a shift with some `half` unknown modes below it, by the density so far, and the factor there."""
        w = np.sqrt(np.abs(self.w2[: self.found]))
        back = min(self.size, self.found - 1)
        step = half * (w[-1] - w[-1 - back]) / back
        for _ in range(TRIES):
            shift = (w[-1] + step) ** 2
            factor = self.pencil.at(shift)
            unknown = factor.negative - self.found
            if unknown <= CROWDED * half:
                break
            step *= half / unknown
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
        When a second factor does not fit into the memory.
    """
    if n < MANY * (size or SMALLEST):
        return None
    pencil = Pencil(K, M, shift)
    size = size or slice_size(pencil, K.shape[0])
    if n < MANY * size:
        return None
    slices = Slices(M, pencil, n, size)
    slices.put(0, *block_lanczos(factor, M, size, shift=shift))
    while slices.found < n:
        slices.advance()
    return slices.w2, slices.phi
