"""Pack functions of time into the tables of the kernel, with knots as close as the interpolation error asks for.

Expressions are first looked at in steps of half the shortest event, so that none of that length stays between knots.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.kernels.time_tables import Tables, quintic
from modalprep.multibody.model.functions.survey import is_surely_slow, survey_width
from modalprep.multibody.model.time_function import FOREVER, Piece, TimeFunction, checked
from modalprep.multibody.packing.step_bounds import smooth_cells, tolerance_of

VALUE_ERROR = 1e-12  # of the largest value of a piece: an integrator at rtol 1e-10 does not see it
ACCELERATION_ERROR = 1e-9  # of the largest acceleration
ROUND_OFF = 64 * np.finfo(float).eps  # what values of size 1 leave of an acceleration times interval squared
PROBES = (0.38196601, 0.5)  # where an interval is tested: the middle, and a place no period shares with it
FIRST_INTERVALS, MOST_KNOTS = 8, 1_000_000
SHORTEST = 1e-12  # of a piece


def tabulate(
    functions: Sequence[TimeFunction], t_end: float, owners: Sequence[str] = (), shortest_event: float | None = None
) -> Tables:
    """Return the tables of functions on [0, t_end]; `owners` begin the messages about them.

    Expressions are looked at for events as short as `shortest_event` (s), by default 1e-4 of t_end.

    Raises
    ------
    InputError
        When a function ends before `t_end`, is not finite, or varies too fast for a table.

    Examples
    --------
    >>> from modalprep.multibody.kernels.time_tables import table
    >>> tables = tabulate([TimeFunction(2.0), TimeFunction("sin(t)")], 1.0)
    >>> bool(abs(table(tables, 1, 0.3)[0] - np.sin(0.3)) < 1e-12)
    True
    """
    width = survey_width(t_end, shortest_event)
    return _tables(functions, t_end, owners, width) if functions else _no_tables()


@cache
def _no_tables() -> Tables:
    """Return the tables of no function, the same for all systems: nothing in them is read."""
    return _tables((), 0.0, (), 0.0)


def _tables(functions: Sequence[TimeFunction], t_end: float, owners: Sequence[str], width: float) -> Tables:
    knots: list[np.ndarray] = []
    until: list[float] = []
    first = [0]
    for number, function in enumerate(functions):
        try:
            for piece, begin, end in _used(function, t_end):
                knots.append(_knots(piece, begin, end, width))
                until.append(piece.until)
        except InputError as error:
            raise InputError(f"{owners[number]}: {error}" if owners else str(error)) from None
        first.append(len(knots))
    return Tables(
        first=np.array(first),
        until=np.array(until, dtype=float),
        knot=np.cumsum([0, *(len(k) for k in knots)]),
        knots=np.concatenate([np.zeros((0, 4)), *knots]),
        middle=np.array([np.nan]),
    )


def _used(function: TimeFunction, t_end: float) -> list[tuple[Piece, float, float]]:
    """Pieces that [0, t_end] needs, with the stretch of each."""
    last = function.pieces[-1].until
    if last < t_end * (1 - 1e-12):
        raise InputError(f"a function of time ends at t = {last:g} s, the simulation at {t_end:g} s; extend it")
    starts = [0.0, *function.breaks]
    ends = [t_end if p.until == FOREVER else p.until for p in function.pieces]
    return [
        (p, a, b) for p, a, b in zip(function.pieces, starts, ends, strict=True) if p.until > 0 and a < max(b, t_end)
    ]


def _knots(piece: Piece, begin: float, end: float, width: float) -> np.ndarray:
    if piece.knots is not None:  # a polynomial of degree five or less is its own interpolant
        if piece.knots[0, 0] > begin:
            raise InputError(
                f"a table of time begins at t = {piece.knots[0, 0]:g} s, but is needed from {begin:g} s on"
            )
        return piece.knots
    t = np.linspace(begin, end, FIRST_INTERVALS + 1)
    if not is_surely_slow(piece.source, end - begin, width):
        t = np.union1d(t, _surveyed(piece, begin, end, width))
    while True:
        knots = _hermite(piece, t)
        coarse = _coarse(piece, knots)
        if not np.any(coarse):
            return knots
        h = np.diff(t)
        if len(t) > MOST_KNOTS or np.any(h[coarse] < SHORTEST * (end - begin)):
            raise InputError(
                f"{piece.text} varies too fast near t = {t[:-1][coarse][0]:.6g} s; "
                "it must be smooth: give its jumps and kinks as ends of pieces"
            )
        t = np.sort(np.concatenate([t, (t[:-1] + h / 2)[coarse]]))


def _surveyed(piece: Piece, begin: float, end: float, width: float) -> np.ndarray:
    """Return times between which an expression is smooth, as far as it is seen at two times in each event."""
    t = np.linspace(begin, end, 2 * FIRST_INTERVALS * int(np.ceil((end - begin) / width / FIRST_INTERVALS)) + 1)
    value = checked(piece, t)[0]
    return t[smooth_cells(t, value, tolerance_of(value))]


def _hermite(piece: Piece, t: np.ndarray) -> np.ndarray:
    return np.column_stack([t, checked(piece, t).T])


def _coarse(piece: Piece, knots: np.ndarray) -> np.ndarray:
    """Return which intervals are too long for their interpolation."""
    h = np.diff(knots[:, 0])
    size = np.abs(knots[:, 1:]).max(axis=0)
    found = np.zeros(len(h), dtype=bool)
    plain = getattr(quintic, "py_func", quintic)  # on arrays
    for probe in PROBES:
        t = knots[:-1, 0] + probe * h
        exact = checked(piece, t)
        value, _, acceleration = plain(knots[:-1].T, knots[1:].T, t)
        allowed = np.maximum(ACCELERATION_ERROR * size[2], ROUND_OFF * size[0] / h**2)
        found |= np.abs(value - exact[0]) > VALUE_ERROR * size[0]
        found |= np.abs(acceleration - exact[2]) > allowed
    return found
