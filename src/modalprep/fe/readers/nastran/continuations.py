"""Which card a continuation line goes on with: the one whose last line ends in its marker, wherever it stands.

The first character of a marker, + or *, does not count. A continuation without a marker goes on with the card before
it, and so does one behind a line without a marker, unless another card has that of the continuation.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from modalprep.errors import InputError
from modalprep.fe.readers.nastran.lines import Line


class Growing(Protocol):
    """A card with its fields, and where it stands."""

    name: str
    fields: list[str]
    line: int


class Continuations:
    """Cards that wait for their next line, and lines that wait for their card, by marker."""

    def __init__(self) -> None:
        self._open: dict[str, list[Growing]] = {}
        self._orphans: dict[str, tuple[Line, str]] = {}
        self._last: tuple[Growing, str] | None = None  # the card of the line before, and its marker
        self._assumed: dict[str, str] = {}  # places of lines that went on with the card before them, by marker
        self._markers: dict[int, str] = {}  # of the last lines of cards, by identity

    @property
    def settled(self) -> bool:
        """Whether no line of the past has to do with the markers of cards that follow."""
        return not self._orphans and not self._assumed

    def begin(self, card: Growing, line: Line) -> None:
        """Open a new card, and add the lines that stand before it."""
        self._wait(card, line.marker)

    def parent(self, line: Line, where: str) -> Growing | None:
        """Return the card that a line goes on with, None when it does not stand before the line.

        Raises
        ------
        InputError
            When several cards end in the marker.
        """
        card, marker = self._last if self._last else (None, "")
        key = line.head[1:]
        if not key or key in _keys(marker):
            return card
        waiting = self._open.get(key, [])
        if len(waiting) > 1:
            listed = " and ".join(f"{one.name} in line {one.line}" for one in waiting[:2])
            raise InputError(f"{where}: the continuation {line.head} belongs to {listed}; give each its own marker")
        if waiting or marker or card is None:
            return waiting[0] if waiting else None
        self._assumed[key] = where
        return card

    def add(self, card: Growing, line: Line) -> None:
        """Add the fields of a line to its card."""
        for key in _keys(self._markers.pop(id(card), "")):
            self._open[key] = [one for one in self._open.get(key, []) if one is not card]
        width = 4 if len(line.data) == 4 else 8
        card.fields += [""] * (-len(card.fields) % width) + line.data
        self._wait(card, line.marker)

    def keep(self, line: Line, where: str) -> None:
        """Keep a line for a card that follows."""
        if self._orphans.setdefault(line.head[1:], (line, where)) != (line, where):
            raise InputError(f"{where}: the continuation {line.head} is there twice; give each its own marker")

    def finish(self) -> None:
        """Refuse lines that belong to no card."""
        for line, where in self._orphans.values():
            raise InputError(f"{where}: the continuation {line.head} belongs to no card; give its card this marker")

    def _wait(self, card: Growing, marker: str) -> None:
        self._last = card, marker
        if not marker:
            return
        self._markers[id(card)] = marker
        for key in _keys(marker):
            if key in self._assumed:
                raise InputError(
                    f"{self._assumed[key]}: the continuation +{key} stands behind a card without a marker and before "
                    f"{card.name} in line {card.line}, which has it; put it behind its card"
                )
            if key in self._orphans:
                self.add(card, self._orphans.pop(key)[0])
                return
            self._open.setdefault(key, []).append(card)


def _keys(marker: str) -> Iterator[str]:
    """Yield what a continuation of a marker may have behind its + or *."""
    if marker[1:]:
        yield marker[1:]
    if marker and marker[0] not in "+*":
        yield marker
