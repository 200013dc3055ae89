"""The table of a study as its page holds it: JSON by columns, short numbers, each text once."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

ROUND_OFF, TINY = 1e-9, 1e-12  # of a number, and of zero
DIGITS = ".8g"  # of numbers on the page; the files beside it have them all


def page_data(columns: Mapping[str, Sequence[Any]], settings: Mapping[str, Any], pages: Sequence[str] = ()) -> str:
    r"""Return the columns, the pages of each job and what else a page reads, as JSON that may stand inside a script.

    Examples
    --------
    >>> print(page_data({"mass_kg": [1 / 3, None]}, {"shown": ["</script>"]}, ["body log", "log"]))
    {"columns": [{"name": "mass_kg", "values": [0.33333333,null]}],
    "pages": {"name": "pages", "texts": ["", "body log", "log"], "index": [1,2]}, "shown": ["\u003c/script>"]}
    """
    found = ",".join(_column(name, values) for name, values in columns.items())
    rest = "".join(f", {json.dumps(key)}: {json.dumps(value)}" for key, value in settings.items())
    return f'{{"columns": [{found}], "pages": {_column("pages", pages)}{rest}}}'.replace("<", "\\u003c")


def _column(name: str, values: Sequence[Any]) -> str:
    head = f'{{"name": {json.dumps(name)}'
    if is_number(values):
        numbers = ",".join("null" if x is None else format(x, DIGITS) for x in values)
        return f'{head}, "values": [{numbers}]}}'
    place = {"": 0}
    index = ",".join(str(place.setdefault("" if x is None else str(x), len(place))) for x in values)
    return f'{head}, "texts": {json.dumps(list(place))}, "index": [{index}]}}'


def is_number(values: Sequence[Any]) -> bool:
    """Whether a column has numbers, and nothing else but empty cells."""
    kinds = {type(value) for value in values} - {type(None)}
    return bool(kinds) and kinds <= {int, float}


def varying(values: Sequence[Any]) -> bool:
    """Whether a column has different values that are no round-off.

    Examples
    --------
    >>> varying([1.0, None, 1.0]), varying([1.0, 2.0])
    (False, True)
    """
    known = iter(value for value in values if value is not None)
    first = next(known, None)
    return any(value != first and not _close(value, first) for value in known)


def _close(one: Any, other: Any) -> bool:
    if isinstance(one, str) or isinstance(other, str):
        return False
    return abs(one - other) <= max(ROUND_OFF * max(abs(one), abs(other)), TINY)
