"""The mesh of a Nastran deck under construction, card by card."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from modalprep.fe.mesh.builder import MeshBuilder
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.grids import Grids, Tables
from modalprep.fe.readers.nastran.materials import Conversion
from modalprep.fe.readers.nastran.properties import BUILDERS, bar
from modalprep.fe.readers.nastran.sections import SECTIONS
from modalprep.fe.readers.units import Units

Gaps = Literal["open", "closed"]
SECTION_FAMILIES = ("shell", "bar", "beam", "bend", "rod", "tube", "shear", "solid", "bush", "elas")


class Builder(MeshBuilder):
    """The mesh under construction, card by card."""

    def __init__(self, tables: Tables, grids: Grids, units: Units, gaps: Gaps | None = None) -> None:
        super().__init__()
        self.gaps = gaps
        self.tables, self.grids, self.units = tables, grids, units
        self.conversion = Conversion(units, tables.get("material", {}))
        self.bare = not any(tables.get(family) for family in SECTION_FAMILIES)  # a mesh without sections
        self.seen: dict[tuple[str, int], Card] = {}
        self.built: dict[tuple[str, int], str] = {}
        self.twist: dict[str, float] = {}
        self.listed = len(grids.points)
        self.scalar_masses: dict[int, tuple[Card, np.ndarray]] = {}  # by row of the grid: first card, six sums
        self.fluid = 0  # elements of the fluid, which are left out
        # ids of elements, and group, kind and rows of their cells
        self.placed: list[tuple[Sequence[int] | np.ndarray, str, str, list[int]]] = []
        self.apart: list[tuple[Card, list[int]]] = []  # elements between scalar points
        self.normal: list[Card] = []  # shells with x of their MCID along the normal

    @cached_property
    def places(self) -> dict[int, list[tuple[str, str, int]]]:
        """Group, kind and row of the cells of each element, once all are there."""
        found: dict[int, list[tuple[str, str, int]]] = {}
        for ids, group, kind, rows in self.placed:
            for number, row in zip(np.array(ids).tolist(), rows, strict=True):
                found.setdefault(number, []).append((group, kind, row))
        return found

    def add(self, card: Card, handler: Callable[[Builder, Card], None]) -> None:
        """Read an element card by its handler; a repeated card with the same content is skipped."""
        known = self.seen.setdefault((card.name, card.id), card)
        if known is not card:
            if not known.same(card):
                raise card.error(f"another {card.name} in line {known.line} has this id; keep one of the two")
            return
        try:
            handler(self, card)
        except ArithmeticError:
            raise card.error("its numbers or those of its property overflow; correct them") from None

    def cell(self, card: Card, kind: str, nodes: list[int], group: str) -> int:
        """Append a cell to a group and return its row."""
        if len(set(nodes)) < len(nodes):
            raise card.error("it names a grid twice; give every corner its own grid")
        row = self.append(kind, nodes, group)
        self.placed.append(([card.id], group, kind, [row]))
        return row

    def section(self, card: Card, family: str, default: int | None = None) -> str:
        """Return the group of the property in field 1 of an element; the property is built once."""
        number = card.integer(1, "PID", default or card.id, lowest=1)
        if (family, number) not in self.built:
            self.built[family, number] = self._built(card, family, number)
        return self.built[family, number]

    def _built(self, card: Card, family: str, number: int) -> str:
        if self.bare:
            return f"p{family}_{number}"
        source = self.tables.get(family, {}).get(number)
        if source is None:
            raise card.error(f"property {number} is not in the deck; add its P{family.upper()} card")
        name = f"{source.name.lower()}_{number}"
        if source.name in SECTIONS:
            section = SECTIONS[source.name](self.conversion, source)
            self.properties[name] = bar(self.conversion, source, section)
            self.twist[name] = section.turned[2]
        else:
            self.properties[name] = BUILDERS[source.name](self.conversion, source)
        return name

    @property
    def has_elements(self) -> bool:
        """Whether there are cells that are no points."""
        return any(kind != "vertex" for kind in self.cells)

    def mesh(self, path: Path, sha256: str, notes: list[str]) -> Mesh:
        """Return the finished mesh."""
        if self.bare and self.has_elements:
            notes.append("the deck has no property cards; its groups have no sections")
        if self.normal:
            what = "shells have x of their MCID along the normal: their material has y as its axis 1"
            notes.append(f"{len(self.normal)} {what} ({_first(self.normal)})")
        if self.apart:
            what = "elements between scalar points, which nothing joins to grids"
            notes.append(f"left out: {len(self.apart)} {what} ({_first([card for card, _ in self.apart])})")
        if self.fluid:
            notes.append(f"left out: {self.fluid} elements of the fluid; neither its mass nor its pressure acts")
        return Mesh(
            points=np.vstack([self.grids.points, *self.more_points]) * self.units.length,
            source=path.name,
            sha256=sha256,
            scale=self.units.length,
            labels=np.append(self.grids.ids, self.grids.ids[-1] + 1 + np.arange(len(self.more_points))),
            **self.fields(),
            coupled_mass=_coupled(self.tables),
            notes=(*notes, *self.conversion.notes),
        )


def _first(cards: list[Card]) -> str:
    return f"first {cards[0].name} {cards[0].id}, {cards[0].file} line {cards[0].line}"


def _coupled(tables: Tables) -> bool:
    """Whether the deck asks for coupled masses; lumped is Nastran's default."""
    asked = [card.integer(1, "COUPMASS", -1) for card in tables.get("PARAM", {}).values() if card.text(0) == "COUPMASS"]
    return bool(asked) and asked[-1] > 0
