"""VTU: the mesh and its modes for ParaView and every other reader of VTK's XML files."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.recovery import BodyMotion
from modalprep.errors import InputError
from modalprep.fe.mesh.cells import CELLS
from modalprep.formats.refusals import refuse_without_modes
from modalprep.multibody.results.fields import cell_fields, node_field, on_mesh
from modalprep.multibody.results.recovered import body_motion
from modalprep.multibody.results.result import Result
from modalprep.vectors import as_rotation

Fields = dict[str, np.ndarray]
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
    _refuse_without_mesh(body)
    refuse_without_modes(body, "on its mesh", "a rigid body has none")
    return _write(path, body, body.points, _modes(body), {})


def write_vtu_series(body: FlexibleBody, result: Result, path: str | Path, *, name: str = "", every: int = 1) -> Path:
    """Write the motion of a body in a run as a time series for ParaView, with its recovered fields.

    Each time is a file ``<stem>_0000.vtu`` beside the collection ``<stem>.pvd``. Points move with the body in inertial
    axes, m; point data is the ``displacement`` in the body's axes, m, to first order in the modal coordinates, and
    recoveries of nodes; cell data are recoveries of elements, such as ``skin.top.von_mises``, NaN in other cells.

    Parameters
    ----------
    body : FlexibleBody
    result : Result
        Of a simulation with this body.
    path : str or Path
        Of the collection, ``.pvd``.
    name : str
        Of the body in the system; default its own.
    every : int
        Every so many times of the run.

    Returns
    -------
    Path
        The collection.

    Raises
    ------
    InputError
        When the body has no mesh, the run has no motion of it, or the file is of another kind.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> still = {"beam.origin": np.zeros((2, 3)), "beam.orientation": np.eye(4)[[0, 0]], "beam.modal": np.zeros((2, 2))}
    >>> run = Result(time=np.array([0.0, 1.0]), channels=still, status="done", message="")
    >>> series = write_vtu_series(uniform_beam(modes=2), run, Path(tempfile.mkdtemp()) / "beam.pvd")
    >>> sorted(file.name for file in series.parent.iterdir())
    ['beam.pvd', 'beam_0000.vtu', 'beam_0001.vtu']
    """
    path = Path(path)
    name = name or body.name
    _refuse_without_mesh(body)
    check_series(path)
    if f"{name}.orientation" not in result or not body.n:
        raise InputError(f"the result has no motion of a flexible body {name!r}; simulate the same system")
    if every < 1:
        raise InputError(f"every = {every} must be at least 1")
    motion = body_motion(body, name, result.channels)
    written = []
    for number, k in enumerate(range(0, len(result.time), every)):
        file = path.with_name(f"{path.stem}_{number:04d}.vtu")
        written.append((float(result.time[k]), _write_time(body, result, name, motion, k, file)))
    lines = (f'<DataSet timestep="{t!r}" file={quoteattr(file.name)}/>\n' for t, file in written)
    text = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1"><Collection>\n'
    with atomic_path(path) as temporary:
        temporary.write_text(f"{text}{''.join(lines)}</Collection></VTKFile>\n", encoding="utf-8")
    return path


def check_series(path: Path) -> None:
    """Refuse a collection of another kind."""
    if path.suffix != ".pvd":
        raise InputError(f"cannot write {path}: a series of VTU files is collected by a .pvd file")


def _write_time(body: FlexibleBody, result: Result, name: str, motion: BodyMotion, k: int, file: Path) -> Path:
    shift = body.shape @ motion.q[k]
    turn = as_rotation(result[f"{name}.orientation"][k], f"orientation of {name}")
    points = (body.points + shift) @ turn.T + result[f"{name}.origin"][k]
    at_nodes = {"displacement": shift}
    in_cells = {}
    now = BodyMotion(*(x[k : k + 1] for x in motion))
    complete = f"{name}.modal_acceleration" in result
    for key, block in body.recovery.items():
        if not on_mesh(block) or (block.moves and not complete):
            continue
        values = block.full_values(now)[0]
        if block.node is not None:
            parts = {part: node_field(body, block, values, part) for part in block.full_components}
            at_nodes |= {f"{key}.{part}": field for part, field in parts.items()}
        else:
            in_cells |= {
                f"{key}.{part}": np.concatenate([fields[kind] for kind in body.cells])
                for part, fields in cell_fields(body, block, values).items()
            }
    return _write(file, body, points, at_nodes, in_cells)


def _refuse_without_mesh(body: FlexibleBody) -> None:
    if not body.cells:
        raise InputError(f"body {body.name!r} has no mesh to write; a VTU file needs one")
    unknown = sorted(kind for kind in body.cells if kind not in CELLS or CELLS[kind].vtk is None)
    if unknown:
        raise InputError(f"body {body.name!r} has cells that VTK does not know: {', '.join(unknown)}")


def _write(path: str | Path, body: FlexibleBody, points: np.ndarray, at_nodes: Fields, in_cells: Fields) -> Path:
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        file.writelines(_lines(body, points, at_nodes, in_cells))
    return Path(path)


def _lines(body: FlexibleBody, points: np.ndarray, at_nodes: Fields, in_cells: Fields) -> Iterator[str]:
    cells = sum(len(nodes) for nodes in body.cells.values())
    yield '<?xml version="1.0"?>\n'
    yield '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
    yield f'<UnstructuredGrid><Piece NumberOfPoints="{len(body.points)}" NumberOfCells="{cells}">\n'
    yield from _section("PointData", at_nodes)
    yield from _section("CellData", in_cells)
    yield from _section("Points", {"Points": points})
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
    return {
        "connectivity": nodes.astype(np.int64),
        "offsets": np.cumsum(sizes, dtype=np.int64),
        "types": types.astype(np.uint8),
    }


def _section(name: str, arrays: dict[str, np.ndarray]) -> Iterator[str]:
    """Yield a section of arrays: a count of bytes and the bytes, little-endian, in base64."""
    yield f"<{name}>\n"
    for key, array in arrays.items():
        data = array.astype(array.dtype.newbyteorder("<")).tobytes()
        text = b64encode(np.array(len(data), dtype="<u8").tobytes() + data).decode()
        size = f' NumberOfComponents="{array.shape[1]}"' if array.ndim > 1 else ""
        kind = f'type="{NAMES[array.dtype.name]}" Name={quoteattr(key)}{size}'
        yield f'<DataArray {kind} format="binary">{text}</DataArray>\n'
    yield f"</{name}>\n"
