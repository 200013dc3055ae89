"""The table of a study: a column for each parameter and quantity, a row for each job."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

FIXED = ("status", "verdict", "cause", "seconds")
Cell = float | int | str | None


@dataclass(frozen=True)
class StudyTable:
    """Columns of equal length by name; None where a job has no value.

    Attributes
    ----------
    columns : {name: list}
        ``job``, the parameters, ``status``, ``verdict``, ``cause``, ``seconds``, then quantities as they came first.
    parameters : tuple of str
        Names of the columns that the grid has set.

    Examples
    --------
    >>> rows = [{"job": "a", "parameters": {"t": 2.0}, "status": "done", "quantities": {"mass_kg": 1.5}},
    ...         {"job": "b", "parameters": {"t": 3.0}, "status": "waiting"}]
    >>> study_table(rows).columns["mass_kg"]
    [1.5, None]
    """

    columns: dict[str, list[Cell]]
    parameters: tuple[str, ...]

    def is_number(self, name: str) -> bool:
        """Whether a column has numbers only; of those without any value only the time.

        Examples
        --------
        >>> table = StudyTable({"a": [1, None], "b": [1, "x"], "c": [None, None]}, ())
        >>> [table.is_number(name) for name in "abc"]
        [True, False, False]
        """
        kinds = {type(value) for value in self.columns[name]} - {type(None)}
        return kinds <= {int, float} and (bool(kinds) or name == "seconds")


def study_table(rows: Sequence[Mapping[str, Any]]) -> StudyTable:
    """Return the table of the jobs of a batch, as ``batch.json`` lists them.

    A parameter that is called as another column is called ``parameter_NAME``, and a quantity that is called as a
    parameter ``NAME_result``.
    """
    parameters = _renamed([row.get("parameters") or row.get("values") or {} for row in rows], ("job", *FIXED),
                          "parameter_{}")  # fmt: skip
    named = ("job", *FIXED, *parameters)
    stated = [row.get("quantities") or {} for row in rows]
    given = _renamed([{key: x for key, x in each.items() if key not in FIXED} for each in stated], named, "{}_result")
    fixed = {"job": [row["job"] for row in rows], **parameters, "status": [row.get("status") for row in rows]}
    fixed["verdict"] = [(row.get("verdict") or {}).get("word") for row in rows]
    fixed["cause"] = [row.get("cause") or None for row in rows]
    fixed["seconds"] = [_cell(row.get("seconds")) for row in rows]
    return StudyTable(fixed | given, tuple(parameters))


def _renamed(rows: Sequence[Mapping[str, Any]], taken: Sequence[str], other: str) -> dict[str, list[Cell]]:
    """Return rows as columns, in the order in which their names come first."""
    names = dict.fromkeys(name for row in rows for name in row)
    return {
        other.format(name) if name in taken else name: [_cell(row.get(name)) for row in rows] for name in names
    }  # fmt: skip


def _cell(value: Any) -> Cell:
    """Return a value that a cell may have: numbers that are finite, texts, and other values as texts."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return None
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, int | float | str) else str(value)
