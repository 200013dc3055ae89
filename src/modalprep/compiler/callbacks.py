"""Compiled loops that ask Python: a function pointer, called from compiled code by its address."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

SIGNATURE = ctypes.CFUNCTYPE(None, ctypes.c_double)


class Pointer:
    """A Python function ``f(t)`` with an address; what it raises is kept, and `raised` (1,) set to one.

    Attributes
    ----------
    address : int
    error : BaseException or None
        The first exception; later calls do nothing.

    Examples
    --------
    >>> seen = []
    >>> pointer = Pointer(seen.append, np.zeros(1))
    >>> call_address(pointer.address, 2.5)
    >>> seen
    [2.5]
    """

    def __init__(self, function: Callable[[float], None], raised: np.ndarray) -> None:
        self.function, self.raised = function, raised
        self.error: BaseException | None = None
        self.pointer = SIGNATURE(self._call)
        self.address = ctypes.cast(self.pointer, ctypes.c_void_p).value

    def _call(self, t: float) -> None:
        if self.error is None:
            try:
                self.function(t)
            except BaseException as error:
                self.error = error
                self.raised[0] = 1.0


def call_address(address: int, t: float) -> None:
    """Call the function ``f(t)`` at an address, from Python or from compiled code."""
    SIGNATURE(address)(t)


def _typed_call(context: Any, address: Any, t: Any) -> tuple[Any, Callable[..., Any]]:
    def generate(context, builder, signature, arguments):
        function = ir.FunctionType(ir.VoidType(), [ir.DoubleType()])
        builder.call(builder.inttoptr(arguments[0], function.as_pointer()), [arguments[1]])
        return context.get_dummy_value()

    return types.void(types.int64, types.float64), generate


_call: Any = intrinsic(_typed_call)


@overload(call_address, inline="never")
def _compiled_call(address, t):
    return lambda address, t: _call(address, t)
