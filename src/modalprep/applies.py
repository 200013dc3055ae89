"""Keys that apply only beside others: a table of rules for each record, and one walk that refuses what has no effect.

A record or a table of a pipeline file lists its rules in its class attribute ``applies``. A key that keeps its default
value says nothing, and is never refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import MISSING, fields
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from modalprep.errors import InputError

_refused = ContextVar("refused", default=True)


class Rule(NamedTuple):
    """When some keys of a record have an effect.

    Attributes
    ----------
    keys : tuple of str
        A dot leads into a table inside the record, as in ``start.angle``.
    needs : tuple of str
        Other keys, of which one at least must be given.
    among : tuple
        Values, of which one of those other keys must have one; empty: any value will do.
    beside : tuple of str
        Other keys, of which none may be given.
    advice : str
        What to do instead of leaving the key out.
    """

    keys: tuple[str, ...]
    needs: tuple[str, ...] = ()
    among: tuple[Any, ...] = ()
    beside: tuple[str, ...] = ()
    advice: str = ""

    def unmet(self, record: Any) -> str:
        """Return why the keys have no effect in a record; empty where they have."""
        for other in self.beside:
            if is_given(record, other):
                return f"beside {other!r}; {self.advice or 'leave one of them out'}"
        if not self.needs:
            return ""
        if not self.among:
            missing = not any(is_given(record, other) for other in self.needs)
            return f"without {_listed(self.needs)}; {self.advice or 'give it too, or leave both out'}" * missing
        found = [getattr(record, other) for other in self.needs]
        if any(value in self.among or (_several(value) and set(value) & set(self.among)) for value in found):
            return ""
        here = " and ".join(f"{other} = {value!r}" for other, value in zip(self.needs, found, strict=True))
        return f"where {here}; {self.advice or f'it belongs to {_listed(self.among)}, so leave it out'}"


def refuse_idle(record: Any, what: str = "") -> None:
    """Raise an `InputError` for a key that has no effect; `what` starts the message.

    Examples
    --------
    >>> from typing import ClassVar
    >>> from dataclasses import dataclass
    >>> @dataclass
    ... class Sheet:
    ...     thickness: float | None = None
    ...     plies: tuple = ()
    ...     applies: ClassVar = (Rule(("thickness",), beside=("plies",)),)
    >>> refuse_idle(Sheet(thickness=1.0))
    >>> refuse_idle(Sheet(thickness=1.0, plies=(0.5, 0.5)), "sheet 'skin': ")
    Traceback (most recent call last):
    modalprep.errors.InputError: sheet 'skin': 'thickness' has no effect beside 'plies'; leave one of them out
    """
    for rule in record.applies if _refused.get() else ():
        why = rule.unmet(record)
        for key in rule.keys if why else ():
            if _changed(record, key):
                raise InputError(f"{what}{key!r} has no effect {why}")


@contextmanager
def idle_allowed(allowed: bool) -> Iterator[None]:
    """Let records have idle keys meanwhile: a case of an ensemble may have no stiffness where others have."""
    token = _refused.set(not allowed)
    try:
        yield
    finally:
        _refused.reset(token)


def is_given(record: Any, key: str) -> bool:
    """Whether a key is there: another value than the default, or in a table of a file any value.

    Examples
    --------
    >>> is_given(Rule(("a",)), "keys"), is_given(Rule(("a",)), "advice")
    (True, False)
    """
    first, _, rest = key.partition(".")
    if rest:
        inside = getattr(record, first)
        return inside is not None and is_given(inside, rest)
    return key in getattr(record, "model_fields_set", ()) or _changed(record, key)


def _changed(record: Any, key: str) -> bool:
    first, _, rest = key.partition(".")
    value = getattr(record, first)
    if rest:
        return value is not None and _changed(value, rest)
    return _plain(value) != _defaults(type(record)).get(first, MISSING)


@cache
def _defaults(kind: type) -> dict[str, Any]:
    """Return the defaults of a class by field."""
    if hasattr(kind, "model_fields"):
        found = {name: field.get_default(call_default_factory=True) for name, field in kind.model_fields.items()}
    elif hasattr(kind, "_field_defaults"):
        found = kind._field_defaults
    else:
        made = {field.name: field.default_factory for field in fields(kind) if field.default_factory is not MISSING}
        found = {field.name: field.default for field in fields(kind)} | {name: make() for name, make in made.items()}
    return {name: _plain(value) for name, value in found.items()}


def _plain(value: Any) -> Any:
    """Return a value that can be compared: arrays and tuples as lists."""
    return value.tolist() if isinstance(value, np.ndarray) else list(value) if isinstance(value, tuple) else value


def _several(value: Any) -> bool:
    return isinstance(value, list | tuple)


def _listed(names: Iterable[Any]) -> str:
    return " or ".join(map(repr, names))
