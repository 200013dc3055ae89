"""What an Ansys input file says, by numbers of the file and in its own units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.readers.systems import System


class Element(NamedTuple):
    """An element with its attributes: numbers of type, material, real constants, section and coordinate system."""

    label: int
    type: int
    material: int
    real: int
    section: int
    system: int
    nodes: tuple[int, ...]
    line: int


class ElementBlock(NamedTuple):
    """Many elements: labels (n,), attributes (n, 5) as in `Element`, nodes (n, most) with their counts (n,), lines."""

    labels: np.ndarray
    attributes: np.ndarray
    counts: np.ndarray
    nodes: np.ndarray
    lines: np.ndarray

    def element(self, k: int) -> Element:
        """Return one element."""
        nodes = tuple(self.nodes[k, : self.counts[k]].tolist())
        kind, material, real, section, system = self.attributes[k].tolist()
        return Element(int(self.labels[k]), kind, material, real, section, system, nodes, int(self.lines[k]))

    def uniform(self) -> Iterator[ElementBlock]:
        """Yield the elements that follow each other with the same attributes and as many nodes."""
        keys = np.column_stack([self.attributes, self.counts])
        cuts = np.flatnonzero(np.any(keys[1:] != keys[:-1], axis=1)) + 1
        for first, last in zip([0, *cuts], [*cuts, len(keys)], strict=True):
            part = ElementBlock(*(values[first:last] for values in self))
            yield part._replace(nodes=part.nodes[:, : part.counts[0]])


class Elements:
    """Elements in the order of the file, one by one or in blocks, each with a number of its own."""

    def __init__(self) -> None:
        self.parts: list[ElementBlock | dict[int, Element]] = []
        self.highest = 0
        self._labels: set[int] = set()
        self._counted = 0  # parts whose labels are known

    def __iter__(self) -> Iterator[Element]:
        """Yield the elements."""
        for part in self.parts:
            yield from part.values() if isinstance(part, dict) else map(part.element, range(len(part.labels)))

    def __len__(self) -> int:
        """Count the elements."""
        return sum(len(part) if isinstance(part, dict) else len(part.labels) for part in self.parts)

    @property
    def labels(self) -> list[int]:
        """The numbers of the elements."""
        parts = (list(part) if isinstance(part, dict) else part.labels.tolist() for part in self.parts)
        return [label for part in parts for label in part]

    def _taken(self) -> set[int]:
        for part in self.parts[self._counted :]:
            self._labels.update(part if isinstance(part, dict) else part.labels.tolist())
        self._counted = len(self.parts)
        return self._labels

    def add(self, element: Element) -> bool:
        """Add an element, unless its number is there."""
        if element.label in self._taken():
            return False
        if not self.parts or not isinstance(self.parts[-1], dict):
            self.parts.append({})
        self.last[element.label] = element
        self._labels.add(element.label)
        self.highest = max(self.highest, element.label)
        return True

    def add_block(self, block: ElementBlock) -> bool:
        """Add a block whose numbers differ, unless one of them is there."""
        if self.parts and not self._taken().isdisjoint(block.labels.tolist()):
            return False
        self.parts.append(block)
        self.highest = max(self.highest, int(block.labels.max()))
        return True

    @property
    def last(self) -> dict[int, Element]:
        """The last elements by number, one by one, as far as they are no block."""
        part = self.parts[-1]
        if not isinstance(part, dict):
            part = {int(label): part.element(k) for k, label in enumerate(part.labels)}
            self.parts[-1] = part
        return part


class Points:
    """Coordinates by the numbers of the nodes: a table as long as nothing else adds one."""

    def __init__(self) -> None:
        self._listed: dict[int, list[float]] = {}
        self._table: tuple[np.ndarray, np.ndarray] | None = None

    def __len__(self) -> int:
        """Count the nodes."""
        return len(self._listed) if self._table is None else len(self._table[0])

    def listed(self) -> dict[int, list[float]]:
        """Return the coordinates by number, to add to."""
        if self._table is not None:
            labels, points = self._table
            self._listed = dict(zip(labels.tolist(), points.tolist(), strict=True))
            self._table = None
        return self._listed

    def add_table(self, labels: np.ndarray, points: np.ndarray) -> bool:
        """Take nodes with numbers of their own, unless there are others."""
        if len(self):
            return False
        self._table = labels, points
        return True

    def sorted(self) -> tuple[np.ndarray, np.ndarray]:
        """Return numbers (n,), ascending, and coordinates (n, 3)."""
        labels, points = self._table or (np.array(list(self._listed)), np.array(list(self._listed.values())))
        order = np.argsort(labels)
        return labels[order], points.reshape(-1, 3)[order]


@dataclass(slots=True)
class ElementType:
    """Number of the element in Ansys' library, and its options by number."""

    name: str
    options: dict[int, int] = field(default_factory=dict)


@dataclass(slots=True)
class SectionData:
    """A section as its commands give it."""

    kind: str
    shape: str
    line: int
    values: list[float] = field(default_factory=list)
    plies: list[list[float]] = field(default_factory=list)
    place: str = ""
    offset: tuple[float, float] = (0.0, 0.0)


class FixedDof(NamedTuple):
    """One DOF of a node that D holds at a value."""

    node: int
    label: str
    value: float
    line: int


@dataclass
class Deck:
    """The content read so far."""

    path: Path
    points: Points = field(default_factory=Points)
    angles: dict[int, list[float]] = field(default_factory=dict)
    elements: Elements = field(default_factory=Elements)
    types: dict[int, ElementType] = field(default_factory=dict)
    materials: dict[int, dict[str, float]] = field(default_factory=dict)
    reals: dict[int, list[float]] = field(default_factory=dict)
    sections: dict[int, SectionData] = field(default_factory=dict)
    systems: dict[int, System] = field(default_factory=dict)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    fixed: list[FixedDof] = field(default_factory=list)
    equations: dict[int, dict[str, Any]] = field(default_factory=dict)
    couples: dict[int, dict[str, Any]] = field(default_factory=dict)
    forces: dict[tuple[int, int], float] = field(default_factory=dict)  # by node and component
    said: dict[str, list[float]] = field(default_factory=dict)  # numbers of commands of the analysis
    unread: list[tuple[str, str]] = field(default_factory=list)  # of the analysis
    attributes: dict[str, int] = field(default_factory=dict)  # of the elements that follow
    section: int = 0  # the one that SECDATA means
    table: tuple[int, str] = (0, "")  # material and kind of the table that TBDATA means
    cyclic: tuple[int, int, str] | None = None  # sectors, coordinate system, name of the components
    notes: list[str] = field(default_factory=list)
    skipped: list[tuple[str, str]] = field(default_factory=list)

    def note(self, text: str) -> None:
        """Add a note once."""
        if text not in self.notes:
            self.notes.append(text)

    def error(self, element: Element, what: str) -> InputError:
        """Return an error that names an element and the line of the file."""
        return InputError(f"mesh file {self.path}, line {element.line}: element {element.label}: {what}")
