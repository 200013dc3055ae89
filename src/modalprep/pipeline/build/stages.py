"""The linear algebra of a reduction, remembered by a cache: solutions of factorised matrices, modes, counts.

Measured on a solid of 57 000 DOFs (20 modes): reading and assembling is 5 % of the work, so that the assembled model
is not worth its room; factorising and finding modes is more than half, and a factor cannot be stored. What is stored
are its solutions, which do not depend on the number of modes.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from modalprep.linalg.algebra import DIRECT, Algebra
from modalprep.linalg.factor import Factor
from modalprep.linalg.modes import Modes
from modalprep.pipeline.build.cache import Cache

UNKNOWN = -1  # stands for None where a count is stored


class RememberedFactor:
    """A factor whose solutions are stored; the matrix is factorised only when one is missing.

    Parameters
    ----------
    cache : Cache
    A : (n, n) csr
    solver, definite
        As `factorise` takes them.
    """

    def __init__(self, cache: Cache, A: csr_array, solver: str, definite: bool) -> None:
        A.sort_indices()  # as factorising does: products with A are to round the same way without it
        self._cache, self._arguments = cache, (A, solver, definite)
        self.key = cache.key("factor", A, solver, definite)
        # A singular matrix is refused here, as by `factorise`.
        self.negative = _number(cache.recall(self.key, lambda: _count(self.exact.negative)))

    @cached_property
    def exact(self) -> Factor:
        """The factor itself."""
        return DIRECT.factorise(*self._arguments)

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return ``A^-1 B``."""
        return self._cache.recall(self._cache.key(self.key, B), lambda: {"X": self.exact.solve(B)})["X"]


def remembering(cache: Cache | None) -> Algebra:
    """Return the algebra of reductions that stores its results; without a cache the plain one.

    Solutions come back to the last bit. Fewer modes than an entry has are its lowest ones, which differ from those
    computed alone by the tolerance of the eigensolver.
    """
    if cache is None:
        return DIRECT

    def factorise(A: csr_array, solver: str = "auto", definite: bool = True) -> Factor:
        return RememberedFactor(cache, A, solver, definite)

    def lowest_modes(
        K: csr_array, M: csr_array, n: int, *, factor: Factor | None = None, shift: float = 0.0, solver: str = "auto"
    ) -> Modes:
        def compute() -> dict[str, np.ndarray]:
            exact = factor.exact if isinstance(factor, RememberedFactor) else factor
            found = DIRECT.lowest_modes(K, M, n, factor=exact, shift=shift, solver=solver)
            return {"w2": found.w2, "phi": found.phi, "counted": np.array(found.counted), "asked": np.array(n)}

        found = cache.recall(cache.key("modes", K, M, shift, solver), compute, lambda entry: entry["asked"] >= n)
        return Modes(found["w2"][:n], found["phi"][:, :n], str(found["counted"]))

    def count_below(K: csr_array, M: csr_array, w2: float, solver: str = "auto") -> int | None:
        key = cache.key("count", K, M, w2, solver)
        return _number(cache.recall(key, lambda: _count(DIRECT.count_below(K, M, w2, solver))))

    return Algebra(factorise, lowest_modes, count_below)


def _count(number: int | None) -> dict[str, np.ndarray]:
    return {"number": np.array(UNKNOWN if number is None else number)}


def _number(found: Any) -> int | None:
    number = int(found["number"])
    return None if number == UNKNOWN else number
