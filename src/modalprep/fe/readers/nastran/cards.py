"""Nastran bulk data as text: lines to cards.

Small field (ten columns of 8 characters), large field (``NAME*``, columns of 16) and free field (commas) may be mixed
line by line. A line continues a card when its first field is blank or starts with ``+`` or ``*`` (continuations.py says
which). Fields are counted from 0 after the name: ``fields[0]`` is the id.
"""

from __future__ import annotations

import codecs
import hashlib
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.readers.nastran import replication
from modalprep.fe.readers.nastran.continuations import Continuations
from modalprep.fe.readers.nastran.lines import REAL, Line, split

INTEGER = re.compile(r"[+-]?\d{1,10}")
BEGIN = re.compile(r"^\s*BEGIN\b(?!\s+SUPER)", re.IGNORECASE)
INCLUDE = re.compile(r"^\s*INCLUDE\b\s*(.*)$", re.IGNORECASE)
MAX_DEPTH, MAX_FILES = 10, 1000  # of INCLUDE; Nastran itself stops at ten levels
MAX_COPIES = 10**6  # cards that one deck makes by replication


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
        return self.name == other.name and all(_value(a or blank) == _value(b or blank) for a, b in pairs)

    def real(self, k: int, what: str, default: float | None = None) -> float:
        """Return field `k` as a number; `default` when blank; with None a blank field is refused."""
        text = self.text(k)
        if not text and default is not None:
            return default
        value = _value(text)
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


def _value(text: str) -> float | str:
    """Return a field as the number that it is, or as its text."""
    match = REAL.fullmatch(text)
    return float(f"{match[1]}e{match[2] or match[3] or 0}") if match else text


def _came(text: str) -> str:
    return f"is {text!r}, not a number that can be used" if text else "is missing (blank, or the card is cut short)"


@dataclass(slots=True)
class Deck:
    """The cards of a deck in file order, the hash of all its files, and whether it ends with ENDDATA."""

    cards: list[Card]
    sha256: str
    ended: bool


def read_cards(path: Path) -> Deck:
    """Read a deck and the files it includes in its bulk data section.

    Raises
    ------
    InputError
        When a file is missing, includes itself, or ends in the middle of a card.

    Examples
    --------
    >>> read_cards(Path("no.bdf"))
    Traceback (most recent call last):
    modalprep.errors.InputError: Nastran deck no.bdf cannot be read (No such file or directory); check its path
    """
    reader = _Reader(path)
    reader.read(path, ())
    reader.continuations.finish()
    for card in reader.cards:
        while card.fields and not card.fields[-1]:
            card.fields.pop()
    return Deck(reader.cards, reader.digest.hexdigest(), reader.ended)


class _Reader:
    def __init__(self, path: Path) -> None:
        self.folder = path.parent
        self.digest = hashlib.sha256()
        self.cards: list[Card] = []
        self.continuations = Continuations()
        self.files, self.ended, self.open = 0, False, False
        self.steps: dict[int, str] = {}  # increments of the last card, by field
        self.copies = 0

    def read(self, path: Path, stack: tuple[Path, ...]) -> None:
        """Append the cards of a file; `stack` are the files that include it."""
        self.files += 1
        if path.resolve() in stack or len(stack) >= MAX_DEPTH or self.files > MAX_FILES:
            raise InputError(f"{path.name}: INCLUDE goes round in circles or too deep; include every file once")
        lines = self._lines(path)
        rest = iter(list(enumerate(lines, 1))[0 if stack else _bulk_start(lines, path) :])
        for number, line in rest:
            if self.ended:
                return
            line = line.split("$", 1)[0].rstrip()
            if match := INCLUDE.match(line):
                name = _whole_name(match[1], rest)
                self.read(self._included(name, path, number), (*stack, path.resolve()))
            elif line:
                self._line(line.upper(), path.name, number)
        if not stack and not self.ended and self.open:
            raise self.cards[-1].error("the file ends where a continuation of this card should follow; export it again")

    def _lines(self, path: Path) -> list[str]:
        try:
            content = path.read_bytes()
        except OSError as error:
            reason = error.strerror or type(error).__name__
            raise InputError(f"Nastran deck {path} cannot be read ({reason}); check its path") from None
        self.digest.update(content)
        return re.split(r"\r\n|\r|\n", content.removeprefix(codecs.BOM_UTF8).decode("latin-1"))

    def _included(self, name: str, path: Path, number: int) -> Path:
        name = name.strip().strip("'\"").strip()
        for folder in (path.parent, self.folder):
            for spelling in (name, name.replace("\\", "/")):
                if "\0" not in spelling and (folder / spelling).is_file():
                    return folder / spelling
        raise InputError(
            f"{path.name} line {number}: INCLUDE file {name[:200]!r} does not exist beside the deck; put it there"
        )

    def _line(self, line: str, file: str, number: int) -> None:
        where = f"{file} line {number}"
        parts = split(line)
        if parts is None:
            raise InputError(f"{where}: more fields behind the marker of the line; continue the card on the next")
        if (copies := replication.count(parts.head)) is not None:
            self._copy(copies, where)
            self.open = False
            return
        if parts.head == "=" or replication.repeats(parts.data):
            if parts.continues and self.cards and self.continuations.parent(parts, where) is not self.cards[-1]:
                raise InputError(f"{where}: = and *(1) in a continuation of another card; write the line out")
            parts = parts._replace(**dict(zip(("head", "data"), self._replicated(*parts[:2], where), strict=True)))
        elif not parts.continues:
            self.steps = {}
        if parts.continues:
            self._continue(parts, where)
        elif parts.head == "ENDDATA":
            self.ended = True
        else:
            self.cards.append(Card(parts.head.rstrip("* "), parts.data, file, number))
            self.continuations.begin(self.cards[-1], parts)
        self.open = bool(parts.marker) or (len(parts.data) == 4 and parts.head[:1] != "*")

    def _continue(self, line: Line, where: str) -> None:
        """Add a line to the card that it goes on with, or keep it for one that follows."""
        card = self.continuations.parent(line, where)
        if card is not None:
            self.continuations.add(card, line)
        elif line.head[1:]:
            self.continuations.keep(line, where)
        else:
            raise InputError(f"{where}: a continuation without a card before it; start at BEGIN BULK")

    def _replicated(self, head: str, data: list[str], where: str) -> tuple[str, list[str]]:
        """Fill the fields that refer to the card before, or of a continuation to the same line of the card before."""
        continues = not head or head[0] in "+*"
        if len(self.cards) < 1 + continues:
            raise InputError(f"{where}: = and *(1) repeat the card before, and there is none; write the card out")
        before = self.cards[-2 if continues else -1]
        name = head.rstrip("* ")
        start = 0
        if continues:
            width = len(data)
            start = -(-len(self.cards[-1].fields) // width) * width
        elif name not in ("=", before.name):
            raise InputError(f"{where}: = and *(1) repeat fields of {before.name} in a {name}; write the card out")
        try:
            data, steps = replication.replicated(data, before.fields[start : start + len(data)])
        except ValueError as error:
            raise InputError(f"{where}: {error}; write the card out") from None
        self.steps = {**(self.steps if continues else {}), **{start + k: step for k, step in steps.items()}}
        return before.name if head == "=" else head, data

    def _copy(self, copies: int, where: str) -> None:
        """Append `copies` cards, each with the increments of the last one."""
        self.copies += copies
        if not self.cards or not self.steps:
            raise InputError(f"{where}: =(n) repeats increments as *(1) of the card before, which has none")
        if self.copies > MAX_COPIES:
            raise InputError(f"{where}: more than {MAX_COPIES} cards by replication; write them out")
        for _ in range(copies):
            last = self.cards[-1]
            fields = list(last.fields)
            try:
                for k, step in self.steps.items():
                    fields[k] = replication.increased(fields[k], step)
            except ValueError as error:
                raise InputError(f"{where}: {error}; write the cards out") from None
            self.cards.append(Card(last.name, fields, last.file, last.line))
            self.continuations.begin(self.cards[-1], Line("", [], ""))


def _whole_name(text: str, rest: Iterator[tuple[int, str]]) -> str:
    """Return the name of a file whose quotation marks close on one of the lines that follow."""
    quote = text[:1]
    while quote in ("'", '"') and quote not in text[1:]:
        _, line = next(rest, (0, quote))
        text = text.rstrip() + line.split("$", 1)[0].strip()
    return text


def _bulk_start(lines: list[str], path: Path) -> int:
    for i, line in enumerate(lines):
        if BEGIN.match(line):
            return i + 1
    if any(line.strip().upper() == "CEND" for line in lines):
        raise InputError(f"{path.name}: the deck has CEND but no BEGIN BULK after it; export it again")
    return 0
