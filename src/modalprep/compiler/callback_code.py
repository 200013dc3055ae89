"""Calls of a Python function by its address in compiled code (`callbacks`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from modalprep.compiler.callbacks import call_address


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
