"""Marks in pictures: interfaces as spheres with names, the colour bar."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody

BALL = 0.016  # radius of an interface's mark, of half the picture's height
MARK = "#D55E00"
QUIET = {"reset_camera": False, "render": False}  # `shot` draws once, when all parts are there


def add_bar(plotter, words: str) -> None:
    """Add the bar of the colours, from 0 to 1, with its title."""
    plotter.add_scalar_bar(
        words, color="black", n_labels=2, fmt="%.0f", vertical=False, title_font_size=24,
        label_font_size=24, position_x=0.58, position_y=0.025, width=0.39, height=0.085,
    )  # fmt: skip


def add_interfaces(plotter, body: FlexibleBody, places: np.ndarray, *, names: bool = True) -> None:
    """Mark the interfaces by spheres drawn over the body (a bolt's centre lies inside its hole) and by their names."""
    places, camera = np.array(places, dtype=float), plotter.camera
    radius = BALL * camera.parallel_scale
    actor = plotter.add_mesh(spheres(places, radius), name="balls", color=MARK, ambient=0.4, **QUIET)
    actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0, -66000)
    if not names:
        return
    beside = np.cross(camera.up, np.array(camera.position) - camera.focal_point)
    beside = np.array(camera.up) + beside / np.linalg.norm(beside)
    plotter.add_point_labels(
        places + radius * beside, list(body.interface_name), name="names", font_size=26, text_color="black",
        shape_color="white", shape_opacity=0.75, show_points=False, always_visible=True, margin=4, **QUIET,
    )  # fmt: skip


def spheres(places: np.ndarray, radius: float):
    """Return a mesh of spheres at points (k, 3)."""
    import pyvista

    return pyvista.PolyData(places).glyph(geom=pyvista.Sphere(radius=radius), scale=False, orient=False)
