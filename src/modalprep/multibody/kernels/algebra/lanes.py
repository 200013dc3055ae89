"""Four numbers that one vector instruction treats alike, as a number of compiled code: one for each of four rows.

Numba has no such type, and does not find the vector instructions by itself where there are three or four numbers. The
functions on tuples (tuples.py, matrices.py) take lanes in place of numbers.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model

from modalprep.jit import compile_inline

WIDTH = 4
VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


class LanesType(types.Type):
    """Type of four numbers."""

    def __init__(self) -> None:
        super().__init__("Lanes")


LANES = LanesType()


@register_model(LanesType)
class _Vector(models.PrimitiveModel):
    """A vector of LLVM."""

    def __init__(self, manager: Any, kind: LanesType) -> None:
        super().__init__(manager, kind, VECTOR)


def _spread(builder: Any, kind: types.Type, value: Any) -> Any:
    """Return a value as four numbers."""
    if isinstance(kind, LanesType):
        return value
    first = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), value, ir.IntType(32)(0))
    return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH))


def _operator(key: Any, instruction: str) -> None:
    """Let an operator take lanes, or lanes and a number."""

    @infer_global(key)
    class _Typing(AbstractTemplate):
        def generic(self, args: tuple, kws: dict) -> Any:
            known = all(isinstance(kind, LanesType) or kind == types.float64 for kind in args)
            return signature(LANES, *args) if known and LANES in args else None

    def lower(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        return getattr(builder, instruction)(*(_spread(builder, *pair) for pair in zip(sig.args, args, strict=True)))

    for pair in ((LanesType, LanesType), (LanesType, types.Float), (types.Float, LanesType)):
        lower_builtin(key, *pair)(lower)


for _key, _instruction in (
    (operator.add, "fadd"), (operator.iadd, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"),
):  # fmt: skip
    _operator(_key, _instruction)


def _pointer(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
    """Return where four numbers of an array begin."""
    array = context.make_array(sig.args[0])(context, builder, args[0])
    place = cgutils.get_item_pointer(context, builder, sig.args[0], array, args[1:2])
    return builder.bitcast(place, VECTOR.as_pointer())


@intrinsic
def _load(typing: Any, array: Any, index: Any) -> Any:
    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        return builder.load(_pointer(context, builder, sig, args), align=8)

    return LANES(array, types.intp), build


@intrinsic
def _store(typing: Any, array: Any, index: Any, value: Any) -> Any:
    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        builder.store(args[2], _pointer(context, builder, sig, args), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, LANES), build


@intrinsic
def _four(typing: Any, value: Any) -> Any:
    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        return _spread(builder, types.float64, args[0])

    return LANES(types.float64), build


@intrinsic
def _lanes(typing: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        found = ir.Constant(VECTOR, ir.Undefined)
        for k, value in enumerate(args):
            found = builder.insert_element(found, value, ir.IntType(32)(k))
        return found

    return LANES(*WIDTH * (types.float64,)), build


@intrinsic
def _add(typing: Any, value: Any) -> Any:
    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        each = [builder.extract_element(args[0], ir.IntType(32)(k)) for k in range(WIDTH)]
        return builder.fadd(builder.fadd(each[0], each[2]), builder.fadd(each[1], each[3]))

    return types.float64(LANES), build


@compile_inline
def add_lanes(v):
    """Return the sum of four numbers."""
    return _add(v)


@compile_inline
def four(value):
    """Return four times the same number."""
    return _four(value)


@compile_inline
def lanes(a, b, c, d):
    """Return four numbers in one."""
    return _lanes(a, b, c, d)


@compile_inline
def get_lanes(a, i):
    """Four numbers ``a[i:i + 4]``."""
    return _load(a, i)


@compile_inline
def put_lanes(a, i, v):
    """Write four numbers to ``a[i:i + 4]``."""
    _store(a, i, v)


@compile_inline
def get_lanes3(a, i):
    """A vector of lanes: ``a[i:i + 12]``."""
    return get_lanes(a, i), get_lanes(a, i + 4), get_lanes(a, i + 8)


@compile_inline
def put_lanes3(a, i, v):
    """Write a vector of lanes to ``a[i:i + 12]``."""
    put_lanes(a, i, v[0])
    put_lanes(a, i + 4, v[1])
    put_lanes(a, i + 8, v[2])


@compile_inline
def get_lanes6(a):
    """A spatial vector of lanes: ``a[:24]``."""
    f, t = get_lanes3(a, 0), get_lanes3(a, 12)
    return f[0], f[1], f[2], t[0], t[1], t[2]


@compile_inline
def put_lanes6(a, v):
    """Write a spatial vector of lanes to ``a[:24]``."""
    put_lanes3(a, 0, (v[0], v[1], v[2]))
    put_lanes3(a, 12, (v[3], v[4], v[5]))


@compile_inline
def get_lane6(a, k):
    """A spatial vector of numbers: lane k of `get_lanes6`."""
    return a[k], a[4 + k], a[8 + k], a[12 + k], a[16 + k], a[20 + k]


@compile_inline
def put_lane6(a, k, v):
    """Write lane k of `put_lanes6`."""
    a[k], a[4 + k], a[8 + k], a[12 + k], a[16 + k], a[20 + k] = v
