"""Nodes and elements of a deck by instance and number: one by one, or many at once."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, MutableMapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from modalprep.fe.mesh.tables import Lookup
from modalprep.fe.readers.abaqus.lexer import Row

Key = tuple[str, int]  # instance in capitals, number


class Element(NamedTuple):
    """An element: its type, what it is one of, the nodes of the file, where it is, and its cells."""

    type: str
    family: str
    nodes: tuple[int, ...]
    row: Row
    cells: tuple[tuple[str, int], ...]
    extra: tuple[int, ...] = ()  # node that orients a beam


class Nodes:
    """The indices of nodes in the list of points."""

    def __init__(self) -> None:
        self._count = 0
        self._places: dict[Key, int] = {}
        self._keys: list[Key] = []
        self._blocks: list[tuple[str, np.ndarray, Lookup, int]] = []  # instance, labels, the same, index of the first
        self._waiting = 0  # the first block whose nodes are not listed one by one

    def add_block(self, scope: str, labels: np.ndarray) -> bool:
        """Add nodes with numbers of their own, unless one of them is there."""
        known = [own for of, own, _, _ in self._blocks if of == scope]
        if self._places and any((scope, label) in self._places for label in labels.tolist()):
            return False
        if len(np.unique(labels)) < len(labels) or any(np.isin(labels, own).any() for own in known):
            return False
        self._blocks.append((scope, labels, Lookup(labels), self._count))
        self._count += len(labels)
        return True

    def add(self, key: Key) -> int:
        """Return the index of a node; one that is not there is added at the end."""
        place = self.places.setdefault(key, self._count)
        if place == self._count:
            self._keys.append(key)
            self._count += 1
        return place

    @property
    def places(self) -> dict[Key, int]:
        """The index of each node by its key."""
        for scope, labels, _, first in self._blocks[self._waiting :]:
            keys = [(scope, label) for label in labels.tolist()]
            self._places.update(zip(keys, range(first, first + len(keys)), strict=True))
            self._keys += keys
        self._waiting = len(self._blocks)
        return self._places

    @property
    def keys(self) -> list[Key]:
        """The keys of the nodes in their order."""
        _ = self.places
        return self._keys

    @property
    def labels(self) -> np.ndarray:
        """The numbers of the nodes in their order."""
        listed = [label for _, label in self._keys]
        return np.array([*listed, *np.concatenate([[], *(own[1] for own in self._blocks[self._waiting :])])], dtype=int)

    def find(self, scope: str, labels: np.ndarray) -> np.ndarray:
        """Return the indices of the nodes of an instance, -1 of those that are not there."""
        found = np.full(labels.shape, -1)
        for of, _, lookup, first in self._blocks:
            if of == scope:
                at = lookup(labels)
                np.add(at, first, out=found, where=at >= 0)
        if self._keys and (found < 0).any():
            rest = [self._places.get((scope, label), -1) for label in labels[found < 0].tolist()]
            found[found < 0] = rest
        return found


class ElementBlock(NamedTuple):
    """Many elements of one type, each one cell: nodes (n, k), lines of the file (n,), rows of the cells."""

    type: str
    family: str
    nodes: np.ndarray
    file: str
    lines: np.ndarray
    cell: str
    rows: range

    def element(self, k: int) -> Element:
        """Return one element."""
        nodes = tuple(self.nodes[k].tolist())
        return Element(
            self.type, self.family, nodes, Row([], self.file, int(self.lines[k])), ((self.cell, self.rows[k]),)
        )


class Elements(MutableMapping[Key, Element]):
    """The elements by key, in the order of the file."""

    def __init__(self) -> None:
        self._place: dict[Key, int] = {}
        self._starts: list[int] = []  # of the parts
        self.parts: list[ElementBlock | list[Element]] = []

    def _at(self, key: Key) -> tuple[ElementBlock | list[Element], int]:
        place = self._place[key]
        part = bisect_right(self._starts, place) - 1
        return self.parts[part], place - self._starts[part]

    def _listed(self, place: int) -> tuple[list[Element], int]:
        """Return the part with an element one by one, and the element's place in it."""
        number = bisect_right(self._starts, place) - 1
        part = self.parts[number]
        if not isinstance(part, list):
            part = [part.element(k) for k in range(len(part.nodes))]
            self.parts[number] = part
        return part, place - self._starts[number]

    def __getitem__(self, key: Key) -> Element:
        part, k = self._at(key)
        return part[k] if isinstance(part, list) else part.element(k)

    def __setitem__(self, key: Key, element: Element) -> None:
        if key not in self._place:
            if not self.parts or not isinstance(self.parts[-1], list):
                self._starts.append(len(self._place))
                self.parts.append([])
            self._place[key] = len(self._place)
            self._listed(self._place[key])[0].append(element)
            return
        part, k = self._listed(self._place[key])
        part[k] = element

    def __delitem__(self, key: Key) -> None:
        raise TypeError("elements stay")

    def __iter__(self) -> Iterator[Key]:
        return iter(self._place)

    def __len__(self) -> int:
        return len(self._place)

    def __contains__(self, key: object) -> bool:
        return key in self._place

    def family(self, key: Key) -> str:
        """Return what an element is one of."""
        part, k = self._at(key)
        return part[k].family if isinstance(part, list) else part.family

    def _runs(self, keys: Sequence[Key]) -> Iterator[tuple[ElementBlock | list[Element], np.ndarray, int]]:
        """Yield the parts with elements that follow each other among the keys, their places in it, and the first."""
        places = np.fromiter(map(self._place.__getitem__, keys), int, len(keys))
        parts = np.searchsorted(self._starts, places, side="right") - 1
        bounds = [*np.flatnonzero(np.diff(parts, prepend=-1)).tolist(), len(keys)]
        for start, end in pairwise(bounds):
            part = int(parts[start])
            yield self.parts[part], places[start:end] - self._starts[part], start

    def families(self, keys: Sequence[Key]) -> dict[str, Key]:
        """Return what elements are one of, each with the last element of that family."""
        found: dict[str, Key] = {}
        for part, places, first in self._runs(keys):
            if isinstance(part, list):
                found |= {part[k].family: keys[first + i] for i, k in enumerate(places.tolist())}
            else:
                found[part.family] = keys[first + len(places) - 1]
        return found

    def cells(self, keys: Sequence[Key]) -> dict[str, list[int]]:
        """Return the rows of the cells of elements by their kinds."""
        found: dict[str, list[int]] = {}
        for part, places, _ in self._runs(keys):
            if isinstance(part, list):
                for cell, row in (own for k in places.tolist() for own in part[k].cells):
                    found.setdefault(cell, []).append(row)
            else:
                found.setdefault(part.cell, []).extend((part.rows.start + part.rows.step * places).tolist())
        return found

    def add_block(self, keys: list[Key], block: ElementBlock) -> None:
        """Add elements none of which is there."""
        first = len(self._place)
        self._starts.append(first)
        self.parts.append(block)
        self._place.update(zip(keys, range(first, first + len(keys)), strict=True))

    def types(self) -> Iterator[tuple[str, int]]:
        """Yield types and how many elements each has, a type perhaps several times."""
        for part in self.parts:
            if isinstance(part, list):
                yield from ((element.type, 1) for element in part)
            else:
                yield part.type, len(part.nodes)

    def nodes_of(self, families: frozenset[str]) -> set[int]:
        """Return the nodes of all elements of some families, those that orient beams too."""
        found: set[int] = set()
        for part in self.parts:
            if isinstance(part, list):
                found.update(n for e in part if e.family in families for n in (*e.nodes, *e.extra))
            elif part.family in families:
                found.update(np.unique(part.nodes).tolist())
        return found
