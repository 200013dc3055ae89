"""A mesh under construction: cells, groups and element data, as the readers of decks collect them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from modalprep.fe.mesh.analysis import AnalysisCase, LoadSet
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.mesh import Equation, Link, MatrixElement, SupportSet
from modalprep.fe.mesh.tables import Table
from modalprep.fe.properties.properties import Property

BLANK = {"ends": 0.0, "pins": 0.0, "integration": 0.0}  # data of cells that have none of their own; NaN for the others


class MeshBuilder:
    """Cells, groups, properties, element data and constraints that grow one by one.

    Examples
    --------
    >>> builder = MeshBuilder()
    >>> builder.append("line", [0, 1], "beam"), builder.append("line", [1, 2], "beam")
    (0, 1)
    >>> builder.put("angle", "line", 1, 0.5)
    >>> builder.fields()["groups"], builder.fields()["data"]
    ({'beam': {'line': array([0, 1])}}, {'angle': {'line': array([nan, 0.5])}})
    """

    def __init__(self) -> None:
        self.cells: dict[str, Table] = {}
        self.groups: dict[str, dict[str, list[int]]] = {}
        self.properties: dict[str, Property] = {}
        self.data: dict[tuple[str, str], dict[int, np.ndarray]] = {}
        self.links: list[Link] = []
        self.equations: list[Equation] = []
        self.matrices: list[MatrixElement] = []
        self.supports: dict[str, SupportSet] = {}
        self.loads: dict[str, LoadSet] = {}
        self.cases: list[AnalysisCase] = []
        self.listed = 0  # nodes that the file has
        self.more_points: list[np.ndarray] = []  # new nodes, in units of the file
        self._middles: dict[
            tuple[int, int], tuple[int, int]
        ] = {}  # new node and its equations, by the ends of its edge

    def point(self, position: np.ndarray) -> int:
        """Append a new node, which the file does not have, and return its row."""
        self.more_points.append(position)
        return self.listed + len(self.more_points) - 1

    def places_of(self, nodes: Sequence[int], points: np.ndarray) -> np.ndarray:
        """Return the places ``(n, 3)`` of nodes: the file has its own at ``points (listed, 3)``."""
        return np.array([points[row] if row < self.listed else self.more_points[row - self.listed] for row in nodes])

    def centre(self, nodes: Sequence[int], points: np.ndarray) -> np.ndarray:
        """Return the mean of nodes, of which `places_of` has the places."""
        return np.mean(self.places_of(nodes, points), axis=0)

    def middle(self, a: int, b: int, position: np.ndarray, components: int) -> int:
        """Return a new node in the middle of an edge that has none: it moves by the mean of the ends `a` and `b`.

        The displacement is then linear along the edge. Elements that share the edge share the node; with rotations
        six `components` are joined, else three.
        """
        edge = min(a, b), max(a, b)
        row, joined = self._middles[edge] if edge in self._middles else (self.point(position), 0)
        for c in range(joined, components):
            terms = [(row, c, 1.0), (a, c, -0.5), (b, c, -0.5)]
            self.equations.append(Equation.of_terms(terms, length=1.0, name="an edge without a mid-side node"))
        self._middles[edge] = row, max(joined, components)
        return row

    def completed(self, kind: str, nodes: Sequence[int | None], points: np.ndarray, components: int) -> list[int]:
        """Return the nodes of a cell of second order with new ones where mid-side nodes are missing."""
        cell = CELLS[kind]
        first = len(cell.corners)
        corners = [row for row in nodes[:first] if row is not None]
        ends = [(corners[i], corners[j]) for i, j in cell.edges]
        return corners + [
            self.middle(a, b, (points[a] + points[b]) / 2, components) if row is None else row
            for row, (a, b) in zip(nodes[first:], ends, strict=True)
        ]

    def append(self, kind: str, nodes: list[int], group: str) -> int:
        """Append a cell to a group and return its row."""
        if kind not in self.cells:
            self.cells[kind] = Table(len(nodes))
        rows = self.cells[kind]
        rows.append(nodes)
        self.groups.setdefault(group, {}).setdefault(kind, []).append(len(rows) - 1)
        return len(rows) - 1

    def extend(self, kind: str, nodes: np.ndarray) -> range:
        """Append cells (k, nodes) and return their rows."""
        if kind not in self.cells:
            self.cells[kind] = Table(nodes.shape[1])
        return self.cells[kind].extend(nodes)

    def join(self, group: str, kind: str, rows: Iterable[int]) -> None:
        """Append cells to a group by their rows."""
        self.groups.setdefault(group, {}).setdefault(kind, []).extend(rows)

    def put(self, name: str, kind: str, row: int, value: np.ndarray | float) -> None:
        """Set a value that one cell has for itself."""
        self.data.setdefault((name, kind), {})[row] = np.asarray(value)

    def put_all(self, name: str, kind: str, rows: Iterable[int], value: float) -> None:
        """Set a value that each of some cells has."""
        self.data.setdefault((name, kind), {}).update(dict.fromkeys(rows, np.asarray(value)))

    def fields(self) -> dict[str, Any]:
        """Return what has been collected, as the fields of `Mesh`."""
        return {
            "cells": {kind: np.array(rows) for kind, rows in self.cells.items()},
            "groups": {n: {kind: np.array(rows) for kind, rows in g.items()} for n, g in self.groups.items()},
            "properties": self.properties,
            "links": tuple(self.links),
            "equations": tuple(self.equations),
            "matrices": tuple(self.matrices),
            "supports": self.supports,
            "loads": self.loads,
            "cases": tuple(self.cases),
            "data": cell_data(self.data, self.cells),
        }


def cell_data(
    values: Mapping[tuple[str, str], Mapping[int, Any]], cells: Mapping[str, Any]
) -> dict[str, dict[str, np.ndarray]]:
    """Return ``{name: {cell type: (n_cells, ...)}}`` of values by name, cell type and row.

    Examples
    --------
    >>> cell_data({("angle", "quad"): {1: 0.5}}, {"quad": [[0, 1, 2, 3], [1, 4, 5, 2]]})
    {'angle': {'quad': array([nan, 0.5])}}
    """
    data: dict[str, dict[str, np.ndarray]] = {}
    for (name, kind), own in values.items():
        table = np.full((len(cells[kind]), *np.shape(next(iter(own.values())))), BLANK.get(name, np.nan))
        table[list(own)] = list(own.values())
        data.setdefault(name, {})[kind] = table
    return data
