"""Four numbers that one vector instruction treats alike, as one number of compiled code: the only vector code by hand.

Numba has no such type, and LLVM finds no vector instructions by itself in loops over three to twenty numbers: the
elimination of a body's modes takes 2.2 to 2.8 times as long in plain loops. The functions on tuples (`tuples.py`,
`matrices.py` of the kernels) take lanes in place of numbers. Each function here has two forms: LLVM's instructions, and
Python on arrays of four numbers, which holds where nothing is compiled; there an access beyond an array is an error.
"""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils, config
from numba.core.errors import TypingError
from numba.core.imputils import lower_builtin
from numba.core.typing import templates
from numba.core.typing.templates import AbstractTemplate, signature
from numba.extending import intrinsic, models, register_model

from modalprep.compiler.jit import compile_inline

F = TypeVar("F", bound=Callable)
infer_global: Any = templates.infer_global
DISABLED = bool(vars(config)["DISABLE_JIT"])  # NUMBA_DISABLE_JIT
WIDTH = 4
VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
WHICH = ir.VectorType(ir.IntType(32), WIDTH)


class Lanes(np.ndarray):
    """Four numbers in Python, a value like a number: ``v += w`` leaves other names of v alone."""

    def __iadd__(self, other: Any) -> Any:
        return self + other


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


def _compiled(build: Callable, result: types.Type, *kinds: types.Type) -> Callable[[F], F]:
    """Return the decorator of a Python function that compiled code has as ``build(builder, *values)``."""

    def typed(typing: Any, *args: Any) -> Any:
        return signature(result, *kinds), lambda context, builder, sig, values: build(builder, *values)

    def decorate(function: F) -> F:
        if DISABLED:
            return function
        named = inspect.signature(function).parameters.values()
        first = inspect.Parameter("typing", inspect.Parameter.POSITIONAL_OR_KEYWORD)
        typed.__signature__ = inspect.Signature([first, *named])
        typed.__name__ = function.__name__
        typed.__doc__ = function.__doc__
        return cast(F, intrinsic(typed))

    return decorate


@_compiled(_spread, LANES, types.float64)
def four(value):
    """Return four times the same number."""
    return np.full(4, value).view(Lanes)


def _joined(builder: Any, *values: Any) -> Any:
    v = ir.Constant(VECTOR, ir.Undefined)
    for k, value in enumerate(values):
        v = builder.insert_element(v, value, ir.IntType(32)(k))
    return v


@_compiled(_joined, LANES, *WIDTH * (types.float64,))
def lanes(a, b, c, d):
    """Return four numbers in one."""
    return np.array([a, b, c, d]).view(Lanes)


@_compiled(
    lambda builder, v: cgutils.pack_array(builder, _each(builder, v)), types.UniTuple(types.float64, WIDTH), LANES
)
def numbers(v):
    """Return four numbers as a tuple."""
    return tuple(v.tolist())


def _total(builder: Any, v: Any) -> Any:
    a, b, c, d = _each(builder, v)
    return builder.fadd(builder.fadd(a, c), builder.fadd(b, d))


@_compiled(_total, types.float64, LANES)
def add_lanes(v):
    """Return the sum of four numbers."""
    return float(v.sum())


def _sums(builder: Any, *each: Any) -> Any:
    pairs = []
    for a, b in (each[:2], each[2:]):
        pairs.append(builder.fadd(_shuffled(builder, a, b, (0, 4, 2, 6)), _shuffled(builder, a, b, (1, 5, 3, 7))))
    a, b = pairs
    return builder.fadd(_shuffled(builder, a, b, (0, 1, 4, 5)), _shuffled(builder, a, b, (2, 3, 6, 7)))


@_compiled(_sums, LANES, *WIDTH * (LANES,))
def sum_lanes(a, b, c, d):
    """Return the sums of a, of b, of c and of d."""
    return np.sum((a, b, c, d), axis=1).view(Lanes)


def _columns(builder: Any, *rows: Any) -> Any:
    pairs = [
        _shuffled(builder, a, b, places) for a, b in (rows[:2], rows[2:]) for places in ((0, 4, 2, 6), (1, 5, 3, 7))
    ]
    halves = ((0, 1, 4, 5), (2, 3, 6, 7))
    found = [_shuffled(builder, pairs[k], pairs[k + 2], places) for places in halves for k in (0, 1)]
    return cgutils.pack_array(builder, found)


@_compiled(_columns, types.UniTuple(LANES, WIDTH), *WIDTH * (LANES,))
def transposed_lanes(a, b, c, d):
    """Return the first numbers of a, of b, of c and of d, then their second ones, and so on."""
    return tuple(row.view(Lanes) for row in np.array((a, b, c, d)).T.copy())


@_compiled(_larger, LANES, LANES, LANES)
def larger(a, b):
    """Return the larger of two numbers in each of four lanes."""
    return np.where(a > b, a, b).view(Lanes)


def _largest(builder: Any, v: Any) -> Any:
    a, b, c, d = _each(builder, v)
    return _larger(builder, _larger(builder, a, c), _larger(builder, b, d))


@_compiled(_largest, types.float64, LANES)
def largest(v):
    """Return the largest of four numbers."""
    return float(v.max())


def _first_at_least(builder: Any, v: Any, value: Any) -> Any:
    reached = builder.fcmp_ordered(">=", v, _spread(builder, value))
    bits = builder.zext(builder.bitcast(reached, ir.IntType(WIDTH)), ir.IntType(64))
    return builder.cttz(bits, ir.IntType(1)(0))


@_compiled(_first_at_least, types.int64, LANES, types.float64)
def first_at_least(v, value):
    """Return which of four numbers is the first that is not less than a value; 64 if none is."""
    return int(np.argmax(v >= value)) if (v >= value).any() else 64


def _above(builder: Any, v: Any, bounds: Any, other: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", v, bounds), v, _spread(builder, other))


@_compiled(_above, LANES, LANES, LANES, types.float64)
def above(v, bounds, other):
    """Return four numbers, the other one in place of those that are not larger than their bounds."""
    return np.where(v > bounds, v, other).view(Lanes)


def _with_lane(builder: Any, v: Any, k: Any, value: Any) -> Any:
    places = ir.VectorType(ir.IntType(64), WIDTH)
    first = builder.insert_element(ir.Constant(places, ir.Undefined), k, ir.IntType(32)(0))
    same = _shuffled(builder, first, first, (0, 0, 0, 0))
    chosen = builder.icmp_signed("==", same, ir.Constant(places, list(range(WIDTH))))
    return builder.select(chosen, _spread(builder, value), v)


@_compiled(_with_lane, LANES, LANES, types.intp, types.float64)
def with_lane(v, k, value):
    """Return four numbers, a value in place of number k; all as they are where there is none."""
    return np.where(np.arange(4) == k, value, v).view(Lanes)


def arrangement(*places: int) -> Callable:
    """Return the function that arranges four numbers anew: those at these places, a zero for 4."""

    def build(builder: Any, v: Any) -> Any:
        return _shuffled(builder, v, ir.Constant(VECTOR, [0.0] * WIDTH), places)

    @_compiled(build, LANES, LANES)
    def arranged(v):
        return np.append(v, 0.0)[list(places)].view(Lanes)

    return arranged


def _pointer(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
    """Return where four numbers of an array begin."""
    array = context.make_array(sig.args[0])(context, builder, args[0])
    place = cgutils.get_item_pointer(context, builder, sig.args[0], array, args[1:2])
    return builder.bitcast(place, VECTOR.as_pointer())


def _get_in_python(a, i):
    """Four numbers ``a[i:i + 4]``."""
    return np.array(np.reshape(a[i : i + 4], 4)).view(Lanes)


def _put_in_python(a, i, v):
    """Write four numbers to ``a[i:i + 4]``."""
    a[i : i + 4] = np.reshape(v, 4)


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


get_lanes: Any = _get_in_python if DISABLED else intrinsic(_load)
put_lanes: Any = _put_in_python if DISABLED else intrinsic(_store)


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


_last_three = arrangement(1, 2, 3, 3)


@_compiled(lambda builder, u, v: _shuffled(builder, u, v, (2, 4, 5, 6)), LANES, LANES, LANES)
def _after_third(u, v):
    """Return the third number of u, then the first three of v."""
    return np.concatenate([u[2:3], v[:3]]).view(Lanes)


@compile_inline
def get_rows9(a):
    """The rows of a matrix ``a[:9]``, each in the first three of four numbers."""
    return get_lanes(a, 0), get_lanes(a, 3), _last_three(get_lanes(a, 5))


@compile_inline
def put_rows9(a, rows):
    """Write the rows of a matrix, each in the first three of four numbers, to ``a[:9]``."""
    put_lanes(a, 0, rows[0])
    put_lanes(a, 3, rows[1])
    put_lanes(a, 5, _after_third(rows[1], rows[2]))
