"""The costly steps of linear algebra that a reduction asks for, so that a caller may remember what they return."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from modalprep.linalg.factor import Factor, factorise
from modalprep.linalg.modes import Modes, count_below, lowest_modes


@dataclass(frozen=True)
class Algebra:
    """Functions called like `factorise`, `lowest_modes` and `count_below`, by default these.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.sparse import csr_array
    >>> DIRECT.factorise(csr_array(np.eye(2) * 4.0)).solve(np.ones(2))
    array([0.25, 0.25])
    """

    factorise: Callable[..., Factor] = factorise
    lowest_modes: Callable[..., Modes] = lowest_modes
    count_below: Callable[..., int | None] = count_below


DIRECT = Algebra()
