"""Notes on functions of time: events too short to be seen, and motions that leave the points of their tables."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np

from modalprep.multibody.evaluation.laws_of_time import parts_of_time
from modalprep.multibody.model.functions.survey import is_surely_slow, survey_width
from modalprep.multibody.model.loads import Callback, SampledLoad
from modalprep.multibody.model.time_function import TimeFunction

BEYOND = 0.01  # of the range of a table: a spline that leaves it by more is told
PLAIN = (float, int, str, np.ndarray, type(None))  # in these there is no function


def time_notes(system: Any, t_end: float, shortest_event: float | None) -> tuple[str, ...]:
    """Return what the functions of time of a system on [0, t_end] cannot promise.

    Parameters
    ----------
    system : System or DeployingSystem
    t_end : float
        s.
    shortest_event : float or None
        As `simulate` has it. Where it is stated, expressions are known to have no shorter event.
    """
    found = list(functions_of_time(system))
    shorts = _unseen(found, t_end, shortest_event)
    return tuple(shorts + [note for name, function in found for note in _overshoots(name, function)])


def functions_of_time(record: Any, name: str = "") -> Iterator[tuple[str, TimeFunction | Callback]]:
    """Yield the functions of time, and the callbacks, in a record, with the names of their owners."""
    if isinstance(record, SampledLoad):
        return
    if isinstance(record, TimeFunction | Callback):
        yield name or getattr(record, "name", ""), record
        return
    own = getattr(record, "name", name)
    parts = record if isinstance(record, tuple | list) else [getattr(record, each) for each in _names(type(record))]
    for part in parts:
        if not isinstance(part, PLAIN):
            yield from functions_of_time(part, own)


@cache
def _names(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else ()


def _unseen(times: list[tuple[str, Any]], t_end: float, shortest_event: float | None) -> list[str]:
    """Return the note on functions that were looked through in steps."""
    widths: dict[float, list[str]] = {}
    for name, function in times:
        width = _looked_at(function, t_end, shortest_event)
        if width:
            widths.setdefault(width, []).append(name)
    return [
        f"features of t shorter than {width:.3g} s may be missed in {', '.join(map(repr, dict.fromkeys(names)))}; give "
        "the shortest event, or the times of short ones as ends of pieces"
        for width, names in widths.items()
    ]


def _looked_at(function: TimeFunction | Callback, t_end: float, shortest_event: float | None) -> float:
    """Return the width (s) to which a function was looked through; 0 where it has no shorter event."""
    if isinstance(function, TimeFunction):
        sampled = [getattr(piece.source, "width", 0.0) for piece in function.pieces]
        if any(sampled):
            return max(sampled)
    if shortest_event is not None:
        return 0.0
    width = survey_width(t_end, None)
    if isinstance(function, TimeFunction):
        parts = [piece.source for piece in function.pieces]
    else:
        parts = [str(part) for law in function.laws for part in parts_of_time(law)]
    return 0.0 if all(is_surely_slow(part, t_end, width) for part in parts) else width


def _overshoots(name: str, function: TimeFunction | Callback) -> list[str]:
    """Return a note where the cubic spline of a motion goes beyond the points that it was made from."""
    pieces = function.pieces if isinstance(function, TimeFunction) else ()
    for curve in (piece.source for piece in pieces if getattr(piece.source, "in_place_of_lines", False)):
        points = curve(curve.x)
        between = curve(np.concatenate([curve.x, curve.derivative().roots(extrapolate=False)]))
        low = points.min()
        high = points.max()
        bottom = np.nanmin(between)
        top = np.nanmax(between)
        if max(low - bottom, top - high) > BEYOND * (high - low):
            return [
                f"{name!r}: the cubic spline of its motion goes from {bottom:.4g} to {top:.4g} between points from "
                f"{low:.4g} to {high:.4g}; give more points, or smooth = true for a curve that does not"
            ]
    return []
