"""The factor of a matrix without rows: of a structure whose nodes are all held."""

from __future__ import annotations

import numpy as np


class EmptyFactor:
    """Solves nothing, as there is nothing to solve.

    Examples
    --------
    >>> import numpy as np
    >>> EmptyFactor().solve(np.zeros((0, 2))).shape
    (0, 2)
    """

    negative: int | None = 0

    def solve(self, B: np.ndarray) -> np.ndarray:
        """Return a copy of ``B (0,)`` or ``(0, k)``."""
        return B.copy()

    def release(self) -> None:
        """Keep nothing."""

    def fits_twice(self) -> bool:
        """It needs no room."""
        return True
