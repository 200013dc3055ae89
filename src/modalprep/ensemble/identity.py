"""Fingerprints of a system, its cases and its options, which tell whose results a file holds."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from types import CodeType, FunctionType
from typing import Any

import numpy as np


def fingerprint(*values: Any) -> str:
    """Return the SHA-256 of records, arrays, numbers, texts and functions, the same in every process.

    Examples
    --------
    >>> fingerprint({"a": np.zeros(2)}) == fingerprint({"a": np.zeros(2)}) != fingerprint({"a": np.ones(2)})
    True
    >>> fingerprint(lambda t: t + 1) == fingerprint(lambda t: t + 1) != fingerprint(lambda t: t + 2)
    True
    """
    total = hashlib.sha256()
    for part in _parts(values, ()):
        total.update(part)
    return total.hexdigest()


def _parts(value: Any, above: tuple[int, ...]) -> Iterator[bytes]:
    """Yield the bytes that tell a value from others; `above` are the objects that hold it."""
    if id(value) in above:
        return
    yield f"{type(value).__name__}:".encode()
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        yield f"{value.dtype.str}{value.shape}".encode() + value.tobytes()
    elif isinstance(value, (type(None), bool, int, float, complex, str, bytes, np.generic, type)):
        yield repr(value).encode() + b";"
    else:
        for inner in _inside(value):
            yield from _parts(inner, (*above, id(value)))


def _inside(value: Any) -> Any:
    """Return what an object is made of."""
    if isinstance(value, Mapping):
        return [each for item in value.items() for each in item]
    if isinstance(value, (list, tuple, set, frozenset, np.ndarray)):
        return list(value)
    if is_dataclass(value):
        return [getattr(value, field.name) for field in fields(value) if field.init]
    if isinstance(value, FunctionType):
        cells = [cell.cell_contents for cell in value.__closure__ or ()]
        return [value.__module__, value.__code__, value.__defaults__, value.__kwdefaults__, cells]
    if isinstance(value, CodeType):
        return [value.co_code, value.co_names, value.co_consts]
    own = getattr(value, "__func__", None), getattr(value, "__self__", None)
    return own if any(each is not None for each in own) else vars(value) if hasattr(value, "__dict__") else [str(value)]
