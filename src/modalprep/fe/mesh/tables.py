"""Tables that grow row by row or by many rows at once, and the rows of labels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

SPREAD = 8  # times as many as there are labels may a list of all numbers have


class Table(Sequence[Any]):
    """Rows of equal width.

    Examples
    --------
    >>> table = Table(2)
    >>> table.append([3, 4])
    >>> _ = table.extend(np.array([[5, 6], [7, 8]]))
    >>> len(table), table[1], np.array(table).shape
    (3, [5, 6], (3, 2))
    """

    def __init__(self, width: int, dtype: type = int) -> None:
        self._rows = np.empty((16, width), dtype=dtype)
        self._count = 0

    def append(self, row: Sequence[float] | np.ndarray) -> None:
        """Append one row."""
        self._grow(1)
        self._rows[self._count] = row
        self._count += 1

    def extend(self, rows: np.ndarray) -> range:
        """Append rows (k, width), and return which they are; the first ones may stay the same array, uncopied."""
        if not self._count and rows.dtype == self._rows.dtype and rows.flags.owndata:
            self._rows = rows
            self._count = len(rows)
            return range(self._count)
        self._grow(len(rows))
        first = self._count
        self._count += len(rows)
        self._rows[first : self._count] = rows
        return range(first, self._count)

    def _grow(self, more: int) -> None:
        needed = self._count + more
        if needed > len(self._rows):
            rows = np.empty((max(needed, len(self._rows) * 3 // 2), self._rows.shape[1]), dtype=self._rows.dtype)
            rows[: self._count] = self._rows[: self._count]
            self._rows = rows

    def __len__(self) -> int:
        """Count the rows."""
        return self._count

    def __getitem__(self, k: Any) -> Any:
        """Return a row: whole numbers as a list, others as an array."""
        row = self.rows[k]
        return row.tolist() if row.dtype.kind == "i" else row

    def __setitem__(self, k: int, row: Sequence[float] | np.ndarray) -> None:
        """Replace a row."""
        self.rows[k] = row

    def __iter__(self) -> Iterator:
        """Yield the rows."""
        return iter(self.rows.tolist() if self.rows.dtype.kind == "i" else self.rows)

    def __array__(self, dtype: type | None = None, copy: bool | None = None) -> np.ndarray:
        """Return all rows."""
        return np.array(self.rows, dtype=dtype)

    @property
    def rows(self) -> np.ndarray:
        """All rows (n, width)."""
        return self._rows[: self._count]


class Lookup:
    """The indices of labels in an array of them, each there once.

    Examples
    --------
    >>> Lookup(np.array([7, 3, 9]))(np.array([[3, 4], [9, 7]]))
    array([[ 1, -1],
           [ 2,  0]])
    """

    def __init__(self, labels: np.ndarray) -> None:
        self._dense = bool(len(labels)) and 0 <= labels.min() and labels.max() < SPREAD * len(labels)
        self._order = np.argsort(labels) if not self._dense else np.full(labels.max() + 1, -1)
        if self._dense:
            self._order[labels] = np.arange(len(labels))
        self._sorted = labels[self._order] if not self._dense else labels[:0]

    def __call__(self, wanted: np.ndarray) -> np.ndarray:
        """Return the index of each label, -1 of one that is not there."""
        if self._dense:
            inside = (wanted >= 0) & (wanted < len(self._order))
            return np.where(inside, self._order[np.where(inside, wanted, 0)], -1)
        if not len(self._sorted):
            return np.full(np.shape(wanted), -1)
        at = np.minimum(np.searchsorted(self._sorted, wanted), len(self._sorted) - 1)
        return np.where(self._sorted[at] == wanted, self._order[at], -1)
