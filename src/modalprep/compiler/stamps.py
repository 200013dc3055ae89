"""Fingerprints of what compiled code depends on."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

STAMP = "modalprep_stamp"  # attribute of functions: fingerprint of all that their code depends on
NO_KERNELS = ("math", "numpy", "scipy")  # modules
NUMERIC = (int, float)  # also bool, and numpy's float64
COMPILER = [*map(str, sorted(Path(__file__).parent.glob("*_code.py"))), str(Path(__file__).with_name("linking.py"))]


Key = tuple[str, str, str]
KERNELS: dict[Key, Any] = {}  # which cached code may call: those of `jit`
LISTENERS: list[Callable[[str], None]] = []  # told the module of each kernel that numba compiles


class Stamped:
    """What stands for a function in compiled code: `py_func`."""

    py_func: Callable


def stamp_of(function: Callable) -> str:
    """Fingerprint of all that the compiled code depends on; kept on the function for its callers."""
    parts = [_file(name) for name in COMPILER]
    parts += _known(function)
    if code := getattr(function, "__code__", None):
        parts += [_file(code.co_filename), repr(_own(function, code))]
    stamp = hashlib.sha256("|".join(parts).encode()).hexdigest()
    if code:
        setattr(function, STAMP, stamp)
    return stamp


def key_of(function: Any) -> Key:
    """Return what tells a function from all others: module, name and fingerprint."""
    return function.__module__, function.__qualname__, getattr(function, STAMP)


def _own(function: Callable, code: CodeType) -> list:
    """What tells functions of one name apart, as two lambdas in one line, whose bytecode no other Python has."""
    constants = [x for x in code.co_consts if not isinstance(x, CodeType)]
    without_name = [code.co_code, constants] if "<lambda>" in function.__qualname__ or not _is_file(code) else []
    enclosed = [cell.cell_contents for cell in function.__closure__ or ()]
    return [code.co_firstlineno, *without_name, [_fingerprint(x) or x for x in enclosed]]


def _is_file(code: CodeType) -> bool:
    return Path(code.co_filename).is_file()


def _known(function: Callable) -> Iterator[str]:
    """Yield the fingerprints of all constants and compiled functions of the function's file so far, and of its modules.

    Not only those that it names: functions that stand below it in the file, which it may call, are not known yet, but
    all that they use of other files is imported.
    """
    for value in getattr(function, "__globals__", {}).values():
        if isinstance(value, ModuleType):
            yield from _fingerprints(value)
        elif stamp := _fingerprint(value):
            yield stamp
        elif _constant(value):
            yield repr(value)


@lru_cache
def _fingerprints(module: ModuleType) -> tuple[str, ...]:
    if module.__name__ in NO_KERNELS:
        return ()
    return tuple(stamp for value in vars(module).values() if (stamp := _fingerprint(value)))


def _fingerprint(value: Any) -> str | None:
    """Return the fingerprint of a compiled function, None of anything else."""
    compiled = value.py_func if isinstance(value, Stamped) else value
    return getattr(compiled, STAMP, None) if isinstance(compiled, FunctionType) else None


def _constant(value: Any) -> bool:
    """Whether compiled code takes a global in by its value: a number, or tuples of them."""
    return isinstance(value, NUMERIC) or (isinstance(value, tuple) and all(map(_constant, value)))


@lru_cache
def _file(name: str) -> str:
    path = Path(name)
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else name
