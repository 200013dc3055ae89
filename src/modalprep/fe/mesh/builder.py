"""A mesh under construction: cells, groups and element data, as the readers of decks collect them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from modalprep.fe.mesh.mesh import Equation, Link, SupportSet
from modalprep.fe.properties.properties import Property

BLANK = {"ends": 0.0, "pins": 0.0}  # data of cells that have none of their own; NaN for the others


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
        self.cells: dict[str, list[list[int]]] = {}
        self.groups: dict[str, dict[str, list[int]]] = {}
        self.properties: dict[str, Property] = {}
        self.data: dict[tuple[str, str], dict[int, np.ndarray]] = {}
        self.links: list[Link] = []
        self.equations: list[Equation] = []
        self.supports: dict[str, SupportSet] = {}

    def append(self, kind: str, nodes: list[int], group: str) -> int:
        """Append a cell to a group and return its row."""
        rows = self.cells.setdefault(kind, [])
        rows.append(nodes)
        self.groups.setdefault(group, {}).setdefault(kind, []).append(len(rows) - 1)
        return len(rows) - 1

    def put(self, name: str, kind: str, row: int, value: np.ndarray | float) -> None:
        """Set a value that one cell has for itself."""
        self.data.setdefault((name, kind), {})[row] = np.asarray(value)

    def fields(self) -> dict[str, Any]:
        """Return what has been collected, as the fields of `Mesh`."""
        return {
            "cells": {kind: np.array(rows) for kind, rows in self.cells.items()},
            "groups": {n: {kind: np.array(rows) for kind, rows in g.items()} for n, g in self.groups.items()},
            "properties": self.properties,
            "links": tuple(self.links),
            "equations": tuple(self.equations),
            "supports": self.supports,
            "data": cell_data(self.data, self.cells),
        }


def cell_data(
    values: Mapping[tuple[str, str], Mapping[int, Any]], cells: Mapping[str, list]
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
