"""Off-screen pictures of bodies by pyvista, where the machine can draw."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError, RenderError
from modalprep.extras import missing, need
from modalprep.report.pictures.colour import WORDS, node_colour
from modalprep.report.pictures.marks import QUIET, add_bar, add_interfaces, spheres
from modalprep.report.pictures.motion import largest_displacement

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
SHARE = 0.12  # largest displacement shown, of the body's size
TUBE = 0.007  # radius of a beam, of the body's size
BODY_COLOUR, EDGE, GHOST = "#a9c7dd", "#5b7486", "#8a949e"
PICTURES = (".png", ".jpg", ".jpeg")
PICTURE = "a picture or film"


@cache
def drawing_problem() -> str | None:
    """Return the reason why this machine cannot draw, or None if it can.

    A VTK without EGL terminates the process, so that a subprocess tries first; its working setup is used here. The
    result is kept for the lifetime of the process.
    """
    if problem := missing("pyvista", PICTURE):
        return problem
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


def try_ahead() -> None:
    """Start the test of `drawing_problem` beside other work."""
    if not _started and not drawing_problem.cache_info().currsize and not missing("pyvista", PICTURE):
        with suppress(OSError):
            _started[EGL] = _start(EGL)


_started: dict[str | None, subprocess.Popen] = {}  # tests by their kind of window


def _start(window: str | None) -> subprocess.Popen:
    """Start a subprocess that draws a sphere with this kind of window."""
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")  # otherwise Mesa writes its device search to the terminal
    environment = os.environ | ({WINDOW: window} if window else {})
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen([sys.executable, "-c", PROBE], env=environment, text=True, **pipes)


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
    body: FlexibleBody,
    mode: int,
    path: str | Path,
    *,
    colour: str = "displacement",
    size: tuple[int, int] = (1000, 750),
) -> Path:
    """Draw mode `mode` (counted from 1): displacement or strain energy in colour, the undeformed body as a ghost.

    Parameters
    ----------
    colour : {"displacement", "energy"}

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
    return save_picture(mode_scene(body, mode, colour, size), path)


def mode_scene(body: FlexibleBody, mode: int, colour: str, size: tuple[int, int], *, off_screen: bool = True):
    """Return a plotter with mode `mode` as `render_mode` draws it."""
    scale = shown_scale(body, mode)
    amount = node_colour(body, mode, colour)
    bent = body.points + scale * body.shape[:, :, mode - 1]
    plotter = framed_plotter(body, size, bent, mode, off_screen=off_screen)
    add_ghost(plotter, body)
    add_deformed(plotter, body, mode, scale, amount)
    add_bar(plotter, WORDS[colour])
    return plotter


def render_mesh(body: FlexibleBody, path: str | Path, *, size: tuple[int, int] = (1000, 750)) -> Path:
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
    return save_picture(mesh_scene(body, size), path)


def mesh_scene(body: FlexibleBody, size: tuple[int, int], *, off_screen: bool = True):
    """Return a plotter with the mesh as `render_mesh` draws it."""
    plotter = framed_plotter(body, size, body.points, None, off_screen=off_screen)  # refuses before the import fails
    from modalprep.report.pictures.surface import edges, surface, tubes

    skin, beams = surface(body, body.points), tubes(body, body.points, 0.4 * TUBE * _size(body))
    if skin is not None:
        plotter.add_mesh(skin, color=BODY_COLOUR, smooth_shading=True, split_sharp_edges=True, ambient=0.25)
        drawn = plotter.add_mesh(edges(body, body.points), color=EDGE, line_width=1)
        # a smaller offset than VTK's default, with which edges behind a silhouette become visible
        drawn.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(1.0, 2.0)
    if beams is not None:
        plotter.add_mesh(beams, color=BODY_COLOUR, smooth_shading=True, ambient=0.25)
    if skin is None:
        plotter.add_mesh(spheres(np.array(body.points), 0.8 * TUBE * _size(body)), color=EDGE)
    if len(body.interface_position):
        add_interfaces(plotter, body, body.interface_position)
    return plotter


def shown_scale(body: FlexibleBody, mode: int) -> float:
    """Return the modal coordinate at which the largest displacement is `SHARE` of the body's size."""
    if not 1 <= mode <= body.n:
        modes = f"its modes are 1 to {body.n}" if body.n else "it is rigid"
        raise InputError(f"body {body.name!r} has no mode {mode}; {modes}")
    largest = largest_displacement(body.shape)[mode - 1]
    return float(SHARE * _size(body) / largest) if largest > 0 else 0.0


def _size(body: FlexibleBody) -> float:
    return float(np.linalg.norm(np.ptp(body.points, axis=0))) or 1.0


def _title(body: FlexibleBody, mode: int | None) -> str:
    if mode is None:
        return f"{body.name}   {len(body.points)} nodes"
    return f"{body.name}   mode {mode}   {body.frequency[mode - 1]:.4g} Hz"


def framed_plotter(
    body: FlexibleBody,
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
    import pyvista

    from modalprep.report.pictures.camera import aim

    plotter = pyvista.Plotter(off_screen=off_screen, window_size=size)
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    shape = None if mode is None else body.shape[:, :, mode - 1]
    aim(plotter, np.concatenate([body.points, body.interface_position, points]), body.points, shape)
    if not text:
        return plotter
    plotter.add_axes(color="black", line_width=3, viewport=(0, 0, 0.14, 0.18))
    title = text if isinstance(text, str) else _title(body, mode)
    plotter.add_text(title, position=(0.025, 0.935), viewport=True, font_size=size[1] // 46, color="black")
    return plotter


def add_ghost(plotter, body: FlexibleBody) -> None:
    """Add the undeformed body: a line per beam, and the sharp edges and the outline of the rest."""
    from modalprep.report.pictures.surface import lines, surface

    skin, beams = surface(body, body.points), lines(body, body.points)
    if skin is not None:
        sharp = skin.extract_feature_edges(30)
        ghost = plotter.add_mesh(skin, color=GHOST, opacity=0.12)
        # behind the faces of the deformed body that lie in the same plane
        ghost.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        ghost.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(1.0, 500.0)
        if sharp.n_cells:
            plotter.add_mesh(sharp, color=GHOST, line_width=1.5)
    if beams is not None:
        plotter.add_mesh(beams, color=GHOST, line_width=2)


def add_deformed(
    plotter, body: FlexibleBody, mode: int, scale: float, amount: np.ndarray, phase: float = 1.0, *, names=True
) -> None:
    """Add or replace the body at its modal coordinate `scale * phase`, coloured by `amount` (n_points,)."""
    from modalprep.report.pictures.surface import surface, tubes

    displacement = phase * scale * body.shape[:, :, mode - 1]
    moved = body.points + displacement
    style = {"scalars": "amount", "cmap": "viridis", "clim": (0, 1), "show_scalar_bar": False}
    style |= {"smooth_shading": True, "ambient": 0.25, **QUIET}
    skin = surface(body, moved, amount)
    radius = (TUBE if skin is None else 0.4 * TUBE) * _size(body)
    beams = tubes(body, moved, radius, amount)
    if skin is not None:
        plotter.add_mesh(skin, name="skin", split_sharp_edges=True, **style)
    if beams is not None:
        plotter.add_mesh(beams, name="beams", **style)
    add_interfaces(plotter, body, body.interface_position + phase * scale * body.phi[:, :, mode - 1], names=names)


def shot(plotter) -> np.ndarray:
    """Return the picture (height, width, 3) of all that a plotter holds, drawn once."""
    plotter.render()  # of the first picture nothing: `screenshot` draws that itself
    return np.array(plotter.screenshot(return_img=True))


def save_picture(plotter, path: str | Path) -> Path:
    """Write the picture of a plotter and close it; the file is written completely or not at all."""
    from PIL import Image

    path = Path(path)
    try:
        if path.suffix.lower() not in PICTURES:
            raise InputError(f"cannot write {path}: a picture is one of {', '.join(PICTURES)}")
        image = plotter.screenshot(return_img=True)
    finally:
        plotter.close()
    with atomic_path(path) as temporary:
        Image.fromarray(image).save(temporary)
    return path
