"""Runs of cards alike in fixed fields, such as all GRID of a deck: their numbers in one table."""

from __future__ import annotations

import string
from typing import NamedTuple

import numpy as np

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.lines import split
from modalprep.fe.readers.text import Lines

GRID = np.array([True, True, False, False, False, True, True, True])  # which fields are whole numbers
HEIGHTS = {"GRID": (1, 2)}  # lines of a card in small and in large fields
NAMES = ["GRID", *dict.fromkeys(card for cell in CELLS.values() for card in cell.nastran if cell.dimension > 1)]
CONTINUATION = -1
IN_MARKERS = np.isin(np.arange(256), [ord(c) for c in string.ascii_letters + string.digits])
HEAD, LAST, MARKER = 8, 72, 80  # where fields begin, where they end, where markers end


class Run(NamedTuple):
    """Cards that follow each other from line `first` (from 0 on) to `stop`, of `height` lines each."""

    name: str
    large: bool
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
            name, large = NAMES[(kinds[a] - 1) // 2], bool((kinds[a] - 1) % 2)
            found[int(cards[a])] = Run(name, large, int(cards[a]), int(cards[b]), int(height[a]))
    return found


def _kinds(lines: Lines) -> np.ndarray:
    """Return of each line 1 + 2 k of card k in small fields, 2 + 2 k in large ones, -1 of a continuation, else 0."""
    beginnings = lines.beginnings(0, len(lines))
    kinds = np.where(np.isin(beginnings, [ord(c) for c in " +*"]), CONTINUATION, 0)
    heads = lines.columns(0, len(lines), 0, HEAD)
    words = heads.view(np.uint64).ravel()
    for k, name in enumerate(NAMES):
        for large in (False, True):
            word = np.frombuffer(f"{name + '*' * large:<{HEAD}}".encode(), dtype=np.uint64)[0]
            kinds[words == word] = 1 + 2 * k + large
    return kinds


def block_of(lines: Lines, run: Run, file: str) -> CardBlock | None:
    """Return the cards of a run; None where one of them asks for a look of its own."""
    width = 4 if run.large else 8
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


def _continued(lines: Lines, run: Run) -> bool:
    """Whether each line goes on with the one before it, by no marker or by the same one, and the last has none."""
    if (lines.stops(run.first, run.stop) - lines.starts(run.first, run.stop)).max() > MARKER:
        return False
    markers = lines.columns(run.first, run.stop, LAST, MARKER).reshape(-1, run.height, MARKER - LAST)
    heads = lines.columns(run.first, run.stop, 0, HEAD).reshape(-1, run.height, HEAD)[:, 1:]
    if (markers[:, -1] != ord(" ")).any():
        return False
    first = heads[:, :, 0]
    if not (first == ord("*") if run.large else np.isin(first, [ord(" "), ord("+")])).all():
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
