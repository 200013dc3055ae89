"""The content of an Abaqus deck as far as it has been read; nodes and elements carry the numbers of the file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.cyclic import CyclicSymmetry
from modalprep.fe.mesh.mesh import Link, MatrixElement
from modalprep.fe.mesh.tables import Table
from modalprep.fe.properties.properties import Property
from modalprep.fe.readers.abaqus.dialect import Dialect, Spoken
from modalprep.fe.readers.abaqus.lexer import Block, Row
from modalprep.fe.readers.abaqus.numbered import Element, Elements, Key, Nodes
from modalprep.fe.readers.abaqus.parts import Parts
from modalprep.fe.readers.units import Units

LABEL = re.compile(r"[0-9]{1,18}")
DEEPEST = 100  # sets of sets of sets

Name = tuple[str, str]  # instance and name, both in capitals


class Surface(NamedTuple):
    """Faces of elements and single nodes."""

    faces: list[tuple[Key, str]]
    nodes: list[int]


@dataclass
class Deck:
    """The content read so far; points in units of the deck, in global axes."""

    path: Path
    units: Units
    parts: Parts
    spoken: Spoken
    points: Table = field(default_factory=lambda: Table(3, float))
    numbered: Nodes = field(default_factory=Nodes)
    elements: Elements = field(default_factory=Elements)
    cells: dict[str, Table] = field(default_factory=dict)
    sets: dict[str, dict[Name, list]] = field(default_factory=lambda: {"NSET": {}, "ELSET": {}})
    spelled: dict[tuple[str, Name], str] = field(default_factory=dict)
    internal: set[tuple[str, Name]] = field(default_factory=set)
    resolved: dict[tuple[str, Name], list] = field(default_factory=dict)
    surfaces: dict[Name, list[Block]] = field(default_factory=dict)
    tables: dict[str, dict[Name, Any]] = field(default_factory=dict)  # orientations, distributions, materials
    systems: dict[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)  # of *SYSTEM, by instance
    sections: dict[Name, Property] = field(default_factory=dict)
    sectioned: dict[Key, Block] = field(default_factory=dict)
    data: dict[tuple[str, str], dict[int, Any]] = field(default_factory=dict)
    axes: dict[int, np.ndarray] = field(default_factory=dict)  # of the components at a node, by *TRANSFORM
    links: list[Link] = field(default_factory=list)
    equations: list[tuple[list[tuple[int, int, float]], str]] = field(default_factory=list)
    matrices: list[MatrixElement] = field(default_factory=list)
    fixed: dict[int, set[int]] = field(default_factory=dict)  # components 0 to 5 by node
    cyclic: CyclicSymmetry | None = None
    notes: list[str] = field(default_factory=list)
    skipped: list[tuple[str, str]] = field(default_factory=list)
    current: dict[str, Any] = field(default_factory=dict)  # what the keywords that follow add to

    def note(self, text: str) -> None:
        """Add a note once."""
        if text not in self.notes:
            self.notes.append(text)

    def dialect(self, block: Block, what: str) -> Dialect:
        """Return the dialect for a keyword that means something else in either, and say how it is known."""
        found = self.spoken.asked(block, what)
        if self.spoken.proof != "as given":
            name = {"abaqus": "Abaqus", "calculix": "CalculiX"}[found]
            self.note(f"read as a deck of {name} ({self.spoken.proof}): *{block.keyword} {what}")
        return found

    def split(self, scope: str, text: str) -> tuple[str, str]:
        """Return the instance and the rest of a name such as ``instance.set``."""
        head, dot, tail = text.partition(".")
        if dot and head.strip('"').upper() in self.parts.moves:
            return head.strip('"').upper(), tail.strip('"')
        return scope, text.strip('"')

    # ------------------------------------------------------------ nodes and elements

    @property
    def nodes(self) -> dict[Key, int]:
        """The indices of the nodes."""
        return self.numbered.places

    @property
    def keys(self) -> list[Key]:
        """The keys of the nodes, in the order of the points."""
        return self.numbered.keys

    def placed(self, scope: str, point: np.ndarray) -> np.ndarray:
        """Return a point of an instance in global axes."""
        turn, shift = self.parts.moves.get(scope, (None, None))
        return point if turn is None else turn @ point + shift

    def turned(self, scope: str, vector: np.ndarray) -> np.ndarray:
        """Return a direction of an instance in global axes."""
        turn, _ = self.parts.moves.get(scope, (None, None))
        return vector if turn is None else turn @ vector

    def add_node(self, row: Row, scope: str, label: int, point: np.ndarray) -> None:
        """Add a node at a point in global axes; its number stands for one."""
        known = self.numbered.add((scope, label))
        if known == len(self.points):
            self.points.append(point)
        elif not np.allclose(self.points[known], point, rtol=1e-9, atol=1e-300):
            raise row.error(f"node {label} is there twice and differs; give every node its own number")

    def node(self, row: Row, scope: str, text: str) -> int:
        """Return the index of the node that a field names."""
        of, label = self.split(scope, text)
        if LABEL.fullmatch(label) and (of, int(label)) in self.nodes:
            return self.nodes[of, int(label)]
        raise row.error(f"node {text!r} is not there; name a node of the deck")

    def label(self, index: int) -> str:
        """Return the name of a node in the deck."""
        scope, label = self.keys[index]
        return f"{self.parts.spelled[scope]}.{label}" if scope else str(label)

    def add_element(self, row: Row, scope: str, label: int, element: Element) -> bool:
        """Add an element unless it is there already, the same; return whether it is new."""
        known = self.elements.setdefault((scope, label), element)
        if (known.type, known.nodes, known.extra) != (element.type, element.nodes, element.extra):
            raise row.error(f"element {label} is there twice and differs; give every element its own number")
        return known is element

    def cell(self, kind: str, nodes: list[int]) -> tuple[str, int]:
        """Append a cell and return its kind and row."""
        if kind not in self.cells:
            self.cells[kind] = Table(len(nodes))
        rows = self.cells[kind]
        rows.append(nodes)
        return kind, len(rows) - 1

    # ------------------------------------------------------------ sets and names

    def members(self, kind: str, scope: str, name: str) -> list:
        """Return the list of a set, NSET or ELSET, to add to; capitals do not count."""
        self.resolved.clear()
        key = (scope, name.upper())
        self.spelled.setdefault((kind, key), name)
        return self.sets[kind].setdefault(key, [])

    def find(self, table: dict[Name, Any], scope: str, text: str) -> Name | None:
        """Return the key of a name in a table: of the instance, or of the whole deck."""
        of, name = self.split(scope, text)
        return next((key for key in ((of, name.upper()), ("", name.upper())) if key in table), None)

    def named(self, what: str, row: Row | Block, scope: str, text: str) -> Any:
        """Return the orientation, distribution or material of a name."""
        table = self.tables.get(what, {})
        key = self.find(table, scope, text)
        if key is None:
            raise row.error(f"names the {what} {text!r}, which is not in the deck; add its keyword *{what.upper()}")
        return table[key]

    def resolve(self, kind: str, key: Name, inside: tuple[Name, ...] = ()) -> list[Any]:
        """Return the indices of the nodes or the keys of the elements of a set, each once."""
        if (kind, key) in self.resolved:
            return self.resolved[kind, key]
        if key in inside or len(inside) > DEEPEST:
            what = "contains itself" if key in inside else f"is more than {DEEPEST} sets deep in others"
            raise InputError(f"mesh file {self.path}: set {self.spelled[kind, key]!r} {what}; repair the sets")
        found: list[Any] = []
        for member in self.sets[kind][key]:
            found += self._member(kind, key, inside, *member)
        self.resolved[kind, key] = list(dict.fromkeys(found))
        return self.resolved[kind, key]

    def _member(self, kind: str, key: Name, inside: tuple[Name, ...], scope: str, member: Any) -> list[Any]:
        if isinstance(member, list):  # keys of elements
            return member
        if isinstance(member, np.ndarray):
            return self._present(kind, scope, member)
        known: Mapping[Key, Any] = self.nodes if kind == "NSET" else self.elements
        if isinstance(member, range):
            labels = member if len(member) < len(known) else [n for s, n in known if s == scope and n in member]
            found = [(scope, label) for label in labels]
        elif isinstance(member, int):
            found = [(scope, member)]
        elif isinstance(member, tuple):  # the nodes of an element set
            inner = self.find(self.sets["ELSET"], scope, member[0])
            elements = self.resolve("ELSET", inner) if inner else []
            return [node for one in elements for node in self.elements[one].nodes]
        else:
            return self._inner(kind, key, inside, scope, member)
        found = [one for one in found if one in known]  # sets may name what another program left out
        return [self.nodes[one] for one in found] if kind == "NSET" else found

    def _present(self, kind: str, scope: str, labels: np.ndarray) -> list[Any]:
        """Return the nodes or elements of numbers, without those that are not there."""
        if kind == "ELSET":
            return [key for label in labels.tolist() if (key := (scope, label)) in self.elements]
        found = self.numbered.find(scope, labels)
        return found[found >= 0].tolist()

    def _inner(self, kind: str, key: Name, inside: tuple[Name, ...], scope: str, member: str) -> list[Any]:
        of, text = self.split(scope, member)
        if LABEL.fullmatch(text):
            return self._member(kind, key, inside, of, int(text))
        inner = self.find(self.sets[kind], scope, member)
        if inner is None:
            what = f"set {self.spelled[kind, key]!r} names {member!r}, which is no number and no set of the file"
            raise InputError(f"mesh file {self.path}: {what}; correct it")
        return self.resolve(kind, inner, (*inside, key))

    def nodes_of(self, row: Row | Block, scope: str, text: str) -> list[int]:
        """Return the indices of the nodes that a field names: a number or a set."""
        of, label = self.split(scope, text)
        if LABEL.fullmatch(label):
            if (of, int(label)) in self.nodes:
                return [self.nodes[of, int(label)]]
        elif key := self.find(self.sets["NSET"], scope, text):
            return self.resolve("NSET", key)
        raise row.error(f"{text!r} is no node and no node set of the deck; correct the name")

    def elements_of(self, row: Row | Block, scope: str, text: str) -> list[Key]:
        """Return the keys of the elements that a field names: a number or a set."""
        of, label = self.split(scope, text)
        if LABEL.fullmatch(label):
            if (of, int(label)) in self.elements:
                return [(of, int(label))]
        elif key := self.find(self.sets["ELSET"], scope, text):
            return self.resolve("ELSET", key)
        raise row.error(f"{text!r} is no element and no element set of the deck; correct the name")

    def put(self, name: str, cell: tuple[str, int], value: Any) -> None:
        """Set a value that one cell has for itself."""
        self.data.setdefault((name, cell[0]), {})[cell[1]] = np.asarray(value)
