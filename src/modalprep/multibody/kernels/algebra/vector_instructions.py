"""The vector instructions of compiled code on four numbers (lanes.py); plain_lanes.py is the same in Python."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model

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
    (operator.add, "fadd"),
    (operator.iadd, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _operator(_key, _instruction)


def _pointer(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
    """Return where four numbers of an array begin."""
    array = context.make_array(sig.args[0])(context, builder, args[0])
    place = cgutils.get_item_pointer(context, builder, sig.args[0], array, args[1:2])
    return builder.bitcast(place, VECTOR.as_pointer())


@intrinsic
def load(typing: Any, array: Any, index: Any) -> Any:
    """Four numbers ``array[index:index + 4]``."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        return builder.load(_pointer(context, builder, sig, args), align=8)

    return LANES(array, types.intp), build


@intrinsic
def store(typing: Any, array: Any, index: Any, value: Any) -> Any:
    """Write four numbers to ``array[index:index + 4]``."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        builder.store(args[2], _pointer(context, builder, sig, args), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, LANES), build


@intrinsic
def spread(typing: Any, value: Any) -> Any:
    """Return four times the same number."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        return _spread(builder, types.float64, args[0])

    return LANES(types.float64), build


@intrinsic
def join(typing: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return four numbers in one."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        found = ir.Constant(VECTOR, ir.Undefined)
        for k, value in enumerate(args):
            found = builder.insert_element(found, value, ir.IntType(32)(k))
        return found

    return LANES(*WIDTH * (types.float64,)), build


@intrinsic
def total(typing: Any, value: Any) -> Any:
    """Return the sum of four numbers."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        each = [builder.extract_element(args[0], ir.IntType(32)(k)) for k in range(WIDTH)]
        return builder.fadd(builder.fadd(each[0], each[2]), builder.fadd(each[1], each[3]))

    return types.float64(LANES), build


@intrinsic
def numbers(typing: Any, value: Any) -> Any:
    """Return four numbers as a tuple."""
    kind = types.UniTuple(types.float64, WIDTH)

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        each = [builder.extract_element(args[0], ir.IntType(32)(k)) for k in range(WIDTH)]
        return context.make_tuple(builder, kind, each)

    return kind(LANES), build


def _mixed(builder: Any, a: Any, b: Any, places: tuple[int, ...]) -> Any:
    """Return the numbers at `places` of eight: those of a, then those of b."""
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), list(places)))


def arrangement(*places: int) -> Callable:
    """Return the function that arranges four numbers anew: those at these places, a zero for 4."""

    @intrinsic
    def arranged(typing: Any, value: Any) -> Any:
        def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
            return _mixed(builder, args[0], ir.Constant(VECTOR, [0.0] * WIDTH), places)

        return LANES(LANES), build

    return arranged


@intrinsic
def sums(typing: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return the sums of four lanes."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        even, odd, low, high = (0, 4, 2, 6), (1, 5, 3, 7), (0, 1, 4, 5), (2, 3, 6, 7)
        pairs = [builder.fadd(_mixed(builder, *two, even), _mixed(builder, *two, odd)) for two in (args[:2], args[2:])]
        return builder.fadd(_mixed(builder, *pairs, low), _mixed(builder, *pairs, high))

    return LANES(*WIDTH * (LANES,)), build


@intrinsic
def transpose(typing: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return the first numbers of four lanes, then their second ones, and so on."""
    kind = types.UniTuple(LANES, WIDTH)

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        a, b = args[:2]
        c, d = args[2:]
        rows = []
        for inner in ((0, 4, 2, 6), (1, 5, 3, 7)):
            rows.append((_mixed(builder, a, b, inner), _mixed(builder, c, d, inner)))
        first, second = ([_mixed(builder, *pair, half) for half in ((0, 1, 4, 5), (2, 3, 6, 7))] for pair in rows)
        return context.make_tuple(builder, kind, [first[0], second[0], first[1], second[1]])

    return kind(*WIDTH * (LANES,)), build


@intrinsic
def larger(typing: Any, a: Any, b: Any) -> Any:
    """Return the larger of two numbers in each of four lanes."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        return builder.select(builder.fcmp_ordered(">", *args), *args)

    return LANES(LANES, LANES), build


@intrinsic
def largest(typing: Any, v: Any) -> Any:
    """Return the largest of four numbers."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        each = [builder.extract_element(args[0], ir.IntType(32)(k)) for k in range(WIDTH)]
        larger = lambda a, b: builder.select(builder.fcmp_ordered(">", a, b), a, b)  # noqa: E731
        return larger(larger(each[0], each[2]), larger(each[1], each[3]))

    return types.float64(LANES), build


@intrinsic
def first_at_least(typing: Any, v: Any, value: Any) -> Any:
    """Return which of four numbers is the first that is not less than a value; beyond them if none is."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        found = builder.fcmp_ordered(">=", args[0], _spread(builder, types.float64, args[1]))
        bits = builder.zext(builder.bitcast(found, ir.IntType(WIDTH)), ir.IntType(64))
        return builder.cttz(bits, ir.IntType(1)(0))

    return types.int64(LANES, types.float64), build


@intrinsic
def above(typing: Any, v: Any, bounds: Any, other: Any) -> Any:
    """Return four numbers, the other one in place of those that are not larger than their bounds."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        larger = builder.fcmp_ordered(">", args[0], args[1])
        return builder.select(larger, args[0], _spread(builder, types.float64, args[2]))

    return LANES(LANES, LANES, types.float64), build


@intrinsic
def with_lane(typing: Any, v: Any, k: Any, value: Any) -> Any:
    """Return four numbers, a value in place of number k; all as they are where there is none."""
    places = ir.VectorType(ir.IntType(64), WIDTH)

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        first = builder.insert_element(ir.Constant(places, ir.Undefined), args[1], ir.IntType(32)(0))
        same = builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH))
        chosen = builder.icmp_signed("==", same, ir.Constant(places, list(range(WIDTH))))
        return builder.select(chosen, _spread(builder, types.float64, args[2]), args[0])

    return LANES(LANES, types.intp, types.float64), build


@intrinsic
def earlier(typing: Any, v: Any) -> Any:
    """Return the last three of four numbers, then any."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        return _mixed(builder, args[0], args[0], (1, 2, 3, 3))

    return LANES(LANES), build


@intrinsic
def after_third(typing: Any, u: Any, v: Any) -> Any:
    """Return the third number of u, then the first three of v."""

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        return _mixed(builder, *args, (2, 4, 5, 6))

    return LANES(LANES, LANES), build
