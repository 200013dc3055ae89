"""Two columns of numbers in a CSV file, in the units that its header says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.pipeline.schema.quantities import in_si, parse_unit, with_gravity
from modalprep.suggest import refuse_missing

BRACKETS = re.compile(r"[(\[]([^()\[\]]*)[)\]]\s*\"?$")  # at the end of a name, as in "torque (N mm)"
Units = tuple[str, ...] | None


def points_of_file(path: Path, units: tuple[Units, Units] = ((), ())) -> tuple[np.ndarray, np.ndarray]:
    """Return the two columns of a CSV file in SI units.

    Parameters
    ----------
    path : Path
        With or without a header, whose names may end with a unit in brackets: ``angle (deg),torque (N mm)``.
    units : two tuples of str
        SI units that each column may have; none: any. None leaves the column as it is.

    Raises
    ------
    InputError
        When there are no rows of two numbers, or the header has a unit that is unknown or of another dimension.
    """
    refuse_missing(path, "table of points")
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    header = lines[0].split(",") if _has_header(lines) else []
    try:
        rows = [[float(word) for word in line.split(",")] for line in lines[bool(header) :] if line.strip()]
        columns = np.array(rows, dtype=float).reshape(len(rows), 2).T
    except ValueError:
        raise InputError(f"table of points {path}: needs rows of two numbers") from None
    for column, name, known in zip(columns, header, units, strict=False):
        column *= 1.0 if known is None else _factor(path, name, known)
    return columns[0], columns[1]


def _factor(path: Path, name: str, units: tuple[str, ...]) -> float:
    """Return the factor to SI of the unit that ends the name of a column; 1 without any."""
    found = BRACKETS.search(name.strip())
    text = found[1].strip().replace("°", "deg") if found else ""
    if text in ("", "-"):
        return 1.0
    try:
        factor = in_si(f"1 {with_gravity(text)}", units) if units else getattr(parse_unit(text), "factor", None)
    except ValueError:
        wanted = " or ".join(units)
        raise InputError(f"table of points {path}: {name.strip()!r} has another dimension than {wanted}") from None
    if factor is None:
        raise InputError(f"table of points {path}: the unit {text!r} of {name.strip()!r} is not known; use SI units")
    return factor


def _has_header(lines: list[str]) -> bool:
    """Whether the first line is none of numbers."""
    first = lines[0].split(",")[0].strip() if lines else ""
    return bool(first) and not first.lstrip("+-.")[:1].isdigit()
