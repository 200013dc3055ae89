"""Nastran bulk data as text: lines to cards.

Small field (ten columns of 8 characters), large field (``NAME*``, columns of 16) and free field (commas) may be mixed
line by line. A line continues a card when its first field is blank or starts with ``+`` or ``*`` (continuations.py says
which). Many cards alike in fixed fields are read at once (runs.py).
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from modalprep.errors import InputError
from modalprep.fe.readers.nastran import replication
from modalprep.fe.readers.nastran.assign import BEGIN, assigned
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.continuations import Continuations
from modalprep.fe.readers.nastran.lines import Line, split
from modalprep.fe.readers.nastran.runs import CardBlock, block_of, find_runs
from modalprep.fe.readers.text import Lines

INCLUDE = re.compile(r"^\s*INCLUDE\b\s*(.*)$", re.IGNORECASE)
MAX_DEPTH, MAX_FILES = 10, 1000  # of INCLUDE; Nastran itself stops at ten levels
MAX_COPIES = 10**6  # cards that one deck makes by replication


@dataclass(slots=True)
class Deck:
    """The cards of a deck in file order, the hash of all its files, and whether it ends with ENDDATA."""

    entries: list[Card | CardBlock]
    sha256: str
    ended: bool

    @property
    def cards(self) -> list[Card]:
        """All cards, one by one."""
        return one_by_one(self.entries)


def one_by_one(entries: list[Card | CardBlock]) -> list[Card]:
    """Return the cards of entries, those of blocks too."""
    return [card for entry in entries for card in ([entry] if isinstance(entry, Card) else entry.cards())]


def read_cards(path: Path) -> Deck:
    """Read a deck and the files it includes in its bulk data section; the hash is that of assigned matrices too.

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
    for file in assigned(path).values():
        reader.digest.update(file.read_bytes() if file.is_file() else b"")
    for card in reader.cards:
        while isinstance(card, Card) and card.fields and not card.fields[-1]:
            card.fields.pop()
    return Deck(reader.cards, reader.digest.hexdigest(), reader.ended)


class _Reader:
    def __init__(self, path: Path) -> None:
        self.folder = path.parent
        self.digest = hashlib.sha256()
        self.cards: list[Any] = []  # the last one is a card, no block
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
        runs = find_runs(lines)
        rest = _Rest(lines, 0 if stack else _bulk_start(lines, path))
        for number, line in rest:
            if self.ended:
                return
            if number - 1 in runs and self.continuations.settled:
                block = block_of(lines, runs[number - 1], path.name)
                if block is not None:
                    self.cards.append(block)
                    rest.at = runs[number - 1].stop
                    continue
            line = line.split("$", 1)[0].rstrip()
            if match := INCLUDE.match(line):
                name = _whole_name(match[1], rest)
                self.read(self._included(name, path, number), (*stack, path.resolve()))
            elif line:
                self._line(line.upper(), path.name, number)
        if not stack and not self.ended and self.open:
            raise self.cards[-1].error("the file ends where a continuation of this card should follow; export it again")

    def _lines(self, path: Path) -> Lines:
        try:
            content = path.read_bytes()
        except OSError as error:
            reason = error.strerror or type(error).__name__
            raise InputError(f"Nastran deck {path} cannot be read ({reason}); check its path") from None
        self.digest.update(content)
        return Lines(content, "latin-1", lambda text: re.split(r"\r\n|\r|\n", text), breaks="")

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
        entry = self.cards[-2 if continues else -1]
        before = entry if isinstance(entry, Card) else entry.card(len(entry.values) - 1)
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


class _Rest:
    """The lines of a file from one on, with their numbers, which count from 1."""

    def __init__(self, lines: Lines, at: int) -> None:
        self._lines, self.at = lines, at

    def __iter__(self) -> Iterator[tuple[int, str]]:
        return self

    def __next__(self) -> tuple[int, str]:
        if self.at >= len(self._lines):
            raise StopIteration
        self.at += 1
        return self.at, self._lines[self.at - 1]


def _bulk_start(lines: Lines, path: Path) -> int:
    for k in lines.having(b"BEGIN"):
        if BEGIN.match(lines[k]):
            return k + 1
    if any(lines[k].strip().upper() == "CEND" for k in lines.having(b"CEND")):
        raise InputError(f"{path.name}: the deck has CEND but no BEGIN BULK after it; export it again")
    return 0
