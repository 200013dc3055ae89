"""Frozen records of read-only arrays: the nouns that flow through the program."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, field, fields, replace
from functools import cache
from typing import Any, Self, TypeVar, dataclass_transform

import numpy as np

Given = TypeVar("Given")
Kept = TypeVar("Kept")
NOTHING: Any = MISSING  # as the default of a value of any type
CHANGED = "_changed"  # attribute of a record while it is made: the fields that are to be converted


def given(
    *, converter: Callable[[Given], Kept], default: Given = NOTHING, default_factory: Callable[[], Given] = NOTHING
) -> Kept:
    """Return a field that users give as one type, such as a list, and that the record keeps as another.

    ``converter(value, what)`` returns what is kept; `what` begins the sentence of an error. Type checkers know both
    types.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from modalprep.vectors import vector
    >>> @dataclass(frozen=True, eq=False, kw_only=True)
    ... class Ray(Record):
    ...     axis: np.ndarray = given(converter=vector, default=(0, 0, 1))
    >>> Ray().axis, Ray(axis=[1, 0, 0]).axis
    (array([0., 0., 1.]), array([1., 0., 0.]))
    """
    make: Any = field  # whose types know nothing of a conversion
    return make(default=default, default_factory=default_factory, metadata={"converter": converter})


def optional(convert: Callable[[Given], Kept]) -> Callable[[Given | None], Kept | None]:
    """Return a converter that leaves None as it is."""
    call: Any = convert
    return lambda value, what="": None if value is None else call(value, what)


def _read_only(array: np.ndarray) -> np.ndarray:
    if array.flags.writeable:
        array = array.view()
        array.flags.writeable = False
    return array


@cache
def _names(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


def filled(value: np.ndarray | None, what: str = "") -> np.ndarray:
    """Return the value of a field as it is: where users give None, the ``__post_init__`` of the record fills it in.

    Examples
    --------
    >>> filled(np.ones(2))
    array([1., 1.])
    """
    found: Any = value
    return found


def start(value: float | Sequence[float] | np.ndarray, what: str = "") -> float | np.ndarray:
    """Return a start value: a number, or an array of a list.

    Examples
    --------
    >>> start(0.5), start([1, 2])
    (0.5, array([1., 2.]))
    """
    return value if isinstance(value, int | float) else np.asarray(value, dtype=float)


def names(value: Iterable[str], what: str = "") -> tuple[str, ...]:
    """Return names as a tuple.

    Examples
    --------
    >>> names(["arm.root", "arm.tip"])
    ('arm.root', 'arm.tip')
    """
    return tuple(value)


def several(value: Sequence[Kept], what: str = "") -> tuple[Kept, ...]:
    """Return a list as a tuple; the record refuses what is neither.

    Examples
    --------
    >>> several([1, 2])
    (1, 2)
    """
    found: Any = tuple(value) if isinstance(value, list) else value
    return found


def by_name(value: Mapping[str, Kept], what: str = "") -> dict[str, Kept]:
    """Return a mapping as a dictionary; the record refuses what is none.

    Examples
    --------
    >>> by_name({"arm": 1})
    {'arm': 1}
    """
    found: Any = dict(value) if isinstance(value, Mapping) else value
    return found


def pair(value: Sequence[str], what: str = "") -> tuple[str, str]:
    """Return two names as a tuple; the record that keeps them counts them.

    Examples
    --------
    >>> pair(["arm.tip", "ground"])
    ('arm.tip', 'ground')
    """
    found: Any = tuple(value)
    return found


@cache
def _converters(kind: type) -> tuple[tuple[str, Callable[[Any, str], Any]], ...]:
    found = ((each.name, each.metadata.get("converter")) for each in fields(kind))
    return tuple((name, converter) for name, converter in found if converter)


@dataclass_transform(eq_default=False, kw_only_default=True, frozen_default=True, field_specifiers=(field, given))
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
        self._convert()
        for name in _names(type(self)):
            value = getattr(self, name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, name, _read_only(value))
            elif isinstance(value, dict):
                frozen = {k: _read_only(v) if isinstance(v, np.ndarray) else v for k, v in value.items()}
                object.__setattr__(self, name, frozen)
        vars(self).pop(CHANGED, None)

    def _convert(self, what: str = "") -> None:
        """Convert what is `given`; a record whose checks need the result does so first, with its name for errors."""
        own = vars(self)
        changed = own.get(CHANGED, own)
        for name, converter in _converters(type(self)):
            if name in changed:
                own[name] = converter(own[name], f"{what}{name}")
        own[CHANGED] = ()  # none is converted again

    def with_(self, **changes: Any) -> Self:
        """Return a copy with the named fields changed; the others are converted already."""
        if not changes.keys() <= set(_names(type(self))):
            return replace(self, **changes)  # type: ignore[type-var]  # which says what is not a field
        found = object.__new__(type(self))
        own = vars(self)
        vars(found).update({name: own[name] for name in _names(type(self))} | changes, **{CHANGED: changes})
        found.__post_init__()
        return found

    def _unchecked(self, **changes: Any) -> Self:
        found = object.__new__(type(self))
        vars(found).update(vars(self), **changes)
        return found
