"""The note on what a reader of a file leaves out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

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
