"""Nastran grids and coordinate systems to basic coordinates (deck units)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.tables import Lookup
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.runs import CardBlock
from modalprep.fe.readers.systems import BASIC, System

Tables = dict[str, dict[int, Card]]
FLUID = -1  # CD of a point of the fluid


def deck_grids(path: Path, cards: Iterable[Card], basic: System = BASIC) -> Grids | None:
    """Return the grids among the cards of a deck, with their coordinate systems; None where there is no GRID.

    `basic` is where the basic system of a part stands.
    """
    tables: Tables = {"grid": {}, "system": {}, "SPOINT": {}, "GRDSET": {}}
    for card in cards:
        if card.name == "GRID":
            tables["grid"][card.id] = card
        elif re.fullmatch("CORD[12][RCS]", card.name):
            tables["system"][card.id] = card
        elif card.name in ("SPOINT", "GRDSET"):
            tables[card.name][len(tables[card.name])] = card
    return Grids(path, tables, basic=basic) if tables["grid"] else None


def system_from_points(card: Card, points: np.ndarray) -> System:
    """Return the system with origin A, z axis towards B and C in its x-z plane; ``points (3, 3)`` basic."""
    z, c = points[1] - points[0], points[2] - points[0]
    y = np.cross(z, c)
    if not np.linalg.norm(y) > 1e-12 * np.linalg.norm(z) * np.linalg.norm(c):
        raise card.error("its three points lie on one line; move the third into the x-z plane")
    z, y = z / np.linalg.norm(z), y / np.linalg.norm(y)
    return System(card.name[-1], points[0], np.array([np.cross(y, z), y, z]))


class Grids:
    """Positions of the grids in basic coordinates (deck units) and the coordinate systems.

    Attributes
    ----------
    ids : (n,) int
        Ascending.
    points : (n, 3) float
    systems : {id: System}
        That of number 0 is the basic one, or where a part stands in it.
    fixed : {row: str}
        Components of the permanent constraints PS.
    """

    def __init__(self, path: Path, tables: Tables, blocks: Sequence[CardBlock] = (), basic: System = BASIC) -> None:
        cards = [card for _, card in sorted(tables.get("grid", {}).items())]
        if not cards and not blocks:
            raise InputError(f"{path.name}: the deck has no GRID; give a Nastran bulk data deck with its nodes")
        default = list(tables.get("GRDSET", {}).values())[-1:]
        cp, cd = (default[0].integer(k, "CP or CD", 0) if default else 0 for k in (1, 5))
        ps = default[0].text(6) if default else ""
        values = np.concatenate([_values(cards, cp, cd), *(np.nan_to_num(block.values[:, :6]) for block in blocks)])
        self._order = np.argsort(values[:, 0])
        self._cards, self._blocks = cards, blocks
        self.ids = values[self._order, 0].astype(int)
        self.find = Lookup(self.ids)
        self.cp = values[self._order, 1].astype(int)
        self.cd = values[self._order, 5].astype(int)
        self.points = np.ascontiguousarray(values[self._order, 2:5])
        given = np.concatenate(
            [[bool(card.text(6) or ps) for card in cards], *(np.nan_to_num(block.values[:, 6]) > 0 for block in blocks)]
        )
        held = {
            i: self.card(i).text(6) or ps
            for i in np.flatnonzero((given > 0)[self._order] & (self.cd != FLUID)).tolist()
        }
        self.fixed = {i: components for i, components in held.items() if components != "0"}
        self.scalar = _scalar_points(tables)
        self.systems = {0: basic}
        if basic is not BASIC:
            self._place(0)
        self._resolve(dict(tables.get("system", {})))
        for used in (self.cp, self.cd):
            for i in np.flatnonzero(~np.isin(used, [FLUID, *self.systems])):
                raise self.card(int(i)).error(f"coordinate system {used[i]} is not in the deck; add its CORD2R card")

    @cached_property
    def row(self) -> dict[int, int]:
        """The rows of the grids by id."""
        return {number: i for i, number in enumerate(self.ids.tolist())}

    def card(self, i: int) -> Card:
        """Return the card of a row."""
        k = int(self._order[i])
        if k < len(self._cards):
            return self._cards[k]
        k -= len(self._cards)
        for block in self._blocks:
            if k < len(block.values):
                return block.card(k)
            k -= len(block.values)
        raise IndexError(i)

    def _place(self, number: int) -> None:
        rows = np.flatnonzero(self.cp == number)
        self.points[rows] = self.systems[number].to_basic(self.points[rows])

    def _resolve(self, waiting: dict[int, Card]) -> None:
        """Place the systems whose reference is placed, until none is left."""
        while waiting:
            corners = {number: self._corners(card, waiting) for number, card in waiting.items()}
            ready = {number: points for number, points in corners.items() if points is not None}
            if not ready:
                raise next(iter(waiting.values())).error("it is defined through itself; break the circle")
            for number, points in ready.items():
                self.systems[number] = system_from_points(waiting[number], points)
                self._place(number)
            waiting = {number: card for number, card in waiting.items() if number not in ready}

    def _corners(self, card: Card, waiting: dict[int, Card]) -> np.ndarray | None:
        if card.name[4] == "1":
            rows = [self.node(card, k, f"G{k}") for k in (1, 2, 3)]
            return None if any(self.cp[i] in waiting for i in rows) else self.points[rows]
        number = card.integer(1, "RID", 0, lowest=0)
        if number not in waiting and number not in self.systems:
            raise card.error(f"coordinate system {number} is not in the deck; add its CORD2R card")
        points = np.array([[card.real(k + i, "a coordinate of A, B, C", 0.0) for i in range(3)] for k in (2, 5, 8)])
        return self.systems[number].to_basic(points) if number in self.systems else None

    def system(self, card: Card, number: int) -> System:
        """Return a coordinate system that `card` refers to."""
        if number not in self.systems:
            raise card.error(f"coordinate system {number} is not in the deck; add its CORD2R card")
        return self.systems[number]

    def node(self, card: Card, k: int, what: str) -> int:
        """Return the row of the grid in field `k`."""
        return self.of(card, card.integer(k, what, lowest=1))

    def of(self, card: Card, number: int) -> int:
        """Return the row of a grid that `card` refers to."""
        if number not in self.row:
            kind = "a scalar point, which has no position" if self.is_scalar(number) else "not in the deck"
            raise card.error(f"grid {number} is {kind}; add its GRID card or remove the reference")
        if self.is_fluid(number):
            raise card.error(
                f"grid {number} is a point of the fluid (CD = -1), which has a pressure and no displacement"
            )
        return self.row[number]

    def is_fluid(self, number: int) -> bool:
        """Whether a number is that of a point of the fluid, which has a pressure only."""
        return number in self.row and self.cd[self.row[number]] == FLUID

    def is_scalar(self, number: int) -> bool:
        """Whether a number is that of an SPOINT."""
        return any(low <= number <= high for low, high in self.scalar)

    def displacement(self, i: int) -> np.ndarray:
        """Return the rows e1, e2, e3 of the displacement system of grid row `i`."""
        return self.systems[int(self.cd[i])].axes_at(self.points[i])


def _values(cards: list[Card], cp: int, cd: int) -> np.ndarray:
    """Return id, CP, X1, X2, X3 and CD of grids, blanks as GRDSET has them."""
    found = np.zeros((len(cards), 6))
    found[:, 0] = [card.id for card in cards]
    found[:, 1] = [card.integer(1, "CP", cp, lowest=0) for card in cards]
    found[:, 5] = [card.integer(5, "CD", cd, lowest=FLUID) for card in cards]
    found[:, 2:5] = np.array([[card.real(k, f"X{k - 1}", 0.0) for k in (2, 3, 4)] for card in cards]).reshape(-1, 3)
    return found


def _scalar_points(tables: Tables) -> list[tuple[int, int]]:
    found = []
    for card in tables.get("SPOINT", {}).values():
        words = " ".join(card.fields)
        for low, high in re.findall(r"(\d+)(?:\s*THRU\s*(\d+))?", words):
            found.append((int(low), int(high or low)))
    return found
