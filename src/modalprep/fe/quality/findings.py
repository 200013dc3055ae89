"""Records of the mesh quality check: findings, statistics, and the cells that were checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.quality.shape import Shape
from modalprep.records import Record

Severity = Literal["error", "warning"]
LISTED = 100  # cells and nodes that `Finding.summary` lists, at most
NOWHERE = np.full(3, np.nan)


@dataclass(frozen=True, eq=False, kw_only=True)
class Finding(Record):
    """One kind of flaw.

    Attributes
    ----------
    kind : str
    severity : {"error", "warning"}
        error: no model can be made of this mesh; warning: the results may suffer.
    count : int
        How many cells, nodes, edges or parts.
    message : str
        The flaw, its location and a remedy.
    cells : {cell type: (k,) int}
        Rows of ``mesh.cells``.
    nodes : (k,) int
    edges : (k, 2) int
        Corner nodes at the ends of each edge, for flaws between shells.
    worst, limit : float
        NaN where there is no number.
    where : (3,) float
        The first of them, m, mesh coordinates; NaN where there is no location.
    """

    kind: str
    severity: Severity
    count: int
    message: str
    cells: dict[str, np.ndarray] = field(default_factory=dict)
    nodes: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    edges: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), dtype=int))
    worst: float = np.nan
    limit: float = np.nan
    where: np.ndarray = field(default_factory=NOWHERE.copy)

    def summary(self, labels: np.ndarray | None = None) -> dict[str, Any]:
        """Return plain data for JSON; nodes by their `labels`, else counted from 1, the first hundred of each."""
        nodes = self.nodes + 1 if labels is None or not len(labels) else labels[self.nodes]
        return {
            "kind": self.kind,
            "severity": self.severity,
            "count": self.count,
            "message": self.message,
            "worst": number(self.worst),
            "limit": number(self.limit),
            "where_m": [number(x) for x in self.where],
            "cells": {kind: rows[:LISTED].tolist() for kind, rows in self.cells.items()},
            "nodes": nodes[:LISTED].tolist(),
        }


@dataclass(frozen=True)
class Statistics:
    """The cells of one type; None where the type has no such number.

    Attributes
    ----------
    count : int
    smallest, median, largest : float
        Mean edge of a cell, m.
    aspect : float
        Largest ratio of two edges of a cell.
    small, large : float
        Smallest and largest angle between edges of a face, degrees.
    jacobian : float
        Smallest scaled Jacobian: 1 best, 0 flat, negative inverted.
    warpage : float
        Largest distance of a quadrilateral's corner from its mean plane over the mean diagonal.
    """

    count: int
    smallest: float | None = None
    median: float | None = None
    largest: float | None = None
    aspect: float | None = None
    small: float | None = None
    large: float | None = None
    jacobian: float | None = None
    warpage: float | None = None

    @classmethod
    def of(cls, count: int, shape: Shape | None) -> Statistics:
        """Summarise shapes; None for cells that have none."""
        if shape is None or not count:
            return cls(count)
        return cls(
            count,
            _of(shape.size, np.min),
            _of(shape.size, np.median),
            _of(shape.size, np.max),
            _of(shape.aspect, np.max),
            _of(shape.small, np.min),
            _of(shape.large, np.max),
            _of(shape.jacobian, np.min),
            _of(shape.warpage, np.max),
        )


def _of(values: np.ndarray, reduce) -> float | None:
    values = values[np.isfinite(values)]
    return float(reduce(values)) if len(values) else None


def number(value: float) -> float | None:
    """Return a number for JSON: None for NaN."""
    return None if value != value else float(value)


@dataclass(frozen=True)
class Quality:
    """The result of `check_mesh`.

    Attributes
    ----------
    findings : tuple of Finding
        Errors first.
    statistics : {cell type: Statistics}
    free_edges, joints : int
        Edges of shells that one shell has, and that more than two share.
    """

    findings: tuple[Finding, ...]
    statistics: dict[str, Statistics]
    free_edges: int = 0
    joints: int = 0

    @property
    def errors(self) -> tuple[Finding, ...]:
        """Findings that make the mesh unusable."""
        return tuple(f for f in self.findings if f.severity == "error")

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """Findings that leave the mesh usable."""
        return tuple(f for f in self.findings if f.severity == "warning")


@dataclass(frozen=True, eq=False, kw_only=True)
class Checked:
    """The part of a mesh that is checked: structural cells whose nodes have coordinates.

    Attributes
    ----------
    mesh : Mesh
    rows : {cell type: (k,) int}
        Rows of ``mesh.cells``.
    cells : {cell type: (k, n_nodes) int}
    owner : {cell type: (k,) int}
        Number of the group that a cell belongs to; 0 without groups.
    plain : {cell type: (k,) bool}
        Cells that are no springs: these may lie side by side, and between nodes in one place.
    shells : {cell type: (k,) int}
        Rows of ``cells`` that are shells and do not merely mark the surface of a solid.
    links : list of (1, k) int
        Nodes that rigid elements and interfaces tie.
    shapes : {cell type: Shape}
    """

    mesh: Mesh
    rows: dict[str, np.ndarray]
    cells: dict[str, np.ndarray]
    owner: dict[str, np.ndarray]
    plain: dict[str, np.ndarray]
    shells: dict[str, np.ndarray]
    links: list[np.ndarray]
    shapes: dict[str, Shape]

    def of_cells(self, kind: str, severity: Severity, chosen: Mapping[str, np.ndarray], text: str, **details: Any):
        """Return the finding about the chosen rows of ``cells``, or None when there are none.

        ``{what}``, ``{are}`` and ``{at}`` in the text become the number of cells, the verb, and the first place.
        """
        chosen = {k: rows for k, rows in chosen.items() if len(rows)}
        if not chosen:
            return None
        first = next(iter(chosen))
        place = self.mesh.points[self.cells[first][chosen[first][0]]].mean(axis=0)
        count = sum(map(len, chosen.values()))
        kinds = ", ".join(f"{len(rows)} {k}" for k, rows in chosen.items())
        what = f"{kinds} {plural('cell', count)}" if len(chosen) == 1 else f"{count} cells ({kinds})"
        cells = {k: self.rows[k][rows] for k, rows in chosen.items()}
        return _finding(kind, severity, text, place, {"count": count, "cells": cells} | details, what)

    def of_edges(self, kind: str, ends: np.ndarray, chosen: Mapping[str, np.ndarray], text: str):
        """Return the warning about the edges ``ends (k, 2)`` of the chosen cells as `of_cells`."""
        if not len(ends):
            return None
        what = f"{len(ends)} {plural('edge', len(ends))}"
        cells = {k: self.rows[k][rows] for k, rows in chosen.items() if len(rows)}
        values = {"count": len(ends), "cells": cells, "nodes": np.unique(ends), "edges": ends}
        return _finding(kind, "warning", text, self.mesh.points[ends[0]].mean(axis=0), values, what)

    def of_nodes(self, kind: str, severity: Severity, nodes: np.ndarray, text: str, **details: Any):
        """Return the finding about these nodes as `of_cells`, or None when there are none."""
        if not len(nodes):
            return None
        what = f"{len(nodes)} {plural('node', len(nodes))}"
        return _finding(
            kind, severity, text, self.mesh.points[nodes[0]], {"count": len(nodes), "nodes": nodes} | details, what
        )


def _finding(kind: str, severity: Severity, text: str, place: np.ndarray, values: dict[str, Any], what: str) -> Finding:
    at = f"({', '.join(f'{x:.4g}' for x in place)}) m"
    message = text.format(what=what, are="is" if values["count"] == 1 else "are", at=at, **values)
    return Finding(kind=kind, severity=severity, message=message, where=place, **values)


def plural(noun: str, count: int) -> str:
    """Return the noun in the number of `count`.

    Examples
    --------
    >>> plural("edge", 1), plural("edge", 2)
    ('edge', 'edges')
    """
    return noun if count == 1 else f"{noun}s"
