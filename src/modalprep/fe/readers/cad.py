"""CAD files (STEP, IGES, BREP): their solids, meshed with tetrahedra by gmsh."""

from __future__ import annotations

import hashlib
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from math import dist, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.gmsh_session import SEGMENTS, TETRAHEDRA, gmsh_session, refuse_too_many
from modalprep.fe.readers.iges import iges_unit

MM = 1e-3
STEP = {".step", ".stp"}
IGES = {".iges", ".igs"}
BREP = {".brep"}
CAD = STEP | IGES | BREP
WHOLE_BREP = re.compile(rb"\nTShapes \d+\s.*\*\s+[+-]\d+ \d+\s*\Z", re.DOTALL)  # the last line names the whole shape
SEWING = 1e-5  # of the diagonal: IGES files have faces alone, whose edges agree to the digits that the file has
FINEST = 0.25  # of the size, at curved faces
KINDS = {1: {"tetra": (4, 4), "triangle": (2, 3)}, 2: {"tetra10": (11, 10), "triangle6": (9, 6)}}  # gmsh's type, nodes
NAMELESS = "Open CASCADE STEP translator"  # what OpenCASCADE calls a part without a name
NODES = {"tetra10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]}  # gmsh swaps the last two


def read_cad(path: Path, length: float, size: float | None, order: int) -> Mesh:
    """Mesh the solids of a CAD file.

    Faces that solids share are meshed once, so that the solids hold together there. Around a full circle there are at
    least sixteen elements, unless they would be smaller than a quarter of `size`.

    Parameters
    ----------
    path : Path
    length : float
        m per unit of length: of `size` and `scale`, and of all coordinates of a BREP file, which has no unit.
    size : float
        Edge of an element.
    order : {1, 2}

    Returns
    -------
    Mesh
        In m, with one group for each solid (`body`; several: their names in the file, else `body`, `body_2`, ...), and
        one of triangles for each face (its name in the file, else `face_1`, ...).

    Raises
    ------
    InputError
        When the size or the order is missing or impossible, or the file is damaged or has no solid.
    """
    size = _checked_size(path, size, order)
    with _opened(path, length) as (gmsh, solids, unit):
        faces = _names(gmsh, sorted(set(gmsh.model.getBoundary([(3, tag) for tag in solids], False, False))), "face")
        _generate(gmsh, path, size * length / unit, order, solids)
        points, cells, groups = _mesh(gmsh, order, solids, faces)
    return Mesh(
        points=points * unit,
        cells=cells,
        groups=groups,
        source=path.name,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        scale=length,
    )


def cad_measures(path: Path, length: float) -> tuple[np.ndarray, float, float]:
    """Return the extensions (3,) in m, the volume in m^3 and the surface in m^2 of the solids of a CAD file.

    `length` is the unit of a BREP file in m.

    Raises
    ------
    InputError
        When the file is damaged or has no solid.
    """
    with _opened(path, length) as (gmsh, solids, unit):
        box = np.reshape(gmsh.model.getBoundingBox(-1, -1), (2, 3))
        volume = sum(gmsh.model.occ.getMass(3, tag) for tag in solids)
        area = sum(gmsh.model.occ.getMass(*face) for face in gmsh.model.getEntities(2))
    return unit * (box[1] - box[0]), unit**3 * volume, unit**2 * area


@contextmanager
def _opened(path: Path, length: float) -> Iterator[tuple[Any, dict[int, str], float]]:
    """Open a file in gmsh; yield gmsh, the names of its solids by their tags, and its unit in m."""
    suffix = path.suffix.lower()
    unit = length if suffix in BREP else iges_unit(path)[1] if suffix in IGES else MM  # STEP files are converted
    with gmsh_session() as gmsh:
        _load(gmsh, path)
        yield gmsh, _solids(gmsh, path), unit


def _checked_size(path: Path, size: float | None, order: int) -> float:
    if size is None:
        raise InputError(f"CAD file {path}: give 'size', the edge of an element in the unit of length of the mesh")
    if not (isinstance(size, (int, float)) and isfinite(size) and size > 0):
        raise InputError(f"CAD file {path}: size is {size!r}; it must be a positive length")
    if order not in KINDS:
        raise InputError(f"CAD file {path}: order is {order!r}; elements have order 1 or 2")
    return float(size)


def _load(gmsh: Any, path: Path) -> None:
    """Read the shapes of a file, in mm where the file says its unit."""
    suffix = path.suffix.lower()
    if suffix in BREP and not WHOLE_BREP.search(path.read_bytes()):  # OpenCASCADE would read a cut one for ever
        raise InputError(f"CAD file {path} is damaged or no BREP file; export it again")
    try:
        with _silent():
            shapes = _shapes(gmsh, path)
            if suffix in IGES and shapes:
                _sew(gmsh)
        gmsh.model.occ.synchronize()
    except Exception as error:  # gmsh knows no other
        raise InputError(f"CAD file {path} is damaged or no {suffix[1:].upper()} file: {error}") from None


def _shapes(gmsh: Any, path: Path) -> list[tuple[int, int]]:
    """Import the shapes of a file: STEP in mm, IGES in the file's own unit, to which OpenCASCADE's tolerances fit."""
    suffix = path.suffix.lower()
    kind = "step" if suffix in STEP else "iges" if suffix in IGES else "brep"
    unit = {"step": "MM", "iges": iges_unit(path)[0] if kind == "iges" else "", "brep": ""}[kind]
    if kind == "iges":
        with suppress(Exception):  # OpenCASCADE has no unit that can be set before it has tried to read a STEP file
            gmsh.model.occ.importShapes(str(path), format="step")
    gmsh.option.setString("Geometry.OCCTargetUnit", unit)
    try:
        return gmsh.model.occ.importShapes(str(path), format=kind)
    except Exception as error:
        if "target unit" not in str(error):
            raise
    gmsh.option.setString("Geometry.OCCTargetUnit", "")  # before the first STEP file the unit is mm, and cannot be set
    return gmsh.model.occ.importShapes(str(path), format=kind)


def _sew(gmsh: Any) -> None:
    """Join faces at their edges, and make solids of what they enclose."""
    gmsh.model.occ.synchronize()
    box = gmsh.model.getBoundingBox(-1, -1)
    tolerance = SEWING * dist(box[:3], box[3:])
    gmsh.model.occ.healShapes([], tolerance, False, False, False, sewFaces=True, makeSolids=True)


@contextmanager
def _silent() -> Iterator[None]:
    """Discard what OpenCASCADE writes to the standard output, which gmsh cannot silence."""
    sys.stdout.flush()
    saved = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(saved, 1)
        os.close(saved)
        os.close(nowhere)


def _solids(gmsh: Any, path: Path) -> dict[int, str]:
    """Return the names of the solids by their tags, after joining those that touch."""
    found = gmsh.model.getEntities(3)
    if not found:
        raise InputError(f"CAD file {path} holds no solid, or is damaged; export the part as a solid")
    if len(found) == 1:
        return {found[0][1]: "body"}
    names = list(_names(gmsh, found, "body").values())
    _, parts = gmsh.model.occ.fragment(found[:1], found[1:])
    gmsh.model.occ.synchronize()
    owners: dict[int, str] = {}
    for name, pieces in zip(names, parts, strict=True):
        for _, tag in pieces:
            if tag in owners:
                raise InputError(f"CAD file {path}: the solids {owners[tag]!r} and {name!r} overlap; cut one")
            owners[tag] = name
    return owners


def _names(gmsh: Any, entities: list[tuple[int, int]], common: str) -> dict[int, str]:
    """Name entities as the file does where it gives a name to one alone, else by `common` and their number."""
    given = [gmsh.model.getEntityName(*entity).rpartition("/")[2].strip() for entity in entities]
    found = {}
    for number, ((_, tag), name) in enumerate(zip(entities, given, strict=True), 1):
        own = name and given.count(name) == 1 and not name.startswith(NAMELESS)
        found[tag] = name if own else "body" if (common, number) == ("body", 1) else f"{common}_{number}"
    return found


def _generate(gmsh: Any, path: Path, size: float, order: int, solids: dict[int, str]) -> None:
    volume = sum(gmsh.model.occ.getMass(3, tag) for tag in solids)
    area = sum(gmsh.model.occ.getMass(*face) for face in gmsh.model.getEntities(2))
    refuse_too_many(max(TETRAHEDRA * volume / size**3, 2.3 * area / size**2), "give a larger size")
    for option, value in {
        "Mesh.MeshSizeMin": FINEST * size,
        "Mesh.MeshSizeMax": size,
        "Mesh.MeshSizeFromCurvature": SEGMENTS,
        "Mesh.ElementOrder": order,
        "Mesh.HighOrderOptimize": order == 2,
    }.items():
        gmsh.option.setNumber(option, float(value))
    try:
        gmsh.model.mesh.generate(3)
    except Exception as error:  # gmsh knows no other
        raise InputError(f"gmsh cannot mesh {path}: {error}; give another size, or repair the part") from None


def _mesh(
    gmsh: Any, order: int, solids: dict[int, str], faces: dict[int, str]
) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, dict[str, np.ndarray]]]:
    """Return points (file's unit), cells and groups of the meshed solids and their faces."""
    tags, flat, _ = gmsh.model.mesh.getNodes()
    sequence = np.argsort(tags)
    tags = tags[sequence]
    points = flat.reshape(-1, 3)[sequence]
    cells, groups = {}, {}
    for (kind, (number, width)), named in zip(KINDS[order].items(), (solids, faces), strict=True):
        blocks = []
        start = 0
        for tag, name in sorted(named.items()):
            rows = gmsh.model.mesh.getElementsByType(number, tag)[1].reshape(-1, width)
            blocks.append(np.searchsorted(tags, rows)[:, NODES.get(kind, slice(None))])
            mine = groups.setdefault(name, {}).get(kind, np.zeros(0, dtype=int))
            groups[name][kind] = np.append(mine, np.arange(start, start := start + len(rows)))
        cells[kind] = np.concatenate(blocks)
    used = np.unique(next(iter(cells.values())))
    new = np.full(len(points), -1)
    new[used] = np.arange(len(used))
    return points[used], {kind: new[conn] for kind, conn in cells.items()}, groups
