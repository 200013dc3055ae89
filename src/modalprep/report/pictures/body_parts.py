"""The parts of a picture of a body: the undeformed body behind it, its surface, edges, beams and interfaces."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.report.pictures.marks import QUIET, add_interfaces, beside
from modalprep.report.pictures.skin import outer_skin

TUBE = 0.007  # radius of a beam, of the body's size
LIFT = 2e-3  # offset of edges before their faces, of the body's size
BODY_COLOUR, EDGE, OUTLINE = "#9dc3e0", "#33475a", "#1d2733"
GHOST, GHOST_EDGE = "#eceff2", "#8a949e"
LIGHT = {"smooth_shading": True, "ambient": 0.3, "diffuse": 0.75}


def label_shifts(plotter, body: FlexibleBody, shown: list[np.ndarray], places: np.ndarray) -> np.ndarray:
    """Return the shifts of the names of the interfaces, beside the body at all of the points (n_points, 3) shown."""
    skin = outer_skin(body.points, body.cells, curved=False)
    parts = [points[part] for points in shown for part in (skin.triangles, skin.lines)]
    return beside(plotter, parts, places, body.interface_name)


def front(plotter, body: FlexibleBody) -> float:
    """Return a distance (m) towards the camera that is before all of the body; 0 for a camera that can turn."""
    return 2 * body_size(body) if plotter.off_screen else 0.0


def add_ghost(plotter, body: FlexibleBody) -> None:
    """Add or replace the undeformed body: faces, visible sharp edges and beams behind all, borders of shells in place.

    Before a camera that can turn all of it is in place, and translucent.
    """
    from modalprep.report.pictures.surface import lines, surface

    back = -front(plotter, body) * _towards(plotter)
    still = body.points + back
    skin = surface(body, still)
    beams = lines(body, still)
    if skin is not None:
        style = {"color": GHOST, "lighting": False, "opacity": 1.0 if back.any() else 0.12}
        plotter.add_mesh(skin, name="ghost", **style, **QUIET)
        _add_outline(plotter, body, still, GHOST_EDGE, "ghost outline")
        rim = surface(body, body.points).extract_feature_edges(
            boundary_edges=True, feature_edges=False, non_manifold_edges=False, manifold_edges=False
        )
        if rim.n_cells:  # of shells, where the motion leaves it before the body
            plotter.add_mesh(rim, name="ghost rim", color=GHOST_EDGE, line_width=1.5, **QUIET)
    if beams is not None:
        plotter.add_mesh(beams, name="ghost beams", color=GHOST_EDGE, line_width=2, **QUIET)


def add_deformed(
    plotter,
    body: FlexibleBody,
    mode: int,
    scale: float,
    amount: np.ndarray,
    phase: float = 1.0,
    *,
    shifts: np.ndarray | None = None,
    edges: bool = False,
) -> None:
    """Add or replace the body at its modal coordinate `scale * phase`, coloured by `amount` (n_points,).

    The interfaces have their names at `shifts` (k, 2), of `label_shifts`; the elements have their edges on request.
    """
    from modalprep.report.pictures.surface import surface, tubes

    moved = body.points + phase * scale * body.shape[:, :, mode - 1]
    style = {"scalars": "amount", "cmap": "viridis", "clim": (0, 1), "show_scalar_bar": False, **LIGHT, **QUIET}
    skin = surface(body, moved, amount)
    radius = (TUBE if skin is None else 0.4 * TUBE) * body_size(body)
    beams = tubes(body, moved, radius, amount)
    if skin is not None:
        plotter.add_mesh(skin, name="skin", split_sharp_edges=True, **style)
        _add_outline(plotter, body, moved, OUTLINE, "outline")
        if edges:
            add_edges(plotter, body, moved)
    if beams is not None:
        plotter.add_mesh(beams, name="beams", **style)
    places = body.interface_position + phase * scale * body.phi[:, :, mode - 1]
    add_interfaces(plotter, body, places, depth=front(plotter, body), shifts=shifts)
    plotter.reset_camera_clipping_range()


def _add_outline(plotter, body: FlexibleBody, points: np.ndarray, colour: str, name: str) -> None:
    """Add the folds and borders of the surface, just before it, so that the part hides those behind it."""
    from modalprep.report.pictures.surface import outline

    if folds := outline(body, points + LIFT * body_size(body) * _towards(plotter)):
        plotter.add_mesh(folds, name=name, color=colour, line_width=1.5, **QUIET)


def add_edges(plotter, body: FlexibleBody, points: np.ndarray) -> None:
    """Add the edges of the elements on the surface, just before it."""
    from modalprep.report.pictures.surface import edges

    lifted = edges(body, points + LIFT * body_size(body) * _towards(plotter))
    plotter.add_mesh(lifted, name="edges", color=EDGE, line_width=1, **QUIET)


def _towards(plotter) -> np.ndarray:
    """Return the unit vector (3,) to the camera."""
    away = np.array(plotter.camera.position) - plotter.camera.focal_point
    return away / np.linalg.norm(away)


def body_size(body: FlexibleBody) -> float:
    """Return the diagonal of the box around a body (m)."""
    return float(np.linalg.norm(np.ptp(body.points, axis=0))) or 1.0
