"""Rows of fixed width: nodes, elements, components and real constants."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from modalprep.fe.readers.ansys.commands import Command, number
from modalprep.fe.readers.ansys.deck import ElementBlock

HEAD = 11  # numbers of an element before its nodes
ITEM = re.compile(r"(\d*)([IEFG])(\d+)(?:\.\d+)?(?:E\d+)?", re.IGNORECASE)
MOST = 1000  # fields in a row


def layout(command: Command, k: int = 0) -> list[int]:
    """Return the widths of the fields that a format line names, such as ``(3i9,6e21.13e3)``.

    Examples
    --------
    >>> from pathlib import Path
    >>> layout(Command(Path("a.cdb"), 1, ["NBLOCK"], ["(3i9,6e21.13e3)"]))
    [9, 9, 9, 21, 21, 21, 21, 21, 21]
    """
    return [width for _, width in columns(command, k)]


def columns(command: Command, k: int = 0) -> list[tuple[str, int]]:
    """Return letter and width of each field of a format line, such as ``(1i7,2i9,6e21.13e3)``."""
    text = command.formats[k].replace(" ", "") if k < len(command.formats) else ""
    found = [ITEM.fullmatch(part) for part in text[1:-1].split(",")] if text[:1] + text[-1:] == "()" else [None]
    items = [(int(one[1] or 1), one[2].upper(), int(one[3])) for one in found if one]
    if len(items) < len(found):
        raise command.error(f"its format {text!r} is not understood; export the model by CDWRITE")
    if sum(count for count, _, _ in items) > MOST or max(width for _, _, width in items) > MOST:
        raise command.error(f"its format {text!r} names more fields than a row has; export the model again")
    return [(letter, width) for count, letter, width in items for _ in range(count)]


def cut(line: str, widths: list[int]) -> list[str]:
    """Return the fields of a line, without those behind its end.

    Examples
    --------
    >>> cut("  1  22", [3, 4, 4])
    ['1', '22']
    """
    fields = []
    at = 0
    for width in widths:
        if at >= len(line):
            break
        fields.append(line[at : at + width].strip())
        at += width
    return fields


def integers(command: Command, texts: list[str], line: int) -> list[int]:
    """Return fields as whole numbers; blanks are 0."""
    try:
        return [int(text) if text else 0 for text in texts]
    except ValueError:
        raise command.error(f"{' '.join(texts)!r} are not whole numbers; the block is damaged", line) from None


def node_table(command: Command) -> tuple[np.ndarray, np.ndarray] | None:
    """Return numbers (n,) and six values (n, 6) of nodes in a table; None unless each has one number of its own."""
    if command.table is None or columns(command)[0][0] != "I":
        return None
    labels = command.table[:, 0]
    if not (labels > 0).all() or len(np.unique(labels)) < len(labels):
        return None
    count = sum(letter == "I" for letter, _ in columns(command))
    values = np.zeros((len(labels), 6))
    given = command.table[:, count : count + 6]
    values[:, : given.shape[1]] = np.nan_to_num(given)
    return labels.astype(int), values


def element_table(command: Command) -> ElementBlock | None:
    """Return the elements of a table with the key SOLID; None where a number is missing, or is there twice."""
    table = command.table
    if table is None or "SOLID" not in command.text(2) or table.shape[1] <= HEAD:
        return None
    blank = np.isnan(table)
    filled = np.full(len(table), table.shape[1])
    if blank.any():
        if (blank[:, :-1] > blank[:, 1:]).any():
            return None
        filled -= blank.sum(axis=1)
    counts = np.nan_to_num(table[:, 8])
    behind = np.maximum(HEAD + counts - table.shape[1], 0)  # numbers in the rows behind the first
    steps = (1 + np.ceil(behind / table.shape[1])).astype(int)
    first = _firsts(steps)
    total = np.add.reduceat(filled, first)
    counts = counts[first].astype(int)
    labels = table[first, HEAD - 1]
    whole = first[-1] + steps[first[-1]] == len(table) and (counts > 0).all() and (counts <= MOST).all()
    if not (whole and (total == HEAD + counts).all() and (labels > 0).all() and len(np.unique(labels)) == len(labels)):
        return None
    attributes = table[first][:, [1, 0, 2, 3, 4]].astype(int)
    nodes = _behind_heads(table, blank, total, counts)
    return ElementBlock(labels.astype(int), attributes, counts, nodes, command.first + 1 + first)


def _firsts(steps: np.ndarray) -> np.ndarray:
    """Return the rows at which elements begin, when one at row k has ``steps[k]`` rows."""
    found = np.arange(0, len(steps), steps[0])
    if (steps[found] == steps[0]).all():
        return found
    rows = []
    at = 0
    while at < len(steps):
        rows.append(at)
        at += int(steps[at])
    return np.array(rows)


def _behind_heads(table: np.ndarray, blank: np.ndarray, total: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return the nodes of elements that have `total` numbers and `counts` nodes, zeros behind the last."""
    most = counts.max()
    if (counts == most).all():
        return table.reshape(len(counts), -1)[:, HEAD : HEAD + most].astype(int)
    nodes = np.zeros((len(counts), most), dtype=int)
    here = np.arange(most) < counts[:, None]
    starts = np.cumsum(total) - counts
    nodes[here] = table[~blank][(starts[:, None] + np.arange(most))[here]]
    return nodes


def node_rows(command: Command) -> Iterator[tuple[int, int, list[float]]]:
    """Yield line, number and six values of each node: coordinates and angles (degrees)."""
    widths = layout(command)
    count = sum(letter == "I" for letter, _ in columns(command))
    for line, text in command.rows:
        fields = cut(text, widths)
        label = integers(command, fields[:1], line)[0]
        values = [number(command, f, "coordinate", line) if f else 0.0 for f in fields[count:]]
        yield line, label, (values + [0.0] * 6)[:6]


def element_rows(command: Command) -> Iterator[tuple[int, list[int]]]:
    """Yield line and numbers of each element: the attributes, then its nodes, also those of the lines that follow."""
    widths = layout(command)
    solid = "SOLID" in command.text(2)
    waiting: list[int] = []
    first = missing = 0
    for line, text in command.rows:
        numbers = integers(command, cut(text, widths), line)
        if waiting and missing > 0:
            waiting += numbers
        else:
            first, waiting = line, numbers
            if solid and not 0 < (numbers[8] if len(numbers) > 10 else 0) <= MOST:
                raise command.error("an element has no number of nodes; the block is damaged", line)
        missing = 11 + waiting[8] - len(waiting) if solid else 0
        if missing <= 0:
            yield first, waiting
    if missing > 0:
        raise command.error("its last element is cut short; export the model again", first)


def members(command: Command) -> list[int]:
    """Return the numbers of a component, of which a negative one ends a range that the one before begins."""
    table = command.table
    if table is not None and (table >= 0).any(axis=1).all() and not (table < 0).any():
        blank = np.isnan(table)
        if not (blank[:, :-1] > blank[:, 1:]).any():
            return table[~blank].astype(int).tolist()
    widths = layout(command)
    found = []
    for line, text in command.rows:
        for value in integers(command, cut(text, widths), line):
            if value >= 0 or not found:
                found.append(value)
            elif found[-1] - value > 10_000_000 or -value - found[-1] > 10_000_000:
                raise command.error(f"a range from {found[-1]} to {-value} is no component; correct it", line)
            else:
                found.extend(range(found[-1] + 1, 1 - value))
    return found


def real_sets(command: Command) -> Iterator[tuple[int, list[float]]]:
    """Yield number and values of each set of real constants."""
    widths = layout(command)
    others = layout(command, 1) if len(command.formats) > 1 else widths[2:]
    label = left = 0
    values: list[float] = []
    for line, text in command.rows:
        fields = cut(text, others if left else widths)
        if not left:
            label, left = integers(command, fields[:2] + ["0"] * (2 - len(fields)), line)
            fields = fields[2:]
            values = []
        values += [number(command, f, "constant", line) if f else 0.0 for f in fields[:left]]
        left = max(left - len(fields), 0) if fields else 0
        if not left:
            yield label, values
    if left:
        yield label, values
