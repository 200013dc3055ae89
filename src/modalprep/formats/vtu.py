"""VTU: the mesh and its modes for ParaView and every other reader of VTK's XML files."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.fe.mesh.cells import CELLS

NAMES = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}


def write_vtu(body: FlexibleBody, path: str | Path) -> Path:
    """Write the mesh with one vector field per mode, named like ``mode_01_12.3Hz``.

    Points are `body.points` (m, frame B), fields the nodal displacements `body.shape` (n_points, 3) per unit modal
    coordinate: M-orthonormal, in 1/sqrt(kg), with the sign of the modal file. Cells keep their mid-side nodes. A wedge
    has the order of today's VTK, in which its volume is positive; meshio swaps its nodes on reading.

    Lost: everything but mesh, shapes and frequencies; also the rotations of the shapes, so that a straight beam in
    torsion shows no motion.

    Parameters
    ----------
    body : FlexibleBody
    path : str or Path
        Usually ``.vtu``.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the body has no mesh or no modes, or the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> file = write_vtu(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.vtu")
    >>> import meshio
    >>> list(meshio.read(file).point_data)
    ['mode_01_0.6Hz', 'mode_02_1.2Hz']
    """
    if not body.cells:
        raise InputError(f"body {body.name!r} has no mesh to write; a VTU file needs one")
    unknown = sorted(kind for kind in body.cells if kind not in CELLS or CELLS[kind].vtk is None)
    if unknown:
        raise InputError(f"body {body.name!r} has cells that VTK does not know: {', '.join(unknown)}")
    if not body.n:
        raise InputError(f"body {body.name!r} has no modes to write on its mesh; a rigid body has none")
    with atomic_path(path) as temporary, open(temporary, "w", encoding="ascii") as file:
        file.writelines(_lines(body))
    return Path(path)


def _lines(body: FlexibleBody) -> Iterator[str]:
    cells = sum(len(nodes) for nodes in body.cells.values())
    yield '<?xml version="1.0"?>\n'
    yield '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
    yield f'<UnstructuredGrid><Piece NumberOfPoints="{len(body.points)}" NumberOfCells="{cells}">\n'
    yield from _section("PointData", _modes(body))
    yield from _section("Points", {"Points": body.points})
    yield from _section("Cells", _cells(body.cells))
    yield "</Piece></UnstructuredGrid></VTKFile>\n"


def _modes(body: FlexibleBody) -> dict[str, np.ndarray]:
    width = max(2, len(str(body.n)))
    names = (f"mode_{k:0{width}d}_{frequency:.1f}Hz" for k, frequency in enumerate(body.frequency, start=1))
    return {name: body.shape[:, :, k] for k, name in enumerate(names)}


def _cells(cells: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    sizes = np.concatenate([np.full(len(nodes), nodes.shape[1]) for nodes in cells.values()])
    types = np.concatenate([np.full(len(nodes), CELLS[kind].vtk) for kind, nodes in cells.items()])
    nodes = np.concatenate([np.ravel(nodes) for nodes in cells.values()])
    return {"connectivity": np.int64(nodes), "offsets": np.cumsum(sizes, dtype=np.int64), "types": np.uint8(types)}


def _section(name: str, arrays: dict[str, np.ndarray]) -> Iterator[str]:
    """Yield a section of arrays: a count of bytes and the bytes, little-endian, in base64."""
    yield f"<{name}>\n"
    for key, array in arrays.items():
        data = array.astype(array.dtype.newbyteorder("<")).tobytes()
        text = b64encode(np.array(len(data), dtype="<u8").tobytes() + data).decode()
        size = f' NumberOfComponents="{array.shape[1]}"' if array.ndim > 1 else ""
        yield f'<DataArray type="{NAMES[array.dtype.name]}" Name="{key}"{size} format="binary">{text}</DataArray>\n'
    yield f"</{name}>\n"
