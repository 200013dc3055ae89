"""A scene as data for the viewer of pages: outer surface, beams, interfaces and mode shapes, as base64."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import RenderError
from modalprep.report.scene.camera import view
from modalprep.report.scene.colour import colours, node_colour
from modalprep.report.scene.motion import SHARE, largest_displacement
from modalprep.report.scene.record import Scene, scene_of
from modalprep.report.scene.skin import Skin, outer_skin, simplified
from modalprep.report.tables import hertz

TRIANGLES = 60_000  # maximum number of surface triangles
BYTES = 8_000_000  # maximum size of all mode shapes and their colours
EDGED = 20_000  # triangles up to which element edges are initially visible: beyond, they hide the colours
ENOUGH = 5000  # nodes used to choose a view
FULL = 32767  # the largest displacement of a mode, as a 16-bit number
ViewerData = dict[str, Any]  # for JSON; report/viewer.js reads it


def scene_data(body: FlexibleBody | Scene, *, triangles: int = TRIANGLES, shape_bytes: int = BYTES) -> ViewerData:
    """Return the data of the viewer, ready for JSON.

    Points are 32-bit floats relative to the body's centre, in units of its size; mode shapes are 16-bit integers, the
    strain energy (root of its density, if the body has it) bytes.
    What has no modes stands still: it has one of zeros, and is `plain`.
    A surface with more triangles is drawn by its corner nodes, then on a coarser grid, with a note.

    Parameters
    ----------
    triangles : int
        Maximum number of surface triangles.
    shape_bytes : int
        Maximum size of all mode shapes; further modes are omitted.

    Raises
    ------
    RenderError
        When a cell type cannot be drawn.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> drawn = scene_data(uniform_beam(modes=2))
    >>> drawn["counts"], drawn["modes"][1]["number"], drawn["notes"]
    ([0, 40], 2, [])
    """
    body = scene_of(body)
    if not body.n:
        return scene_data(_still(body), triangles=triangles) | {"plain": True}
    skin, notes = limited_skin(body.points, body.cells, body.skin, triangles)
    used = np.unique(np.concatenate([part.ravel() for part in vars(skin).values()]))
    renumber = np.zeros(len(body.points), dtype=int)
    renumber[used] = np.arange(len(used))
    points, shape = _with_interfaces(body, used)
    largest = largest_displacement(body.shape)
    count = max(1, min(body.n, shape_bytes // (7 * len(points))))
    if count < body.n:
        notes.append(f"The viewer holds modes 1 to {count} of {body.n}, to keep the page small.")
    parts = {name: encoded(renumber[part], "<u4") for name, part in vars(skin).items()}
    return parts | {
        "points": encoded(_centred(body, points), "<f4"),
        "modes": [_mode(body, k, shape[:, :, k], float(largest[k]), used) for k in range(min(count, body.n))],
        "colours": colours(body),
        "interfaces": list(body.interface_name),
        "counts": [len(skin.triangles), len(skin.lines)],
        "edged": len(skin.triangles) <= EDGED,
        "share": SHARE,
        "notes": notes,
    }


def _still(body: Scene) -> Scene:
    """Return a scene with one mode in which nothing moves."""
    shape = np.zeros((len(body.points), 3, 1))
    return replace(body, shape=shape, phi=np.zeros((len(body.interface_name), 3, 1)), frequency=np.zeros(1))


def limited_skin(points: np.ndarray, cells: Mapping[str, np.ndarray], skin: Skin, limit: int) -> tuple[Skin, list[str]]:
    """Return a skin of a mesh with at most `limit` triangles, and a note if it was simplified."""
    count = len(skin.triangles)
    if count <= limit:
        return skin, []
    skin = outer_skin(points, cells, curved=False)
    if len(skin.triangles) > limit:
        skin = simplified(points, skin, limit)
    kept = len(skin.triangles)
    return skin, [f"The surface is drawn with {kept} of its {count} triangles, to keep the page small."]


def _with_interfaces(body: Scene, used: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return points and shapes of these nodes and, behind them, of the interfaces."""
    points = np.concatenate([body.points[used], body.interface_position.reshape(-1, 3)])
    return points, np.concatenate([body.shape[used], body.phi])


def _centred(body: Scene, points: np.ndarray) -> np.ndarray:
    low = body.points.min(axis=0)
    high = body.points.max(axis=0)
    return (points - (low + high) / 2) / (np.linalg.norm(high - low) or 1.0)


def _mode(body: Scene, k: int, shape: np.ndarray, largest: float, used: np.ndarray) -> dict[str, Any]:
    """Return one mode with its shape, largest displacement one, its strain, and the view direction."""
    unit = shape / largest if largest else np.zeros_like(shape)
    some = slice(None, None, len(body.points) // ENOUGH + 1)
    towards, up = view(body.points[some], body.shape[some, :, k] if largest else None)
    return {
        "number": k + 1,
        "frequency": hertz(body.frequency[k]),
        "shape": encoded(np.rint(FULL * np.clip(unit, -1, 1)), "<i2"),
        "energy": encoded(_strain(body, k, used), "u1"),
        "view": [np.cross(up, towards).tolist(), up.tolist(), towards.tolist()],
    }


def _strain(body: Scene, k: int, used: np.ndarray) -> np.ndarray:
    """Return the colour of these nodes and of the interfaces, which have none, as bytes; empty where unknown."""
    if "energy" not in colours(body):
        return np.zeros(0)
    strain = node_colour(body, k + 1, "energy")[used]
    return np.rint(255 * np.append(strain, np.zeros(len(body.interface_name))))


def encoded(array: np.ndarray, kind: str) -> str:
    """Return an array as base64, of numbers of this kind."""
    return base64.b64encode(np.ascontiguousarray(array, dtype=kind).tobytes()).decode()


def drawable(body: FlexibleBody | Scene) -> tuple[ViewerData | None, str]:
    """Return the data of the viewer, or None and the reason.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=1)
    >>> drawable(body.with_(cells={"polygon": np.array([[0, 1, 2]])}))[1].split(";")[0]
    'cells of type polygon cannot be drawn'
    """
    if not body.n:
        return None, ""
    try:
        return scene_data(body), ""
    except RenderError as error:
        return None, str(error)
