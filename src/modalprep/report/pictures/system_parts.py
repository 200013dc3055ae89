"""The bodies of a run as meshes of pyvista."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pyvista

from modalprep.report.pictures.body_parts import TUBE
from modalprep.report.pictures.surface import surface, tubes
from modalprep.report.scene.skin import Skin

FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def bodies_at(
    shown: Sequence[tuple[Skin, np.ndarray, np.ndarray]], radius: float
) -> Iterator[tuple[str, pyvista.PolyData | None]]:
    """Yield the surfaces and the beams of all bodies together, each with its name; None where there are none.

    Parameters
    ----------
    shown : sequence of (skin, points (n_points, 3), amount (n_points,))
        Bodies at one time, with the values for their colours.
    radius : float
        Of the marks of interfaces, m.
    """
    yield "skin", _joined([surface(*one) for one in shown])
    yield "beams", _joined([tubes(skin, points, _thick(points, radius), amount) for skin, points, amount in shown])


def boxes_at(corners: Sequence[np.ndarray]) -> pyvista.PolyData | None:
    """Return boxes of corners (8, 3), in the order of `box_corners`; None without any."""
    if not corners:
        return None
    faces = np.concatenate([FACES + 8 * k for k in range(len(corners))])
    return pyvista.PolyData(np.concatenate(corners), faces=np.column_stack([np.full(len(faces), 4), faces]).ravel())


def _thick(points: np.ndarray, radius: float) -> float:
    return max(0.5 * radius, TUBE * float(np.ptp(points, axis=0).max()))


def _joined(parts: Sequence[pyvista.PolyData | None]) -> pyvista.PolyData | None:
    known = [part for part in parts if part is not None]
    return known[0].append_polydata(*known[1:]) if len(known) > 1 else next(iter(known), None)


def put(plotter, name: str, part: pyvista.PolyData | None, style: Mapping):
    """Add a part in place of the last of this name, or only remove that; return the actor."""
    if part is None:
        plotter.remove_actor(name, reset_camera=False, render=False)
        return None
    return plotter.add_mesh(part, name=name, **style)
