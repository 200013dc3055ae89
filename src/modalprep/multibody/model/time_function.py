"""Functions of time for prescribed motions and forces: expressions, tables, sampled callables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import scipy

from modalprep.errors import InputError
from modalprep.multibody.model.safe_expression import FUNCTIONS, read_expression

FOREVER = float("inf")
SAMPLES = (64, 65536)  # initial and largest number of intervals of a sampled callable
SAMPLED = 1e-11  # error of a sampled callable, relative to its largest value
SMOOTH = 1e-6  # relative size below which a jump of a prescribed motion is rounding of constants


class Piece(NamedTuple):
    """One smooth piece: its end (s), ``t -> (value, rate, acceleration)``, knots of a spline, text of an expression."""

    until: float
    evaluate: Callable[[np.ndarray], np.ndarray]
    knots: np.ndarray | None
    text: str


@dataclass(frozen=True, eq=False)
class TimeFunction:
    """A function of time ``t`` (s): a number, an expression, or pieces ``(until, expression)``, the last without end.

    Expressions are differentiated by symengine; nothing is ever evaluated as Python. `table` takes
    points, `sampled` a Python function. A force may jump between pieces, where the integrator restarts; of a
    prescribed motion only the acceleration may jump.

    Raises
    ------
    InputError
        When an expression cannot be read, or the pieces are not in order of time.

    Examples
    --------
    >>> ramp = TimeFunction([(2.0, "t**2/2"), (float("inf"), "2*t - 2")])
    >>> ramp(1.0), ramp(3.0), ramp.breaks
    ((0.5, 1.0, 1.0), (4.0, 2.0, 0.0), [2.0])
    >>> TimeFunction(3)(5.0), (-ramp)(3.0)
    ((3.0, 0.0, 0.0), (-4.0, -2.0, 0.0))
    """

    source: Any
    pieces: tuple[Piece, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Parse every piece."""
        given = self.given
        for piece in given:
            if not (isinstance(piece, tuple | list) and len(piece) == 2):
                raise InputError(
                    f"function of time: {piece!r} is no piece (until, expression); pieces are a list of such pairs, "
                    "and where each coordinate has a function of its own a TimeFunction of that list"
                )
        ends = [until for until, _ in given]
        if not ends or not all(a < b for a, b in pairwise(ends)):
            raise InputError(f"function of time: the pieces must end at increasing times, got {ends}")
        if not _is_table(given[-1][1]) and ends[-1] != FOREVER:
            raise InputError("function of time: the last piece must have no 'until'")
        object.__setattr__(self, "pieces", tuple(_piece(float(until), what) for until, what in given))

    @classmethod
    def of(cls, value: Any) -> TimeFunction:
        """Return `value` if it is one already, else a new one of a number, an expression or pieces.

        Returns
        -------
        TimeFunction
            The function.
        """
        return value if isinstance(value, cls) else cls(value)

    @classmethod
    def table(cls, t: Sequence[float], values: Sequence[float]) -> TimeFunction:
        """Return the cubic spline with two continuous derivatives through points; a repeated time is a jump.

        Parameters
        ----------
        t : (n,)
            s, from 0 or earlier to the end of the simulation or later.
        values : (n,)

        Returns
        -------
        TimeFunction
            A piece between each two jumps.

        Raises
        ------
        InputError
            When the points are too few, out of order or not finite.

        Examples
        --------
        >>> step = TimeFunction.table([0, 1, 1, 2], [0, 0, 5, 5])
        >>> step(0.5)[0], step(1.5)[0]
        (0.0, 5.0)
        """
        t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
        if t.ndim != 1 or t.shape != values.shape:
            raise InputError(f"table of time: {t.size} times and {values.size} values; give one value per time")
        if not np.all(np.isfinite([t, values])):
            raise InputError("table of time: a time or a value is not a finite number")
        cuts = [0, *(np.flatnonzero(np.diff(t) == 0) + 1), len(t)]
        if np.any(np.diff(t) < 0) or np.any(np.diff(cuts) < 2):
            raise InputError(
                "table of time: needs two points or more at increasing times; a jump repeats its time once, and has "
                "two points or more on either side"
            )
        return cls([(t[b - 1], scipy.interpolate.CubicSpline(t[a:b], values[a:b])) for a, b in pairwise(cuts)])

    @classmethod
    def sampled(cls, function: Callable[[float], float], until: float) -> TimeFunction:
        """Return the quintic spline of a Python function on [0, until], refined to a relative error of 1e-11.

        Returns
        -------
        TimeFunction
            Of one piece, with four continuous derivatives.

        Raises
        ------
        InputError
            When the function is not smooth enough, or not finite.

        Examples
        --------
        >>> import math
        >>> wave = TimeFunction.sampled(math.sin, until=2.0)
        >>> bool(abs(wave(1.0)[0] - math.sin(1.0)) < 1e-11)
        True
        """
        intervals, largest = SAMPLES
        while intervals <= largest:
            t = np.linspace(0.0, until, 2 * intervals + 1)
            values = np.array([float(function(x)) for x in t])
            if not np.all(np.isfinite(values)):
                raise InputError(f"function of time: not finite at t = {t[~np.isfinite(values)][0]:g} s")
            coarse = scipy.interpolate.make_interp_spline(t[::2], values[::2], k=5)
            if np.abs(coarse(t) - values).max() <= 2**6 * SAMPLED * np.abs(values).max():  # order 6: t is finer by 2
                fine = scipy.interpolate.make_interp_spline(t, values, k=5)
                return cls([(float(until), scipy.interpolate.PPoly.from_spline(fine))])
            intervals *= 2
        raise InputError(
            f"function of time: {largest} samples up to t = {until:g} s do not resolve it; it must be smooth: give "
            "jumps as pieces of an expression, or by a table that repeats their times"
        )

    def __call__(self, t: float) -> tuple[float, float, float]:
        """Return value, rate and acceleration at time t; an `InputError` where they are not finite.

        Returns
        -------
        (3,) float
            Unit of the value, that per s, per s^2.
        """
        piece = next((p for p in self.pieces if t < p.until), self.pieces[-1])
        value, rate, acceleration = checked(piece, np.array([t]))[:, 0].tolist()
        return value, rate, acceleration

    def __reduce__(self) -> tuple:
        """Copies in other processes are made anew: what evaluates a piece cannot be sent."""
        return TimeFunction, (self.source,)

    def __neg__(self) -> TimeFunction:
        """Return the function with the opposite sign."""
        return self.scaled(-1.0)

    def scaled(self, factor: float) -> TimeFunction:
        """Return the function times a number.

        Returns
        -------
        TimeFunction
            Of as many pieces.

        Examples
        --------
        >>> TimeFunction("t**2").scaled(2.0)(3.0)
        (18.0, 12.0, 4.0)
        """
        return TimeFunction([(until, _times(what, float(factor))) for until, what in self.given])

    @property
    def given(self) -> list[tuple]:
        """What the pieces were made from: ``(until, number, expression or spline)``."""
        whole = isinstance(self.source, (str, int, float, np.number))
        return [(FOREVER, self.source)] if whole else list(self.source)

    @property
    def breaks(self) -> list[float]:
        """Times at which one piece ends and the next begins."""
        return [piece.until for piece in self.pieces[:-1]]

    def refuse_jumps(self, what: str, smooth: bool = True) -> None:
        """Raise an `InputError` when the value or, if `smooth`, the rate jumps between pieces."""
        if not self.breaks:
            return
        at = np.array(self.breaks)[:, None]
        sides = [[checked(p, t)[:2, 0] for p in two] for t, two in zip(at, pairwise(self.pieces), strict=True)]
        scale = np.abs([self(0.0)[:2], *(side for pair in sides for side in pair)]).max(axis=0)
        for t, (left, right) in zip(self.breaks, sides, strict=True):
            for name, a, b, size in list(zip(("value", "rate"), left, right, scale, strict=True))[: 1 + smooth]:
                if abs(b - a) > SMOOTH * size:
                    may = "acceleration of a prescribed motion" if smooth else "rate"
                    raise InputError(
                        f"{what} jumps at t = {t:g} s: its {name} is {a:g} before and {b:g} after; only the {may} "
                        "may jump"
                    )


def checked(piece: Piece, t: np.ndarray) -> np.ndarray:
    """Return value, rate and acceleration (3, len(t)) of a piece; an `InputError` where they are not finite."""
    with np.errstate(all="ignore"):
        found = piece.evaluate(t)
    bad = ~np.all(np.isfinite(found), axis=0)
    if np.any(bad):
        raise InputError(f"{piece.text} has no finite value, rate and acceleration at t = {t[bad][0]:g} s")
    return found


def _is_table(what: Any) -> bool:
    """Whether a piece is a spline; its class is not imported where there is none, which takes a fifth of a second."""
    return hasattr(what, "derivative")


def _times(what: Any, factor: float) -> Any:
    if _is_table(what):
        return scipy.interpolate.PPoly(factor * what.c, what.x)
    return f"({factor!r})*({what})" if isinstance(what, str) else factor * what


def _piece(until: float, what: Any) -> Piece:
    if _is_table(what):
        first, second = what.derivative(), what.derivative(2)
        return Piece(until, lambda t: np.array([what(t), first(t), second(t)]), np.unique(what.x), "a table")
    if isinstance(what, str):
        return Piece(until, expression(what), None, f"function of time {what!r}")
    value = float(what)
    if not np.isfinite(value):
        raise InputError(f"function of time: {value} is not a finite number")
    return Piece(until, lambda t: np.array([np.full(len(t), value), 0 * t, 0 * t]), None, f"{value:g}")


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

    value, t = read_expression(text), symengine.Symbol("t")
    try:
        derivatives = symengine.Lambdify([t], [value, value.diff(t), value.diff(t, t)])
    except (RuntimeError, TypeError, ValueError, AttributeError, NotImplementedError):
        raise InputError(f"function of time {text!r} has no two real derivatives; use t and {FUNCTIONS}") from None
    return lambda times: np.asarray(derivatives(times[:, None]), dtype=float).reshape(len(times), 3).T
