"""The lines of a deck: one by one as text, many at once as numbers."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Iterator

import numpy as np

from modalprep.fe.readers.numbers import plain_numbers

BREAKS = "\x0b\x0c\x1c\x1d\x1e\x85\u2028\u2029"  # by which str.splitlines divides lines too
STEP = 2**13  # lines whose fields are looked at in one go
NEAR = 2**10  # lines that are texts at a time
NEWLINE, RETURN, COMMA, BLANK = b"\n\r, "


def _places(content: bytes, where: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return the places of some bytes, those that `where` marks."""
    text = np.frombuffer(content, dtype=np.uint8)
    found = [k + np.flatnonzero(where(text[k : k + 2**22])) for k in range(0, len(content), 2**22)]
    return np.concatenate([np.zeros(0, dtype=np.int64), *found])


def _plain(content: bytes, encoding: str, split: Callable[[str], list[str]], breaks: str) -> bytes:
    """Return a content whose lines are divided by line feeds, perhaps with carriage returns before them, alone."""
    marks = [mark.encode() for mark in breaks if mark.isascii() or not content.isascii()]
    lone = b"\r" in content and content.count(b"\r") != content.count(b"\r\n")
    if lone or any(mark in content for mark in marks):
        content = "\n".join(split(content.decode(encoding, "replace"))).encode(encoding)
    return content


class Lines:
    r"""The lines of a file, without what divides them.

    Parameters
    ----------
    content : bytes
    encoding : str
        Bytes that it does not have are replaced.
    split : callable
        Divides a text into lines.
    breaks : str
        What divides lines besides ``\n``, ``\r\n`` and ``\r``.

    Examples
    --------
    >>> lines = Lines(b"*NODE\n1, 0.5\r\n2, 1e3\n")
    >>> lines[1], lines.free(1, 3, reals=True)[0]
    ('1, 0.5', array([1.e+00, 5.e-01, 2.e+00, 1.e+03]))
    """

    least = 64  # of numbers at once, below which it is not worth it

    def __init__(
        self,
        content: bytes,
        encoding: str = "utf-8",
        split: Callable[[str], list[str]] = str.splitlines,
        breaks: str = BREAKS,
    ) -> None:
        self._encoding = encoding
        content = content.removeprefix(codecs.BOM_UTF8)
        ends = _places(content, lambda part: part < BLANK)
        if not content.isascii() or (np.frombuffer(content, dtype=np.uint8)[ends] != NEWLINE).any():
            content = _plain(content, encoding, split, breaks)
            ends = _places(content, lambda part: part == NEWLINE)
        self._content = content
        self.text = np.frombuffer(content, dtype=np.uint8)
        rest = [len(content)] if content and content[-1] != NEWLINE else []
        self._ends = np.concatenate([[-1], ends, rest]).astype(np.int64)
        self._first = 0
        self._near: list[str] = []

    def __len__(self) -> int:
        """Count the lines."""
        return len(self._ends) - 1

    def __getitem__(self, k: int) -> str:
        """Return line `k`, from 0 on."""
        if not 0 <= k - self._first < len(self._near):
            self._first = k - k % NEAR
            self._near = self._texts(self._first, min(self._first + NEAR, len(self)))
        return self._near[k - self._first]

    def _texts(self, first: int, last: int) -> list[str]:
        part = self._content[self._ends[first] + 1 : self._ends[last]]
        return part.decode(self._encoding, "replace").replace("\r\n", "\n").removesuffix("\r").split("\n")

    def __iter__(self) -> Iterator[str]:
        """Yield the lines."""
        return (self[k] for k in range(len(self)))

    def having(self, word: bytes) -> Iterator[int]:
        """Yield the lines that have a word, in capitals or not."""
        for found in re.finditer(re.escape(word), self._content, re.IGNORECASE):
            yield int(np.searchsorted(self._ends, found.start())) - 1

    def starts(self, first: int, last: int) -> np.ndarray:
        """Return where lines start in `text`."""
        return self._ends[first:last] + 1

    def stops(self, first: int, last: int) -> np.ndarray:
        """Return where lines end in `text`."""
        ends = self._ends[first + 1 : last + 1]
        return ends - (self.text[np.maximum(ends - 1, 0)] == RETURN) if len(self.text) else ends

    def beginnings(self, first: int, last: int) -> np.ndarray:
        """Return the first byte of each line, of an empty one what ends it."""
        return self.text[np.minimum(self.starts(first, last), len(self.text) - 1)]

    def columns(self, first: int, last: int, begin: int, end: int) -> np.ndarray:
        """Return the bytes (lines, end - begin) of columns of lines, blanks behind their ends."""
        found = np.full((last - first, end - begin), ord(" "), dtype=np.uint8)
        for k in range(first, last, STEP):
            stop = min(k + STEP, last)
            at = self.starts(k, stop)[:, None] + np.arange(begin, end)
            inside = at < self.stops(k, stop)[:, None]
            found[k - first : stop - first][inside] = self.text[at[inside]]
        return found

    def table(
        self, first: int, last: int, edges: np.ndarray, whole: np.ndarray, bare: bool = True
    ) -> np.ndarray | None:
        """Return the numbers in columns of lines between `edges` (k + 1,), NaN of blanks; None unless all are plain.

        `whole` says which columns are of whole numbers, of some lines in turn.
        """
        found = np.empty((last - first, len(edges) - 1))
        step = STEP - STEP % max(len(whole) // (len(edges) - 1), 1)
        for k in range(first, last, step):
            end = min(k + step, last)
            part = plain_numbers(self.text, *self._between(k, end, edges), whole, bare)
            if part is None:
                return None
            found[k - first : end - first] = part
        return found

    def _between(self, first: int, last: int, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where columns between `edges` begin and end in `text`, no further than their lines."""
        starts = self.starts(first, last)[:, None]
        stops = self.stops(first, last)[:, None]
        begins, ends = starts + edges[:-1], starts + edges[1:]
        if (ends[:, -1:] > stops).any():
            begins, ends = np.minimum(begins, stops), np.minimum(ends, stops)
        return begins, ends

    def free(self, first: int, last: int, reals: bool = False) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the numbers between the commas of lines, NaN of blanks, and how many each line has.

        With `reals` all lines have as many, the first of them a whole number; else all are whole. None unless all
        numbers are plain.
        """
        values, counts = np.empty(self._field_count(first, last)), []
        filled = 0
        for k in range(first, last, STEP):
            starts, stops, own = self.fields(k, min(k + STEP, last))
            counts.append(own)
            if reals and len({*counts[0].tolist(), *own.tolist()}) > 1:
                return None
            whole = np.arange(counts[0][0]) == 0 if reals else np.ones(1, dtype=bool)
            found = plain_numbers(self.text, starts, stops, whole)
            if found is None:
                return None
            values[filled : filled + len(found)] = found
            filled += len(found)
        return values[:filled], np.concatenate(counts)

    def _field_count(self, first: int, last: int) -> int:
        """Count the fields of lines: as many as their commas and their ends."""
        return self._content.count(COMMA, self._ends[first] + 1, self._ends[last]) + last - first

    def fields(self, first: int, last: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where the fields between the commas of lines begin and end in `text`, and how many each line has."""
        begin, end = self._ends[first] + 1, self._ends[last]
        part = self.text[begin:end]
        cuts = np.append(np.flatnonzero((part == COMMA) | (part == NEWLINE)), len(part))
        closes = np.append(part[cuts[:-1]] == NEWLINE, True)
        counts = np.diff(np.flatnonzero(closes), prepend=-1)
        stops = begin + cuts - (closes & (part[cuts - 1] == RETURN))
        return begin + np.append(0, cuts[:-1] + 1), stops, counts
