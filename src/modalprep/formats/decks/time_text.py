"""Functions of time as expressions of a programming language."""

from __future__ import annotations

import re
from collections.abc import Iterator

from modalprep.errors import InputError
from modalprep.multibody.model.time_function import TimeFunction


def python_text(function: TimeFunction, what: str) -> str:
    """Return a function of time as an expression of Python with the names of its module math.

    Raises
    ------
    InputError
        When it is a table or a Python function; `what` starts the message.

    Examples
    --------
    >>> python_text(TimeFunction([(2.0, "t^2/2"), (float("inf"), "2*t - 2")]), "the motion")
    '(t**2/2) if t <= 2.0 else (2*t - 2)'
    """
    texts = []
    for until, source in _expressions(function, what, "a script"):
        text = f"({source.replace('^', '**')})" if isinstance(source, str) else repr(float(source))
        texts.append(text if until == float("inf") else f"{text} if t <= {float(until)!r} else")
    return " ".join(texts)


def is_zero(function: TimeFunction) -> bool:
    """Return whether a function is the number zero.

    Examples
    --------
    >>> is_zero(TimeFunction(0.0)), is_zero(TimeFunction("t"))
    (True, False)
    """
    return all(isinstance(source, int | float) and source == 0 for _, source in function.given)


def mbdyn_text(function: TimeFunction, what: str) -> str:
    """Return a function of time as an expression of MBDyn, in which the time is `Time`.

    Raises
    ------
    InputError
        When it is a table or a Python function; `what` starts the message.

    Examples
    --------
    >>> mbdyn_text(TimeFunction([(2.0, "t**2/2."), (float("inf"), "2*sqrt(t)")]), "the motion")
    '(Time^2/2.)*(Time <= 2.0) + (2.*sqrt(Time))*(Time > 2.0)'
    """
    texts, since = [], ""
    for until, source in _expressions(function, what, "a deck"):
        text = f"({_of_mbdyn(source)})" if isinstance(source, str) else repr(float(source))
        ends = [since] if since else []
        ends += [] if until == float("inf") else [f"(Time <= {float(until)!r})"]
        texts.append("*".join([text, *ends]))
        since = f"(Time > {float(until)!r})"
    return " + ".join(texts)


def _expressions(function: TimeFunction, what: str, carrier: str) -> Iterator[tuple[float, float | str]]:
    """Yield the pieces of a function by the times at which they end; refuse tables and functions of Python."""
    for until, source in function.given:
        if not isinstance(source, int | float | str):
            raise InputError(
                f"{what} is a table or a function of Python, which {carrier} cannot carry; give expressions"
            )
        yield until, source


def _of_mbdyn(text: str) -> str:
    """Return an expression with MBDyn's names; integers become reals, as it divides integers without remainder."""
    text = re.sub(r"\bt\b", "Time", text.replace("**", "^"))
    return re.sub(r"(?<![\w.^])(\d+)(?![\w.])", r"\1.", text)
