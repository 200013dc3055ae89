"""Functions of time as expressions of a programming language."""

from __future__ import annotations

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
    for until, source in function.given:
        if not isinstance(source, int | float | str):
            raise InputError(
                f"{what} is a table or a function of Python, which a script cannot carry; give expressions"
            )
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
