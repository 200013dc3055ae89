"""LLVM's instructions for four numbers at once (`lanes`)."""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.core.imputils import lower_builtin
from numba.core.registry import cpu_target
from numba.core.typing import templates
from numba.core.typing.templates import AbstractTemplate, signature
from numba.extending import intrinsic, models, register_model

from modalprep.compiler.sizes import WIDTH

infer_global: Any = templates.infer_global
VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
WHICH = ir.VectorType(ir.IntType(32), WIDTH)


class LanesType(types.Type):
    """Type of four numbers in compiled code."""

    def __init__(self) -> None:
        super().__init__("Lanes")


LANES = LanesType()


@register_model(LanesType)
class _Vector(models.PrimitiveModel):
    """A vector of LLVM."""

    def __init__(self, manager: Any, kind: LanesType) -> None:
        super().__init__(manager, kind, VECTOR)


def _spread(builder: Any, value: Any) -> Any:
    """Return a value as four numbers."""
    if value.type == VECTOR:
        return value
    first = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), value, ir.IntType(32)(0))
    return _shuffled(builder, first, first, (0, 0, 0, 0))


def _shuffled(builder: Any, a: Any, b: Any, places: tuple[int, ...]) -> Any:
    """Return the numbers at `places` of eight: those of a, then those of b."""
    return builder.shuffle_vector(a, b, ir.Constant(WHICH, list(places)))


def _each(builder: Any, v: Any) -> list[Any]:
    """Return the four numbers."""
    return [builder.extract_element(v, ir.IntType(32)(k)) for k in range(WIDTH)]


def _larger(builder: Any, a: Any, b: Any) -> Any:
    """Return the larger of two values."""
    return builder.select(builder.fcmp_ordered(">", a, b), a, b)


def _operator(key: Any, instruction: str) -> None:
    """Let an operator take lanes, or lanes and a number."""

    @infer_global(key)
    class _Typing(AbstractTemplate):
        def generic(self, args: tuple, kws: dict) -> Any:
            known = all(isinstance(kind, LanesType) or kind == types.float64 for kind in args)
            return signature(LANES, *args) if known and LANES in args else None

    def lower(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        return getattr(builder, instruction)(*(_spread(builder, value) for value in args))

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


def _joined(builder: Any, *values: Any) -> Any:
    v = ir.Constant(VECTOR, ir.Undefined)
    for k, value in enumerate(values):
        v = builder.insert_element(v, value, ir.IntType(32)(k))
    return v


def _total(builder: Any, v: Any) -> Any:
    a, b, c, d = _each(builder, v)
    return builder.fadd(builder.fadd(a, c), builder.fadd(b, d))


def _sums(builder: Any, *each: Any) -> Any:
    pairs = []
    for a, b in (each[:2], each[2:]):
        pairs.append(builder.fadd(_shuffled(builder, a, b, (0, 4, 2, 6)), _shuffled(builder, a, b, (1, 5, 3, 7))))
    a, b = pairs
    return builder.fadd(_shuffled(builder, a, b, (0, 1, 4, 5)), _shuffled(builder, a, b, (2, 3, 6, 7)))


def _columns(builder: Any, *rows: Any) -> Any:
    pairs = [
        _shuffled(builder, a, b, places) for a, b in (rows[:2], rows[2:]) for places in ((0, 4, 2, 6), (1, 5, 3, 7))
    ]
    halves = ((0, 1, 4, 5), (2, 3, 6, 7))
    found = [_shuffled(builder, pairs[k], pairs[k + 2], places) for places in halves for k in (0, 1)]
    return cgutils.pack_array(builder, found)


def _largest(builder: Any, v: Any) -> Any:
    a, b, c, d = _each(builder, v)
    return _larger(builder, _larger(builder, a, c), _larger(builder, b, d))


def _first_at_least(builder: Any, v: Any, value: Any) -> Any:
    reached = builder.fcmp_ordered(">=", v, _spread(builder, value))
    bits = builder.zext(builder.bitcast(reached, ir.IntType(WIDTH)), ir.IntType(64))
    return builder.cttz(bits, ir.IntType(1)(0))


def _above(builder: Any, v: Any, bounds: Any, other: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", v, bounds), v, _spread(builder, other))


def _with_lane(builder: Any, v: Any, k: Any, value: Any) -> Any:
    places = ir.VectorType(ir.IntType(64), WIDTH)
    first = builder.insert_element(ir.Constant(places, ir.Undefined), k, ir.IntType(32)(0))
    same = _shuffled(builder, first, first, (0, 0, 0, 0))
    chosen = builder.icmp_signed("==", same, ir.Constant(places, list(range(WIDTH))))
    return builder.select(chosen, _spread(builder, value), v)


def _pointer(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
    """Return where four numbers of an array begin."""
    array = context.make_array(sig.args[0])(context, builder, args[0])
    place = cgutils.get_item_pointer(context, builder, sig.args[0], array, args[1:2])
    return builder.bitcast(place, VECTOR.as_pointer())


def _load(typing: Any, a: Any, i: Any) -> Any:
    """Four numbers ``a[i:i + 4]``."""
    _refuse_other_numbers(a)

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        return builder.load(_pointer(context, builder, sig, args), align=8)

    return LANES(a, types.intp), build


def _store(typing: Any, a: Any, i: Any, v: Any) -> Any:
    """Write four numbers to ``a[i:i + 4]``."""
    _refuse_other_numbers(a)

    def build(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
        builder.store(args[2], _pointer(context, builder, sig, args), align=8)
        return context.get_dummy_value()

    return types.void(a, types.intp, LANES), build


def _refuse_other_numbers(a: Any) -> None:
    if getattr(a, "dtype", None) != types.float64:
        raise TypingError(f"four numbers are of type float64; they were asked of {a}")


def _definition(build: Callable, result: types.Type, *kinds: types.Type) -> Callable:
    """Return the definition of an intrinsic function that is ``build(builder, *values)``."""

    def typed(typing: Any, *args: Any) -> Any:
        return signature(result, *kinds), lambda context, builder, sig, values: build(builder, *values)

    return typed


DEFINITIONS = {
    "get_lanes": _load,
    "put_lanes": _store,
    "four": _definition(_spread, LANES, types.float64),
    "lanes": _definition(_joined, LANES, *WIDTH * (types.float64,)),
    "numbers": _definition(
        lambda builder, v: cgutils.pack_array(builder, _each(builder, v)), types.UniTuple(types.float64, WIDTH), LANES
    ),
    "add_lanes": _definition(_total, types.float64, LANES),
    "sum_lanes": _definition(_sums, LANES, *WIDTH * (LANES,)),
    "transposed_lanes": _definition(_columns, types.UniTuple(LANES, WIDTH), *WIDTH * (LANES,)),
    "larger": _definition(_larger, LANES, LANES, LANES),
    "largest": _definition(_largest, types.float64, LANES),
    "first_at_least": _definition(_first_at_least, types.int64, LANES, types.float64),
    "above": _definition(_above, LANES, LANES, LANES, types.float64),
    "with_lane": _definition(_with_lane, LANES, LANES, types.intp, types.float64),
    "_after_third": _definition(lambda builder, u, v: _shuffled(builder, u, v, (2, 4, 5, 6)), LANES, LANES, LANES),
}


def type_of(function: Callable, places: tuple[int, ...]) -> types.Type:
    """Return numba's type of a function on lanes; `places` of one that arranges four numbers anew."""
    typed = _arranged(places) if places else DEFINITIONS[function.__name__]
    first = inspect.Parameter("typing", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    named = inspect.signature(function).parameters.values()
    typed.__signature__ = inspect.Signature([first, *named])  # type: ignore[attr-defined]
    typed.__name__ = function.__name__
    made = intrinsic(typed)
    known: Any = cpu_target.typing_context
    known.refresh()
    return known.resolve_value_type(made)


def _arranged(places: tuple[int, ...]) -> Callable:
    zero = ir.Constant(VECTOR, [0.0] * WIDTH)
    return _definition(lambda builder, v: _shuffled(builder, v, zero, places), LANES, LANES)
