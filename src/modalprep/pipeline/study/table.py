"""The table of a study: a column for each parameter and quantity, a row for each job."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

FIXED = ("status", "verdict", "cause", "seconds")
SIGNS = str.maketrans({"²": "2", "½": "0.5", "^": "", "·": " "})
EXACT = 2**53  # integers up to it are floats
WITH_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-zµ].*?)\s*")
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

    A parameter whose values are texts with one unit is a number, called ``NAME_UNIT``. One that is called as another
    column is called ``parameter_NAME``, and a quantity that is called as a parameter ``NAME_result``.
    """
    given = [row.get("parameters") or row.get("values") or {} for row in rows]
    parameters = dict(_in_one_unit(*column) for column in _renamed(given, ("job", *FIXED), "parameter_{}").items())
    named = ("job", *FIXED, *parameters)
    stated = [row.get("quantities") or {} for row in rows]
    found = _renamed([{key: x for key, x in each.items() if key not in FIXED} for each in stated], named, "{}_result")
    fixed = {"job": [_cell(row["job"]) for row in rows], **parameters, "status": [row.get("status") for row in rows]}
    fixed["verdict"] = [(row.get("verdict") or {}).get("word") for row in rows]
    fixed["cause"] = [_cell(row.get("cause") or None) for row in rows]
    fixed["seconds"] = [_cell(row.get("seconds")) for row in rows]
    return StudyTable(fixed | found, tuple(parameters))


def _renamed(rows: Sequence[Mapping[str, Any]], taken: Sequence[str], other: str) -> dict[str, list[Cell]]:
    """Return rows as columns, in the order in which their names come first."""
    names = dict.fromkeys(name for row in rows for name in row)
    return {other.format(name) if name in taken else name: [_cell(row.get(name)) for row in rows] for name in names}


def _in_one_unit(name: str, cells: list[Cell]) -> tuple[str, list[Cell]]:
    """Return a column of texts with one unit as numbers, and its name with the unit.

    Examples
    --------
    >>> _in_one_unit("E", ["70 GPa", None, "210 GPa"]), _in_one_unit("t", ["2 mm", "1 in"])
    (('E_GPa', [70.0, None, 210.0]), ('t', ['2 mm', '1 in']))
    """
    found = [WITH_UNIT.fullmatch(cell) if isinstance(cell, str) else None for cell in cells]
    units = {match[2] if match else "" for match, cell in zip(found, cells, strict=True) if cell is not None}
    if len(units) != 1 or "" in units:
        return name, cells
    return with_unit(name, units.pop()), [match and float(match[1]) for match in found]


def with_unit(name: str, unit: str) -> str:
    """Return a name with the unit at its end, in letters that need no quotes.

    Examples
    --------
    >>> with_unit("tip.acceleration.x_peak", "m/s^2"), with_unit("hinge.torque_max", "N m"), with_unit("damage", "")
    ('tip.acceleration.x_peak_m_s2', 'hinge.torque_max_N_m', 'damage')
    """
    text = re.sub(r"[^\w.]+", "_", unit.translate(SIGNS)).strip("_")
    return f"{name}_{text}" if text and unit != "1" else name


def _cell(value: Any) -> Cell:
    """Return a value that a cell may have: numbers that are finite and exact as floats, texts, others as texts.

    Examples
    --------
    >>> [_cell(value) for value in (1, 2.5, math.nan, 2**60, True, [1, 2])]
    [1, 2.5, None, '1152921504606846976', 'true', '[1, 2]']
    """
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return None
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float) or (isinstance(value, int) and abs(value) <= EXACT):
        return value
    text = str(value)  # names of files may be in another encoding
    return text if text.isascii() else text.encode("utf-8", "backslashreplace").decode()
