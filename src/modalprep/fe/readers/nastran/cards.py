"""One entry of Nastran bulk data: its name and its fields, counted from 0 after the name."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.readers.numbers import real

INTEGER = re.compile(r"[+-]?\d{1,10}")


@dataclass(slots=True)
class Card:
    """One bulk data entry: upper-case name and fields, file and line.

    Examples
    --------
    >>> card = Card("MAT1", ["1", "7.+10", "", ".33"], "a.bdf", 3)
    >>> card.real(1, "E"), card.real(2, "G", 0.0), card.id
    (70000000000.0, 0.0, 1)
    """

    name: str
    fields: list[str]
    file: str
    line: int

    @property
    def id(self) -> int:
        """The number in the first field."""
        return self.integer(0, "its id", lowest=1)

    def text(self, k: int) -> str:
        """Return field `k`, empty when the card is shorter."""
        return self.fields[k] if k < len(self.fields) else ""

    def error(self, problem: str) -> InputError:
        """Return the error that names the card and describes the `problem`."""
        number = self.text(0) if INTEGER.fullmatch(self.text(0)) else ""
        return InputError(f"{self.file} line {self.line}: {f'{self.name} {number}'.strip()}: {problem}")

    def same(self, other: Card) -> bool:
        """Whether another card says the same, however its numbers are spelled; of grids a blank is zero.

        Examples
        --------
        >>> first = Card("GRID", ["1", "", "1.", "2.5-1"], "a.bdf", 3)
        >>> first.same(Card("GRID", ["1", "0", "1.0E0", ".25"], "a.bdf", 4))
        True
        """
        blank = "0" if self.name == "GRID" else ""
        pairs = zip_longest(self.fields, other.fields, fillvalue="")
        return self.name == other.name and all(real(a or blank) == real(b or blank) for a, b in pairs)

    def real(self, k: int, what: str, default: float | None = None) -> float:
        """Return field `k` as a number; `default` when blank; with None a blank field is refused."""
        text = self.text(k)
        if not text and default is not None:
            return default
        value = real(text)
        if isinstance(value, str) or not math.isfinite(value):
            raise self.error(f"{what} {_came(text)}; give a number such as 1.5-6")
        return value

    def integer(self, k: int, what: str, default: int | None = None, lowest: int = -1) -> int:
        """Return field `k` as a whole number; `default` when blank; with None a blank field is refused."""
        text = self.text(k)
        if not text and default is not None:
            return default
        if not INTEGER.fullmatch(text) or int(text) < lowest:
            raise self.error(f"{what} {_came(text)}; give a whole number, {lowest} or more")
        return int(text)

    def reals(self, first: int, count: int, what: str) -> np.ndarray:
        """Return `count` numbers from field `first` on, blanks as zero."""
        return np.array([self.real(first + i, f"{what}{i + 1}", 0.0) for i in range(count)])

    def is_integer(self, k: int) -> bool:
        """Whether field `k` is written as an integer, without a decimal point."""
        return INTEGER.fullmatch(self.text(k)) is not None

    def row(self, number: int) -> list[str]:
        """Return the eight fields of a row of the card."""
        fields = self.fields[8 * number : 8 * number + 8]
        return fields + [""] * (8 - len(fields))

    @property
    def rows(self) -> int:
        """Number of rows of eight fields."""
        return -(-len(self.fields) // 8)

    def numbers(self, first: int, what: str, known: np.ndarray) -> list[int]:
        """Return the ids from field `first` on; ``a THRU b`` stands for those of the sorted `known` in between."""
        words = " ".join(self.fields[first:]).replace("THRU", " THRU ").split()
        found: list[int] = []
        while words:
            ends = self._integer(words[:1], what), self._integer(words[2:3], what) if "THRU" in words[1:2] else 0
            if ends[1]:
                found += known[np.searchsorted(known, ends[0]) : np.searchsorted(known, ends[1], "right")].tolist()
            else:
                found.append(ends[0])
            words = words[3 if ends[1] else 1 :]
        return found

    def _integer(self, words: list[str], what: str) -> int:
        word = words[0] if words else ""
        if not INTEGER.fullmatch(word) or int(word) < 1:
            raise self.error(f"{what} {_came(word)}; give ids, or a range as 1 THRU 9")
        return int(word)


def _came(text: str) -> str:
    return f"is {text!r}, not a number that can be used" if text else "is missing (blank, or the card is cut short)"
