"""Off-screen pictures of bodies by pyvista, where the machine can draw."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from functools import cache
from pathlib import Path

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError, RenderError

WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.add_mesh(pyvista.Sphere())
assert plotter.screenshot(return_img=True).std() > 0
"""
ADVICE = "as root: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri"
SHARE = 0.12  # largest displacement shown, of the body's size
LINEAR = {
    "tetra10": ("tetra", 4),
    "triangle6": ("triangle", 3),
    "line3": ("line", 2),
    "hexahedron20": ("hexahedron", 8),
}


@cache
def drawing_problem() -> str | None:
    """Return why this machine cannot draw, or None when it can.

    A VTK without EGL ends the process, so a subprocess tries first; what worked there is set up here.
    """
    for window in ("vtkEGLRenderWindow", ""):
        environment = os.environ | {WINDOW: window} if window else dict(os.environ)
        try:
            done = subprocess.run([sys.executable, "-c", PROBE], env=environment, capture_output=True, timeout=120)
        except (OSError, subprocess.TimeoutExpired):
            continue
        if done.returncode == 0:
            if window:
                os.environ[WINDOW] = window
            return None
    return f"VTK finds no OpenGL that works without a display ({ADVICE})"


def render_mode(body: FlexibleBody, mode: int, path: str | Path, *, size: tuple[int, int] = (1000, 750)) -> Path:
    """Draw mode `mode` (counted from 1): displacement in colour, the undeformed body as a ghost.

    Raises
    ------
    InputError
        When the body has no such mode.
    RenderError
        When the machine cannot draw.
    """
    displacement = _displacement(body, mode)
    plotter = _plotter(body, size, displacement)
    _add_deformed(plotter, body, displacement)
    plotter.add_text(_title(body, mode), font_size=12, color="black")
    return _save(plotter, path)


def render_mesh(body: FlexibleBody, path: str | Path, *, size: tuple[int, int] = (1000, 750)) -> Path:
    """Draw the undeformed mesh with its interfaces.

    Raises
    ------
    RenderError
        When the machine cannot draw.
    """
    plotter = _plotter(body, size, None)
    grid = _grid(body, body.points)
    solid = not _is_line(body)
    plotter.add_mesh(_visible(grid, body), color="#9ecae1", show_edges=solid, edge_color="#4a6a7a", line_width=1)
    _add_interfaces(plotter, body, np.zeros((len(body.interface_name), 3)))
    plotter.add_text(f"{body.name}: {len(body.points)} nodes", font_size=12, color="black")
    return _save(plotter, path)


def animate_mode(body: FlexibleBody, mode: int, path: str | Path, *, frames: int = 24) -> Path:
    """Write one period of a mode as a GIF.

    Raises
    ------
    InputError, RenderError
        As `render_mode`.
    """
    from PIL import Image

    displacement = _displacement(body, mode)
    images = []
    for phase in np.linspace(0, 2 * np.pi, frames, endpoint=False):
        plotter = _plotter(body, (700, 525), displacement)
        _add_deformed(plotter, body, np.sin(phase) * displacement, bar=False)
        plotter.add_text(_title(body, mode), font_size=10, color="black")
        images.append(Image.fromarray(plotter.screenshot(return_img=True)))
        plotter.close()
    with atomic_path(path) as temporary:
        images[0].save(temporary, save_all=True, append_images=images[1:], duration=60, loop=0, format="GIF")
    return Path(path)


def _displacement(body: FlexibleBody, mode: int) -> np.ndarray:
    """Nodal displacement (n_points, 3) scaled to `SHARE` of the body's size."""
    if not 1 <= mode <= body.n:
        raise InputError(f"body {body.name!r} has no mode {mode}; its modes are 1 to {body.n}")
    shape = body.shape[:, :, mode - 1]
    largest = np.linalg.norm(shape, axis=1).max()
    return shape * (SHARE * _size(body) / largest) if largest > 0 else shape


def _size(body: FlexibleBody) -> float:
    return float(np.linalg.norm(np.ptp(body.points, axis=0)))


def _title(body: FlexibleBody, mode: int) -> str:
    return f"{body.name}, mode {mode}: {body.frequency[mode - 1]:.4g} Hz"


def _is_line(body: FlexibleBody) -> bool:
    return all(kind.startswith("line") for kind in body.cells)


def _grid(body: FlexibleBody, points: np.ndarray):
    """Return the body as a pyvista grid of linear cells: mid-edge nodes would clutter the edges."""
    import pyvista
    from meshio import Mesh

    cells = [(*LINEAR.get(kind, (kind, None)), c) for kind, c in body.cells.items()]
    mesh = Mesh(points, [(kind, c[:, :count]) for kind, count, c in cells])
    return pyvista.from_meshio(mesh)


def _visible(grid, body: FlexibleBody):
    """Return what is drawn: tubes for lines, the surface for the rest."""
    if _is_line(body):
        return grid.extract_surface(algorithm=None).tube(radius=0.008 * _size(body), n_sides=16)
    return grid.extract_surface(algorithm=None)


def _plotter(body: FlexibleBody, size: tuple[int, int], displacement: np.ndarray | None):
    problem = drawing_problem()
    if problem:
        raise RenderError(problem)
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=size)
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    plotter.camera_position = _camera(body, displacement)
    plotter.add_axes(color="black")
    return plotter


def _camera(body: FlexibleBody, displacement: np.ndarray | None):
    """Look square at a line body's motion, else from a corner."""
    centre, distance = (body.points.max(axis=0) + body.points.min(axis=0)) / 2, 2.2 * _size(body)
    direction, up = np.array([1.0, -1.6, 1.1]), np.array([0.0, 0.0, 1.0])
    if _is_line(body) and displacement is not None:
        axis = np.linalg.svd(body.points - body.points.mean(axis=0))[2][0]
        motion = displacement[np.argmax(np.linalg.norm(displacement, axis=1))]
        motion = motion - (motion @ axis) * axis
        if np.linalg.norm(motion) > 1e-3 * _size(body):
            up = motion / np.linalg.norm(motion)
            up = up * np.sign(up[np.argmax(np.abs(up))])
            direction = np.cross(axis, up)
            direction = direction * np.sign(direction[np.argmax(np.abs(direction))]) + 0.15 * up
    elif np.ptp(body.points, axis=0)[2] < 0.2 * np.ptp(body.points, axis=0).min(
        initial=np.inf, where=[True, True, False]
    ):
        direction = np.array([0.35, -0.8, 1.2])  # flat in x-y: more from above
    return [centre + distance * direction / np.linalg.norm(direction), centre, up]


def _add_deformed(plotter, body: FlexibleBody, displacement: np.ndarray, *, bar: bool = True) -> None:
    ghost = _grid(body, body.points).extract_surface(algorithm=None)
    outline = ghost if _is_line(body) else ghost.extract_feature_edges(30)
    plotter.add_mesh(outline, color="#999999", line_width=2)
    deformed = _grid(body, body.points + displacement)
    amplitude = np.linalg.norm(displacement, axis=1)
    limit = SHARE * _size(body)
    deformed["displacement"] = amplitude / limit
    bar_style = {"title": "displacement", "color": "black", "n_labels": 3, "fmt": "%.1f", "vertical": True}
    bar_style |= {"position_x": 0.9, "position_y": 0.25, "height": 0.5, "width": 0.05}
    plotter.add_mesh(
        _visible(deformed, body), scalars="displacement", cmap="viridis", clim=(0, 1), show_scalar_bar=bar,
        scalar_bar_args=bar_style, smooth_shading=True, split_sharp_edges=True,
    )  # fmt: skip
    moved = [displacement[np.argmin(np.linalg.norm(body.points - p, axis=1))] for p in body.interface_position]
    _add_interfaces(plotter, body, np.array(moved))


def _add_interfaces(plotter, body: FlexibleBody, moved: np.ndarray) -> None:
    at = body.interface_position + moved
    plotter.add_points(at, color="#D55E00", point_size=14, render_points_as_spheres=True)
    plotter.add_point_labels(
        at, list(body.interface_name), font_size=18, text_color="black", shape_color="white", shape_opacity=0.7,
        show_points=False, always_visible=True,
    )  # fmt: skip


def _save(plotter, path: str | Path) -> Path:
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        plotter.reset_camera()
        image = plotter.screenshot(return_img=True)
    plotter.close()
    with atomic_path(path) as temporary:
        Image.fromarray(image).save(temporary, format="PNG")
    return Path(path)
