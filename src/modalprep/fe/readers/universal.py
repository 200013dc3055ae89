"""Universal files (.unv): nodes, elements and groups."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.cells import CELLS, Cell
from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.mesh.mesh import Mesh

NODES = {"2411", "781"}
ELEMENTS = {"2412"}
GROUPS = {"2435", "2452", "2467", "2477"}
LINES = {"11", "21", "22", "23", "24"}  # descriptors of rods and beams, which have one row more
NODE, ELEMENT = 7, 8  # kinds of the members of a group
# Descriptors of elements; quadratic ones go around with their mid-side nodes between the corners.
KINDS = {
    "line": (11, 21, 22, 23, 24),
    "triangle": (41, 51, 61, 74, 81, 91),
    "triangle6": (42, 52, 62, 72, 82, 92),
    "quad": (44, 54, 64, 71, 84, 94),
    "quad8": (45, 55, 65, 75, 85, 95),
    "tetra": (111,),
    "tetra10": (118,),
    "wedge": (112,),
    "wedge15": (113,),
    "hexahedron": (115,),
    "hexahedron20": (116,),
    "pyramid": (101, 117),
    "vertex": (161,),
}
OF_DESCRIPTOR = {number: CELLS[kind] for kind, numbers in KINDS.items() for number in numbers}


def read_universal(path: Path, scale: float) -> Mesh:
    r"""Read datasets 2411, 2412 and 2467 (also 781, 2435, 2452, 2477) of a universal file.

    Parameters
    ----------
    path : Path
    scale : float
        m per unit of length of the file.

    Raises
    ------
    InputError
        When the file is damaged or an element has no counterpart.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "bar.unv"
    >>> rows = ["-1", "2411", "5 1 1 11", "0. 0. 0.", "9 1 1 11", "2.5D+02 0. 0.", "-1"]
    >>> rows += ["-1", "2412", "1 21 1 1 7 2", "0 1 1", "5 9", "-1"]
    >>> _ = path.write_text("\n".join(rows))
    >>> read_universal(path, 1e-3).points[1]
    array([0.25, 0.  , 0.  ])
    """
    content = path.read_bytes()
    nodes: dict[int, list[float]] = {}
    elements: dict[int, tuple[Cell, list[int]]] = {}
    groups: dict[str, list[tuple[int, int]]] = {}
    skipped = []
    try:
        for number, line, rows in _datasets(content.decode("utf-8-sig", errors="replace").splitlines()):
            if number in NODES:
                nodes |= _nodes(rows)
            elif number in ELEMENTS:
                elements |= _elements(rows, path)
            elif number in GROUPS:
                groups |= _groups(rows)
            else:
                skipped.append((f"dataset {number}", f"line {line}"))
        notes = left_out(skipped, "groups, nodes and elements are read only")
        return _mesh(path, content, scale, nodes, elements, groups).with_(notes=notes)
    except (ValueError, IndexError, KeyError, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"mesh file {path} is damaged or cut short; export it again as a universal file") from None


def _datasets(lines: list[str]) -> Iterator[tuple[str, int, list[str]]]:
    """Yield number, first line and rows of each dataset, which stand between two lines of -1."""
    at = 0
    while at < len(lines):
        if lines[at].strip() != "-1":
            at += 1
            continue
        end = next(k for k in range(at + 1, len(lines) + 1) if k == len(lines) or lines[k].strip() == "-1")
        if end == len(lines):
            raise ValueError("a dataset is cut short")
        yield lines[at + 1].strip(), at + 1, lines[at + 2 : end]
        at = end + 1


def _nodes(rows: list[str]) -> dict[int, list[float]]:
    pairs = zip(rows[::2], rows[1::2], strict=True)
    return {int(head.split()[0]): [float(x.replace("D", "E")) for x in row.split()[:3]] for head, row in pairs}


def _elements(rows: list[str], path: Path) -> dict[int, tuple[Cell, list[int]]]:
    found = {}
    at = 0
    while at < len(rows):
        label, descriptor, *_, count = (int(x) for x in rows[at].split())
        cell = OF_DESCRIPTOR.get(descriptor)
        if cell is None:
            raise InputError(
                f"mesh file {path}: element {label} has FE descriptor {descriptor}, which is not known here"
            )
        at += 1 + (str(descriptor) in LINES)
        nodes: list[int] = []
        while len(nodes) < count:
            nodes += [int(x) for x in rows[at].split()]
            at += 1
        cell = CELLS["line3"] if cell.shape == "line" and count == 3 else cell
        if len(nodes) != cell.count:
            raise ValueError("an element has another number of nodes")
        found[label] = cell, [nodes[k] for k in _order(cell)]
    return found


def _order(cell: Cell) -> list[int]:
    """Return the place in the file of each node of a cell.

    Examples
    --------
    >>> _order(CELLS["tetra10"])
    [0, 2, 4, 9, 1, 3, 5, 6, 7, 8]
    """
    if not cell.second_order:
        return list(range(cell.count))
    edges = [tuple(int(k) for k in edge) for edge in cell.edges]
    if cell.dimension == 1:
        return [0, 2, 1]
    below = [k for k in range(len(cell.corners)) if cell.dimension == 2 or cell.corners[k, 2] == 0]
    above = [k for k in range(len(cell.corners)) if k not in below]
    upright = [e for e in edges if e[0] in below and e[1] in above]
    file: list[tuple[int, ...]] = [*_around(below, edges), *upright, *_around(above, edges)]
    wanted = [*((k,) for k in range(len(cell.corners))), *edges]
    return [file.index(entry) for entry in wanted]


def _around(corners: list[int], edges: list[tuple[int, ...]]) -> Iterator[tuple[int, ...]]:
    """Yield corners with the edges between them in turn."""
    for k, corner in enumerate(corners):
        yield (corner,)
        after = corners[(k + 1) % len(corners)]
        yield from (edge for edge in edges if len(corners) > 1 and set(edge) == {corner, after})


def _groups(rows: list[str]) -> dict[str, list[tuple[int, int]]]:
    """Return kind and number of the members of each group; two members stand in a row."""
    found = {}
    at = 0
    while at < len(rows):
        count = int(rows[at].split()[-1])
        name = rows[at + 1].strip()
        numbers: list[int] = []
        at += 2
        while len(numbers) < 4 * count:
            numbers += [int(x) for x in rows[at].split()]
            at += 1
        found[name] = list(zip(numbers[::4], numbers[1::4], strict=True))
    return found


def _mesh(path: Path, content: bytes, scale: float, nodes: dict, elements: dict, groups: dict) -> Mesh:
    if not nodes or not elements:
        raise InputError(f"mesh file {path} holds no {'elements' if nodes else 'nodes'}; export it again")
    labels = np.array(sorted(nodes))
    row = {label: k for k, label in enumerate(labels.tolist())}
    cells: dict[str, list[list[int]]] = {}
    place: dict[int, tuple[str, int]] = {}
    for label, (cell, members) in elements.items():
        missing = [node for node in members if node not in row]
        if missing:
            raise InputError(f"mesh file {path}: element {label} refers to node {missing[0]}, which is not there")
        place[label] = cell.name, len(cells.setdefault(cell.name, []))
        cells[cell.name].append([row[node] for node in members])
    named: dict[str, dict[str, list[int]]] = {}
    for name, members in groups.items():
        for kind, number in members:
            if kind == ELEMENT and number in place:
                cell, k = place[number]
                named.setdefault(name, {}).setdefault(cell, []).append(k)
            elif kind == NODE and number in row:
                cells.setdefault("vertex", []).append([row[number]])
                named.setdefault(name, {}).setdefault("vertex", []).append(len(cells["vertex"]) - 1)
    return Mesh(
        points=scale * np.array([nodes[label] for label in labels.tolist()]),
        cells={kind: np.array(rows) for kind, rows in cells.items()},
        groups={name: {kind: np.array(rows) for kind, rows in found.items()} for name, found in named.items()},
        labels=labels,
        source=path.name,
        sha256=hashlib.sha256(content).hexdigest(),
        scale=scale,
    )
