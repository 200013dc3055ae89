"""Rows of fixed width: nodes, elements, components and real constants."""

from __future__ import annotations

import re
from collections.abc import Iterator

from modalprep.fe.readers.ansys.commands import Command, number

FORMAT = re.compile(r"\((\d+)I(\d+)(?:,(\d+)[EFG](\d+).*)?\)", re.IGNORECASE)
REALS = re.compile(r"\((\d+)[EFG](\d+).*\)", re.IGNORECASE)
MOST = 1000  # fields in a row


def layout(command: Command, k: int = 0) -> list[int]:
    """Return the widths of the fields that a format line names, such as ``(3i9,6e21.13e3)``.

    Examples
    --------
    >>> from pathlib import Path
    >>> layout(Command(Path("a.cdb"), 1, ["NBLOCK"], ["(3i9,6e21.13e3)"]))
    [9, 9, 9, 21, 21, 21, 21, 21, 21]
    """
    text = command.formats[k].replace(" ", "") if k < len(command.formats) else ""
    found = FORMAT.fullmatch(text) or REALS.fullmatch(text)
    counts = [int(part) for part in found.groups() if part] if found else []
    if not counts:
        raise command.error(f"its format {text!r} is not understood; export the model by CDWRITE")
    if sum(counts[::2]) > MOST or max(counts) > MOST:
        raise command.error(f"its format {text!r} names more fields than a row has; export the model again")
    return [width for count, width in zip(counts[::2], counts[1::2], strict=True) for _ in range(count)]


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
    given = FORMAT.fullmatch(command.formats[0].replace(" ", ""))
    count = int(given[1]) if given else 0
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
