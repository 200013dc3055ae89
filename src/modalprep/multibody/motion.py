"""Prescribed motion: pieces of an angle as expressions of time, differentiated symbolically."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from modalprep.errors import InputError

FUNCTIONS = "sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, exp, log, sqrt, pi"


@dataclass(frozen=True)
class Motion:
    """An angle (rad) as expressions of time ``t`` (s): pieces ``(until, expression)``, the last without end.

    Expressions are parsed and differentiated by symengine; nothing is ever evaluated as Python.

    Raises
    ------
    InputError
        When an expression cannot be read, or the pieces are not in order of time.

    Examples
    --------
    >>> ramp = Motion([(2.0, "t**2/2"), (float("inf"), "2*t - 2")])
    >>> ramp(1.0), ramp(3.0)
    ((0.5, 1.0, 1.0), (4.0, 2.0, 0.0))
    """

    pieces: Sequence[tuple[float, str]]
    _functions: tuple = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Parse every piece."""
        ends = [until for until, _ in self.pieces]
        if not ends or ends != sorted(ends) or len(set(ends)) != len(ends):
            raise InputError(f"motion: the pieces must end at increasing times, got {ends}")
        if ends[-1] != float("inf"):
            raise InputError("motion: the last piece must have no 'until'")
        object.__setattr__(self, "_functions", tuple(expression(text) for _, text in self.pieces))

    def __call__(self, t: float) -> tuple[float, float, float]:
        """Return angle, rate and acceleration at time t; an `InputError` where they are not finite."""
        piece = next(k for k, (until, _) in enumerate(self.pieces) if t < until)
        with np.errstate(all="ignore"):
            angle, rate, acceleration = np.ravel(self._functions[piece]([t])).tolist()
        if not math.isfinite(angle + rate + acceleration):
            text = self.pieces[piece][1]
            raise InputError(f"motion {text!r} has no finite angle, rate and acceleration at t = {t:g} s")
        return angle, rate, acceleration

    @property
    def breaks(self) -> list[float]:
        """Times at which one piece ends and the next begins."""
        return [until for until, _ in self.pieces[:-1]]


def expression(text: str) -> Any:
    """Return a function of ``[t]`` that gives the value and first two derivatives of an expression of time.

    Raises
    ------
    InputError
        When the text is not an expression of t and known functions.

    Examples
    --------
    >>> expression("sin(t)")([0.0]).tolist()
    [0.0, 1.0, 0.0]
    >>> expression("open(t)")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    modalprep.errors.InputError: motion 'open(t)': unknown name open; use t and sin, cos, ...
    """
    import symengine

    try:
        value = symengine.sympify(text)
        free = value.free_symbols
    except (RuntimeError, TypeError, ValueError, SyntaxError, AttributeError) as error:
        raise InputError(f"motion {text!r} is not an expression of t: {error}") from None
    t = symengine.Symbol("t")
    called = [f.get_name() for f in value.atoms(symengine.Function) if type(f).__name__ == "FunctionSymbol"]
    unknown = [*called, *(str(s) for s in free if s != t)]
    if unknown:
        raise InputError(f"motion {text!r}: unknown name {unknown[0]}; use t and {FUNCTIONS}")
    try:
        return symengine.Lambdify([t], [value, value.diff(t), value.diff(t, t)])
    except (RuntimeError, TypeError, ValueError, AttributeError, NotImplementedError):
        raise InputError(f"motion {text!r} is no real function of t with two derivatives; use {FUNCTIONS}") from None
