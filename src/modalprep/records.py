"""Frozen records of read-only arrays: the nouns that flow through the program."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, Self

import numpy as np


def _read_only(array: np.ndarray) -> np.ndarray:
    view = array.view()
    view.flags.writeable = False
    return view


class Record:
    """Base of the frozen dataclasses: array fields cannot be written through the record.

    Use with ``@dataclass(frozen=True, eq=False, kw_only=True)``. The caller's own array stays
    writable: the record holds a read-only view of it.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, eq=False, kw_only=True)
    ... class Point(Record):
    ...     x: np.ndarray
    >>> p = Point(x=np.zeros(3))
    >>> p.x.flags.writeable
    False
    >>> p.with_(x=np.ones(3)).x.sum()
    np.float64(3.0)
    """

    def __post_init__(self) -> None:
        """Replace every array by a read-only view, also inside dictionaries."""
        for field in fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, field.name, _read_only(value))
            elif isinstance(value, dict):
                frozen = {k: _read_only(v) if isinstance(v, np.ndarray) else v for k, v in value.items()}
                object.__setattr__(self, field.name, frozen)

    def with_(self, **changes: Any) -> Self:
        """Return a copy with the named fields changed."""
        return replace(self, **changes)  # type: ignore[type-var]
