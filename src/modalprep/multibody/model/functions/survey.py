"""How short the events of a function of time may be: the width that is looked for, and what an expression promises."""

from __future__ import annotations

from typing import Any

from modalprep.errors import InputError
from modalprep.multibody.model.functions.safe_expression import read_expression

SHARE = 1e-4  # of its span: the shortest event that is looked for where none is stated
MOST_EVENTS = 2e6  # in a span that is looked for short ones


def survey_width(span: float, shortest_event: float | None) -> float:
    """Return the width (s) of the shortest event that is looked for in a span (s).

    Raises
    ------
    InputError
        When the one stated is not positive, or too short to be looked for.
    """
    width = SHARE * span if shortest_event is None else shortest_event
    if isinstance(width, bool) or not isinstance(width, int | float) or not 0 < width < float("inf"):
        raise InputError(f"shortest_event = {width} must be a positive number (s)")
    if width < span / MOST_EVENTS:
        raise InputError(
            f"shortest_event = {width:g} s is less than {1 / MOST_EVENTS:g} of {span:g} s, which takes too long to "
            "look for; give a longer one, and the times of shorter events as ends of pieces"
        )
    return float(width)


def is_surely_slow(what: Any, span: float, width: float) -> bool:
    """Whether a number or an expression of time surely has no event shorter than `width` in a span (s).

    Numbers, polynomials, and sines and exponentials of what is linear in time, their sums and products.

    Examples
    --------
    >>> is_surely_slow("3*t**2*sin(5*t)", 10.0, 1e-3), is_surely_slow("exp(-((t - 5)/0.01)**2)", 10.0, 1e-3)
    (True, False)
    """
    return not isinstance(what, str) or _fastest(read_expression(what), span) * width <= 1.0


def _fastest(node: Any, span: float) -> float:
    """Return a bound of rates over values (1/s); infinite where none is known."""
    import symengine as se

    if not node.free_symbols:
        return 0.0
    rates = [_fastest(part, span) for part in node.args]
    if node.is_Symbol:
        return 1.0 / span
    if node.is_Add:
        return max(rates)
    if node.is_Mul:
        return sum(rates)
    if node.is_Pow and isinstance(node.args[1], se.Integer) and node.args[1] > 0:
        return rates[0] * int(node.args[1])
    if node.is_Pow and not node.args[0].free_symbols:
        return _slope(node.args[1] * se.log(node.args[0]))
    return _slope(node.args[0]) if isinstance(node, se.sin | se.cos | se.sinh | se.cosh) else float("inf")


def _slope(node: Any) -> float:
    """Return the rate of what is linear in time, or of an angle; infinite of all else."""
    import symengine as se

    slope = node.diff(se.Symbol("t"))
    return float("inf") if slope.free_symbols else abs(complex(slope))
