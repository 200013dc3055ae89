"""Channels that follow from others, as stresses and recovered forces, as combinations of the columns of a row."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import scipy

EXACT = 1e-10  # of the size of the terms of a sum
MOST = 1 << 24  # numbers at once

Rows = Callable[[np.ndarray], Mapping[str, np.ndarray]]  # (nt, width) -> channels


def combinations(channels: Rows, width: int) -> tuple[dict[str, scipy.sparse.csr_array], list[str]]:
    """Return the matrix (c, width) of each channel that is linear in the row, and the names of the others.

    Parameters
    ----------
    channels : callable
        Of rows (nt, width), only those that follow from them.

    Examples
    --------
    >>> found, others = combinations(lambda rows: {"sum": rows.sum(axis=1), "size": abs(rows[:, 0])}, 3)
    >>> found["sum"].toarray(), others
    (array([[1., 1., 1.]]), ['size'])
    """
    drawn = np.random.default_rng(0).standard_normal((3, width))
    sample = np.concatenate([drawn, -drawn])  # both signs: a size is not linear
    seen = {name: values.reshape(6, -1) for name, values in channels(sample).items()}
    origin = {name: values.reshape(-1) for name, values in channels(np.zeros((1, width))).items()}
    many = max(1, MOST // max(1, width + sum(values.shape[1] for values in seen.values())))
    parts: dict[str, list] = {name: [] for name in seen}
    for first in range(0, width, many):
        unit = np.eye(min(many, width - first), width, first)
        for name, values in channels(unit).items():
            parts[name].append(scipy.sparse.csr_array(values.reshape(len(unit), -1).T))
    found = {}
    for name, blocks in parts.items():
        matrix = scipy.sparse.csr_array(scipy.sparse.hstack(blocks))
        size = np.abs(sample) @ np.abs(matrix).T
        linear = np.abs(sample @ matrix.T - seen[name]) <= EXACT * size
        if np.all(linear) and not np.any(origin[name]):
            found[name] = matrix
    return found, [name for name in parts if name not in found]
