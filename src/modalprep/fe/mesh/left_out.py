"""The note on what a reader of a file leaves out, and refusals that such notes explain."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from functools import wraps
from typing import Any

from modalprep.errors import InputError

MOST = 12  # names in one note


def left_out(found: Iterable[tuple[str, str]], advice: str) -> tuple[str, ...]:
    """Return one note that counts what was left out and says where the first of each is, or none.

    Parameters
    ----------
    found : iterable of (name, place)
    advice : str
        What the user can do.

    Returns
    -------
    tuple of str
        Empty when nothing was left out.

    Examples
    --------
    >>> left_out([("*MPC", "line 8"), ("*TIE", "line 9"), ("*MPC", "line 12")], "model them otherwise")
    ('left out: 2 *MPC (first in line 8), 1 *TIE (line 9); model them otherwise',)
    """
    count: Counter[str] = Counter()
    place: dict[str, str] = {}
    for name, where in found:
        count[name] += 1
        place.setdefault(name, where)
    if not count:
        return ()
    listed = ", ".join(f"{n} {name} ({'first in ' * (n > 1)}{place[name]})" for name, n in count.most_common(MOST))
    return (f"left out: {listed}{' and others' if len(count) > MOST else ''}; {advice}",)


def explained(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function of a mesh whose refusals end with the notes of the mesh's reader, which may explain them."""

    @wraps(function)
    def told(mesh: Any, *args: Any, **given: Any) -> Any:
        try:
            return function(mesh, *args, **given)
        except InputError as error:
            notes = getattr(mesh, "notes", ())
            if not notes:
                raise
            raise InputError(f"{error} (of {mesh.source or 'the mesh'} its reader noted: {'; '.join(notes)})") from None

    return told
