"""Meshes: points, cells and named groups, read through meshio and checked at the door."""

from __future__ import annotations

import contextlib
import hashlib
import io
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.properties import Property
from modalprep.records import Record
from modalprep.suggest import suggestion

LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "in": 0.0254, "ft": 0.3048}
DIMENSION = {
    "vertex": 0,
    "line": 1,
    "triangle": 2,
    "quad": 2,
    "tetra": 3,
    "hexahedron": 3,
    "wedge": 3,
    "pyramid": 3,
}


def cell_dimension(kind: str) -> int:
    """Return the dimension of a meshio cell type: 0 point, 1 line, 2 surface, 3 volume.

    Examples
    --------
    >>> cell_dimension("tetra10"), cell_dimension("line")
    (3, 1)
    """
    return DIMENSION.get(kind.rstrip("0123456789"), 3)


@dataclass(frozen=True, eq=False, kw_only=True)
class Link(Record):
    """A rigid or an averaging element between mesh nodes.

    Attributes
    ----------
    kind : {"rbe2", "rbe3"}
        rbe2: `nodes` follow `node` rigidly. rbe3: `node` moves with the weighted mean motion of `nodes`.
    node : int
    nodes : (k,) int
    components : (6,) bool
        rbe2: which DOFs of `nodes` follow. rbe3: which DOFs of `node` follow.
    weights : (k,) float
        rbe3 only.
    """

    kind: str
    node: int
    nodes: np.ndarray
    components: np.ndarray = field(default_factory=lambda: np.ones(6, dtype=bool))
    weights: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, eq=False, kw_only=True)
class Mesh(Record):
    """A mesh with named groups.

    Attributes
    ----------
    points : (n_points, 3) float
        m.
    cells : {cell type: (n_cells, n_nodes) int}
        meshio's cell types and node order.
    groups : {name: {cell type: (k,) int}}
        Rows of ``cells`` that belong to each named group.
    source, sha256 : str
        The file it came from and the hash of its bytes; empty for a mesh made in memory.
    scale : float
        m per unit of length of the file.
    labels : (n_points,) int
        The file's own node numbers; empty counts from 1.
    properties : {group: Property}
        Sections that the file carries, SI.
    links : tuple of Link
        Rigid and averaging elements that the file carries.
    data : {name: {cell type: (n_cells, ...) float}}
        Per element, NaN where the section's own value holds: ``up (3)`` of a beam, ``ends (2, 3)`` offsets of a
        beam's ends (mesh axes, m), ``axis (3)``, ``angle`` (rad) and ``offset`` (m) of a shell, ``frame (3, 3)``
        rows e1, e2, e3 of a spring.
    notes : tuple of str
        What the reader left out, for the user.

    Examples
    --------
    >>> mesh = Mesh(points=np.eye(3), cells={"line": np.array([[0, 1], [1, 2]])},
    ...             groups={"beam": {"line": np.array([0, 1])}})
    >>> mesh.nodes("beam")
    array([0, 1, 2])
    """

    points: np.ndarray
    cells: dict[str, np.ndarray]
    groups: dict[str, dict[str, np.ndarray]]
    source: str = ""
    sha256: str = ""
    scale: float = 1.0
    labels: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    properties: dict[str, Property] = field(default_factory=dict)
    links: tuple[Link, ...] = ()
    data: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def group(self, name: str) -> dict[str, np.ndarray]:
        """Return the connectivity of a group, ``{cell type: (k, n_nodes)}``.

        Raises
        ------
        InputError
            When the mesh has no such group; the sentence lists those it has.
        """
        if name not in self.groups:
            raise InputError(
                f"mesh {self.source or 'in memory'} has no group {name!r}; {suggestion(name, self.groups, 'it has')}"
            )
        return {kind: self.cells[kind][rows] for kind, rows in self.groups[name].items() if len(rows)}

    def nodes(self, name: str) -> np.ndarray:
        """Return the sorted node numbers of a group."""
        return np.unique(np.concatenate([c.ravel() for c in self.group(name).values()]))

    def __repr__(self) -> str:
        """Counts and group names."""
        counts = ", ".join(f"{len(c)} {kind}" for kind, c in self.cells.items())
        return f"Mesh({len(self.points)} points, {counts}; groups {', '.join(self.groups)})"


def read_mesh(path: str | Path, length_unit: str = "m") -> Mesh:
    """Read a mesh file (any format meshio knows; best .msh 4.1) and convert it to metres.

    Groups are the file's cell sets, or its ``gmsh:physical`` numbers with their names. An element
    that the file lists twice, as .msh 2.2 does for two groups, is kept once in both groups.

    Raises
    ------
    InputError
        When the file is missing, damaged, truncated, empty or holds NaN coordinates, or the unit is unknown.

    Examples
    --------
    >>> read_mesh("no.msh")
    Traceback (most recent call last):
    modalprep.errors.InputError: mesh file no.msh does not exist; give a path relative to the pipeline file
    """
    path = Path(path)
    if length_unit not in LENGTH_UNITS:
        raise InputError(f"unknown length_unit {length_unit!r}; {suggestion(length_unit, LENGTH_UNITS, 'known are')}")
    if not path.is_file():
        raise InputError(f"mesh file {path} does not exist; give a path relative to the pipeline file")
    content = path.read_bytes()
    raw = _read_with_meshio(path, content)
    cells, groups = _merge(raw)
    if not cells:
        raise InputError(f"mesh file {path} holds no cells; save the mesh with its elements")
    points = _points(raw, path)
    _refuse_missing_nodes(cells, len(points), path, content)
    mesh = Mesh(
        points=points * LENGTH_UNITS[length_unit],
        cells=cells,
        groups=groups,
        source=path.name,
        sha256=hashlib.sha256(content).hexdigest(),
        scale=LENGTH_UNITS[length_unit],
    )
    return mesh


def _read_with_meshio(path: Path, content: bytes) -> Any:
    import meshio

    damaged = f"mesh file {path} is damaged or cut short; export it again (.msh 4.1 is best)"
    if path.suffix == ".msh" and not _msh_is_whole(content):
        raise InputError(damaged)
    try:  # meshio prints its complaint and calls sys.exit
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            return meshio.read(path)
    except (Exception, SystemExit) as error:
        raise InputError(f"{damaged}; the reader said: {str(error).strip() or type(error).__name__}") from None


def _msh_is_whole(content: bytes) -> bool:
    """Whether the last section of a .msh file is closed and, in text of version 4.1, every section has its lines.

    The reader behind meshio does not notice a missing line: the numbers after it slip to other nodes.
    """
    last = content.rstrip().rsplit(b"\n", 1)[-1].strip()
    sections = re.findall(rb"^\$(?!End)(\w+)\s*$", content, re.MULTILINE)
    if last not in (b"$End" + section for section in sections):
        return False
    if not re.match(rb"\$MeshFormat\s+4\.1\s+0\s", content):
        return True
    return _has_its_lines(content, b"Nodes", 2) and _has_its_lines(content, b"Elements", 1)


def _has_its_lines(content: bytes, section: bytes, per_entry: int) -> bool:
    found = re.search(rb"^\$" + section + rb"\s*\n(.*?)^\$End" + section, content, re.MULTILINE | re.DOTALL)
    lines = found[1].splitlines() if found else [b""]
    try:
        blocks, entries = (int(number) for number in lines[0].split()[:2])
    except ValueError:
        return False
    if section == b"Elements" and not _nodes_are_numbered_from_one(lines[1:]):
        return False
    return len(lines) == 1 + blocks + per_entry * entries


def _nodes_are_numbered_from_one(lines: list[bytes]) -> bool:
    """Walk the blocks of $Elements: a header ``dim tag type count``, then ``number node node ...``."""
    while lines:
        header = lines[0].split()
        if len(header) != 4 or not header[3].isdigit():
            return False
        count = int(header[3])
        if any(b"0" in line.split()[1:] for line in lines[1 : count + 1] if b" 0" in line):
            return False
        lines = lines[count + 1 :]
    return True


def _points(raw: Any, path: Path) -> np.ndarray:
    points = np.asarray(raw.points, dtype=float)
    points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise InputError(
            f"mesh file {path}: {len(bad)} of {len(points)} nodes have coordinates that are not numbers, "
            f"the first is node {bad[0] + 1}; repair the mesh"
        )
    return points


def _refuse_missing_nodes(cells: dict[str, np.ndarray], n_points: int, path: Path, content: bytes) -> None:
    negative = path.suffix == ".msh" and re.search(rb"\$Elements\r?\n(?:[\d \r\n]*)-", content)
    for kind, conn in cells.items():
        bad = np.flatnonzero(np.any((conn < 0) | (conn >= n_points), axis=1))
        if len(bad) or negative:
            number = bad[0] + 1 if len(bad) else "?"
            raise InputError(
                f"mesh file {path}: {kind} cell {number} refers to a node that is not there; export it again"
            )


def _merge(raw: Any) -> tuple[dict[str, np.ndarray], dict[str, dict[str, np.ndarray]]]:
    """Merge meshio's blocks of equal type, keeping an element that is listed twice only once."""
    kinds = list(dict.fromkeys(block.type for block in raw.cells))
    cells, groups = {}, {}
    for kind in kinds:
        blocks = [i for i, block in enumerate(raw.cells) if block.type == kind]
        stacked = np.concatenate([raw.cells[i].data for i in blocks])
        _, first, row = np.unique(np.sort(stacked, axis=1), axis=0, return_index=True, return_inverse=True)
        order = np.argsort(np.argsort(first))  # keep the file's order
        cells[kind] = stacked[np.sort(first)]
        for name, members in _block_groups(raw, blocks).items():
            groups.setdefault(name, {})[kind] = np.unique(order[row.ravel()[members]])
    return cells, groups


def _block_groups(raw: Any, blocks: list[int]) -> dict[str, np.ndarray]:
    """Return {group name: rows in the concatenation of `blocks`}."""
    start = np.cumsum([0] + [len(raw.cells[i].data) for i in blocks])
    found: dict[str, list[np.ndarray]] = {}
    for name, sets in raw.cell_sets.items():
        for offset, i in zip(start, blocks, strict=False):
            if not name.startswith("gmsh:") and sets[i] is not None and len(sets[i]):
                found.setdefault(name, []).append(np.asarray(sets[i], dtype=int) + offset)
    if not raw.cell_sets and "gmsh:physical" in raw.cell_data:  # .msh 2.2
        numbers = np.concatenate([raw.cell_data["gmsh:physical"][i] for i in blocks])
        dimension = cell_dimension(raw.cells[blocks[0]].type)
        for name, (number, dim) in raw.field_data.items():
            if dim == dimension and np.any(numbers == number):
                found[name] = [np.flatnonzero(numbers == number)]
    return {name: np.concatenate(rows) for name, rows in found.items()}
