"""The scene of a run as data for the viewer: their surfaces, and for each frame their places and deflections."""

from __future__ import annotations

from typing import Any

import numpy as np

from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.report.scene.camera import viewpoint
from modalprep.report.scene.skin import Skin
from modalprep.report.scene.style import FilmStyle
from modalprep.report.scene.system import SystemScene
from modalprep.report.viewer.still import EDGED, FULL, TRIANGLES, ViewerData, encoded, limited_skin

FRAMES = 240  # of a run
BYTES = 12_000_000  # maximum size of all deflections
Part = dict[str, Any]


def run_data(system: System | DeployingSystem, result: Result, *, frames: int = FRAMES) -> ViewerData:
    """Return the data of the viewer for a run, ready for JSON.

    Lengths are in units of the size of the motion; a body has a place and a quaternion in each frame, and the
    deflections of its nodes as 16-bit integers, with their second order. Bodies that are not there yet have no place.

    Parameters
    ----------
    result : Result
        Of this system.
    frames : int
        Maximum number of frames, spread evenly over the run, or over that part of it whose deflections can be shown.

    Raises
    ------
    InputError
        When the result is not of this system.
    RenderError
        When a cell type cannot be drawn.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.preparation import start_channels
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", angle=0.5)
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))
    >>> drawn = run_data(arm, start_channels(arm))
    >>> drawn["counts"], drawn["run"]["times"], drawn["bodies"]
    ([0, 40], ['0'], ['arm'])
    """
    scene = SystemScene(system, _thinned(result, frames), frames, FilmStyle())
    skins = {name: _skin(scene, name) for name in scene.bodies}
    scene.rows = _affordable(scene.rows, sum(len(used) for _, used, _ in skins.values()))
    notes = [note for _, _, said in skins.values() for note in said]
    middle, size = _extent(scene)
    parts = [_part(scene, k, name, skins[name][1], size) for k, name in enumerate(skins)]
    parts += [_marks(scene, k, name, size) for k, name in enumerate(skins)]
    index = _joined({name: skin for name, (skin, _, _) in skins.items()}, [part["count"] for part in parts])
    towards, up = viewpoint(_seen(scene), scene.system.gravity)
    moved = scene.factor * scene.largest > 0
    return {name: encoded(nodes, "<u4") for name, nodes in index.items()} | {
        "run": {
            "frames": len(scene.rows),
            "bodies": len(skins),
            "nodes": sum(part["count"] for part in parts),
            "times": [f"{time:.4g}" for time in scene.result.time[scene.rows]],
            "parts": parts,
            "poses": encoded(_poses(scene, middle, size), "<f4"),
            "range": scene.largest / scene.factor / size,
            "view": [np.cross(up, towards).tolist(), up.tolist(), towards.tolist()],
        },
        "plain": not moved,
        "bodies": list(skins),
        "interfaces": [f"{name}.{i}" for name, body in scene.bodies.items() for i in body.interface_name],
        "largest": f"{scene.largest:.3g}",
        "unit": scene.unit,
        "seconds": float(np.ptp(scene.result.time[scene.rows])),
        "counts": [len(index["triangles"]), len(index["lines"])],
        "edged": len(index["triangles"]) <= EDGED,
        "share": 0,
        "notes": notes,
    }


def _thinned(result: Result, frames: int) -> Result:
    rows = np.unique(np.linspace(0, len(result.time) - 1, frames).round().astype(int))
    return result.with_(time=result.time[rows], channels={name: a[rows] for name, a in result.channels.items()})


def _affordable(rows: np.ndarray, nodes: int) -> np.ndarray:
    """Return as many of the rows, spread evenly, as fit into `BYTES`."""
    count = int(max(2, min(len(rows), BYTES // (6 * max(nodes, 1)))))
    return rows[np.unique(np.linspace(0, len(rows) - 1, count).round().astype(int))]


def _skin(scene: SystemScene, name: str) -> tuple[Skin, np.ndarray, list[str]]:
    """Return the skin of a body by its own nodes, the numbers of these in the body, and notes."""
    body = scene.bodies[name]
    skin, notes = limited_skin(body.points, body.cells, scene.skins[name], max(200, TRIANGLES // len(scene.bodies)))
    used = np.unique(np.concatenate([part.ravel() for part in vars(skin).values()]))
    own = Skin(**{kind: np.searchsorted(used, part) for kind, part in vars(skin).items()})
    return own, used, [f"{name}: {note[0].lower()}{note[1:]}" for note in notes]


def _joined(skins: dict[str, Skin], counts: list[int]) -> dict[str, np.ndarray]:
    """Return the skins of all bodies by the numbers that their nodes have behind each other."""
    begins = np.concatenate([[0], np.cumsum(counts)])
    kinds = ("triangles", "edges", "outline", "lines")
    return {
        kind: np.concatenate([getattr(skin, kind) + begin for skin, begin in zip(skins.values(), begins, strict=False)])
        for kind in kinds
    }


def _part(scene: SystemScene, k: int, name: str, used: np.ndarray, size: float) -> Part:
    return _moving(k, scene.bodies[name].points[used], scene.bends[name][scene.rows][:, used], size)


def _marks(scene: SystemScene, k: int, name: str, size: float) -> Part:
    """Return the interfaces of a body; their deflection is known in the axes of the body."""
    body = scene.bodies[name]
    bends = np.zeros((len(scene.rows), *body.interface_position.shape))
    if body.n:
        histories = [scene.result.channels.get(f"{name}.{i}.deflection") for i in body.interface_name]
        for i, history in enumerate(histories):
            bends[:, i] = 0.0 if history is None else history[scene.rows]
    return _moving(k, body.interface_position.reshape(-1, 3), bends, size)


def _moving(k: int, points: np.ndarray, bends: np.ndarray, size: float) -> Part:
    """Return nodes of a body: their places at rest, deflections in each frame as integers, and the box of all."""
    bends = np.nan_to_num(bends)
    full = float(np.abs(bends).max(initial=0.0))
    moved = points + bends
    low, high = (reach(moved, axis=(0, 1)) / size if moved.size else np.zeros(3) for reach in (np.min, np.max))
    return {
        "body": k,
        "count": len(points),
        "rest": encoded(points / size, "<f4"),
        "full": full / size,
        "bend": encoded(np.rint(FULL * bends / full), "<i2") if full else "",
        "box": [*low.tolist(), *high.tolist()],
    }


def _poses(scene: SystemScene, middle: np.ndarray, size: float) -> np.ndarray:
    """Return origin and quaternion of each body in each frame (frames, bodies, 7)."""
    poses = [
        np.hstack(
            [
                (scene.result[f"{name}.origin"][scene.rows] - middle) / size,
                scene.result[f"{name}.orientation"][scene.rows],
            ]
        )
        for name in scene.bodies
    ]
    return np.stack(poses, axis=1)


def _seen(scene: SystemScene) -> np.ndarray:
    """Return the places of nodes and interfaces in some frames (n, 3)."""
    some = scene.rows[:: -(-len(scene.rows) // 24)]
    there = [(name, k) for name in scene.bodies for k in some if scene.is_out(name, k)]
    return np.concatenate([scene.ground, *(place(*at) for at in there for place in (scene.points, scene.interfaces))])


def _extent(scene: SystemScene) -> tuple[np.ndarray, float]:
    seen = _seen(scene)
    low = seen.min(axis=0)
    high = seen.max(axis=0)
    return (low + high) / 2, float(np.linalg.norm(high - low)) or 1.0
