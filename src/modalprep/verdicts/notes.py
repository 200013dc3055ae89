"""Notes for the user on a result, which of them are warnings, and how Python says those."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from typing import ParamSpec, TypeVar

from modalprep.errors import ModalprepWarning

# Parts of notes that need no action. All others are warnings, so that a note nobody thought of is not good news.
WELL = (
    r"all \d+ [\w-]+ modes below .* were found",
    r"there are no [\w-]+ modes below",
    r"cells have no property .* and are left out; their groups name nodes only",
    r"the second-order modal mass \(T\) is included",
    r"mixed interfaces: ",
    r"^exact: ",
    r"the file does not hold units: ",
    r"the model has \d+ [\w-]+ modes only",
    r"error against the full model below",
    r"damping couples the modes: the coupled equations are solved",
    r"as if it were rigid, which changes the force there by",
    r"of which cycles are Rayleigh's, not Dirlik's",
    r"^conventional theory \(without\): ",  # compared on purpose
    r"PARDISO, quicker,",
    r"is not audited",
    r"without the deflection that loads cause at once",
    r"is free: static responses are exact for the loads",
    r"miss the sine by",
    r"their peaks are listed, without curves$",
    r"^pictures not drawn: ",
    r"^pictures of links that are missing or neither ",
    r"coordinates are kept; they represent at least",
    r"hexahedra of 20 nodes are integrated with ",
    r"has the integration of its property, ",
    r"have incompatible modes here, and no hourglasses",
    r"elements of S4R are shells here",
    r"^by differences of ",
    r"large deflections by \d+ stations along the ways from the root$",
    r"stations leave about [^:]*$",
    r"^the stiffness was factorised: ",
)
P = ParamSpec("P")
R = TypeVar("R")
SHOWN = 3  # warnings behind the text of a record
_silent: ContextVar[bool] = ContextVar("silent", default=False)


def kind_of(note: str) -> str:
    """Return "notes" or "warnings".

    Examples
    --------
    >>> kind_of("all 19 fixed-interface modes below 49162 Hz were found (a dense solver leaves none out)")
    'notes'
    >>> kind_of("its size is implausible for a body of 120 m")
    'warnings'
    """
    return "notes" if any(re.search(pattern, note) for pattern in WELL) else "warnings"


def warnings_of(notes: Iterable[str]) -> tuple[str, ...]:
    """Return the warnings among notes, each once.

    Examples
    --------
    >>> warnings_of(["there are no free modes below 3 Hz", "its mass is implausible", "its mass is implausible"])
    ('its mass is implausible',)
    """
    return tuple(dict.fromkeys(note for note in notes if kind_of(note) == "warnings"))


def with_warnings(text: str, notes: Iterable[str]) -> str:
    """Return the text of a record with its warnings below, a line each.

    Examples
    --------
    >>> print(with_warnings("FlexibleBody('arm')", ["its mass is implausible"]))
    FlexibleBody('arm')
      warning: its mass is implausible
    """
    found = warnings_of(notes)
    more = [f"  and {len(found) - SHOWN} more warnings in its notes"] if len(found) > SHOWN else []
    return "\n".join([text, *(f"  warning: {note}" for note in found[:SHOWN]), *more])


def warn(notes: Iterable[str]) -> None:
    """Issue the warnings among notes as `ModalprepWarning`, at the line of the user's code that asked for the result.

    Python shows a warning once for each line of code; its filters silence them or turn them into errors:
    ``warnings.simplefilter("error", modalprep.ModalprepWarning)``.
    """
    if _silent.get():
        return
    for note in warnings_of(notes):
        warnings.warn(note, ModalprepWarning, stacklevel=_level_of_the_user())


def told(make: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function to issue the warnings of what it returns, less those of the records that it was given.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> @told
    ... def weigh(mesh):
    ...     return SimpleNamespace(notes=("its mass is implausible", *mesh.notes))
    >>> with warnings.catch_warnings(record=True) as heard:
    ...     warnings.simplefilter("always")
    ...     found = weigh(SimpleNamespace(notes=("1 cell is warped",)))
    >>> [str(each.message) for each in heard]
    ['its mass is implausible']
    """

    @wraps(make)
    def telling(*given: P.args, **options: P.kwargs) -> R:
        with silent():
            found = make(*given, **options)
        records = [each for each in (*given, *options.values()) if not hasattr(each, "bodies")]  # systems say nothing
        before = {note for each in records for note in getattr(each, "notes", ())}
        warn(note for note in getattr(found, "notes", ()) if note not in before)
        return found

    return telling


@contextmanager
def silent() -> Iterator[None]:
    """Issue no warnings inside, where a report prints the notes.

    Examples
    --------
    >>> with silent():
    ...     warn(["its mass is implausible"])
    """
    token = _silent.set(True)
    try:
        yield
    finally:
        _silent.reset(token)


def _level_of_the_user() -> int:
    """Return the number of frames between `warn` and the first one outside this package."""
    frame = sys._getframe(1)
    level = 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "modalprep":
        frame = frame.f_back
        level = level + 1
    return level
