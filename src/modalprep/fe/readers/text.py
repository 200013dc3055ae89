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
NEWLINE, RETURN, COMMA = b"\n\r,"


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
        marks = [mark.encode() for mark in breaks if mark.isascii() or not content.isascii()]
        if any(mark in content for mark in marks) or (
            b"\r" in content and content.count(b"\r") != content.count(b"\r\n")
        ):
            content = "\n".join(split(content.decode(encoding, "replace"))).encode(encoding)
        self._content = content
        self.text = np.frombuffer(content, dtype=np.uint8)
        cuts = [k + np.flatnonzero(self.text[k : k + 2**22] == NEWLINE) for k in range(0, len(content), 2**22)]
        rest = [[len(content)]] if content and content[-1] != NEWLINE else []
        self._ends = np.concatenate([[-1], *cuts, *rest]).astype(np.int64)
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
            stops = self.stops(k, end)[:, None]
            at = np.minimum(self.starts(k, end)[:, None] + edges, stops)
            part = plain_numbers(self.text, at[:, :-1], at[:, 1:], whole, bare)
            if part is None:
                return None
            found[k - first : end - first] = part
        return found

    def free(self, first: int, last: int, reals: bool = False) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the numbers between the commas of lines, NaN of blanks, and how many each line has.

        With `reals` all lines have as many, the first of them a whole number; else all are whole. None unless all
        numbers are plain.
        """
        values, counts = [], []
        for k in range(first, last, STEP):
            starts, stops, own = self.fields(k, min(k + STEP, last))
            counts.append(own)
            if reals and len({*counts[0].tolist(), *own.tolist()}) > 1:
                return None
            whole = np.arange(counts[0][0]) == 0 if reals else np.ones(1, dtype=bool)
            found = plain_numbers(self.text, starts, stops, whole)
            if found is None:
                return None
            values.append(found)
        return np.concatenate(values), np.concatenate(counts)

    def fields(self, first: int, last: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where the fields between the commas of lines begin and end in `text`, and how many each line has."""
        begin, end = self._ends[first] + 1, self._ends[last]
        part = self.text[begin:end]
        cuts = np.append(np.flatnonzero((part == COMMA) | (part == NEWLINE)), len(part))
        closes = np.append(part[cuts[:-1]] == NEWLINE, True)
        counts = np.diff(np.flatnonzero(closes), prepend=-1)
        stops = begin + cuts - (closes & (part[cuts - 1] == RETURN))
        return begin + np.append(0, cuts[:-1] + 1), stops, counts
