"""User expressions: arithmetic and known functions only, with bounded size."""

from __future__ import annotations

import ast
import warnings
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from modalprep.errors import InputError

FUNCTIONS = "sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, exp, log, sqrt, pi"
LONGEST = 1000  # characters
LARGEST = 1000  # exponent that is kept as an integer, so that powers of negative numbers are real
OPERATORS = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
}


def read_expression(text: str, what: str = "", known: tuple[str, ...] = ("t",)) -> Any:
    """Return an expression of the `known` names as symengine's; all numbers but exponents are floating point.

    Exact numbers would let ``9**9**9`` take all memory. `what` starts the error message.

    Raises
    ------
    InputError
        When the text is anything but arithmetic with `FUNCTIONS`, or longer than `LONGEST`.

    Examples
    --------
    >>> read_expression("2*sin(t)^2")
    2.0*sin(t)**2
    >>> read_expression("9**9**9*t")
    inf.0*t
    >>> read_expression("open(t)")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    modalprep.errors.InputError: function of time 'open(t)': unknown name open; use t and sin, cos, ...
    """
    what = what or f"function of time {text[:60]!r}"
    names = "t" if known == ("t",) else "t, channels"
    if len(text) > LONGEST:
        raise InputError(f"{what}... has {len(text)} characters, more than {LONGEST}; give it in pieces, or by points")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return _translated(ast.parse(" ".join(text.replace("^", "**").split()), mode="eval").body, known)
    except InputError as error:
        raise InputError(f"{what}: {error}; use {names} and {FUNCTIONS}") from None
    except (SyntaxError, ValueError, ArithmeticError, RuntimeError, MemoryError, TypeError) as error:
        raise InputError(f"{what} is not an expression of {names}: {error}") from None


def _translated(node: ast.expr, known: tuple[str, ...]) -> Any:
    import symengine

    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return symengine.RealDouble(float(value))
        case ast.Name(id=name) if name in known:
            return symengine.Symbol(name)
        case ast.Name(id="pi"):
            return symengine.pi
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=operand):
            value = _translated(operand, known)
            return -value if isinstance(sign, ast.USub) else value
        case ast.BinOp(left=base, op=ast.Pow(), right=exponent) if (n := _integer(exponent)) is not None:
            return _translated(base, known) ** n
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            return OPERATORS[type(op)](_translated(left, known), _translated(right, known))
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS.split(", ")[:-1]:
            return getattr(symengine, name)(_translated(argument, known))
        case ast.Name(id=name) | ast.Call(func=ast.Name(id=name)):
            raise InputError(f"unknown name {name}")
    raise InputError(f"{ast.unparse(node)[:60]!r} is no arithmetic")


def _integer(node: ast.expr) -> int | None:
    """Return an exponent that is a small integer as it is written."""
    match node:
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() as value)):
            value = -value
        case ast.Constant(value=int() as value):
            pass
        case _:
            return None
    return value if abs(value) <= LARGEST else None


@lru_cache(maxsize=256)
def expression(text: str) -> Callable[[np.ndarray], np.ndarray]:
    """Return ``t (n,) -> (3, n)``: value and first two derivatives of an expression of time.

    Raises
    ------
    InputError
        When the text is not an expression of t and known functions.

    Examples
    --------
    >>> expression("sin(t)")(np.zeros(1)).ravel().tolist()
    [0.0, 1.0, 0.0]
    >>> expression("open(t)")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    modalprep.errors.InputError: function of time 'open(t)': unknown name open; use t and sin, cos, ...
    """
    import symengine

    value = read_expression(text)
    t = symengine.Symbol("t")
    try:
        derivatives = symengine.Lambdify([t], [value, value.diff(t), value.diff(t, t)])
    except (RuntimeError, TypeError, ValueError, AttributeError, NotImplementedError):
        raise InputError(f"function of time {text!r} has no two real derivatives; use t and {FUNCTIONS}") from None
    return lambda times: np.asarray(derivatives(times[:, None]), dtype=float).reshape(len(times), 3).T
