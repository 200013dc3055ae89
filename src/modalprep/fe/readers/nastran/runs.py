"""Runs of cards alike in fixed or free fields, such as all GRID of a deck: their numbers in one table."""

from __future__ import annotations

import string
from typing import NamedTuple

import numpy as np

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.lines import split
from modalprep.fe.readers.numbers import plain_numbers
from modalprep.fe.readers.text import STEP, Lines

GRID = np.array([True, True, False, False, False, True, True, True])  # which fields are whole numbers
HEIGHTS = {"GRID": (1, 2)}  # lines of a card in small and in large fields
NAMES = ["GRID", *dict.fromkeys(card for cell in CELLS.values() for card in cell.nastran if cell.dimension > 1)]
CONTINUATION = -1
IN_MARKERS = np.isin(np.arange(256), [ord(c) for c in string.ascii_letters + string.digits])
FORMS = ("small", "large", "free")
WIDTH = 8  # fields of a line, but large ones
HEAD, LAST, MARKER = 8, 72, 80  # where fields begin, where they end, where markers end


class Run(NamedTuple):
    """Cards that follow each other from line `first` (from 0 on) to `stop`, of `height` lines each.

    `form` is that of their fields: "small", "large" or "free".
    """

    name: str
    form: str
    first: int
    stop: int
    height: int


class CardBlock(NamedTuple):
    """Many cards of one name.

    Attributes
    ----------
    values : (n, fields) float
        NaN where a field is blank.
    """

    name: str
    values: np.ndarray
    file: str
    lines: Lines
    run: Run

    @property
    def ids(self) -> np.ndarray:
        """The numbers in the first field."""
        return self.values[:, 0].astype(int)

    def card(self, k: int) -> Card:
        """Return one card."""
        first = self.run.first + k * self.run.height
        fields: list[str] = []
        for line in range(first, first + self.run.height):
            parts = split(self.lines[line].upper())
            assert parts is not None  # only free fields can be None
            fields += parts.data
        while not fields[-1]:
            fields.pop()
        return Card(self.name, fields, self.file, first + 1)

    def cards(self) -> list[Card]:
        """Return all cards."""
        return [self.card(k) for k in range(len(self.values))]


def find_runs(lines: Lines) -> dict[int, Run]:
    """Return the runs of at least `Lines.least` cards with as many lines each, by their first lines.

    The last card before any other line is left out, so that what follows finds it where continuations and replication
    look for it.
    """
    if len(lines) < lines.least:
        return {}
    kinds = _kinds(lines)
    cards = np.flatnonzero(kinds > 0)
    height = np.diff(cards)
    behind = np.cumsum(kinds == CONTINUATION)
    alone = np.diff(behind[cards]) == height - 1  # nothing but continuations up to the next card
    kinds = kinds[cards[:-1]]
    key = np.where(alone, kinds * (len(lines) + 1) + height, -1)
    cuts = np.concatenate([[0], np.flatnonzero(np.diff(key)) + 1, [len(key)]])
    found = {}
    for a, b in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        if b - a >= lines.least and alone[a]:
            name, form = (int(k) for k in divmod(kinds[a] - 1, len(FORMS)))
            found[int(cards[a])] = Run(NAMES[name], FORMS[form], int(cards[a]), int(cards[b]), int(height[a]))
    return found


def _kinds(lines: Lines) -> np.ndarray:
    """Return of each line 1 + 3 k of card k in small fields, one more in large ones and in free ones, or 0.

    -1 is a continuation.
    """
    beginnings = lines.beginnings(0, len(lines))
    kinds = np.where(np.isin(beginnings, [ord(c) for c in " +*,"]), CONTINUATION, 0)
    words = lines.columns(0, len(lines), 0, HEAD).view("<u8").ravel()
    for k, name in enumerate(NAMES):
        for form, end in enumerate(("", "*")):
            kinds[words == _word(f"{name + end:<{HEAD}}")] = 1 + len(FORMS) * k + form
        if len(name) < HEAD:
            free = f"{name},"
            kinds[words & _word("\xff" * len(free)) == _word(free)] = 1 + len(FORMS) * k + 2
    return kinds


def _word(text: str) -> np.uint64:
    """Return the first bytes of a line as one number, zeros behind its end."""
    return np.frombuffer(text.encode("latin-1").ljust(HEAD, b"\0"), dtype="<u8")[0]


def block_of(lines: Lines, run: Run, file: str) -> CardBlock | None:
    """Return the cards of a run; None where one of them asks for a look of its own."""
    if run.form == "free":
        return _free_block(lines, run, file)
    width = 4 if run.form == "large" else 8
    edges = np.linspace(HEAD, LAST, width + 1).astype(int)
    count = (run.stop - run.first) // run.height
    whole = GRID if run.name == "GRID" else np.ones(width * run.height, dtype=bool)
    if len(whole) != width * run.height or not _continued(lines, run):
        return None
    table = lines.table(run.first, run.stop, edges, whole)
    if table is None:
        return None
    values = table.reshape(count, -1)
    return CardBlock(run.name, values, file, lines, run) if _is_regular(run.name, values) else None


def _free_block(lines: Lines, run: Run, file: str) -> CardBlock | None:
    """Return the cards of a run in free fields, as many in each line; + and nothing may mark lines that go on."""
    count = (run.stop - run.first) // run.height
    whole = GRID if run.name == "GRID" else np.ones(WIDTH * run.height, dtype=bool)
    if len(whole) != WIDTH * run.height:
        return None
    values = np.full((count, WIDTH * run.height), np.nan)
    step = (STEP // run.height) * run.height
    for first in range(run.first, run.stop, step):
        last = min(first + step, run.stop)
        begins, ends, counts = lines.fields(first, last)
        own = counts[: run.height].tolist()
        if (counts.reshape(-1, run.height) != own).any():
            return None
        table = _free_table(lines, own, begins.reshape(-1, sum(own)), ends.reshape(-1, sum(own)), whole)
        if table is None:
            return None
        values[(first - run.first) // run.height : (last - run.first) // run.height] = table
    return CardBlock(run.name, values, file, lines, run) if _is_regular(run.name, values) else None


def _free_table(
    lines: Lines, counts: list[int], begins: np.ndarray, ends: np.ndarray, whole: np.ndarray
) -> np.ndarray | None:
    """Return the numbers of some cards whose lines have so many fields, NaN of blanks; None unless all are plain."""
    values = np.full((len(begins), len(whole)), np.nan)
    at = 0
    for k, count in enumerate(counts):
        head, data, marker = at, slice(at + 1, at + min(count, WIDTH + 1)), at + WIDTH + 1
        at += count
        if count > WIDTH + 2 or (k and not _is_plus(lines, begins[:, head], ends[:, head])):
            return None
        if count == WIDTH + 2 and (k == len(counts) - 1 or not _is_plus(lines, begins[:, marker], ends[:, marker])):
            return None
        own = whole[WIDTH * k : WIDTH * k + min(count, WIDTH + 1) - 1]
        if not len(own):
            return None
        found = plain_numbers(lines.text, begins[:, data], ends[:, data], own, bare=True)
        if found is None:
            return None
        values[:, WIDTH * k : WIDTH * k + len(own)] = found
    return values


def _is_plus(lines: Lines, begins: np.ndarray, ends: np.ndarray) -> bool:
    """Whether fields are empty, or a plus alone."""
    size = ends - begins
    return bool((size <= 1).all() and (lines.text[begins[size == 1]] == ord("+")).all())


def _continued(lines: Lines, run: Run) -> bool:
    """Whether each line goes on with the one before it, by no marker or by the same one, and the last has none."""
    if (lines.stops(run.first, run.stop) - lines.starts(run.first, run.stop)).max() > MARKER:
        return False
    markers = lines.columns(run.first, run.stop, LAST, MARKER).reshape(-1, run.height, MARKER - LAST)
    heads = lines.columns(run.first, run.stop, 0, HEAD).reshape(-1, run.height, HEAD)[:, 1:]
    if (markers[:, -1] != ord(" ")).any():
        return False
    first = heads[:, :, 0]
    if not (first == ord("*") if run.form == "large" else np.isin(first, [ord(" "), ord("+")])).all():
        return False
    before = markers[:, :-1]
    named = (before != ord(" ")).any(axis=2)
    marked = (before[:, :, 0] == ord("+")) | (before[:, :, 0] == ord("*"))
    return bool((~named | marked).all()) and _keys_agree(before[:, :, 1:], heads[:, :, 1:])


def _keys_agree(markers: np.ndarray, heads: np.ndarray) -> bool:
    """Whether what stands behind the + of continuations is blank, or what their markers have there."""
    blank = heads == ord(" ")
    if not (blank.all(axis=2) | (markers == heads).all(axis=2)).all():
        return False
    words = np.concatenate([markers, heads])
    blank = words == ord(" ")
    return bool((blank | IN_MARKERS[words]).all()) and not (blank[:, :, :-1] & ~blank[:, :, 1:]).any()


def _is_regular(name: str, values: np.ndarray) -> bool:
    """Whether cards have ids of their own, in all of them the same fields are filled, and no field is special."""
    ids = values[:, 0]
    if not (ids >= 1).all() or len(np.unique(ids)) < len(ids):
        return False
    if name == "GRID":
        with np.errstate(invalid="ignore"):
            return not ((values[:, 1] < 0) | (values[:, 5] < -1) | (values[:, 7] > 0) | (values[:, 7] < 0)).any()
    count = int((~np.isnan(values[0])).sum())
    counts = [cell.count for cell in CELLS.values() if name in cell.nastran]
    return count - 2 in counts and bool((values[:, :count] >= 1).all() and np.isnan(values[:, count:]).all())
