"""Rows of fixed width: nodes, elements, components and real constants."""

from __future__ import annotations

import re
from collections.abc import Iterator

from modalprep.fe.readers.ansys.commands import Command, number

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
    return [width for _, width in _items(command, k)]


def _items(command: Command, k: int = 0) -> list[tuple[str, int]]:
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


def node_rows(command: Command) -> Iterator[tuple[int, int, list[float]]]:
    """Yield line, number and six values of each node: coordinates and angles (degrees)."""
    widths = layout(command)
    count = sum(letter == "I" for letter, _ in _items(command))
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
