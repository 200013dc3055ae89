"""The library of compiled kernels that the package brings, if it does: `build` writes it.

Its functions have names that say all on which they depend: a kernel and its fingerprint, and the types of arguments.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import sys
from collections.abc import Callable, Iterable
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

from modalprep.compiler.stamps import Stamped, key_of

FOLDER = Path(__file__).parents[1] / "compiled"
SUFFIX = {"win32": ".dll", "darwin": ".dylib"}  # of libraries; .so elsewhere
V3 = {"avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave"}  # flags in /proc/cpuinfo
V4 = V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
LEVELS = {"v4": V4, "v3": V3, "v1": set[str]()}  # what a processor must have for a library, the fastest first
PYTHON = (
    "PyFloat_FromDouble",
    "PyLong_FromLongLong",
    "PyBool_FromLong",
    "PyTuple_New",
    "PyTuple_SetItem",
    "PyTuple_GetItem",
    "PyFloat_AsDouble",
    "PyNumber_AsSsize_t",
    "PyObject_IsTrue",
    "PyObject_GetBuffer",
    "PyBuffer_Release",
    "PyErr_Occurred",
    "PyErr_SetString",
    "PyEval_SaveThread",
    "PyEval_RestoreThread",
    "Py_IncRef",
)
METH_FASTCALL = 0x80


class _Method(ctypes.Structure):
    _fields_ = (("name", ctypes.c_char_p), ("call", ctypes.c_void_p), ("flags", ctypes.c_int), ("doc", ctypes.c_char_p))


def symbol_of(kernel: Stamped, arguments: Iterable[str]) -> str:
    """Return the name of a kernel's function in the library, for types of arguments as `by_address.written`."""
    text = "|".join((*key_of(kernel.py_func), *arguments))
    return f"mp_{hashlib.sha256(text.encode()).hexdigest()[:24]}"


def file_of(level: str, suffix: str) -> str:
    """Return the name of the library for processors of a level."""
    return f"kernels-{level}{suffix}"


def entry_of(kernel: Stamped, arguments: Iterable[str]) -> Callable | None:
    """Return the function of a kernel for types of arguments; None if there is none."""
    library = loaded()
    symbol = symbol_of(kernel, arguments) if library else ""
    try:
        address = ctypes.cast(library[symbol], ctypes.c_void_p).value if library else None
    except AttributeError:
        return None
    return _making(_record(library, symbol), _function(kernel, address)) if address else None


def _record(library: Any, symbol: str) -> Any:
    """Return the class of the record that a function of the library returns; None if it returns none."""
    try:
        text = ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(library, f"{symbol}_record")))
    except ValueError:  # there is no such text
        return None
    module, name = text.decode().split(":")
    return getattr(import_module(module), name)


def _making(record: Any, function: Callable) -> Callable:
    """Return the function with its tuples as records."""
    return function if record is None else lambda *given: record._make(function(*given))


def _function(kernel: Stamped, address: int) -> Callable:
    """Return the function of C at an address as one of Python, which takes a tenth of the time of ctypes."""
    method = _Method(kernel.py_func.__name__.encode(), address, METH_FASTCALL, None)
    _METHODS.append(method)
    make = ctypes.pythonapi.PyCFunction_NewEx
    make.restype = ctypes.py_object
    make.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
    return make(ctypes.addressof(method), None, None)


_METHODS: list[_Method] = []  # Python keeps their addresses


@lru_cache
def loaded() -> Any:
    """Return the library for this processor; None if there is none, or ``MODALPREP_COMPILER`` asks for another way."""
    if os.environ.get("MODALPREP_COMPILER", "") not in ("", "library"):
        return None
    paths = {level: FOLDER / file_of(level, SUFFIX.get(sys.platform, ".so")) for level in LEVELS}
    found = [paths[level] for level, needed in LEVELS.items() if needed <= _flags() and paths[level].is_file()]
    if not found:
        return None
    library = ctypes.CDLL(str(found[0]))
    if sys.platform == "win32" and library.has_v3():  # where no file says what the processor can
        library = ctypes.CDLL(str(paths["v3"]))
    python = [ctypes.cast(getattr(ctypes.pythonapi, name), ctypes.c_void_p).value for name in PYTHON]
    values = *python, *_blas(), id(ValueError), id(None), object.__basicsize__
    table = ctypes.c_void_p * len(values)
    if ctypes.c_int64.in_dll(library, "python_size").value != ctypes.sizeof(table):
        return None  # of another version
    table.in_dll(library, "python")[:] = values
    return library


def _blas() -> list[int]:
    """Return the addresses of SciPy's products of matrices."""
    from scipy.linalg import cython_blas

    name = ctypes.pythonapi.PyCapsule_GetName
    name.restype = ctypes.c_char_p
    name.argtypes = (ctypes.py_object,)
    pointer = ctypes.pythonapi.PyCapsule_GetPointer
    pointer.restype = ctypes.c_void_p
    pointer.argtypes = (ctypes.py_object, ctypes.c_char_p)
    capsules = [cython_blas.__pyx_capi__[each] for each in ("dgemm", "dgemv")]
    return [pointer(each, name(each)) for each in capsules]


@lru_cache
def _flags() -> set[str]:
    """Return what the processor can."""
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return set()
    return set(text.partition("\nflags")[2].partition("\n")[0].split())
