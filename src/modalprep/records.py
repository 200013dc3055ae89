"""Frozen records of read-only arrays: the nouns that flow through the program."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache
from typing import Any, Self

import numpy as np


def _read_only(array: np.ndarray) -> np.ndarray:
    if array.flags.writeable:
        array = array.view()
        array.flags.writeable = False
    return array


@cache
def _names(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


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
        for name in _names(type(self)):
            value = getattr(self, name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, name, _read_only(value))
            elif isinstance(value, dict):
                frozen = {k: _read_only(v) if isinstance(v, np.ndarray) else v for k, v in value.items()}
                object.__setattr__(self, name, frozen)

    def with_(self, **changes: Any) -> Self:
        """Return a copy with the named fields changed."""
        return replace(self, **changes)  # type: ignore[type-var]

    def _unchecked(self, **changes: Any) -> Self:
        found = object.__new__(type(self))
        vars(found).update(vars(self), **changes)
        return found
