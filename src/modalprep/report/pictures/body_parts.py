"""The parts of a picture of a body: the undeformed body behind it, its surface, edges, beams and interfaces."""

from __future__ import annotations

import numpy as np

from modalprep.report.pictures.marks import QUIET, add_interfaces, beside
from modalprep.report.scene.record import Scene

TUBE = 0.007  # radius of a beam, of the body's size
LIFT = 2e-3  # offset of edges before their faces, of the body's size
BODY_COLOUR, EDGE, OUTLINE = "#9dc3e0", "#33475a", "#1d2733"
GHOST, GHOST_EDGE = "#eceff2", "#8a949e"
LIGHT = {"smooth_shading": True, "ambient": 0.3, "diffuse": 0.75}


def label_shifts(plotter, body: Scene, shown: list[np.ndarray], places: np.ndarray) -> np.ndarray:
    """Return the shifts of the names of the interfaces, beside the body at all of the points (n_points, 3) shown."""
    skin = body.corner_skin
    parts = [points[part] for points in shown for part in (skin.triangles, skin.lines)]
    return beside(plotter, parts, places, body.interface_name)


def front(plotter, body: Scene) -> float:
    """Return a distance (m) towards the camera that is before all of the body; 0 for a camera that can turn."""
    return 2 * body.size if plotter.off_screen else 0.0


def add_ghost(plotter, body: Scene) -> None:
    """Add or replace the undeformed body: faces, visible sharp edges and beams behind all, borders of shells in place.

    Before a camera that can turn all of it is in place, and translucent.
    """
    from modalprep.report.pictures.surface import segments, surface

    back = -front(plotter, body) * _towards(plotter)
    still = body.points + back
    skin = surface(body.skin, still)
    beams = segments(body.skin.lines, still)
    if skin is not None:
        style = {"color": GHOST, "lighting": False, "opacity": 1.0 if back.any() else 0.12}
        plotter.add_mesh(skin, name="ghost", **style, **QUIET)
        _add_outline(plotter, body, still, GHOST_EDGE, "ghost outline")
        rim = skin.translate(-back, inplace=False).extract_feature_edges(
            boundary_edges=True, feature_edges=False, non_manifold_edges=False, manifold_edges=False
        )
        if rim.n_cells:  # of shells, where the motion leaves it before the body
            plotter.add_mesh(rim, name="ghost rim", color=GHOST_EDGE, line_width=1.5, **QUIET)
    if beams is not None:
        plotter.add_mesh(beams, name="ghost beams", color=GHOST_EDGE, line_width=2, **QUIET)


def add_deformed(
    plotter,
    body: Scene,
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
    skin = surface(body.skin, moved, amount)
    radius = (TUBE if skin is None else 0.4 * TUBE) * body.size
    beams = tubes(body.skin, moved, radius, amount)
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


def _add_outline(plotter, body: Scene, points: np.ndarray, colour: str, name: str) -> None:
    """Add the folds and borders of the surface, just before it, so that the part hides those behind it."""
    from modalprep.report.pictures.surface import segments

    folds = segments(body.skin.outline, points + LIFT * body.size * _towards(plotter))
    if folds is not None:
        plotter.add_mesh(folds, name=name, color=colour, line_width=1.5, **QUIET)


def add_edges(plotter, body: Scene, points: np.ndarray) -> None:
    """Add the edges of the elements on the surface, just before it."""
    from modalprep.report.pictures.surface import segments

    lifted = segments(body.skin.edges, points + LIFT * body.size * _towards(plotter))
    plotter.add_mesh(lifted, name="edges", color=EDGE, line_width=1, **QUIET)


def _towards(plotter) -> np.ndarray:
    """Return the unit vector (3,) to the camera."""
    away = np.array(plotter.camera.position) - plotter.camera.focal_point
    return away / np.linalg.norm(away)
