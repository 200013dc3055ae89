"""Recovery matrices of an external superelement of Nastran: MUG1, MES1, MEF1 and the like, labelled by DTI tables."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from modalprep.errors import InputError
from modalprep.supplied.nastran_cards import TableRow
from modalprep.supplied.rows import Rows

QUANTITY = {
    "UG1": "displacement",
    "ES1": "element stress",
    "EE1": "element strain",
    "EF1": "force",
    "QG1": "reaction",
    "QMG1": "constraint force",
}
GRID, SCALAR, BAR = 1, 2, 34  # types of rows
AT_BAR = {  # what the rows of a CBAR are, and the powers of length and mass in their units
    "EF1": (
        ("moment_a1", 2),
        ("moment_a2", 2),
        ("moment_b1", 2),
        ("moment_b2", 2),
        ("shear_1", 1),
        ("shear_2", 1),
        ("axial", 1),
        ("torque", 2),
    ),
    "ES1": tuple((name, -1) for name in ("a_c", "a_d", "a_e", "a_f", "axial", "b_c", "b_d", "b_e", "b_f")),
}
UNITS = {-1: "Pa", 1: "N", 2: "N m"}  # by the power of length; all have the mass once


def recovery_rows(
    matrices: dict[str, np.ndarray], tables: dict[str, list[TableRow]], size: int, length: float, mass: float
) -> tuple[dict[str, Rows], list[str]]:
    """Return the recovery matrices with their rows, and the names of those that no table labels.

    Parameters
    ----------
    matrices : {name: (k, size)}
    tables : {name: lines}
        DTI tables by name.
    size : int
        Coordinates of the body.
    length, mass : float
        m and kg per unit of the deck.

    Raises
    ------
    InputError
        When a table does not fit its matrix.

    Examples
    --------
    >>> lines = [TableRow(1, 4, 6, 1), TableRow(2, 9, 6, 7)]
    >>> found, left = recovery_rows({"MUG1": np.eye(7)}, {"TUG1": lines}, 7, 0.1, 1.0)
    >>> found["MUG1"].labels[-2:], found["MUG1"].units[-2:]
    (('grid_4.r3', 'point_9'), ('rad', 'deck'))
    """
    found = {}
    left = []
    for key, quantity in QUANTITY.items():
        name = f"M{key}"
        matrix = matrices.get(f"M{key}")
        if matrix is None or matrix.shape[1] != size or not np.any(matrix):
            continue
        if f"T{key}" not in tables:
            left.append(name)
            continue
        lines = [row for line in tables[f"T{key}"] for row in _lines(key, line, length, mass)]
        if max(row for row, *_ in lines) >= len(matrix):
            raise InputError(
                f"table T{key} names row {1 + max(row for row, *_ in lines)}, matrix {name} has {len(matrix)}"
            )
        rows, labels, units, factor = zip(*lines, strict=True)
        found[name] = Rows(quantity, labels, units, np.array(factor), matrix[list(rows)])
    return found, left


def _lines(key: str, line: TableRow, length: float, mass: float) -> Iterator[tuple[int, str, str, float]]:
    """Yield row, label, unit and SI factor of each component of a line."""
    first = line.first - 1
    if first < 0:
        raise InputError(f"table T{key} begins at row {line.first}, rows count from 1")
    if line.kind == SCALAR:
        yield first, f"point_{line.number}", "deck", 1.0
        return
    for k in range(line.components):
        if line.kind == GRID:
            label, unit, factor = _of_grid(key, k, length, mass)
            yield first + k, f"grid_{line.number}.{label}", unit, factor
        elif line.kind == BAR and line.components == len(AT_BAR.get(key, ())):
            label, power = AT_BAR[key][k]
            yield first + k, f"CBAR_{line.number}.{label}", UNITS[power], mass * length**power
        else:
            yield first + k, f"element_{line.number}.{k + 1}", "deck", 1.0


def _of_grid(key: str, k: int, length: float, mass: float) -> tuple[str, str, float]:
    label = f"{'tr'[k // 3]}{k % 3 + 1}" if k < 6 else str(k + 1)
    if key == "UG1":
        return (label, "m", length) if k < 3 else (label, "rad", 1.0)
    return (label, "N", mass * length) if k < 3 else (label, "N m", mass * length**2)
