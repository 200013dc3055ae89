"""The commands of an Ansys input file, and the blocks of numbers that follow some of them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.readers.ansys.blocks import columns
from modalprep.fe.readers.ansys.commands import Command
from modalprep.fe.readers.text import Lines

BLOCKS = ("NBLO", "EBLO", "CMBL", "RLBL", "SECB", "ETBL")
TABLES = ("NBLO", "EBLO", "CMBL")  # which may be long
WHOLE_LINE = ("/TITLE", "/COM", "/STITLE", "C***", "/EOF")  # whose text is no list of fields
NUMERIC = "0123456789+-."
IN_ROWS = np.isin(np.arange(256), [ord(c) for c in NUMERIC + " "])
SHORT = 12  # letters of a line that may be -1


def commands(path: Path, content: bytes) -> Iterator[Command]:
    """Yield the commands of a file in turn, each with its block."""
    lines = Lines(content)
    at = 0
    while at < len(lines):
        at += 1
        for fields in _split(lines[at - 1]):
            command = Command(path, at, fields)
            if command.key in BLOCKS:
                at = _take_block(command, lines, at)
            yield command


def _split(line: str) -> Iterator[list[str]]:
    """Yield the commands of a line, which ``$`` divides; a comment begins at ``!``."""
    if line.strip().upper().startswith(WHOLE_LINE):
        return
    for part in line.split("!")[0].split("$"):
        fields = [f.strip() for f in part.split(",")]
        if "=" in fields[0]:
            fields = ["*SET", *(f.strip() for f in part.split("=", 1))]
        if fields[0]:
            yield fields


def _take_block(command: Command, lines: Lines, at: int) -> int:
    """Take formats and rows of numbers, as far as they go, and return the line behind them."""
    while at < len(lines):
        line = lines[at].split("!")[0].rstrip()
        stripped = line.lstrip()
        if stripped.startswith("(") and not command.listed:
            command.formats.append(stripped)
        elif stripped == "-1":
            return at + 1
        elif stripped and stripped[0] in NUMERIC:
            if not command.listed and (end := _take_table(command, lines, at)):
                return end
            command.listed.append((at + 1, line))
        elif stripped:
            return at
        at += 1
    return at


def _take_table(command: Command, lines: Lines, at: int) -> int:
    """Take all rows of a block as one table, and return the line behind it; 0 where they are not regular."""
    end = _end(lines, at)
    closing = lines[end].split("!")[0].strip() if end < len(lines) else "-1"
    ended = closing == "-1" or (closing != "" and closing[0] not in NUMERIC)
    if command.key not in TABLES or end - at < lines.least or not ended:
        return 0
    with suppress(InputError):  # the rows say so in their turn
        items = columns(command)
        edges = np.cumsum([0, *(width for _, width in items)])
        command.table = lines.table(at, end, edges, np.array([letter == "I" for letter, _ in items]))
        command.first = at
        command.lines = lines
    return 0 if command.table is None else end + (closing == "-1")


def _end(lines: Lines, at: int) -> int:
    """Return the first line from `at` on that is blank, -1, or begins with neither a digit nor a blank."""
    size = 64
    while at < len(lines):
        end = min(at + size, len(lines))
        odd = ~IN_ROWS[lines.beginnings(at, end)] | (lines.stops(at, end) - lines.starts(at, end) <= SHORT)
        for k in (at + np.flatnonzero(odd)).tolist():
            if lines[k].strip() in ("", "-1") or lines[k][0] not in NUMERIC + " ":
                return k
        at = end
        size *= 2
    return at
