"""Functions of time for prescribed motions and forces: expressions, tables, sampled callables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.model.functions.safe_expression import expression
from modalprep.multibody.model.functions.survey import survey_width

TimeFunctionLike: TypeAlias = "TimeFunction | float | str | Sequence[tuple[float, Any]]"  # what `TimeFunction.of` takes
FOREVER = float("inf")
SMOOTH = 1e-6  # relative size below which a jump of a prescribed motion is rounding of constants


class Piece(NamedTuple):
    """One piece of a function of time.

    Attributes
    ----------
    until : float
        s, its end.
    evaluate : callable
        Of times ``(n,)``: value, rate and acceleration, ``(3, n)``.
    knots : (k, ...) or None
        `curves.knots` of a curve.
    text : str
        What it is called in messages.
    source : object
        What it was made of.
    """

    until: float
    evaluate: Callable[[np.ndarray], np.ndarray]
    knots: np.ndarray | None
    text: str
    source: Any


@dataclass(frozen=True, eq=False)
class TimeFunction:
    """A function of time ``t`` (s): a number, an expression, or pieces ``(until, expression)``, the last without end.

    Expressions are differentiated by symengine; nothing is ever evaluated as Python. `table` takes
    points, `sampled` a Python function. A force may jump between pieces, where the integrator restarts; of a
    prescribed motion only the acceleration may jump.

    Attributes
    ----------
    source : float, str, sequence of (float, str), or TimeFunction
        What it was made of.
    pieces : tuple of Piece
        In order of time.

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

    source: TimeFunctionLike
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
    def of(cls, value: TimeFunctionLike, what: str = "") -> TimeFunction:
        """Return `value` if it is one already, else a new one of a number, an expression or pieces.

        Returns
        -------
        TimeFunction
            The function.
        """
        return value if isinstance(value, cls) else cls(value)

    @classmethod
    def table(
        cls, t: Sequence[float], values: Sequence[float], *, smooth: bool = False, spline: bool = False
    ) -> TimeFunction:
        """Return straight lines between points, by default; a repeated time is a jump.

        Of a prescribed motion only the acceleration may jump: there a cubic spline takes the place of the lines.

        Parameters
        ----------
        t : (n,)
            s, from 0 or earlier to the end of the simulation or later.
        values : (n,)
        smooth : bool
            A monotone curve (PCHIP) instead, which never leaves the values of two neighbouring points.
        spline : bool
            A cubic spline with two continuous derivatives, which may go far beyond the points.

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
        >>> step = TimeFunction.table([0, 1, 1, 2], [0, 1, 5, 5])
        >>> step(0.5)[0], step(1.5)[0]
        (0.5, 5.0)
        """
        from modalprep.multibody.model.functions import curves

        return cls(curves.through(t, values, smooth, spline))

    @classmethod
    def sampled(
        cls, function: Callable[[float], float], until: float, shortest_event: float | None = None
    ) -> TimeFunction:
        """Return the quintic spline of a Python function on [0, until], refined to a relative error of 1e-11.

        Parameters
        ----------
        function : callable
            ``t -> value``.
        until : float
            s.
        shortest_event : float or None
            s, by default 1e-4 of the span: the function is called twice in each, and what is shorter may be missed.

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
        from modalprep.multibody.model.functions import curves

        return cls([(float(until), curves.sampled(function, float(until), survey_width(until, shortest_event)))])

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

    def as_motion(self) -> TimeFunction:
        """Return the function with the continuous rate that a prescribed motion needs.

        A cubic spline takes the place of straight lines between points. A monotone curve becomes a piece between each
        two points, where its acceleration jumps.

        Returns
        -------
        TimeFunction
            Itself, but for tables.

        Examples
        --------
        >>> TimeFunction.table([0, 1, 2], [0, 1, 0]).as_motion()(0.5)[0]
        0.75
        """
        return self._with_curves("in_motion")

    def by_parts(self) -> TimeFunction:
        """Return the function with a piece between each two points of its tables, for a use in which the rate counts.

        Returns
        -------
        TimeFunction
            Itself, but for tables of straight lines and monotone curves.

        Examples
        --------
        >>> TimeFunction.table([0, 1, 2], [0, 1, 0]).by_parts().breaks
        [1.0]
        """
        return self._with_curves("parts")

    def _with_curves(self, change: str) -> TimeFunction:
        if not any(_is_table(what) for _, what in self.given):
            return self
        from modalprep.multibody.model.functions import curves

        found = []
        for until, what in self.given:
            found += getattr(curves, change)(what, until) if _is_table(what) else [(until, what)]
        return TimeFunction(found)

    @property
    def given(self) -> list[tuple]:
        """What the pieces were made from: ``(until, number, expression or spline)``."""
        source: Any = self.source
        return [(FOREVER, source)] if isinstance(source, (str, int, float, np.number)) else list(source)

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
        scale = np.abs(np.array([self(0.0)[:2], *(side for pair in sides for side in pair)])).max(axis=0)
        mean = np.diff([left[0] for left, _ in sides]) / np.diff(self.breaks)  # rates at the breaks may be round-off
        scale[1] = np.abs(mean).max(initial=scale[1])
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
        raise InputError(
            f"{piece.text} has no finite value, rate and acceleration at t = {t[bad][0]:g} s; give its jumps and kinks "
            "as ends of pieces"
        )
    return found


def _is_table(what: Any) -> bool:
    """Whether a piece is a spline; its class is not imported where there is none, which takes a fifth of a second."""
    return hasattr(what, "derivative")


def _times(what: Any, factor: float) -> Any:
    if _is_table(what):
        from modalprep.multibody.model.functions.curves import scaled

        return scaled(what, factor)
    return f"({factor!r})*({what})" if isinstance(what, str) else factor * what


def motion(value: TimeFunctionLike, what: str = "") -> TimeFunction:
    """Return a function of time as `TimeFunction.as_motion` has it."""
    return TimeFunction.of(value).as_motion()


def motions(
    value: TimeFunction | float | str | Sequence[TimeFunctionLike], what: str = ""
) -> TimeFunction | tuple[TimeFunction, ...]:
    """Return the motion of a joint's coordinate, or a tuple of them of a list or tuple.

    Examples
    --------
    >>> type(motions(["t", 2.0])).__name__
    'tuple'
    """
    each: Any = value
    return tuple(map(motion, each)) if isinstance(value, list | tuple) else motion(each)


def by_parts(value: TimeFunctionLike, what: str = "") -> TimeFunction:
    """Return a function of time as `TimeFunction.by_parts` has it, for a mass whose rate counts."""
    return TimeFunction.of(value).by_parts()


def _piece(until: float, what: Any) -> Piece:
    if _is_table(what):
        from modalprep.multibody.model.functions.curves import knots

        first = what.derivative()
        second = what.derivative(2)
        return Piece(until, lambda t: np.array([what(t), first(t), second(t)]), knots(what), "a table", what)
    if isinstance(what, str):
        return Piece(until, expression(what), None, f"function of time {what!r}", what)
    value = float(what)
    if not np.isfinite(value):
        raise InputError(f"function of time: {value} is not a finite number")
    return Piece(until, lambda t: np.array([np.full(len(t), value), 0 * t, 0 * t]), None, f"{value:g}", value)
