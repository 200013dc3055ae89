"""Off-screen pictures of bodies by pyvista, where the machine can draw."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError, RenderError
from modalprep.extras import missing, need
from modalprep.report.pictures.body_parts import (
    BODY_COLOUR,
    EDGE,
    LIGHT,
    TUBE,
    add_deformed,
    add_edges,
    add_ghost,
    front,
    label_shifts,
)
from modalprep.report.pictures.camera import look
from modalprep.report.pictures.files import save_picture
from modalprep.report.pictures.marks import add_bar, add_interfaces, plainly, spheres
from modalprep.report.scene.camera import view
from modalprep.report.scene.colour import WORDS, node_colour
from modalprep.report.scene.motion import SHARE, largest_displacement
from modalprep.report.scene.record import Scene, scene_of

WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
EGL = "vtkEGLRenderWindow"
PROBE = """
import sys
try:
    import vtkmodules.vtkRenderingOpenGL2
    from vtkmodules.vtkFiltersSources import vtkSphereSource
    from vtkmodules import vtkRenderingCore as vtk
except ImportError as error:
    sys.exit(f"import: {error}")
source, mapper, actor = vtkSphereSource(), vtk.vtkPolyDataMapper(), vtk.vtkActor()
mapper.SetInputConnection(source.GetOutputPort())
actor.SetMapper(mapper)
renderer, window, image = vtk.vtkRenderer(), vtk.vtkRenderWindow(), vtk.vtkWindowToImageFilter()
renderer.AddActor(actor)
window.SetOffScreenRendering(True)
window.SetSize(32, 32)
window.AddRenderer(renderer)
image.SetInput(window)
image.Update()
low, high = image.GetOutput().GetScalarRange()
sys.exit(0 if high > low else "blank")
"""
PATIENCE = 120  # s; the first import of VTK from a network disk takes most of a minute
ADVICE = "as root: apt-get install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libx11-6 libxrender1"
SAMPLES = 8  # of each pixel
PICTURE = "a picture or film"


@cache
def drawing_problem() -> str | None:
    """Return the reason why this machine cannot draw, or None if it can.

    A VTK without EGL terminates the process, so that a subprocess tries first; its working setup is used here. The
    result is kept for the lifetime of the process.
    """
    if problem := missing("pyvista", PICTURE):
        return problem
    if _trusted:
        return _import_problem()
    for window in (EGL, None):
        problem = _attempt(window)
        if not problem:
            if window:
                os.environ[WINDOW] = window
            return _import_problem()
    return f"{problem} ({ADVICE})"


def refuse_drawing() -> None:
    """Refuse pictures where this machine cannot draw them.

    Raises
    ------
    NotInstalledError
        When pyvista is not installed.
    RenderError
        When it cannot draw.
    """
    need("pyvista", PICTURE)
    if problem := drawing_problem():
        raise RenderError(problem)


def is_untested() -> bool:
    """Whether pyvista is installed and no test of drawing has run or started in this process."""
    return not (_trusted or _started or drawing_problem.cache_info().currsize or missing("pyvista", PICTURE))


def try_ahead() -> None:
    """Start the test of `drawing_problem` beside other work."""
    if is_untested():
        with suppress(OSError):
            _started[EGL] = _start(EGL)


def trust() -> None:
    """Draw with EGL without a test: another process has drawn, or this one may end by it."""
    os.environ[WINDOW] = EGL
    _trusted.append(True)


_started: dict[str | None, subprocess.Popen] = {}  # tests by their kind of window
_trusted: list[bool] = []  # empty before `trust`


def _start(window: str | None) -> subprocess.Popen:
    """Start a subprocess that draws a sphere with this kind of window."""
    none = subprocess.DEVNULL
    command = [sys.executable, "-c", PROBE]
    return subprocess.Popen(
        command, env=environment(window), text=True, stdin=none, stdout=none, stderr=subprocess.PIPE
    )


def environment(window: str | None) -> dict[str, str]:
    """Return the environment of a process that draws with this kind of window."""
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")  # otherwise Mesa writes its device search to the terminal
    return os.environ | ({WINDOW: window} if window else {})


def _attempt(window: str | None) -> str:
    """Let a subprocess draw a sphere with this kind of window; return the error."""
    try:
        test = _started.pop(window, None) or _start(window)
    except OSError as error:
        return f"the test of VTK did not start: {error}"
    with test:
        try:
            _, said = test.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            return f"VTK did not draw a test picture within {PATIENCE} s"
        finally:
            test.kill()
    if test.returncode == 0:
        return ""
    cause = said.strip().rpartition("\n")[2]
    if cause.startswith("import: "):
        return f"pyvista cannot be imported: {cause.removeprefix('import: ')}"
    return "VTK finds no OpenGL that works without a display"


def _import_problem() -> str | None:
    try:
        import pyvista  # noqa: F401
    except ImportError as error:
        return f"pyvista cannot be imported: {error}"
    return None


def render_mode(
    body: FlexibleBody | Scene,
    mode: int,
    path: str | Path,
    *,
    colour: str = "displacement",
    size: tuple[int, int] = (1000, 750),
    edges: bool = False,
) -> Path:
    """Draw mode `mode` (counted from 1): displacement or strain energy in colour, the undeformed body as a ghost.

    Parameters
    ----------
    colour : {"displacement", "energy"}
    size : (int, int)
        Width and height in pixels.
    edges : bool
        Draw the edges of the elements too.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the body has no such mode or no such colour, or the file is neither .png nor .jpg.
    RenderError
        When the machine cannot draw.
    """
    return save_picture(mode_scene(scene_of(body), mode, colour, size, edges=edges), path)


def mode_scene(
    body: Scene,
    mode: int,
    colour: str,
    size: tuple[int, int],
    *,
    edges: bool = False,
    off_screen: bool = True,
):
    """Return a plotter with mode `mode` as `render_mode` draws it."""
    scale = shown_scale(body, mode)
    plotter = framed_plotter(body, size, bent(body, mode, scale), mode, off_screen=off_screen)
    _add_mode(plotter, body, mode, scale, colour, edges)
    add_bar(plotter, WORDS[colour])
    return plotter


def show_mode(plotter, body: Scene, mode: int, colour: str) -> None:
    """Let a plotter of `mode_scene` show another mode of the body."""
    scale = shown_scale(body, mode)
    _frame(plotter, body, bent(body, mode, scale), mode)
    _add_title(plotter, _title(body, mode))
    _add_mode(plotter, body, mode, scale, colour, edges=False)


def _add_mode(plotter, body: Scene, mode: int, scale: float, colour: str, edges: bool) -> None:
    """Add or replace the undeformed body and the mode, as the camera sees them."""
    amount = node_colour(body, mode, colour)
    add_ghost(plotter, body)
    places = body.interface_position + scale * body.phi[:, :, mode - 1]
    shifts = label_shifts(plotter, body, [bent(body, mode, scale)], places)
    add_deformed(plotter, body, mode, scale, amount, shifts=shifts, edges=edges)


def bent(body: Scene, mode: int, scale: float) -> np.ndarray:
    """Return the nodes (n_points, 3) of the body at a modal coordinate."""
    return body.points + scale * body.shape[:, :, mode - 1]


def render_mesh(body: FlexibleBody | Scene, path: str | Path, *, size: tuple[int, int] = (1000, 750)) -> Path:
    """Draw the undeformed mesh with its interfaces.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the file is neither .png nor .jpg.
    RenderError
        When the machine cannot draw.
    """
    return save_picture(mesh_scene(scene_of(body), size), path)


def mesh_scene(body: Scene, size: tuple[int, int], *, off_screen: bool = True):
    """Return a plotter with the mesh as `render_mesh` draws it."""
    plotter = framed_plotter(body, size, body.points, None, off_screen=off_screen)  # refuses before the import fails
    from modalprep.report.pictures.surface import surface, tubes

    skin = surface(body.skin, body.points)
    beams = tubes(body.skin, body.points, 0.4 * TUBE * body.size)
    if skin is not None:
        plotter.add_mesh(skin, color=BODY_COLOUR, split_sharp_edges=True, **LIGHT)
        add_edges(plotter, body, body.points)
    if beams is not None:
        plotter.add_mesh(beams, color=BODY_COLOUR, **LIGHT)
    if skin is None:
        plotter.add_mesh(spheres(np.array(body.points), 0.8 * TUBE * body.size), color=EDGE)
    if len(body.interface_position):
        shifts = label_shifts(plotter, body, [body.points], body.interface_position)
        add_interfaces(plotter, body, body.interface_position, depth=front(plotter, body), shifts=shifts)
    plotter.reset_camera_clipping_range()
    return plotter


def shown_scale(body: Scene, mode: int) -> float:
    """Return the modal coordinate at which the largest displacement is `SHARE` of the body's size."""
    if not 1 <= mode <= body.n:
        modes = f"its modes are 1 to {body.n}" if body.n else "it is rigid"
        raise InputError(f"body {body.name!r} has no mode {mode}; {modes}")
    largest = largest_displacement(body.shape)[mode - 1]
    return float(SHARE * body.size / largest) if largest > 0 else 0.0


def _title(body: Scene, mode: int | None) -> str:
    if mode is None:
        return f"{body.name}   {len(body.points)} nodes"
    return f"{body.name}   mode {mode}   {body.frequency[mode - 1]:.4g} Hz"


def framed_plotter(
    body: Scene,
    size: tuple[int, int],
    points: np.ndarray,
    mode: int | None,
    *,
    text: bool | str = True,
    off_screen: bool = True,
):
    """Return an empty picture, its camera on the body and the (deformed) points; `text` adds a title and axes."""
    if off_screen:
        refuse_drawing()
    plotter = empty_plotter(size, off_screen=off_screen)
    _frame(plotter, body, points, mode)
    if text:
        plotter.add_axes(color="black", line_width=3, viewport=(0, 0, 0.14, 0.18))
        _add_title(plotter, text if isinstance(text, str) else _title(body, mode))
    return plotter


def empty_plotter(size: tuple[int, int], *, off_screen: bool = True) -> Any:
    """Return a plotter whose pictures are white and have smooth edges, by as many samples as the machine can take."""
    import pyvista

    plotter: Any = pyvista.Plotter(off_screen=off_screen, window_size=list(size))  # whose methods have untyped wrappers
    plotter.set_background("white")
    plotter.enable_anti_aliasing("msaa", multi_samples=SAMPLES)
    return plotter


def _frame(plotter, body: Scene, points: np.ndarray, mode: int | None) -> None:
    shape = None if mode is None else body.shape[:, :, mode - 1]
    look(plotter, np.concatenate([body.points, body.interface_position, points]), *view(body.points, shape))


def _add_title(plotter, title: str) -> None:
    style = {"font_size": plotter.window_size[1] // 46, "color": "black", "render": False}
    plotter.add_text(plainly(title), name="title", position=(0.025, 0.935), viewport=True, **style)
