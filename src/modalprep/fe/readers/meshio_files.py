"""The formats that meshio reads: .msh of gmsh, .med, .vtu and others; what it leaves unchecked is checked here."""

from __future__ import annotations

import codecs
import contextlib
import hashlib
import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.facets import numbered
from modalprep.fe.mesh.mesh import Mesh, refuse_far_points
from modalprep.fe.readers.cad import CAD
from modalprep.fe.readers.deck_format import BY_ENDING
from modalprep.fe.readers.med import in_vtk_order, learn_cells, name_groups
from modalprep.fe.readers.unpacking import limited_unpacking, refuse_packed_datasets

VTK = (".vtu", ".vtk")
MED = ".med"
UNIVERSAL = {".unv", ".uff"}


def read_by_meshio(path: Path, scale: float) -> Mesh:
    """Return points, cells and groups of a file; `scale` is its unit of length in m."""
    content = path.read_bytes()
    raw = _read(path, content)
    ending = path.suffix.lower()
    if ending == MED:
        name_groups(raw)
    cells, groups = _merge(raw)
    if not cells:
        raise InputError(f"mesh file {path} holds no cells; save the mesh with its elements")
    points = _points(raw, path)
    _refuse_missing_nodes(cells, len(points), path, content)
    _add_node_sets(raw, cells, groups)
    if ending in VTK and "wedge" in cells:
        cells["wedge"] = _upright(cells["wedge"], points)
    if ending == MED:
        cells = {kind: in_vtk_order(kind, rows, points) for kind, rows in cells.items()}
    digest = hashlib.sha256(content).hexdigest()
    return Mesh(points=points * scale, cells=cells, groups=groups, source=path.name, sha256=digest, scale=scale)


def _read(path: Path, content: bytes) -> Any:
    import meshio
    from meshio._helpers import extension_to_filetypes

    if path.suffix.lower() not in extension_to_filetypes:
        known = ", ".join(sorted({*extension_to_filetypes, *BY_ENDING, *UNIVERSAL, *CAD}))
        raise InputError(f"mesh file {path}: the format {path.suffix!r} is not known; known are {known}")
    content = content.removeprefix(codecs.BOM_UTF8)
    damaged = f"mesh file {path} is damaged or cut short; export it again (.msh 4.1 is best)"
    if path.suffix == ".msh" and not _msh_is_whole(content):
        raise InputError(damaged)
    try:  # meshio prints its complaint and calls sys.exit
        with (
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()),
            limited_unpacking(len(content)),
        ):
            refuse_packed_datasets(path, content)
            learn_cells()
            return _read_msh(path) if path.suffix == ".msh" else meshio.read(path)
    except (Exception, SystemExit) as error:
        raise InputError(f"{damaged}; the reader said: {str(error).strip() or type(error).__name__}") from None


def _read_msh(path: Path) -> Any:
    """Read a file of gmsh from behind a byte-order mark, which meshio does not know."""
    from meshio.gmsh.main import read_buffer

    with path.open("rb") as file:
        if file.read(len(codecs.BOM_UTF8)) != codecs.BOM_UTF8:
            file.seek(0)
        return read_buffer(file)


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
    refuse_far_points(points, np.zeros(0), f"mesh file {path}")
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


def _add_node_sets(raw: Any, cells: dict[str, np.ndarray], groups: dict[str, dict[str, np.ndarray]]) -> None:
    """Give every node set of the file vertex cells, in the group of its name if that has none."""
    for name, nodes in raw.point_sets.items():
        rows = cells.get("vertex", np.zeros((0, 1), dtype=int))
        if len(nodes) and "vertex" not in groups.get(name, {}):
            groups.setdefault(name, {})["vertex"] = np.arange(len(rows), len(rows) + len(nodes))
            cells["vertex"] = np.concatenate([rows, np.asarray(nodes, dtype=int)[:, None]])


def _merge(raw: Any) -> tuple[dict[str, np.ndarray], dict[str, dict[str, np.ndarray]]]:
    """Merge meshio's blocks of equal type, keeping an element that is listed twice only once."""
    kinds = list(dict.fromkeys(block.type for block in raw.cells))
    cells, groups = {}, {}
    for kind in kinds:
        blocks = [i for i, block in enumerate(raw.cells) if block.type == kind]
        stacked = np.concatenate([raw.cells[i].data for i in blocks])
        _, first, row = np.unique(numbered(stacked), return_index=True, return_inverse=True)
        order = np.argsort(np.argsort(first))  # keep the file's order
        cells[kind] = stacked[np.sort(first)]
        for name, members in _block_groups(raw, blocks).items():
            groups.setdefault(name, {})[kind] = np.unique(order[row[members]])
    return cells, groups


def _upright(wedges: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Turn wedges ``(k, 6)`` that stand on their head: meshio swaps their nodes, as VTK no longer does."""
    base = points[wedges[:, :3]]
    normal = np.cross(base[:, 1] - base[:, 0], base[:, 2] - base[:, 0])
    height = points[wedges[:, 3:]].mean(axis=1) - base.mean(axis=1)
    down = np.einsum("ij,ij->i", normal, height) < 0
    return np.where(down[:, None], wedges[:, [0, 2, 1, 3, 5, 4]], wedges)


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
    if not raw.cell_sets and not raw.field_data:
        found |= _numbered_groups(raw, blocks)
    return {name: np.concatenate(rows) for name, rows in found.items()}


def _numbered_groups(raw: Any, blocks: list[int]) -> dict[str, list[np.ndarray]]:
    """One group ``<array>_<value>`` for each value of an integer cell array, as .vtu files carry them."""
    found = {}
    for name, values in raw.cell_data.items():
        array = np.concatenate([values[i] for i in blocks])
        if array.ndim == 1 and np.issubdtype(array.dtype, np.integer) and name.removeprefix("gmsh:") != "geometrical":
            for value in np.unique(array):
                found[f"{name.removeprefix('gmsh:')}_{value}"] = [np.flatnonzero(array == value)]
    return found
