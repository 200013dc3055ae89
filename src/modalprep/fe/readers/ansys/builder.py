"""The mesh of an Ansys deck under construction, element by element."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.families import FAMILIES
from modalprep.fe.mesh.builder import MeshBuilder
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.mesh import Link, Mesh
from modalprep.fe.mesh.tables import Lookup
from modalprep.fe.properties.properties import Property
from modalprep.fe.readers.ansys.cyclic import cyclic_symmetry
from modalprep.fe.readers.ansys.deck import Deck, Element
from modalprep.fe.readers.ansys.materials import Materials
from modalprep.fe.readers.ansys.sections import Sections
from modalprep.fe.readers.ansys.systems import PREDEFINED
from modalprep.fe.readers.systems import System
from modalprep.fe.readers.units import Units


class Builder(MeshBuilder):
    """Cells, groups, properties and links by the nodes' rows."""

    def __init__(self, deck: Deck, units: Units) -> None:
        super().__init__()
        self.deck, self.units = deck, units
        self.labels, self.points = deck.points.sorted()
        self.listed = len(self.points)
        self.find = Lookup(self.labels)
        self.materials = Materials(deck, units)
        self.sections = Sections(deck, self.materials)
        self.bare = not deck.materials  # a mesh without materials
        self.turning: set[int] = set()  # rows of nodes of beams and shells, which have rotations
        self.placed: dict[str, list[tuple[Any, Sequence[int]]]] = {}  # labels of elements, and rows of their cells
        self.rigid: list[tuple[int, int]] = []  # pairs of nodes that MPC184 joins

    @cached_property
    def row(self) -> dict[int, int]:
        """The rows of the nodes by number."""
        return {label: k for k, label in enumerate(self.labels.tolist())}

    def nodes(self, element: Element, which: Iterable[int]) -> list[int]:
        """Return the rows of nodes of an element by their place in its list."""
        found = []
        for k in which:
            label = element.nodes[k] if k < len(element.nodes) else 0
            if label not in self.row:
                raise self.deck.error(element, f"node {label} is not in the deck; export the model again")
            found.append(self.row[label])
        return found

    def cell_nodes(self, element: Element, kind: str, which: Sequence[int], components: int) -> list[int]:
        """Return the rows of nodes of a cell by their place in the element's list; mid-side nodes may be missing."""
        first = len(CELLS[kind].corners)
        labels = [element.nodes[k] if k < len(element.nodes) else 0 for k in which[first:]]
        if all(labels):
            return self.nodes(element, which)
        middle = [
            self.nodes(element, [k])[0] if label else None for k, label in zip(which[first:], labels, strict=True)
        ]
        return self.completed(kind, [*self.nodes(element, which[:first]), *middle], self.points, components)

    def cell(self, element: Element, kind: str, nodes: list[int], group: str) -> int:
        """Append a cell to a group and return its row."""
        if len(set(nodes)) < len(nodes):
            raise self.deck.error(
                element, f"nodes of this {kind} coincide in a way that Ansys does not define; mesh again"
            )
        row = self.append(kind, nodes, group)
        self.placed.setdefault(kind, []).append(([element.label], [row]))
        return row

    def group(self, element: Element, kinds: str, make: Callable[[Element], Property]) -> str:
        """Return the group of an element's type and attributes, whose property is made once.

        `kinds` names the attributes that matter: m material, r real constants, s section.
        """
        parts = [f"type{element.type}"]
        parts += [f"mat{element.material}"] * ("m" in kinds)
        parts += [f"real{element.real}"] * ("r" in kinds and element.section not in self.deck.sections)
        parts += [f"sec{element.section}"] * ("s" in kinds and element.section in self.deck.sections)
        name = "_".join(parts)
        if name not in self.properties and not self.bare:
            self.properties[name] = make(element)
        return name

    def system(self, element: Element) -> System | None:
        """Return the coordinate system of an element, None for the global one."""
        if element.system in self.deck.systems:
            return self.deck.systems[element.system]
        if element.system in PREDEFINED:
            return PREDEFINED[element.system]
        if element.system > 0:
            raise self.deck.error(element, f"coordinate system {element.system} is not in the deck; add its LOCAL")
        return None

    def refuse_without_element(self, element: Element, kind: str, section: type[Property]) -> None:
        """Refuse a cell that no element family has."""
        if kind not in FAMILIES[section] and not self.bare:
            raise self.deck.error(
                element, f"{kind} cells have no element here; mesh with {', '.join(FAMILIES[section])}"
            )

    def mesh(self, sha256: str) -> Mesh:
        """Return the finished mesh."""
        if not any(kind != "vertex" for kind in self.cells):
            raise InputError(
                f"mesh file {self.deck.path} has no elements that can be read; export the model by CDWRITE"
            )
        if self.bare:
            self.deck.note("the deck has no materials; its groups have no sections")
        self._add_rigid()
        cyclic = cyclic_symmetry(self.deck, self.units)
        self._add_sets()
        return Mesh(
            points=np.vstack([self.points, *self.more_points]) * self.units.length,
            source=self.deck.path.name,
            sha256=sha256,
            scale=self.units.length,
            cyclic=cyclic,
            labels=np.append(self.labels, self.labels[-1] + 1 + np.arange(len(self.more_points))),
            **self.fields(),
        )

    def _add_sets(self) -> None:
        """Add the components as groups; one with the name of a group joins it."""
        placed = [(kind, *map(np.concatenate, zip(*own, strict=True))) for kind, own in self.placed.items()]
        finds = [(kind, Lookup(labels), rows) for kind, labels, rows in placed if self.deck.element_sets]
        for name, labels in self.deck.element_sets.items():
            self._add_element_set(name, np.array(labels, dtype=int), finds)
        for name, labels in self.deck.node_sets.items():
            rows = self.find(np.array(labels, dtype=int))
            if (rows >= 0).any():
                self.join(name, "vertex", self.extend("vertex", rows[rows >= 0, None]))

    def _add_element_set(self, name: str, labels: np.ndarray, finds: list[tuple[str, Lookup, np.ndarray]]) -> None:
        """Add the cells of elements to a group, kinds in the order in which the set has them."""
        at = [(kind, find(labels), rows) for kind, find, rows in finds]
        there = [(int(np.argmax(places >= 0)), kind, rows[places[places >= 0]]) for kind, places, rows in at]
        for _, kind, rows in sorted((one for one in there if len(one[2])), key=lambda one: one[0]):
            self.join(name, kind, rows.tolist())

    def _add_rigid(self) -> None:
        """Join the pairs of rigid beams that hang together to one link about their most frequent node."""
        parent: dict[int, int] = {}

        def find(k: int) -> int:
            while parent.setdefault(k, k) != k:
                parent[k] = parent[parent[k]]
                k = parent[k]
            return k

        count: dict[int, int] = {}
        for a, b in self.rigid:
            parent[find(a)] = find(b)
            count[a], count[b] = count.get(a, 0) + 1, count.get(b, 0) + 1
        joined: dict[int, list[int]] = {}
        for k in sorted(count):
            joined.setdefault(find(k), []).append(k)
        for nodes in joined.values():
            middle = max(nodes, key=lambda k: (count[k], -k))
            followers = np.array([k for k in nodes if k != middle])
            self.links.append(Link(kind="rbe2", node=middle, nodes=followers))
