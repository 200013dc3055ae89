"""Nastran OUTPUT4 files: matrices by name, text or binary, dense columns or strings (theory 8.2)."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array

from modalprep.errors import InputError
from modalprep.fe.readers.entries import refuse_hollow

KINDS = {1: (1, float), 2: (2, float), 3: (1, complex), 4: (2, complex)}  # words of 32 bits for each real number
STRING = 65536  # an integer IS packs row + STRING * (length + 1)
HEADER = 6  # integers as long as the header: four, and the name
INTEGER = {4: "i", 8: "q"}  # bytes of an integer
FORMAT = re.compile(r"(\d+)[ED](\d+)\.\d+", re.IGNORECASE)


class Piece(NamedTuple):
    """Values (k,) of one column from a row on, both counted from 0."""

    row: int
    column: int
    values: np.ndarray


def read_output4(path: Path) -> dict[str, csr_array]:
    r"""Return the matrices of a file by their names.

    Single and double precision, real and complex, dense or sparse columns ("bigmat" or not), either byte order,
    integers of 32 or 64 bits.

    Raises
    ------
    InputError
        When the file is damaged.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "k.op4"
    >>> lines = ["       1       1       6       2KGG     1P,3E23.16", "       1       1       1"]
    >>> lines += [" 4.0000000000000000E+00", "       2       1       1", " 1.4142135623730951E+00"]
    >>> _ = path.write_text("\n".join(lines) + "\n")
    >>> read_output4(path)["KGG"].toarray()
    array([[4.]])
    """
    content = path.read_bytes()
    try:
        return _matrices(_Text(content) if content[:8].strip().isdigit() else _Binary(content, path), path)
    except (IndexError, ValueError, struct.error) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"OUTPUT4 file {path} is damaged or cut short; export it again") from None


def _matrices(reader: _Text | _Binary, path: Path) -> dict[str, csr_array]:
    found: dict[str, csr_array] = {}
    while (header := reader.header()) is not None:
        columns, rows, kind, name = header
        if kind not in KINDS:
            raise ValueError(f"matrix {name} is of type {kind}")
        found[name] = _assembled(list(reader.pieces(columns, rows < 0, kind)), abs(rows), columns)
    if not found:
        raise InputError(f"OUTPUT4 file {path} holds no matrix; export it again")
    return found


def _assembled(pieces: list[Piece], rows: int, columns: int) -> csr_array:
    count = [len(piece.values) for piece in pieces]
    refuse_hollow(max(rows, columns), sum(count))
    first = np.repeat(
        [piece.row - before for piece, before in zip(pieces, np.cumsum([0, *count]), strict=False)], count
    )
    at = first.astype(int) + np.arange(sum(count))
    column = np.repeat([piece.column for piece in pieces], count).astype(int)
    values = np.concatenate([np.zeros(0), *(piece.values for piece in pieces)])
    return coo_array((values, (at, column)), shape=(rows, columns)).tocsr()


class _Text:
    """Text files: integers in fields of eight, numbers in the format of the header."""

    def __init__(self, content: bytes) -> None:
        self.lines = content.replace(b"\r", b"").split(b"\n")
        self.at = 0
        self.per_line, self.width = 5, 16

    def _next(self) -> bytes:
        self.at += 1
        return self.lines[self.at - 1]

    def _integers(self, count: int) -> list[int]:
        line = self._next()
        return [int(line[8 * k : 8 * k + 8]) for k in range(count)]

    def header(self) -> tuple[int, int, int, str] | None:
        """Columns, rows (negative for bigmat), type and name of the next matrix; None at the end."""
        if not any(line.strip() for line in self.lines[self.at : self.at + 2]):
            return None
        line = self.lines[self.at].decode("ascii", "replace")
        columns, rows, _, kind = self._integers(4)
        if layout := FORMAT.search(line[40:]):
            self.per_line, self.width = int(layout[1]), int(layout[2])
        return columns, rows, kind, line[32:40].strip()

    def pieces(self, columns: int, big: bool, kind: int) -> Iterator[Piece]:
        """Pieces of the matrix, until its trailer is read."""
        while True:
            column, row, left = self._integers(3)
            if column > columns:
                self._next()
                return
            if row > 0:
                yield Piece(row - 1, column - 1, self._values(left, kind))  # here the count is of values, not words
                continue
            while left > 0:
                length, row = self._integers(2) if big else divmod(int(self._next()), STRING)
                yield Piece(row - 1, column - 1, self._values((length - 1) // KINDS[kind][0], kind))
                left -= length + big

    def _values(self, count: int, kind: int) -> np.ndarray:
        lines = self.lines[self.at : self.at + -(-count // self.per_line)]
        self.at += len(lines)
        packed = b"".join(lines).replace(b"D", b"E")
        if len(packed) != count * self.width:
            raise ValueError("a column is cut short")
        return np.frombuffer(packed, dtype=f"S{self.width}").astype(float).view(KINDS[kind][1])


class _Binary:
    """Binary files: records between two markers of their length in bytes; integers of 32 or 64 bits."""

    def __init__(self, content: bytes, path: Path) -> None:
        self.content, self.at = content, 0
        layouts = ((order, size) for order in "<>" for size in (4, 8))
        found = [each for each in layouts if content[:4] == struct.pack(f"{each[0]}i", HEADER * each[1])]
        if not found:
            raise InputError(f"{path} does not begin as an OUTPUT4 file does; export it again, or formatted, as text")
        self.order, self.size = found[0]  # of integers, in bytes

    def _integers(self, count: int, data: bytes, at: int = 0) -> tuple[int, ...]:
        return struct.unpack_from(f"{self.order}{count}{INTEGER[self.size]}", data, at)

    def _record(self) -> bytes:
        (size,) = struct.unpack_from(f"{self.order}i", self.content, self.at)
        record = self.content[self.at + 4 : self.at + 4 + size]
        (again,) = struct.unpack_from(f"{self.order}i", self.content, self.at + 4 + size)
        if again != size or size < 0:
            raise ValueError("a record is damaged")
        self.at += size + 8
        return record

    def header(self) -> tuple[int, int, int, str] | None:
        """Columns, rows (negative for bigmat), type and name of the next matrix; None at the end."""
        if self.at >= len(self.content):
            return None
        record = self._record()
        columns, rows, _, kind = self._integers(4, record)
        name = record[4 * self.size :].decode("ascii", "replace")  # of 64 bits, four letters in each eight bytes
        return columns, rows, kind, name.replace(" ", "").strip("\0")

    def pieces(self, columns: int, big: bool, kind: int) -> Iterator[Piece]:
        """Pieces of the matrix, until its trailer is read."""
        while True:
            record = self._record()
            column, row, words = self._integers(3, record)
            if column > columns:
                return
            if len(record) != self.size * (3 + words):
                raise ValueError("a column is damaged")
            data = record[3 * self.size :]
            if row > 0:
                yield Piece(row - 1, column - 1, self._values(data, kind))
                continue
            yield from self._strings(data, column - 1, big, kind)

    def _strings(self, data: bytes, column: int, big: bool, kind: int) -> Iterator[Piece]:
        at = 0
        head = 2 if big else 1
        while at < len(data):
            numbers = self._integers(head, data, at)
            length, row = numbers if big else divmod(numbers[0], STRING)
            if length < 1:
                raise ValueError("a string is damaged")
            end = at + self.size * (head + length - 1)
            yield Piece(row - 1, column, self._values(data[at + self.size * head : end], kind))
            at = end

    def _values(self, data: bytes, kind: int) -> np.ndarray:
        words, number = KINDS[kind]
        size = max(4 * words, self.size)
        return np.frombuffer(data, dtype=f"{self.order}f{size}").astype(float).view(number)
