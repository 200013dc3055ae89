"""The linear algebra of a reduction with a cache: solutions of factorised matrices, modes, counts of eigenvalues.

Measured on a solid of 57 000 DOFs (20 modes): reading and assembly take 5 % of the time, so that storing the assembled
model does not pay. Factorisation and eigensolution take more than half; a factor cannot be stored, but its solutions
can, which do not depend on the number of modes.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from modalprep.linalg.algebra import DIRECT, Algebra
from modalprep.linalg.congruent import Congruent
from modalprep.linalg.factor import Factor
from modalprep.linalg.forecast import Forecast
from modalprep.linalg.modes import Modes
from modalprep.pipeline.building.cache import Cache

UNKNOWN = -1  # stored instead of None where a count is unknown


class CachedFactor:
    """A factor whose solutions are stored; the matrix is factorised only when one is missing.

    Parameters
    ----------
    cache : Cache
    A : (n, n) csr
    solver, definite
        As `factorise` takes them.
    """

    def __init__(self, cache: Cache, A: csr_array | Congruent, solver: str, definite: bool) -> None:
        if not isinstance(A, Congruent):
            A.sort_indices()  # as the factorisation does: products with A must round alike with and without the cache
        self._cache = cache
        self._arguments = (A, solver, definite)
        self.key = cache.key("factor", A, solver, definite)
        # A singular matrix is refused here, as by `factorise`.
        self.negative = _number(cache.recall(self.key, lambda: _count(self.exact.negative)))

    @cached_property
    def exact(self) -> Factor:
        """The factorisation itself."""
        return DIRECT.factorise(*self._arguments)

    @property
    def forecast(self) -> Forecast | None:
        """What the factorisation was to need, where it was made."""
        return getattr(self.exact, "forecast", None) if "exact" in self.__dict__ else None

    def release(self) -> None:
        """Free the memory of the factorisation; the next solution that is not stored computes it again."""
        if "exact" in self.__dict__:
            self.exact.release()

    def fits_twice(self) -> bool:
        """Say whether another one in double precision has room beside it."""
        return self.exact.fits_twice()

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B``."""
        return self._cache.recall(self._cache.key(self.key, B), lambda: {"X": self.exact.solve(B)})["X"]


def caching_algebra(cache: Cache | None) -> Algebra:
    """Return the linear algebra of reductions with stored results; without a cache the plain one.

    Stored solutions are bitwise identical. When fewer modes are needed than an entry has, its lowest ones are used,
    which agree with directly computed ones to the tolerance of the eigensolver.
    """
    if cache is None:
        return DIRECT

    def factorise(A: csr_array | Congruent, solver: str = "auto", definite: bool = True) -> Factor:
        return CachedFactor(cache, A, solver, definite)

    def lowest_modes(
        K: csr_array | Congruent,
        M: csr_array | Congruent,
        n: int,
        *,
        factor: Factor | None = None,
        shift: float = 0.0,
        solver: str = "auto",
    ) -> Modes:
        def compute() -> dict[str, np.ndarray]:
            exact = factor.exact if isinstance(factor, CachedFactor) else factor
            modes = DIRECT.lowest_modes(K, M, n, factor=exact, shift=shift, solver=solver)
            return {"w2": modes.w2, "phi": modes.phi, "counted": np.array(modes.counted), "requested": np.array(n)}

        entry = cache.recall(
            cache.key("modes", K, M, shift, solver), compute, lambda entry: bool(entry["requested"] >= n)
        )
        return Modes(entry["w2"][:n], entry["phi"][:, :n], str(entry["counted"]))

    def count_below(K: csr_array, M: csr_array, w2: float, solver: str = "auto") -> int | None:
        key = cache.key("count", K, M, w2, solver)
        return _number(cache.recall(key, lambda: _count(DIRECT.count_below(K, M, w2, solver))))

    return Algebra(factorise, lowest_modes, count_below)


def _count(number: int | None) -> dict[str, np.ndarray]:
    return {"number": np.array(UNKNOWN if number is None else number)}


def _number(entry: Mapping[str, np.ndarray]) -> int | None:
    number = int(entry["number"])
    return None if number == UNKNOWN else number
