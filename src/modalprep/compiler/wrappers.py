"""Calls of kernels from Python, in C: arguments as numba's code takes them, and what it returns as Python's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numba import types
from numba.np.numpy_support import as_dtype

from modalprep.compiler.address_code import AddressType

CALL = """
extern int {{0}}(void *, P *{parameters});{record}
EXPORT P {symbol}(P self, P *given, I count) {{{{
  {result} value = {{{{0}}}};
  P error = 0;
  {values}
  if (python.PyErr_Occurred()) return 0;
  {before}int status = {{0}}(&value, &error{arguments});{after}
  if (status != 0 && status != NONE) return failed("{name}");
  return {found};
}}}}
"""

MAKE = {types.float64: "PyFloat_FromDouble", types.int64: "PyLong_FromLongLong", types.boolean: "PyBool_FromLong"}


def wrapper(symbol: str, code: str, kernel: Any, result: types.Type, kinds: Sequence[types.Type]) -> str:
    """Return the C function, with ``{0}`` for the name of the kernel's code."""
    parts = [part for k, kind in enumerate(kinds) for part in _parts(kind, f"given[{k}]")]
    free = kernel.options.get("nogil", True)
    return CALL.format(
        symbol=symbol,
        parameters="".join(f", {kind}" for kind, _ in parts),
        values="\n  ".join(f"{kind} v{k} = {value};" for k, (kind, value) in enumerate(parts)),
        arguments="".join(f", v{k}" for k in range(len(parts))),
        result=_struct(result),
        before="P thread = python.PyEval_SaveThread();\n  " if free else "",
        after="\n  python.PyEval_RestoreThread(thread);" if free else "",
        name=kernel.__name__,
        record=_record(symbol, result),
        found=_packed(result, "value.it"),
    )


def _record(symbol: str, result: Any) -> str:
    """Return a text with the module and the name of the NamedTuple that the kernel returns, which Python makes."""
    kind = getattr(result, "instance_class", None)
    if kind is None:
        return ""
    return f'\nEXPORT const char {symbol}_record[] = "{kind.__module__}:{kind.__qualname__}";'


def _parts(kind: types.Type, given: str) -> list[tuple[str, str]]:
    """Return type and value of each number by which numba's code takes an argument."""
    if isinstance(kind, types.Array):
        size = as_dtype(kind.dtype).itemsize
        head = [("P", "0"), ("P", "0"), ("I", f"items_of({given})"), ("I", str(size)), ("P", f"DATA({given})")]
        return head + [("I", f"{what}({given}, {k})") for what in ("SHAPE", "STRIDE") for k in range(kind.ndim)]
    if isinstance(kind, types.BaseTuple):
        return [part for k, each in enumerate(_each(kind)) for part in _parts(each, f"PART({given}, {k})")]
    return [_scalar(kind, given)]


def _each(kind: Any) -> list[types.Type]:
    return list(kind)


def _scalar(kind: types.Type, given: str) -> tuple[str, str]:
    if isinstance(kind, AddressType):
        return "P", f"ADDRESS({given})"
    if isinstance(kind, types.Record):
        return "P", f"row_of({given})"
    if isinstance(kind, types.NoneType):
        return "P", "0"
    number = {types.float64: ("double", "REAL"), types.int64: ("I", "WHOLE"), types.boolean: ("char", "TRUTH")}[kind]
    return number[0], f"{number[1]}({given})"


def _struct(result: types.Type) -> str:
    return f"struct {{{{ {_type(result)} it; }}}}"


def _type(result: types.Type) -> str:
    if isinstance(result, types.BaseTuple):
        return "struct {{ " + " ".join(f"{_type(each)} p{k};" for k, each in enumerate(_each(result))) + " }}"
    return {types.float64: "double", types.int64: "I", types.boolean: "char", types.none: "P"}[result]


def _packed(result: types.Type, value: str) -> str:
    if isinstance(result, types.BaseTuple):
        each = [_packed(kind, f"{value}.p{k}") for k, kind in enumerate(_each(result))]
        return f"tuple_of({', '.join([str(len(each)), *each])})"
    return f"python.{MAKE[result]}({value})" if result in MAKE else "nothing()"
